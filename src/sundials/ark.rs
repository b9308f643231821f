//! What ERKStep and ARKStep share: everything but how they are made.

use std::ffi::{c_int, c_long, c_void};

use super::context::{Controller, DenseNewton};
use super::core::{Core, Status, finite, max_steps, positive};
use super::cvode::count;
use super::error::{Callback, SolverError};
use super::flags::Family;
use super::stepping::{Interpolant, StepController, Stepping};
use super::{Counters, Direction, OdeSystem, Outcome, Task, Tolerances, callbacks, ffi};

/// The memory of `ERKStepCreate` or `ARKStepCreate`.
struct Memory(*mut c_void);

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: made by ARKODE; the objects that it refers to are freed later.
        unsafe { ffi::ARKodeFree(&mut self.0) }
    }
}

/// Which stepper the memory belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stepper {
    Explicit,
    Implicit,
}

/// ARKODE with a system.
pub(super) struct Ark<S: OdeSystem> {
    // Dropped in this order.
    memory: Memory,
    pub(super) newton: Option<DenseNewton>,
    controller: Option<Controller>,
    pub(super) core: Core<S>,
    stepper: Stepper,
    order: u32,
    fixed_step: bool,
    /// What was asked for, to be set again after a retried step.
    initial_step: f64,
    stop_time: Option<f64>,
}

// SAFETY: nothing of it is shared: memory, vectors and context are its own, and SUNDIALS keeps no thread's identity.
unsafe impl<S: OdeSystem + Send> Send for Ark<S> {}

/// Calls a function of ARKODE and checks its flag.
macro_rules! ark {
    ($self:ident, $function:ident($($argument:expr),*)) => {{
        // SAFETY: the memory is that of the stepper, and the arguments are as the function wants them.
        let code = unsafe { $crate::sundials::ffi::$function($self.memory(), $($argument),*) };
        $self.core.check(stringify!($function), $crate::sundials::flags::Family::Arkode, code)
    }};
}

/// The same for its linear solver interface.
macro_rules! arkls {
    ($self:ident, $function:ident($($argument:expr),*)) => {{
        // SAFETY: as in `ark`.
        let code = unsafe { $crate::sundials::ffi::$function($self.memory(), $($argument),*) };
        $self.core.check(stringify!($function), $crate::sundials::flags::Family::ArkodeLinear, code)
    }};
}

pub(super) use {ark, arkls};

impl<S: OdeSystem> Ark<S> {
    /// Makes the memory. The table comes later, and is not looked at before the first step.
    pub(super) fn new(
        stepper: Stepper,
        system: S,
        order: u32,
        stepping: Stepping,
        t0: f64,
        y0: &[f64],
        tolerances: &Tolerances,
    ) -> Result<Self, SolverError> {
        let core = Core::new(system, t0, y0)?;
        let (y, context) = (core.state.raw(), core.context.raw());
        let rhs: ffi::ARKRhsFn = Some(callbacks::rhs::<S>);
        // SAFETY: vector and context are alive.
        let (function, memory) = unsafe {
            match stepper {
                Stepper::Explicit => ("ERKStepCreate", ffi::ERKStepCreate(rhs, t0, y, context)),
                Stepper::Implicit => ("ARKStepCreate", ffi::ARKStepCreate(None, rhs, t0, y, context)),
            }
        };
        let memory = Memory(memory);
        if memory.0.is_null() {
            return Err(SolverError::Allocation { function });
        }
        let mut this = Self {
            memory,
            newton: None,
            controller: None,
            core,
            stepper,
            order,
            fixed_step: stepping.fixed_step.is_some(),
            initial_step: 0.0,
            stop_time: None,
        };
        ark!(this, ARKodeSetUserData(this.core.user_data()))?;
        ark!(this, ARKodeSetPostprocessStepFn(Some(callbacks::step_completed::<S>)))?;
        // SUNDIALS would print this warning.
        ark!(this, ARKodeSetMaxHnilWarns(-1))?;
        this.set_tolerances(tolerances)?;
        this.set_stepping(stepping)?;
        Ok(this)
    }

    pub(super) fn memory(&self) -> *mut c_void {
        self.memory.0
    }

