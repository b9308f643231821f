//! The solver: CVODE or ARKODE, with the system that it integrates.

use std::ffi::{c_int, c_long, c_void};

use super::context::{FixedPointSolver, no_memory};
use super::core::{Core, SolverStatus, finite, positive};
use super::flags::FlagFamily;
use super::method::{CvodeOptions, Multistep, Nonlinear, ShortSteps, SolverMethod};
use super::newton::{self, Newton};
use super::non_finite::Callback;
use super::{AdvanceTarget, Advanced, Counters, Direction, OdeSystem, Tolerances, callbacks, ffi};
use crate::Error;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SolverFamily {
    Cvode,
    Erk,
    Ark,
}

impl SolverFamily {
    fn family(self) -> FlagFamily {
        match self {
            SolverFamily::Cvode => FlagFamily::Cvode,
            SolverFamily::Erk | SolverFamily::Ark => FlagFamily::Arkode,
        }
    }
}

struct Memory {
    kind: SolverFamily,
    raw: *mut c_void,
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: made by this solver; the objects that it refers to are freed later.
        unsafe {
            match self.kind {
                SolverFamily::Cvode => ffi::CVodeFree(&mut self.raw),
                SolverFamily::Erk | SolverFamily::Ark => ffi::ARKodeFree(&mut self.raw),
            }
        }
    }
}

/// A solver of an initial value problem; it owns the system.
///
/// The docs name the functions of CVODE; those of ARKODE have the prefix `ARKode`. Arguments that are not finite,
/// slices of a wrong length, and failure flags of C functions give an [`Error`].
pub struct Solver<S: OdeSystem> {
    // Fields are dropped in this order.
    memory: Memory,
    newton: Option<Newton>,
    _fixed_point: Option<FixedPointSolver>,
    core: Core<S>,
    /// CVODE: highest order; Runge-Kutta: the method's order.
    order: c_int,
    short_steps: Option<ShortSteps>,
    climbing: bool,
    /// Settings that ARKODE needs again after a retried step.
    fixed_step: bool,
    initial_step: f64,
    stop_time: Option<f64>,
}

// SAFETY: memory, vectors and context are its own, and SUNDIALS keeps no thread's identity.
unsafe impl<S: OdeSystem + Send> Send for Solver<S> {}

macro_rules! call {
    ($self:ident, $family:ident, $function:ident($($argument:expr),*)) => {{
        // SAFETY: the solver's own memory, and arguments as the function requires.
        let code = unsafe { ffi::$function($self.memory.raw, $($argument),*) };
        $self.core.check(stringify!($function), FlagFamily::$family, code)
    }};
}

/// [`call`] for a function of both CVODE and ARKODE.
macro_rules! either {
    ($self:ident, $cvode:ident | $arkode:ident $arguments:tt) => {
        match $self.memory.kind {
            SolverFamily::Cvode => call!($self, Cvode, $cvode $arguments),
            SolverFamily::Erk | SolverFamily::Ark => call!($self, Arkode, $arkode $arguments),
        }
    };
}

/// [`either`] for the interfaces to linear solvers.
macro_rules! either_linear {
    ($self:ident, $cvode:ident | $arkode:ident $arguments:tt) => {
        match $self.memory.kind {
            SolverFamily::Cvode => call!($self, CvodeLinear, $cvode $arguments),
            SolverFamily::Erk | SolverFamily::Ark => call!($self, ArkodeLinear, $arkode $arguments),
        }
    };
}

