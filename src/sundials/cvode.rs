//! CVODE: multistep methods of variable order and step.

use std::ffi::{c_int, c_long, c_void};

use super::context::{DenseNewton, FixedPointSolver};
use super::core::{Core, Status, finite, max_steps, positive};
use super::error::SolverError;
use super::flags::Family;
use super::{Counters, Direction, Integrator, OdeSystem, Outcome, Task, Tolerances, callbacks, ffi};

/// Family of linear multistep methods. (`lmm` of `CVodeCreate`)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Multistep {
    /// Adams-Moulton, orders 1 to 12, for systems that are not stiff. (`CV_ADAMS`)
    Adams,
    /// Backward differentiation, orders 1 to 5, for stiff systems. (`CV_BDF`)
    Bdf,
}

/// How the implicit equation of each step is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Nonlinear {
    /// Newton iteration with a dense Jacobian, the system's own if it has one. (`CVodeSetLinearSolver` with
    /// `SUNLinSol_Dense`, `CVodeSetJacFn`)
    Newton,
    /// Fixed-point iteration. (`SUNNonlinSol_FixedPoint`)
    FixedPoint {
        /// Number of vectors of Anderson's acceleration; 0 for none.
        acceleration: u32,
    },
}

/// What a [`Cvode`] is made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CvodeOptions {
    /// Which methods.
    pub method: Multistep,
    /// How their equations are solved.
    pub nonlinear: Nonlinear,
    /// Highest order; None for that of the method. (`CVodeSetMaxOrd`)
    pub max_order: Option<u32>,
    /// Whether BDF lowers its order where it would be unstable near the imaginary axis. (`CVodeSetStabLimDet`)
    pub stability_limit_detection: bool,
    /// How far below the local error the iteration of a step has to converge; None for CVODE's own 0.1. An explicit method
    /// is made of an implicit one by too few iterations, and loses its stability. (`CVodeSetNonlinConvCoef`)
    pub convergence: Option<f64>,
    /// A lower order as long as steps are short; None for none.
    pub short_steps: Option<ShortSteps>,
}

/// Orders of BDF above 2 are unstable near the imaginary axis, but there only where the step is short against the
/// oscillation: of order 3, 4 and 5 up to |h lambda| of 1.9, 4.7 and 9.7. After a start the order therefore stays low until
/// a step has got past that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortSteps {
    /// Highest order until a step is longer than `until`. (`CVodeSetMaxOrd`)
    pub max_order: u32,
    /// s.
    pub until: f64,
}

impl CvodeOptions {
    /// Adams with fixed-point iteration: for systems that are not stiff.
    pub const ADAMS: Self = Self {
        method: Multistep::Adams,
        nonlinear: Nonlinear::FixedPoint { acceleration: 0 },
        max_order: None,
        stability_limit_detection: false,
        convergence: None,
        short_steps: None,
    };

    /// BDF with Newton iteration: for stiff systems.
    pub const BDF: Self = Self {
        method: Multistep::Bdf,
        nonlinear: Nonlinear::Newton,
        max_order: None,
        stability_limit_detection: false,
        convergence: None,
        short_steps: None,
    };
}

/// The memory of `CVodeCreate`.
struct Memory(*mut c_void);

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: made by CVodeCreate; the objects that it refers to are freed later.
        unsafe { ffi::CVodeFree(&mut self.0) }
    }
}

/// CVODE with a system.
pub struct Cvode<S: OdeSystem> {
    // Dropped in this order.
    memory: Memory,
    newton: Option<DenseNewton>,
    _fixed_point: Option<FixedPointSolver>,
    /// Highest order of all, and of short steps, as long as those last.
    max_order: c_int,
    short_steps: Option<ShortSteps>,
    climbing: bool,
    core: Core<S>,
}

// SAFETY: nothing of it is shared: memory, vectors and context are its own, and SUNDIALS keeps no thread's identity.
unsafe impl<S: OdeSystem + Send> Send for Cvode<S> {}

