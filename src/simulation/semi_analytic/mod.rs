//! The brake's own solver: Radau IIA over the quiet stretches of a slip, Taylor series where the fast mode moves.
//!
//! Where steps have to resolve the fast mode ([`Location::resolved`]), each is a Taylor expansion of the slip. Where they
//! have not, the expansion at the segment's start says how much of the fast mode is there: as long as it is more than
//! what is tolerated, expansions follow it down, and from then on Radau IIA strides over it.
//!
//! On a Taylor step the guards are polynomials, of the step's own accuracy, and their first root is isolated, not
//! searched for. A slip that begins tangentially starts at a double root of its own guard, which is divided out. On a
//! Radau step the guards' values at the stages are interpolated, and the root's step is taken again, exactly to the
//! root.
//!
//! | module | what it is |
//! |---|---|
//! | `expansion` | Taylor steps of the slip, and along its slow manifold |
//! | `collocation` | Radau steps |

mod collocation;
mod expansion;

pub(super) use expansion::{SHORTEST_SLOW, SLOW_ORDER};

use super::brake::{Brake, GUARD_STABILITY, GUARD_STOPPING, Location, Watch};
use crate::friction::Law;
use crate::hybrid::{Advance, ChosenSolver, Dynamics, Engine, EngineError, Segment};
use crate::model::slip_series::SlipSeries;
use crate::model::state::{Components, DIMENSION, DYNAMIC, TorsionState};
use crate::numerics::radau::{Radau, Step, Work};
use crate::numerics::radau_tableau::RadauTableau;
use crate::sundials::Counters;
use std::sync::{Arc, OnceLock};

/// Coefficients of a Taylor expansion: order 27, as products are summed in groups of four coefficients. From 24 to 32 a
/// run takes the same time.
const TERMS: usize = 28;

/// Stages of Radau IIA: order 13.
pub(super) const STAGES: usize = 7;

/// Share of c_t within which the stability margin counts as zero where a segment begins. The root that began it was
/// located to 1e-14 s or better.
pub(super) const MARGIN_NOISE: f64 = 1e-9;

/// The same for the contact force: a share of the parts that it is the sum of. Without c_t the zero of the force, where the
/// contact closes, is the margin's.
pub(super) const FORCE_NOISE: f64 = 16.0 * f64::EPSILON;

/// The same for the relative velocity: a share of the speeds that it is the difference of.
const VELOCITY_NOISE: f64 = 16.0 * f64::EPSILON;

/// What a Radau step may leave beside the slow manifold, over what is tolerated of its error; a perturbation that means
/// anything is larger by as much again.
pub(super) const STEP_NOISE: f64 = 1e3;

/// What the last step was.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Last {
    /// An expansion about this time.
    Expansion(f64),
    /// Held by [`Radau::step`].
    Collocation,
}

/// See the module.
pub struct SemiAnalyticEngine {
    brake: Arc<Brake>,
    /// 1 / omega_n, s.
    unit: f64,
    series: SlipSeries<f64, TERMS>,
    force: [f64; TERMS],
    radau: Radau<STAGES>,
    /// A step whose root is looked for.
    whole: Step<STAGES>,
    location: Location,
    origin: f64,
    span: f64,
    max_step: f64,
    relative: f64,
    absolute: TorsionState,
    tau: f64,
    y: TorsionState,
    last: Last,
    /// Nothing has been stepped over in this segment.
    first: bool,
    /// The slip has begun against its sense, see [`Dynamics::starts_beyond`], and has not turned yet.
    beyond: bool,
    /// The fast mode may be above what is tolerated, though it need not be resolved for its own sake.
    ringing: bool,
    /// The next Radau step, and whether the last one's polynomial predicts it.
    next: f64,
    predicted: bool,
    /// Length and error of the last Radau step; zero before the first.
    accepted: (f64, f64),
    counters: Counters,
    radau_before: Work,
}

pub(super) fn tableau() -> &'static Arc<RadauTableau<STAGES>> {
    static TABLEAU: OnceLock<Arc<RadauTableau<STAGES>>> = OnceLock::new();
    TABLEAU.get_or_init(|| Arc::new(RadauTableau::new()))
}

/// Counters of Taylor steps with the work of Radau steps since it was `before`.
pub(super) fn with_work_of(counters: Counters, work: Work, before: Work) -> Counters {
    let jacobians = work.jacobian_evaluations - before.jacobian_evaluations;
    Counters {
        rhs_evaluations: counters.rhs_evaluations + work.rhs_evaluations - before.rhs_evaluations,
        jacobian_evaluations: jacobians,
        linear_solver_setups: jacobians,
        nonlinear_iterations: work.iterations - before.iterations,
        nonlinear_convergence_failures: work.convergence_failures - before.convergence_failures,
        ..counters
    }
}

impl SemiAnalyticEngine {
    /// For the slips of one brake, with what it has to compute once.
    pub fn new(brake: Arc<Brake>) -> Self {
        let unit = 1.0 / brake.torsion.natural_angular_frequency();
        let location = Location {
            mode: crate::model::Mode::SlipForward,
            resolved: true,
            watch: Watch::Off,
            piece: 0,
        };
        SemiAnalyticEngine {
            unit,
            series: SlipSeries::new(brake.torsion_in(&location), unit),
            force: [0.0; TERMS],
            radau: Radau::new(tableau().clone(), DYNAMIC, DIMENSION),
            whole: Step::new(DIMENSION),
            location,
            origin: 0.0,
            span: 0.0,
            max_step: f64::INFINITY,
            relative: 0.0,
            absolute: [0.0; DIMENSION],
            tau: 0.0,
            y: [0.0; DIMENSION],
            last: Last::Expansion(0.0),
            first: true,
            beyond: false,
            ringing: true,
            next: 0.0,
            predicted: false,
            accepted: (0.0, 0.0),
            counters: Counters::default(),
            radau_before: Work::default(),
            brake,
        }
    }