impl<S: OdeSystem> Solver<S> {
    /// Makes a solver for `system` from y(t0) = `y0`. (`CVodeCreate`, `ERKStepCreate`, `ARKStepCreate`,
    /// `CVodeSVtolerances`, and the functions named at the options)
    pub fn new(
        system: S,
        method: impl Into<SolverMethod>,
        t0: f64,
        y0: &[f64],
        tolerances: &Tolerances,
    ) -> Result<Self, Error> {
        let method = method.into();
        let core = Core::new(system, t0, y0)?;
        let (y, context) = (core.state.raw(), core.context.raw());
        let rhs: ffi::ARKRhsFn = Some(callbacks::rhs::<S>);
        // SAFETY: vector and context are alive.
        let (kind, function, raw) = unsafe {
            match method {
                SolverMethod::Cvode(CvodeOptions { method, .. }) => {
                    let method = match method {
                        Multistep::Adams => ffi::CV_ADAMS,
                        Multistep::Bdf => ffi::CV_BDF,
                    };
                    (SolverFamily::Cvode, "CVodeCreate", ffi::CVodeCreate(method, context))
                }
                SolverMethod::Erk { .. } => (
                    SolverFamily::Erk,
                    "ERKStepCreate",
                    ffi::ERKStepCreate(rhs, t0, y, context),
                ),
                SolverMethod::Esdirk { .. } => {
                    let memory = ffi::ARKStepCreate(None, rhs, t0, y, context);
                    (SolverFamily::Ark, "ARKStepCreate", memory)
                }
            }
        };
        let memory = Memory { kind, raw };
        if raw.is_null() {
            return Err(no_memory(function));
        }
        let mut this = Self {
            memory,
            newton: None,
            _fixed_point: None,
            core,
            order: 0,
            short_steps: None,
            climbing: false,
            fixed_step: false,
            initial_step: 0.0,
            stop_time: None,
        };
        if kind == SolverFamily::Cvode {
            this.core.shared_mut().clock = raw;
            call!(this, Cvode, CVodeInit(rhs, t0, y))?;
        } else {
            call!(
                this,
                Arkode,
                ARKodeSetPostprocessStepFn(Some(callbacks::step_completed::<S>))
            )?;
        }
        either!(this, CVodeSetUserData | ARKodeSetUserData(this.core.user_data()))?;
        either!(this, CVodeSetMaxHnilWarns | ARKodeSetMaxHnilWarns(-1))?;
        this.set_tolerances(tolerances)?;
        match method {
            SolverMethod::Cvode(options) => this.set_multistep(options)?,
            SolverMethod::Erk { table, fixed_step } => {
                this.set_fixed_step(fixed_step)?;
                this.order = int(table.order());
                call!(this, Arkode, ERKStepSetTableNum(table.id()))?;
            }
            SolverMethod::Esdirk {
                fixed_step,
                trust_convergence_rate,
            } => {
                this.set_fixed_step(fixed_step)?;
                this.order = 5;
                let table = ffi::ARKODE_ESDIRK547L2SA2_7_4_5;
                call!(this, Arkode, ARKStepSetTableNum(table, ffi::ARKODE_ERK_NONE))?;
                this.set_newton()?;
                if !trust_convergence_rate {
                    call!(this, Arkode, ARKodeSetNonlinCRDown(1.0))?;
                }
            }
        }
        Ok(this)
    }

    fn set_multistep(&mut self, options: CvodeOptions) -> Result<(), Error> {
        match options.nonlinear {
            Nonlinear::Newton => self.set_newton()?,
            Nonlinear::FixedPoint => {
                let solver = FixedPointSolver::new(&self.core.context, &self.core.state)?;
                let raw = solver.0;
                self._fixed_point = Some(solver);
                call!(self, Cvode, CVodeSetNonlinearSolver(raw))?;
            }
        }
        if let Some(order) = options.max_order {
            call!(self, Cvode, CVodeSetMaxOrd(int(order)))?;
        }
        if let Some(coefficient) = options.convergence {
            positive("coefficient of convergence", coefficient)?;
            call!(self, Cvode, CVodeSetNonlinConvCoef(coefficient))?;
        }
        if let Some(short) = options.short_steps {
            positive("end of short steps", short.until)?;
        }
        self.order = int(options.max_order.unwrap_or(match options.method {
            Multistep::Adams => 12,
            Multistep::Bdf => 5,
        }));
        self.short_steps = options.short_steps;
        self.start_climbing()
    }

    fn set_newton(&mut self) -> Result<(), Error> {
        let (core, system) = (&self.core, self.system());
        let (newton, jacobian): (_, ffi::CVLsJacFn) = match system.half_width() {
            Some(half_width) => {
                let newton = Newton::band::<S>(&core.context, &core.state, half_width, core.user_data())?;
                (newton, Some(newton::band_jacobian::<S>))
            }
            None => (
                Newton::dense(&core.context, &core.state)?,
                system.has_jacobian().then_some(callbacks::jacobian::<S>),
            ),
        };
        let (solver, matrix) = (newton.solver, newton.matrix);
        self.newton = Some(newton);
        either_linear!(self, CVodeSetLinearSolver | ARKodeSetLinearSolver(solver, matrix))?;
        if jacobian.is_some() {
            either_linear!(self, CVodeSetJacFn | ARKodeSetJacFn(jacobian))?;
        }
        Ok(())
    }