    fn set_stepping(&mut self, stepping: Stepping) -> Result<(), SolverError> {
        let Stepping {
            interpolant,
            fixed_step,
            controller,
            safety,
        } = stepping;
        let (kind, degree) = match interpolant {
            Interpolant::Hermite { degree } => (ffi::ARK_INTERP_HERMITE, degree),
            Interpolant::Lagrange { degree } => (ffi::ARK_INTERP_LAGRANGE, degree),
        };
        ark!(self, ARKodeSetInterpolantType(kind))?;
        ark!(
            self,
            ARKodeSetInterpolantDegree(c_int::try_from(degree).unwrap_or(c_int::MAX))
        )?;
        if let Some(controller) = controller {
            let context = &self.core.context;
            // SAFETY: these functions make a controller of a context.
            let controller = unsafe {
                match controller {
                    StepController::Integral => {
                        Controller::new(context, "SUNAdaptController_I", ffi::SUNAdaptController_I)
                    }
                    StepController::ProportionalIntegral => {
                        Controller::new(context, "SUNAdaptController_PI", ffi::SUNAdaptController_PI)
                    }
                    StepController::Pid => {
                        Controller::new(context, "SUNAdaptController_PID", ffi::SUNAdaptController_PID)
                    }
                    StepController::ExplicitGustafsson => {
                        Controller::new(context, "SUNAdaptController_ExpGus", ffi::SUNAdaptController_ExpGus)
                    }
                    StepController::ImplicitGustafsson => {
                        Controller::new(context, "SUNAdaptController_ImpGus", ffi::SUNAdaptController_ImpGus)
                    }
                }
            }?;
            ark!(self, ARKodeSetAdaptController(controller.raw()))?;
            self.controller = Some(controller);
        }
        if let Some(safety) = safety {
            positive("safety factor", safety)?;
            ark!(self, ARKodeSetSafetyFactor(safety))?;
        }
        if let Some(step) = fixed_step {
            finite("fixed step", step)?;
            positive("fixed step", step.abs())?;
            ark!(self, ARKodeSetFixedStep(step))?;
        }
        Ok(())
    }

    fn init_crossings(&mut self) -> Result<(), SolverError> {
        let count = self.core.directions.len();
        // Without the first call ARKODE would keep what it knows of functions of the same number: which of them were
        // zero, and so are not watched.
        ark!(self, ARKodeRootInit(0, None))?;
        if count > 0 {
            ark!(self, ARKodeRootInit(count as c_int, callbacks::roots::<S>(count)))?;
            ark!(self, ARKodeSetRootDirection(self.core.directions.as_mut_ptr()))?;
            ark!(self, ARKodeSetNoInactiveRootWarn())?;
        }
        Ok(())
    }

    pub(super) fn restart(&mut self, t0: f64, y0: &[f64]) -> Result<(), SolverError> {
        self.core.take_initial_state(t0, y0)?;
        let y = self.core.state.raw();
        match self.stepper {
            Stepper::Explicit => ark!(self, ERKStepReInit(Some(callbacks::rhs::<S>), t0, y))?,
            Stepper::Implicit => ark!(self, ARKStepReInit(None, Some(callbacks::rhs::<S>), t0, y))?,
        }
        ark!(self, ARKodeClearStopTime())?;
        self.stop_time = None;
        if !self.core.directions.is_empty() {
            self.init_crossings()?;
        }
        self.core.restarted(t0);
        Ok(())
    }

    pub(super) fn set_tolerances(&mut self, tolerances: &Tolerances) -> Result<(), SolverError> {
        self.core.take_tolerances(tolerances)?;
        ark!(self, ARKodeSVtolerances(tolerances.relative, self.core.work.raw()))
    }

    pub(super) fn set_crossings(&mut self, crossings: &[Direction]) -> Result<(), SolverError> {
        let had_none = self.core.directions.is_empty();
        self.core.take_crossings(crossings);
        if had_none && crossings.is_empty() {
            Ok(())
        } else {
            self.init_crossings()
        }
    }

    pub(super) fn set_stop_time(&mut self, time: Option<f64>) -> Result<(), SolverError> {
        match time {
            None => ark!(self, ARKodeClearStopTime())?,
            Some(time) => {
                finite("stop time", time)?;
                ark!(self, ARKodeSetStopTime(time))?;
            }
        }
        self.stop_time = time;
        Ok(())
    }