    fn sense(&self) -> f64 {
        f64::from(self.location.mode.sense())
    }

    /// The guards' indices, each with the sign that makes it fire when it falls.
    fn guards(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let stability = match self.location.watch {
            Watch::Off => None,
            Watch::Stable => Some((GUARD_STABILITY, 1.0)),
            Watch::Unstable => Some((GUARD_STABILITY, -1.0)),
        };
        let below = self.brake.guard_below(&self.location);
        let ends = below.into_iter().flat_map(|below| [(below, 1.0), (below + 1, 1.0)]);
        std::iter::once((GUARD_STOPPING, 1.0)).chain(stability).chain(ends)
    }

    /// Of a guard at an end of the piece of the friction law, whether it is the upper end.
    fn end_of_piece(&self, index: usize) -> Option<bool> {
        let below = self.brake.guard_below(&self.location)?;
        (index >= below).then_some(index > below)
    }

    fn guard(&self, index: usize, tau: f64, y: &TorsionState) -> f64 {
        if index == GUARD_STOPPING {
            self.sense() * self.brake.torsion.relative_velocity(y)
        } else if let Some(above) = self.end_of_piece(index) {
            self.brake.inside_piece(&self.location, above, y)
        } else {
            self.brake.stability_margin(&self.location, self.origin + tau, y)
        }
    }

    /// What counts as zero of a guard where the segment begins.
    fn noise(&self, index: usize) -> f64 {
        if index == GUARD_STOPPING || self.end_of_piece(index).is_some() {
            let speeds = self.brake.torsion.relative_velocity_terms(&self.y);
            VELOCITY_NOISE * speeds
        } else {
            MARGIN_NOISE * self.brake.torsion.torsion.damping + self.noise_of_force().0
        }
    }

    /// What the contact force's rounding where the segment begins is in the margin, N m s/rad, and what that of its rate is
    /// in the margin's, N m/rad.
    fn noise_of_force(&self) -> (f64, f64) {
        let Brake { torsion, axial, .. } = &*self.brake;
        let t = self.origin;
        // The time is itself no more exact than its last place.
        let force = axial.force.largest() + (axial.at(t).pressing_rate * t).abs();
        let rate = axial.curvature_bound(t) * (t + torsion.natural_period());
        let relative_velocity = self.sense() * torsion.relative_velocity(&self.y);
        let slope = torsion.friction.law.coefficient_and_slope(relative_velocity).1.abs();
        let noise = |of: f64| torsion.slope_weight(FORCE_NOISE * of) * slope;
        (noise(force), noise(rate))
    }

    fn weights(&self) -> TorsionState {
        std::array::from_fn(|k| self.absolute[k] + self.relative * self.y[k].abs())
    }
}

impl Engine<Location> for SemiAnalyticEngine {
    fn begin(&mut self, segment: &Segment<'_, Location>, chosen: &ChosenSolver) -> Result<(), EngineError> {
        let (location, t, y) = (&segment.location, segment.start, segment.state);
        if location.piece != self.location.piece {
            self.series = SlipSeries::new(self.brake.torsion_in(location), self.unit);
        }
        self.location = *location;
        self.origin = t;
        self.span = segment.span();
        self.max_step = chosen.max_step.unwrap_or(f64::INFINITY);
        self.relative = chosen.tolerances.relative;
        self.absolute.copy_from_slice(&chosen.tolerances.absolute);
        self.tau = 0.0;
        self.y.copy_from_slice(y);
        self.last = Last::Expansion(0.0);
        self.first = true;
        self.beyond = self.brake.starts_beyond(location, t, y, GUARD_STOPPING);
        self.ringing = true;
        self.next = 4.0 * self.brake.torsion.natural_period();
        self.predicted = false;
        self.accepted = (0.0, 0.0);
        self.counters = Counters::default();
        self.radau_before = self.radau.work();
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, EngineError> {
        if !self.location.resolved
            && let Some(advance) = self.slow_step()?
        {
            self.ringing = true;
            self.predicted = false;
            return Ok(advance);
        }
        if self.ringing || self.location.resolved || self.beyond {
            self.expand();
            self.ringing = self.ringing_rate() > Components::of(&self.weights()).rotor_twist_rate;
        }
        if !self.ringing && !self.location.resolved && !self.beyond {
            if let Some(advance) = self.collocation_step()? {
                return Ok(advance);
            }
            self.next = 4.0 * self.brake.torsion.natural_period();
            self.predicted = false;
            self.accepted = (0.0, 0.0);
            self.ringing = true;
            self.expand();
        }
        let longest = self.longest_expansion(TERMS - 1, &self.weights());
        self.expansion_step(longest)
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.y
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), EngineError> {
        match self.last {
            Last::Expansion(about) => out.copy_from_slice(&self.series.at(&((tau - about) / self.series.unit))),
            Last::Collocation => self.radau.step().at(tau, out),
        }
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters, EngineError> {
        Ok(with_work_of(self.counters, self.radau.work(), self.radau_before))
    }
}