    fn set_fixed_step(&mut self, step: Option<f64>) -> Result<(), Error> {
        self.fixed_step = step.is_some();
        let Some(step) = step else { return Ok(()) };
        finite("fixed step", step)?;
        positive("fixed step", step.abs())?;
        call!(self, Arkode, ARKodeSetFixedStep(step))
    }

    fn start_climbing(&mut self) -> Result<(), Error> {
        self.climbing = self.short_steps.is_some();
        match self.short_steps {
            Some(short) => call!(self, Cvode, CVodeSetMaxOrd(int(short.max_order))),
            None => Ok(()),
        }
    }

    /// Out of line, to keep a plain step short.
    #[inline(never)]
    fn climb(&mut self, short: ShortSteps) -> Result<(), Error> {
        if self.last_step_size()? > short.until {
            self.climbing = false;
            call!(self, Cvode, CVodeSetMaxOrd(self.order))?;
        }
        Ok(())
    }

    fn init_crossings(&mut self) -> Result<(), Error> {
        let count = self.core.directions.len();
        let roots = callbacks::roots::<S>(count);
        // The first call makes SUNDIALS forget which functions were zero at the last start, and therefore not watched.
        either!(self, CVodeRootInit | ARKodeRootInit(0, None))?;
        if count > 0 {
            let directions = self.core.directions.as_mut_ptr();
            either!(self, CVodeRootInit | ARKodeRootInit(count as c_int, roots))?;
            either!(self, CVodeSetRootDirection | ARKodeSetRootDirection(directions))?;
            either!(self, CVodeSetNoInactiveRootWarn | ARKodeSetNoInactiveRootWarn())?;
        }
        Ok(())
    }

    /// The system of equations.
    pub fn system(&self) -> &S {
        &self.core.shared().system
    }

    /// The system of equations, to be changed. A change of its right-hand side needs a [`restart`](Self::restart).
    pub fn system_mut(&mut self) -> &mut S {
        &mut self.core.shared_mut().system
    }

    /// Time of the last solution that was returned.
    pub fn time(&self) -> f64 {
        self.core.time
    }

    /// Last solution that was returned, at [`time`](Self::time).
    pub fn state(&self) -> &[f64] {
        self.core.state.values()
    }

    /// Restarts at `t0` with the state `y0`. Resets counters and stop time, and keeps the other settings.
    /// (`CVodeReInit`, `ERKStepReInit`, `ARKStepReInit`)
    pub fn restart(&mut self, t0: f64, y0: &[f64]) -> Result<(), Error> {
        self.core.take_initial_state(t0, y0)?;
        let (y, rhs) = (self.core.state.raw(), Some(callbacks::rhs::<S> as _));
        match self.memory.kind {
            SolverFamily::Cvode => call!(self, Cvode, CVodeReInit(t0, y))?,
            SolverFamily::Erk => call!(self, Arkode, ERKStepReInit(rhs, t0, y))?,
            SolverFamily::Ark => call!(self, Arkode, ARKStepReInit(None, rhs, t0, y))?,
        }
        self.start_climbing()?;
        self.set_stop_time(None)?;
        if !self.core.directions.is_empty() {
            self.init_crossings()?;
        }
        self.core.restarted(t0);
        Ok(())
    }

    /// Sets the tolerances. (`CVodeSVtolerances`)
    pub fn set_tolerances(&mut self, tolerances: &Tolerances) -> Result<(), Error> {
        self.core.take_tolerances(tolerances)?;
        let (relative, absolute) = (tolerances.relative, self.core.work.raw());
        either!(self, CVodeSVtolerances | ARKodeSVtolerances(relative, absolute))
    }

    /// Sets the crossing direction for each function of [`OdeSystem::roots`]; an empty slice removes all. A function
    /// that is exactly zero at the start is no crossing, and is watched only after it has left zero. (`CVodeRootInit`,
    /// `CVodeSetRootDirection`)
    pub fn set_crossings(&mut self, crossings: &[Direction]) -> Result<(), Error> {
        let had_none = self.core.directions.is_empty();
        self.core.take_crossings(crossings);
        if had_none && crossings.is_empty() {
            Ok(())
        } else {
            self.init_crossings()
        }
    }