    pub(super) fn set_max_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
        step.map_or(Ok(()), |step| positive("longest step", step))?;
        ark!(self, ARKodeSetMaxStep(step.unwrap_or(0.0)))
    }

    pub(super) fn set_min_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
        step.map_or(Ok(()), |step| positive("shortest step", step))?;
        ark!(self, ARKodeSetMinStep(step.unwrap_or(0.0)))
    }

    pub(super) fn set_initial_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
        step.map_or(Ok(()), |step| finite("initial step", step))?;
        self.initial_step = step.unwrap_or(0.0);
        // A fixed step is kept in the same place.
        if self.fixed_step {
            Ok(())
        } else {
            ark!(self, ARKodeSetInitStep(self.initial_step))
        }
    }

    pub(super) fn set_max_steps(&mut self, steps: Option<u64>) -> Result<(), SolverError> {
        ark!(self, ARKodeSetMaxNumSteps(max_steps(steps)))
    }

    pub(super) fn advance(&mut self, t_out: f64, task: Task) -> Result<Outcome, SolverError> {
        self.core.begin(t_out)?;
        let (c_task, done) = match task {
            Task::Normal => (ffi::ARK_NORMAL, Outcome::Reached),
            Task::OneStep => (ffi::ARK_ONE_STEP, Outcome::Stepped),
        };
        let mut time = self.core.time;
        // SAFETY: no reference to anything that C or the callbacks use is alive.
        let mut code = unsafe { ffi::ARKodeEvolve(self.memory(), t_out, self.core.next.raw(), &mut time, c_task) };
        if code < 0 {
            code = self.retry_shorter(code, t_out, c_task, &mut time)?;
        }
        let outcome = match code {
            ffi::ARK_SUCCESS => done,
            ffi::ARK_TSTOP_RETURN => {
                self.stop_time = None;
                Outcome::StopTime
            }
            ffi::ARK_ROOT_RETURN => Outcome::Roots,
            _ => {
                // After a failed stage ARKODE's own time is that of the stage.
                let mesh_time = self.core.shared().mesh_time;
                return Err(self.core.fail("ARKodeEvolve", Family::Arkode, code, mesh_time));
            }
        };
        self.core.succeed(time);
        if outcome == Outcome::Roots {
            ark!(self, ARKodeGetRootInfo(self.core.raw_found.as_mut_ptr()))?;
            self.core.read_crossings();
        }
        Ok(outcome)
    }

    /// Tries shorter steps after an explicit stage met a right-hand side that is not finite, which ARKODE takes for
    /// unrecoverable. Returns the flag that it came to.
    #[cold]
    fn retry_shorter(
        &mut self,
        mut code: c_int,
        t_out: f64,
        c_task: c_int,
        time: &mut f64,
    ) -> Result<c_int, SolverError> {
        /// As patient as ARKODE is with the stages of implicit methods (`ARKodeSetMaxConvFails`).
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
            // With ARK_RHSFUNC_FAIL the state itself has no slope, except while the first step is estimated.
            let first = code == ffi::ARK_RHSFUNC_FAIL
                && self.core.status == Status::Fresh
                && shared.non_finite.is_some_and(|found| found.time != shared.mesh_time);
            if self.fixed_step || !met_non_finite || !(code == ffi::ARK_UNREC_RHSFUNC_ERR || first) {
                break attempts > 0;
            }
            if shared.mesh_time != mesh_time {
                mesh_time = shared.mesh_time;
                attempts = 0;
                step = 0.0;
                if !first {
                    ark!(self, ARKodeGetCurrentStep(&mut step))?;
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
            // ARKODE has put the state at the mesh time there, unless there is no step yet.
            let start = if first {
                self.core.state.raw()
            } else {
                self.core.next.raw()
            };
            ark!(self, ARKodeReset(mesh_time, start))?;
            ark!(self, ARKodeSetInitStep(step))?;
            if let Some(stop_time) = self.stop_time {
                ark!(self, ARKodeSetStopTime(stop_time))?;
            }
            // SAFETY: as in `advance`.
            code = unsafe { ffi::ARKodeEvolve(self.memory(), t_out, self.core.next.raw(), time, c_task) };
        };
        if retried {
            ark!(self, ARKodeSetInitStep(self.initial_step))?;
        }
        Ok(code)
    }

    pub(super) fn interpolate(&mut self, t: f64, k: u32, out: &mut [f64]) -> Result<(), SolverError> {
        let k = self.core.begin_interpolation(t, k, out)?;
        // SAFETY: as in `advance`.
        let code = unsafe { ffi::ARKodeGetDky(self.memory(), t, k, self.core.work.raw()) };
        self.core.end_interpolation("ARKodeGetDky", Family::Arkode, code, out)
    }

    pub(super) fn mesh_time(&mut self) -> Result<f64, SolverError> {
        Ok(self.core.shared().mesh_time)
    }

    pub(super) fn last_step_size(&mut self) -> Result<f64, SolverError> {
        let mut step = 0.0;
        ark!(self, ARKodeGetLastStep(&mut step))?;
        Ok(step)
    }

    pub(super) fn counters(&mut self) -> Result<Counters, SolverError> {
        // Some counters start anew only with the first step.
        if self.core.status == Status::Fresh {
            return Ok(Counters::default());
        }
        let mut counters = Counters {
            last_order: self.order,
            ..Counters::default()
        };
        let [mut steps, mut failures, mut rhs, mut roots]: [c_long; 4] = [0; 4];
        ark!(self, ARKodeGetNumSteps(&mut steps))?;
        ark!(self, ARKodeGetNumErrTestFails(&mut failures))?;
        ark!(self, ARKodeGetLastStep(&mut counters.last_step))?;
        ark!(self, ARKodeGetCurrentStep(&mut counters.current_step))?;
        match self.stepper {
            Stepper::Explicit => ark!(self, ERKStepGetNumRhsEvals(&mut rhs))?,
            Stepper::Implicit => {
                let [mut explicit, mut setups, mut iterations, mut divergences]: [c_long; 4] = [0; 4];
                let [mut jacobians, mut differences]: [c_long; 2] = [0; 2];
                ark!(self, ARKStepGetNumRhsEvals(&mut explicit, &mut rhs))?;
                ark!(self, ARKodeGetNumLinSolvSetups(&mut setups))?;
                ark!(self, ARKodeGetNonlinSolvStats(&mut iterations, &mut divergences))?;
                arkls!(self, ARKodeGetNumJacEvals(&mut jacobians))?;
                arkls!(self, ARKodeGetNumLinRhsEvals(&mut differences))?;
                rhs += differences;
                counters.linear_solver_setups = count(setups);
                counters.nonlinear_iterations = count(iterations);
                counters.nonlinear_convergence_failures = count(divergences);
                counters.jacobian_evaluations = count(jacobians);
            }
        }
        if !self.core.directions.is_empty() {
            ark!(self, ARKodeGetNumGEvals(&mut roots))?;
        }
        counters.steps = count(steps);
        counters.rhs_evaluations = count(rhs);
        counters.error_test_failures = count(failures);
        counters.root_evaluations = count(roots);
        Ok(counters)
    }
}

