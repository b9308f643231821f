//! Step sizes and dense output of the Runge-Kutta methods.

/// The dense output of a Runge-Kutta method. Its degree is at most 5, and at most the method's order less 1.
/// (`ARKodeSetInterpolantType`, `ARKodeSetInterpolantDegree`)
///
/// Output times and crossings are read from it, too: with the long steps of a method of order 6 to 9 their error can
/// be far above the tolerance, unless the step is bounded. A step's end has the error of the method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Interpolant {
    /// From values and slopes at both ends of the step. Degrees 4 and 5 call the right-hand side each time that they
    /// are evaluated, also by the search for crossings.
    Hermite {
        /// Highest degree, at most 5.
        degree: u32,
    },
    /// From values at the ends of the last steps: of degree 1 after a restart, more as steps come. For stiff systems,
    /// whose slopes are large.
    Lagrange {
        /// Highest degree, at most 5.
        degree: u32,
    },
}

impl Default for Interpolant {
    /// Hermite of degree 5, as in ARKODE.
    fn default() -> Self {
        Self::Hermite { degree: 5 }
    }
}

/// What chooses the next step from the errors of the last ones. (`ARKodeSetAdaptController`)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StepController {
    /// From the last error. (`SUNAdaptController_I`)
    Integral,
    /// From the last two. (`SUNAdaptController_PI`)
    ProportionalIntegral,
    /// From the last three. (`SUNAdaptController_PID`)
    Pid,
    /// Gustafsson's for explicit methods. (`SUNAdaptController_ExpGus`)
    ExplicitGustafsson,
    /// Gustafsson's for implicit methods. (`SUNAdaptController_ImpGus`)
    ImplicitGustafsson,
}

/// Step sizes and dense output, part of the options of every Runge-Kutta method. The default is ARKODE's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stepping {
    /// The dense output.
    pub interpolant: Interpolant,
    /// Steps of this length, without control of the error; negative to go back in time. (`ARKodeSetFixedStep`)
    pub fixed_step: Option<f64>,
    /// None for the choice of ERKStep or ARKStep.
    pub controller: Option<StepController>,
    /// Factor on the step that would just be accepted, below 1; None for 0.96. (`ARKodeSetSafetyFactor`)
    pub safety: Option<f64>,
}

impl Stepping {
    /// Steps of this length, without control of the error; negative to go back in time.
    pub fn fixed(step: f64) -> Self {
        Self {
            fixed_step: Some(step),
            ..Self::default()
        }
    }
}