    /// Sets a time that no step passes; `advance` returns [`Advanced::StopTime`] there once. The time must lie beyond
    /// the internal mesh, not only beyond [`time`](Self::time). (`CVodeSetStopTime`, `CVodeClearStopTime`)
    pub fn set_stop_time(&mut self, time: Option<f64>) -> Result<(), Error> {
        match time {
            None => either!(self, CVodeClearStopTime | ARKodeClearStopTime())?,
            Some(time) => {
                finite("stop time", time)?;
                either!(self, CVodeSetStopTime | ARKodeSetStopTime(time))?;
            }
        }
        self.stop_time = time;
        Ok(())
    }

    /// Sets the longest step, which is positive; None for no bound. (`CVodeSetMaxStep`)
    pub fn set_max_step(&mut self, step: Option<f64>) -> Result<(), Error> {
        step.map_or(Ok(()), |step| positive("longest step", step))?;
        either!(self, CVodeSetMaxStep | ARKodeSetMaxStep(step.unwrap_or(0.0)))
    }

    /// Sets the first step after a start or restart, with the sign of the direction of integration; None for an
    /// estimate. (`CVodeSetInitStep`)
    pub fn set_initial_step(&mut self, step: Option<f64>) -> Result<(), Error> {
        step.map_or(Ok(()), |step| finite("initial step", step))?;
        self.initial_step = step.unwrap_or(0.0);
        // ARKODE keeps a fixed step in the same place.
        if self.fixed_step {
            return Ok(());
        }
        either!(self, CVodeSetInitStep | ARKodeSetInitStep(self.initial_step))
    }

    /// Sets the largest number of steps in a call of `advance`, by default 500; None for no bound. After this error
    /// `advance` may be called again. (`CVodeSetMaxNumSteps`)
    pub fn set_max_steps(&mut self, steps: Option<u64>) -> Result<(), Error> {
        let most = steps.map_or(-1, |steps| c_long::try_from(steps.max(1)).unwrap_or(c_long::MAX));
        either!(self, CVodeSetMaxNumSteps | ARKodeSetMaxNumSteps(most))
    }

    /// Integrates towards `t_out`, until the first [`Advanced`]. (`CVode`, `ARKodeEvolve`)
    ///
    /// # Panics
    /// Resumes the panic of a callback.
    #[inline]
    pub fn advance(&mut self, t_out: f64, task: AdvanceTarget) -> Result<Advanced, Error> {
        self.core.begin(t_out)?;
        let mut time = self.core.time;
        let mut code = self.evolve(t_out, task, &mut time);
        if code < 0 && self.memory.kind != SolverFamily::Cvode {
            code = self.retry_shorter(code, t_out, task, &mut time)?;
        }
        // ARKODE has the same numbers.
        let outcome = match (code, task) {
            (ffi::CV_SUCCESS, AdvanceTarget::Normal) => Advanced::Reached,
            (ffi::CV_SUCCESS, AdvanceTarget::OneStep) => Advanced::Stepped,
            (ffi::CV_TSTOP_RETURN, _) => {
                self.stop_time = None;
                Advanced::StopTime
            }
            (ffi::CV_ROOT_RETURN, _) => Advanced::Roots,
            _ => return Err(self.failed(code, time)),
        };
        self.core.succeed(time);
        if let Some(short) = self.short_steps.filter(|_| self.climbing) {
            self.climb(short)?;
        }
        if outcome == Advanced::Roots {
            self.find_crossings()?;
        }
        Ok(outcome)
    }

