//! Rotation or translation.

use super::quantity::Dimension;

/// Kind of a case's coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Motion {
    /// Angles: radians, N m, kg m^2.
    #[default]
    Rotation,
    /// Positions: metres, newtons, kilograms.
    Translation,
}

impl Motion {
    /// Both kinds.
    pub const ALL: [Motion; 2] = [Motion::Rotation, Motion::Translation];

    /// The word of the key `motion`.
    pub fn name(self) -> &'static str {
        match self {
            Motion::Rotation => "rotation",
            Motion::Translation => "translation",
        }
    }

    /// The dimension that replaces `of_rotation` in this motion.
    pub fn dimension(self, of_rotation: Dimension) -> Dimension {
        use Dimension as D;
        match (self, of_rotation) {
            (Motion::Rotation, other) => other,
            (Motion::Translation, D::Inertia) => D::Mass,
            (Motion::Translation, D::TorsionalStiffness) => D::Stiffness,
            (Motion::Translation, D::TorsionalDamping) => D::Damping,
            (Motion::Translation, D::AngularVelocity) => D::Velocity,
            (Motion::Translation, D::Angle) => D::Length,
            (Motion::Translation, D::Torque) => D::Force,
            (Motion::Translation, D::FrictionDecay) => D::SlidingDecay,
            (Motion::Translation, D::FrictionCurvature) => D::SlidingCurvature,
            (Motion::Translation, D::FrictionThird) => D::SlidingThird,
            (Motion::Translation, D::InverseAngle) => D::InverseLength,
            (Motion::Translation, D::AngularImpulse) => D::Impulse,
            (Motion::Translation, other) => other,
        }
    }
}