/// Calls a function of CVODE and checks its flag.
macro_rules! cv {
    ($self:ident, $function:ident($($argument:expr),*)) => {{
        // SAFETY: the memory is that of CVodeCreate, and the arguments are as the function wants them.
        let code = unsafe { ffi::$function($self.memory.0, $($argument),*) };
        $self.core.check(stringify!($function), Family::Cvode, code)
    }};
}

/// The same for its linear solver interface.
macro_rules! cvls {
    ($self:ident, $function:ident($($argument:expr),*)) => {{
        // SAFETY: as in `cv`.
        let code = unsafe { ffi::$function($self.memory.0, $($argument),*) };
        $self.core.check(stringify!($function), Family::CvodeLinear, code)
    }};
}

impl<S: OdeSystem> Cvode<S> {
    /// Makes the solver for `system` from y(t0) = `y0`.
    /// (`CVodeCreate`, `CVodeInit`, `CVodeSVtolerances` and the functions named at the options)
    pub fn new(
        system: S,
        options: CvodeOptions,
        t0: f64,
        y0: &[f64],
        tolerances: &Tolerances,
    ) -> Result<Self, SolverError> {
        let core = Core::new(system, t0, y0)?;
        let method = match options.method {
            Multistep::Adams => ffi::CV_ADAMS,
            Multistep::Bdf => ffi::CV_BDF,
        };
        // SAFETY: the context is alive.
        let memory = Memory(unsafe { ffi::CVodeCreate(method, core.context.raw()) });
        if memory.0.is_null() {
            return Err(SolverError::Allocation {
                function: "CVodeCreate",
            });
        }
        let mut this = Self {
            memory,
            newton: None,
            _fixed_point: None,
            max_order: 0,
            short_steps: options.short_steps,
            climbing: false,
            core,
        };
        this.core.shared_mut().clock = this.memory.0;
        cv!(this, CVodeInit(Some(callbacks::rhs::<S>), t0, this.core.state.raw()))?;
        cv!(this, CVodeSetUserData(this.core.user_data()))?;
        // SUNDIALS would print this warning.
        cv!(this, CVodeSetMaxHnilWarns(-1))?;
        this.set_tolerances(tolerances)?;

        match options.nonlinear {
            Nonlinear::Newton => {
                let newton = DenseNewton::new(&this.core.context, &this.core.state)?;
                cvls!(this, CVodeSetLinearSolver(newton.solver(), newton.matrix()))?;
                this.newton = Some(newton);
                if this.system().has_jacobian() {
                    cvls!(this, CVodeSetJacFn(Some(callbacks::jacobian::<S>)))?;
                }
            }
            Nonlinear::FixedPoint { acceleration } => {
                let solver = FixedPointSolver::new(&this.core.context, &this.core.state, acceleration)?;
                let raw = solver.raw();
                this._fixed_point = Some(solver);
                cv!(this, CVodeSetNonlinearSolver(raw))?;
            }
        }
        if let Some(order) = options.max_order {
            cv!(this, CVodeSetMaxOrd(order_of(order)))?;
        }
        if let Some(coefficient) = options.convergence {
            positive("coefficient of convergence", coefficient)?;
            cv!(this, CVodeSetNonlinConvCoef(coefficient))?;
        }
        if let Some(short) = options.short_steps {
            positive("end of short steps", short.until)?;
        }
        if options.stability_limit_detection {
            cv!(this, CVodeSetStabLimDet(1))?;
        }
        this.max_order = order_of(options.max_order.unwrap_or(match options.method {
            Multistep::Adams => 12,
            Multistep::Bdf => 5,
        }));
        this.start_climbing()?;
        Ok(this)
    }

    /// Back to the order of short steps, at a start.
    fn start_climbing(&mut self) -> Result<(), SolverError> {
        self.climbing = self.short_steps.is_some();
        match self.short_steps {
            Some(short) => cv!(self, CVodeSetMaxOrd(order_of(short.max_order))),
            None => Ok(()),
        }
    }