    #[inline]
    fn evolve(&mut self, t_out: f64, task: AdvanceTarget, time: &mut f64) -> c_int {
        let (memory, next) = (self.memory.raw, self.core.next.raw());
        let task = match task {
            AdvanceTarget::Normal => ffi::CV_NORMAL,
            AdvanceTarget::OneStep => ffi::CV_ONE_STEP,
        };
        // SAFETY: no reference to data of C or the callbacks is alive.
        unsafe {
            match self.memory.kind {
                SolverFamily::Cvode => ffi::CVode(memory, t_out, next, time, task),
                SolverFamily::Erk | SolverFamily::Ark => ffi::ARKodeEvolve(memory, t_out, next, time, task),
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn failed(&mut self, code: c_int, time: f64) -> Error {
        // After a failed stage ARKODE reports the time of the stage.
        let mesh_time = self.mesh_time().unwrap_or(time);
        let function = match self.memory.kind {
            SolverFamily::Cvode => "CVode",
            SolverFamily::Erk | SolverFamily::Ark => "ARKodeEvolve",
        };
        self.core.fail(function, self.memory.kind.family(), code, mesh_time)
    }

    /// Out of line, to keep a plain step short.
    #[inline(never)]
    fn find_crossings(&mut self) -> Result<(), Error> {
        let found = self.core.raw_found.as_mut_ptr();
        either!(self, CVodeGetRootInfo | ARKodeGetRootInfo(found))?;
        self.core.read_crossings();
        Ok(())
    }

    /// Tries shorter steps if a right-hand side in an explicit stage was not finite, an error that ARKODE considers
    /// unrecoverable. Returns the final flag.
    #[cold]
    fn retry_shorter(
        &mut self,
        mut code: c_int,
        t_out: f64,
        task: AdvanceTarget,
        time: &mut f64,
    ) -> Result<c_int, Error> {
        /// As many attempts as ARKODE makes for implicit stages (`ARKodeSetMaxConvFails`).
        const MOST: u32 = 10;
        let mut attempts = 0;
        let mut mesh_time = f64::NAN;
        let mut step = 0.0;
        let retried = loop {
            let shared = self.core.shared();
            let met_non_finite = !shared.has_panicked()
                && shared
                    .non_finite
                    .is_some_and(|found| found.callback == Callback::RightHandSide);
            // ARK_RHSFUNC_FAIL: the state itself has no slope, unless the first step is being estimated.
            let first = code == ffi::ARK_RHSFUNC_FAIL
                && self.core.status == SolverStatus::Fresh
                && shared.non_finite.is_some_and(|found| found.time != shared.mesh_time);
            if self.fixed_step || !met_non_finite || !(code == ffi::ARK_UNREC_RHSFUNC_ERR || first) {
                break attempts > 0;
            }
            if shared.mesh_time != mesh_time {
                mesh_time = shared.mesh_time;
                attempts = 0;
                step = 0.0;
                if !first {
                    call!(self, Arkode, ARKodeGetCurrentStep(&mut step))?;
                }
            }
            if attempts == MOST {
                break true;
            }
            attempts += 1;
            step = if step == 0.0 {
                0.1 * (t_out - mesh_time)
            } else {
                0.25 * step
            };
            // After a step, `next` holds ARKODE's state at the mesh time.
            let start = if first {
                self.core.state.raw()
            } else {
                self.core.next.raw()
            };
            call!(self, Arkode, ARKodeReset(mesh_time, start))?;
            call!(self, Arkode, ARKodeSetInitStep(step))?;
            if let Some(stop_time) = self.stop_time {
                call!(self, Arkode, ARKodeSetStopTime(stop_time))?;
            }
            code = self.evolve(t_out, task, time);
        };
        if retried {
            call!(self, Arkode, ARKodeSetInitStep(self.initial_step))?;
        }
        Ok(code)
    }

    /// After [`Advanced::Roots`]: for each crossing the direction in which it passes zero at [`time`](Self::time), if
    /// it does. Later calls of `advance` keep the values of the last `Roots`; a restart resets them to None.
    /// (`CVodeGetRootInfo`)
    pub fn crossings_found(&self) -> &[Option<Direction>] {
        &self.core.found
    }

    /// Writes the k-th derivative (0: the solution) of the dense output at the time `t` within the last step, which
    /// has the length [`last_step_size`](Self::last_step_size) and ends at [`mesh_time`](Self::mesh_time).
    /// (`CVodeGetDky`)
    ///
    /// For a Runge-Kutta method the degree of the dense output is at most 5 and below the method's order. Output times
    /// and crossings use it too: in long steps of a method of order 6 to 9 their error can exceed the tolerance by
    /// far, unless the step is bounded. The end of a step has the error of the method.
    pub fn interpolate(&mut self, t: f64, k: u32, out: &mut [f64]) -> Result<(), Error> {
        let k = self.core.begin_interpolation(t, k, out)?;
        let (memory, work) = (self.memory.raw, self.core.work.raw());
        // SAFETY: as in `evolve`.
        let (function, code) = unsafe {
            match self.memory.kind {
                SolverFamily::Cvode => ("CVodeGetDky", ffi::CVodeGetDky(memory, t, k, work)),
                SolverFamily::Erk | SolverFamily::Ark => ("ARKodeGetDky", ffi::ARKodeGetDky(memory, t, k, work)),
            }
        };
        self.core
            .end_interpolation(function, self.memory.kind.family(), code, out)
    }

    /// End of the last internal step, at or beyond [`time`](Self::time). (`CVodeGetCurrentTime`)
    pub fn mesh_time(&mut self) -> Result<f64, Error> {
        if self.memory.kind != SolverFamily::Cvode {
            return Ok(self.core.shared().mesh_time);
        }
        let mut time = 0.0;
        call!(self, Cvode, CVodeGetCurrentTime(&mut time))?;
        Ok(time)
    }

    /// Length of the last internal step; 0 before the first. (`CVodeGetLastStep`)
    pub fn last_step_size(&mut self) -> Result<f64, Error> {
        let mut step = 0.0;
        either!(self, CVodeGetLastStep | ARKodeGetLastStep(&mut step))?;
        Ok(step)
    }

    /// Work since the start or the last restart.
    pub fn counters(&mut self) -> Result<Counters, Error> {
        let mut counters = Counters::default();
        // SUNDIALS resets some counters only in the first step.
        if self.core.status == SolverStatus::Fresh {
            return Ok(counters);
        }
        let [mut steps, mut failures, mut rhs, mut roots]: [c_long; 4] = [0; 4];
        let [mut setups, mut iterations, mut divergences]: [c_long; 3] = [0; 3];
        let [mut jacobians, mut differences]: [c_long; 2] = [0; 2];
        let (mut order, mut explicit) = (self.order, 0);
        either!(self, CVodeGetNumSteps | ARKodeGetNumSteps(&mut steps))?;
        either!(self, CVodeGetNumErrTestFails | ARKodeGetNumErrTestFails(&mut failures))?;
        either!(self, CVodeGetLastStep | ARKodeGetLastStep(&mut counters.last_step))?;
        match self.memory.kind {
            SolverFamily::Cvode => {
                call!(self, Cvode, CVodeGetNumRhsEvals(&mut rhs))?;
                call!(self, Cvode, CVodeGetLastOrder(&mut order))?;
            }
            SolverFamily::Erk => call!(self, Arkode, ERKStepGetNumRhsEvals(&mut rhs))?,
            SolverFamily::Ark => call!(self, Arkode, ARKStepGetNumRhsEvals(&mut explicit, &mut rhs))?,
        }
        if self.memory.kind != SolverFamily::Erk {
            let (iterations, divergences) = (&mut iterations, &mut divergences);
            either!(self, CVodeGetNumLinSolvSetups | ARKodeGetNumLinSolvSetups(&mut setups))?;
            either!(
                self,
                CVodeGetNonlinSolvStats | ARKodeGetNonlinSolvStats(iterations, divergences)
            )?;
        }
        if self.newton.is_some() {
            either_linear!(self, CVodeGetNumJacEvals | ARKodeGetNumJacEvals(&mut jacobians))?;
            either_linear!(self, CVodeGetNumLinRhsEvals | ARKodeGetNumLinRhsEvals(&mut differences))?;
        }
        if !self.core.directions.is_empty() {
            either!(self, CVodeGetNumGEvals | ARKodeGetNumGEvals(&mut roots))?;
        }
        counters.steps = count(steps);
        counters.rhs_evaluations = count(rhs) + count(differences);
        counters.jacobian_evaluations = count(jacobians);
        counters.linear_solver_setups = count(setups);
        counters.error_test_failures = count(failures);
        counters.nonlinear_iterations = count(iterations);
        counters.nonlinear_convergence_failures = count(divergences);
        counters.root_evaluations = count(roots);
        counters.last_order = order.unsigned_abs();
        Ok(counters)
    }
}

fn int(number: u32) -> c_int {
    c_int::try_from(number).unwrap_or(c_int::MAX)
}

fn count(number: c_long) -> u64 {
    u64::try_from(number).unwrap_or(0)
}