/// Implements the trait by the field `ark`.
macro_rules! integrator_by_ark {
    ($name:ident) => {
        impl<S: OdeSystem> Integrator for $name<S> {
            type System = S;

            fn system(&self) -> &S {
                &self.ark.core.shared().system
            }
            fn system_mut(&mut self) -> &mut S {
                &mut self.ark.core.shared_mut().system
            }
            fn time(&self) -> f64 {
                self.ark.core.time
            }
            fn state(&self) -> &[f64] {
                self.ark.core.state.values()
            }
            fn restart(&mut self, t0: f64, y0: &[f64]) -> Result<(), SolverError> {
                self.ark.restart(t0, y0)
            }
            fn set_tolerances(&mut self, tolerances: &Tolerances) -> Result<(), SolverError> {
                self.ark.set_tolerances(tolerances)
            }
            fn set_crossings(&mut self, crossings: &[Direction]) -> Result<(), SolverError> {
                self.ark.set_crossings(crossings)
            }
            fn set_stop_time(&mut self, time: Option<f64>) -> Result<(), SolverError> {
                self.ark.set_stop_time(time)
            }
            fn set_max_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
                self.ark.set_max_step(step)
            }
            fn set_min_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
                self.ark.set_min_step(step)
            }
            fn set_initial_step(&mut self, step: Option<f64>) -> Result<(), SolverError> {
                self.ark.set_initial_step(step)
            }
            fn set_max_steps(&mut self, steps: Option<u64>) -> Result<(), SolverError> {
                self.ark.set_max_steps(steps)
            }
            fn advance(&mut self, t_out: f64, task: Task) -> Result<Outcome, SolverError> {
                self.ark.advance(t_out, task)
            }
            fn crossings_found(&self) -> &[Option<Direction>] {
                &self.ark.core.found
            }
            fn interpolate(&mut self, t: f64, k: u32, out: &mut [f64]) -> Result<(), SolverError> {
                self.ark.interpolate(t, k, out)
            }
            fn mesh_time(&mut self) -> Result<f64, SolverError> {
                self.ark.mesh_time()
            }
            fn last_step_size(&mut self) -> Result<f64, SolverError> {
                self.ark.last_step_size()
            }
            fn counters(&mut self) -> Result<Counters, SolverError> {
                self.ark.counters()
            }
        }
    };
}

pub(super) use integrator_by_ark;