    /// Out of line, to keep the path of a plain step short.
    #[inline(never)]
    fn climb(&mut self, short: ShortSteps) -> Result<(), SolverError> {
        if self.last_step_size()? > short.until {
            self.climbing = false;
            cv!(self, CVodeSetMaxOrd(self.max_order))?;
        }
        Ok(())
    }

    fn init_crossings(&mut self) -> Result<(), SolverError> {
        let count = self.core.directions.len();
        // Without the first call CVODE would keep what it knows of functions of the same number: which of them were
        // zero, and so are not watched.
        cv!(self, CVodeRootInit(0, None))?;
        if count > 0 {
            cv!(self, CVodeRootInit(count as c_int, callbacks::roots::<S>(count)))?;
            cv!(self, CVodeSetRootDirection(self.core.directions.as_mut_ptr()))?;
            cv!(self, CVodeSetNoInactiveRootWarn())?;
        }
        Ok(())
    }

    #[cold]
    #[inline(never)]
    fn failed(&mut self, code: c_int, time: f64) -> SolverError {
        let mesh_time = self.mesh_time().unwrap_or(time);
        self.core.fail("CVode", Family::Cvode, code, mesh_time)
    }

    /// Out of line, to keep the path of a plain step short.
    #[inline(never)]
    fn find_crossings(&mut self) -> Result<(), SolverError> {
        cv!(self, CVodeGetRootInfo(self.core.raw_found.as_mut_ptr()))?;
        self.core.read_crossings();
        Ok(())
    }
}

impl<S: OdeSystem> Integrator for Cvode<S> {
    type System = S;

    fn system(&self) -> &S {
        &self.core.shared().system
    }

    fn system_mut(&mut self) -> &mut S {
        &mut self.core.shared_mut().system
    }

    fn time(&self) -> f64 {
        self.core.time
    }

    fn state(&self) -> &[f64] {
        self.core.state.values()
    }

    fn restart(&mut self, t0: f64, y0: &[f64]) -> Result<(), SolverError> {
        self.core.take_initial_state(t0, y0)?;
        cv!(self, CVodeReInit(t0, self.core.state.raw()))?;
        self.start_climbing()?;
        cv!(self, CVodeClearStopTime())?;
        self.init_crossings()?;
        self.core.restarted(t0);
        Ok(())
    }

    fn set_tolerances(&mut self, tolerances: &Tolerances) -> Result<(), SolverError> {
        self.core.take_tolerances(tolerances)?;
        cv!(self, CVodeSVtolerances(tolerances.relative, self.core.work.raw()))
    }

    fn set_crossings(&mut self, crossings: &[Direction]) -> Result<(), SolverError> {
        self.core.take_crossings(crossings);
        self.init_crossings()
    }

    fn set_stop_time(&mut self, time: Option<f64>) -> Result<(), SolverError> {
        match time {
            None => cv!(self, CVodeClearStopTime()),
            Some(time) => {
                finite("stop time", time)?;
                cv!(self, CVodeSetStopTime(time))
            }
        }
    }

