//! The dynamic part of a state, its equations, and the guards, at a value of the parameters.

use crate::friction::Law;
use crate::model::axial::AxialMotion;
use crate::model::state::{DIMENSION, DYNAMIC};
use crate::model::torsion::TorsionModel;
use crate::model::{Mode, Parameters};
use crate::record::EventKind;
use nalgebra::{SMatrix, SVector};
use std::borrow::Cow;

/// The dynamic part of a state.
pub(super) type Dynamic = SVector<f64, DYNAMIC>;

/// The equations at a value of the parameters.
pub(super) struct Equations {
    pub(super) torsion: TorsionModel,
    pub(super) axial: AxialMotion,
}

impl Equations {
    pub(super) fn new(parameters: &Parameters) -> Equations {
        Equations {
            torsion: TorsionModel::new(parameters),
            axial: parameters.axial_motion(),
        }
    }

    pub(super) fn rates(&self, mode: Mode, t: f64, y: &Dynamic) -> Dynamic {
        let force = || self.axial.pressing_force(t);
        Dynamic::from_column_slice(&self.torsion.rates_at(mode, force, &extended(y))[..DYNAMIC])
    }

    /// The piece of the friction law that a state slides on; at a knot the one below.
    pub(super) fn piece(&self, y: &Dynamic) -> usize {
        let knots = self.torsion.friction.law.knots();
        if knots.is_empty() {
            return 0;
        }
        let speed = self.torsion.relative_velocity(&extended(y)).abs();
        knots.partition_point(|knot| *knot < speed)
    }

    fn on_piece(&self, piece: usize) -> Cow<'_, TorsionModel> {
        match self.torsion.friction.law.knots() {
            [] => Cow::Borrowed(&self.torsion),
            _ => Cow::Owned(self.torsion.on_piece(piece)),
        }
    }

    /// [`Self::rates`] with a piece of the friction law.
    pub(super) fn rates_on(&self, piece: usize, mode: Mode, t: f64, y: &Dynamic) -> Dynamic {
        let force = || self.axial.pressing_force(t);
        Dynamic::from_column_slice(&self.on_piece(piece).rates_at(mode, force, &extended(y))[..DYNAMIC])
    }

    /// The Jacobian of [`Self::rates_on`].
    pub(super) fn jacobian(&self, piece: usize, mode: Mode, t: f64, y: &Dynamic) -> SMatrix<f64, DYNAMIC, DYNAMIC> {
        let force = || self.axial.pressing_force(t);
        self.on_piece(piece).dynamic_jacobian(mode, force, &extended(y))
    }

    /// The knot of the friction law that steady sliding loses or regains its stability at, if the event is at one: the margin
    /// jumps there, and the event is where the speed is the knot's.
    pub(super) fn stability_knot(&self, kind: EventKind, mode: Mode, t: f64, y: &Dynamic) -> Option<usize> {
        // Of a knot, by how much a speed located there may be off.
        const LOCATED: f64 = 1e-9;
        if !matches!(kind, EventKind::Destabilised | EventKind::Restabilised) {
            return None;
        }
        let (sense, relative) = (f64::from(mode.sense()), self.torsion.relative_velocity(&extended(y)));
        let force = self.axial.pressing_force(t);
        let knots = self.torsion.friction.law.knots();
        let k = knots
            .iter()
            .position(|knot| (relative.abs() - knot).abs() <= LOCATED * knot)?;
        let margin = |piece: usize| self.on_piece(piece).stability_margin(sense, relative, force);
        ((margin(k) > 0.0) != (margin(k + 1) > 0.0)).then_some(k)
    }

    /// How far the speed is above a knot of the friction law, rad/s.
    pub(super) fn above_knot(&self, knot: usize, mode: Mode, y: &Dynamic) -> Option<f64> {
        let speed = f64::from(mode.sense()) * self.torsion.relative_velocity(&extended(y));
        Some(speed - self.torsion.friction.law.knots().get(knot)?)
    }

    /// The gradient of I theta' + J phi_2', which in slip is the one slow variable.
    pub(super) fn momentum(&self) -> Dynamic {
        let mut unit = [0.0; DYNAMIC];
        Dynamic::from_fn(|row, _| {
            unit.fill(0.0);
            unit[row] = 1.0;
            self.torsion.torsion.slow_momentum(&unit)
        })
    }

    /// The guard whose zero an event is, in the mode before it; `None` if the event is set by time.
    pub(super) fn guard(&self, kind: EventKind, before: Mode, after: Mode, t: f64, y: &Dynamic) -> Option<f64> {
        let full = extended(y);
        let speed = self.torsion.relative_velocity(&full);
        let force = self.axial.pressing_force(t);
        match kind {
            EventKind::Stick | EventKind::Reversal => Some(speed),
            EventKind::Slip => {
                let sense = f64::from(after.sense());
                Some(self.torsion.breakaway_torque(force) - sense * self.torsion.tested_torque(&full))
            }
            EventKind::Separation | EventKind::Contact => Some(force),
            EventKind::Destabilised | EventKind::Restabilised => {
                let sense = f64::from(before.sense());
                Some(self.torsion.stability_margin(sense, speed, force))
            }
            EventKind::Kick | EventKind::Corner => None,
        }
    }
}

pub(super) fn extended(y: &Dynamic) -> [f64; DIMENSION] {
    let mut full = [0.0; DIMENSION];
    full[..DYNAMIC].copy_from_slice(y.as_slice());
    full
}