    fn set_max_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
        step.map_or(Ok(()), |step| positive("longest step", step))?;
        cv!(self, CVodeSetMaxStep(step.unwrap_or(0.0)))
    }

    fn set_min_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
        step.map_or(Ok(()), |step| positive("shortest step", step))?;
        cv!(self, CVodeSetMinStep(step.unwrap_or(0.0)))
    }

    fn set_initial_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
        step.map_or(Ok(()), |step| finite("initial step", step))?;
        cv!(self, CVodeSetInitStep(step.unwrap_or(0.0)))
    }

    fn set_max_steps(&mut self, steps: Option<u64>) -> Result<(), SolverError> {
        cv!(self, CVodeSetMaxNumSteps(max_steps(steps)))
    }

    #[inline]
    fn advance(&mut self, t_out: f64, task: Task) -> Result<Outcome, SolverError> {
        self.core.begin(t_out)?;
        let (c_task, done) = match task {
            Task::Normal => (ffi::CV_NORMAL, Outcome::Reached),
            Task::OneStep => (ffi::CV_ONE_STEP, Outcome::Stepped),
        };
        let mut time = self.core.time;
        // SAFETY: no reference to anything that C or the callbacks use is alive.
        let code = unsafe { ffi::CVode(self.memory.0, t_out, self.core.next.raw(), &mut time, c_task) };
        let outcome = match code {
            ffi::CV_SUCCESS => done,
            ffi::CV_TSTOP_RETURN => Outcome::StopTime,
            ffi::CV_ROOT_RETURN => Outcome::Roots,
            _ => return Err(self.failed(code, time)),
        };
        self.core.succeed(time);
        if let Some(short) = self.short_steps.filter(|_| self.climbing) {
            self.climb(short)?;
        }
        if outcome == Outcome::Roots {
            self.find_crossings()?;
        }
        Ok(outcome)
    }

    fn crossings_found(&self) -> &[Option<Direction>] {
        &self.core.found
    }

    fn interpolate(&mut self, t: f64, k: u32, out: &mut [f64]) -> Result<(), SolverError> {
        let k = self.core.begin_interpolation(t, k, out)?;
        // SAFETY: as in `advance`.
        let code = unsafe { ffi::CVodeGetDky(self.memory.0, t, k, self.core.work.raw()) };
        self.core.end_interpolation("CVodeGetDky", Family::Cvode, code, out)
    }

    fn mesh_time(&mut self) -> Result<f64, SolverError> {
        let mut time = 0.0;
        cv!(self, CVodeGetCurrentTime(&mut time))?;
        Ok(time)
    }

    fn last_step_size(&mut self) -> Result<f64, SolverError> {
        let mut step = 0.0;
        cv!(self, CVodeGetLastStep(&mut step))?;
        Ok(step)
    }

    fn counters(&mut self) -> Result<Counters, SolverError> {
        // Some counters start anew only with the first step.
        if self.core.status == Status::Fresh {
            return Ok(Counters::default());
        }
        let mut counters = Counters::default();
        let [mut steps, mut rhs, mut setups, mut failures]: [c_long; 4] = [0; 4];
        let [mut last_order, mut current_order]: [c_int; 2] = [0; 2];
        let [mut first_step, mut time]: [f64; 2] = [0.0; 2];
        cv!(
            self,
            CVodeGetIntegratorStats(
                &mut steps,
                &mut rhs,
                &mut setups,
                &mut failures,
                &mut last_order,
                &mut current_order,
                &mut first_step,
                &mut counters.last_step,
                &mut counters.current_step,
                &mut time
            )
        )?;
        let [mut iterations, mut divergences]: [c_long; 2] = [0; 2];
        cv!(self, CVodeGetNonlinSolvStats(&mut iterations, &mut divergences))?;
        let [mut jacobians, mut differences, mut roots]: [c_long; 3] = [0; 3];
        if self.newton.is_some() {
            cvls!(self, CVodeGetNumJacEvals(&mut jacobians))?;
            cvls!(self, CVodeGetNumLinRhsEvals(&mut differences))?;
        }
        if !self.core.directions.is_empty() {
            cv!(self, CVodeGetNumGEvals(&mut roots))?;
        }
        counters.steps = count(steps);
        counters.rhs_evaluations = count(rhs) + count(differences);
        counters.jacobian_evaluations = count(jacobians);
        counters.linear_solver_setups = count(setups);
        counters.error_test_failures = count(failures);
        counters.nonlinear_iterations = count(iterations);
        counters.nonlinear_convergence_failures = count(divergences);
        counters.root_evaluations = count(roots);
        counters.last_order = last_order.unsigned_abs();
        Ok(counters)
    }
}

/// An order as C has it.
fn order_of(order: u32) -> c_int {
    c_int::try_from(order).unwrap_or(c_int::MAX)
}

/// A counter of C: a long that is never negative.
pub(super) fn count(number: c_long) -> u64 {
    u64::try_from(number).unwrap_or(0)
}
