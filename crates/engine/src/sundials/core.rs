//! A solver without its C memory: system, vectors, and the work around a C call.

use std::ffi::{c_int, c_void};
use std::panic::resume_unwind;
use std::ptr::NonNull;

use super::callbacks::Shared;
use super::context::{Context, Vector};
use super::ffi;
use super::flags::FlagFamily;
use super::{Direction, OdeSystem, Tolerances};
use crate::error::{Error, ErrorKind};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SolverStatus {
    Fresh,
    Stepped,
    /// After a failed step the solver's memory is unreliable.
    Failed,
}

/// Fields are dropped in this order: vectors before their context.
pub(super) struct Core<S> {
    pub(super) state: Vector,
    /// Next state, written by C. It replaces `state` only after success.
    pub(super) next: Vector,
    pub(super) work: Vector,
    pub(super) time: f64,
    pub(super) status: SolverStatus,
    pub(super) directions: Vec<c_int>,
    pub(super) raw_found: Vec<c_int>,
    pub(super) found: Vec<Option<Direction>>,
    /// From a `Box`; C has the same pointer as its user data.
    shared: NonNull<Shared<S>>,
    pub(super) context: Context,
}

impl<S: OdeSystem> Core<S> {
    pub(super) fn new(system: S, t0: f64, y0: &[f64]) -> Result<Self, Error> {
        let dimension = system.dimension();
        finite("initial time", t0)?;
        initial_state(dimension, y0)?;
        let context = Context::new()?;
        let state = Vector::new(&context, y0)?;
        let next = Vector::new(&context, y0)?;
        let work = Vector::new(&context, y0)?;
        let shared = Shared::new(system, dimension, t0);
        Ok(Self {
            state,
            work,
            next,
            time: t0,
            status: SolverStatus::Fresh,
            directions: Vec::new(),
            raw_found: Vec::new(),
            found: Vec::new(),
            shared: NonNull::from(Box::leak(Box::new(shared))),
            context,
        })
    }

    pub(super) fn user_data(&self) -> *mut c_void {
        self.shared.as_ptr().cast()
    }

    pub(super) fn shared(&self) -> &Shared<S> {
        // SAFETY: from a Box that lives as long as `self`; callbacks use it only during C calls, which take `&mut
        // self`.
        unsafe { self.shared.as_ref() }
    }

    pub(super) fn shared_mut(&mut self) -> &mut Shared<S> {
        // SAFETY: as above.
        unsafe { self.shared.as_mut() }
    }

    pub(super) fn check(&self, function: &'static str, family: FlagFamily, code: c_int) -> Result<(), Error> {
        self.context.verdict(function, family, code, self.shared().mesh_time)
    }

    #[inline]
    pub(super) fn begin(&mut self, t_out: f64) -> Result<(), Error> {
        if !t_out.is_finite() || self.status == SolverStatus::Failed {
            return self.refuse_to_begin(t_out);
        }
        self.shared_mut().non_finite = None;
        self.context.clear_messages();
        Ok(())
    }

    #[cold]
    fn refuse_to_begin(&self, t_out: f64) -> Result<(), Error> {
        finite("output time", t_out)?;
        let time = self.time;
        let message = format!("the solver failed at t = {time} and was not restarted");
        Err(Error::new(ErrorKind::NotRestarted, time, message))
    }

    #[cold]
    pub(super) fn fail(&mut self, function: &'static str, family: FlagFamily, code: c_int, mesh_time: f64) -> Error {
        let shared = self.shared_mut();
        shared.mesh_time = mesh_time;
        let cause = shared.non_finite.take();
        let panic = shared.take_panic();
        let stalled = shared.take_stalled();
        let error = match self.context.verdict(function, family, code, mesh_time) {
            Err(error) => error,
            Ok(()) => unreachable!("a failure has a flag"),
        };
        if panic.is_some() || !leaves_the_solver_intact(code) {
            self.status = SolverStatus::Failed;
        }
        if let Some(payload) = panic {
            resume_unwind(payload);
        }
        if stalled {
            let message = format!("the steps at t = {mesh_time} are too short to be seen in the time");
            return Error::new(ErrorKind::Stalled, mesh_time, message).caused_by(cause);
        }
        // A run that failed for another reason may have recovered from such a value.
        error.caused_by(cause.filter(|_| !leaves_the_solver_intact(code)))
    }

    #[inline]
    pub(super) fn succeed(&mut self, time: f64) {
        std::mem::swap(&mut self.state, &mut self.next);
        self.time = time;
        self.status = SolverStatus::Stepped;
    }

    pub(super) fn restarted(&mut self, t0: f64) {
        self.time = t0;
        self.status = SolverStatus::Fresh;
        self.found.fill(None);
        let shared = self.shared_mut();
        shared.mesh_time = t0;
        shared.non_finite = None;
        shared.reset_watch();
    }

    pub(super) fn dimension(&self) -> usize {
        self.shared().dimension
    }

    pub(super) fn take_initial_state(&mut self, t0: f64, y0: &[f64]) -> Result<(), Error> {
        finite("initial time", t0)?;
        initial_state(self.dimension(), y0)?;
        self.state.values_mut().copy_from_slice(y0);
        self.context.clear_messages();
        Ok(())
    }

    pub(super) fn take_tolerances(&mut self, tolerances: &Tolerances) -> Result<(), Error> {
        length("absolute tolerances", self.dimension(), tolerances.absolute.len())?;
        not_negative("relative tolerance", tolerances.relative)?;
        for &absolute in &tolerances.absolute {
            not_negative("absolute tolerance", absolute)?;
        }
        self.work.values_mut().copy_from_slice(&tolerances.absolute);
        Ok(())
    }

    pub(super) fn take_crossings(&mut self, crossings: &[Direction]) {
        self.shared_mut().crossings = crossings.len();
        self.directions.clear();
        self.directions
            .extend(crossings.iter().map(|direction| match direction {
                Direction::Rising => 1,
                Direction::Falling => -1,
                Direction::Either => 0,
            }));
        self.raw_found.clear();
        self.raw_found.resize(crossings.len(), 0);
        self.found.clear();
        self.found.resize(crossings.len(), None);
    }

    pub(super) fn read_crossings(&mut self) {
        let Self { raw_found, found, .. } = self;
        for (found, raw) in found.iter_mut().zip(raw_found) {
            *found = match *raw {
                0 => None,
                raw if raw > 0 => Some(Direction::Rising),
                _ => Some(Direction::Falling),
            };
        }
    }

    pub(super) fn begin_interpolation(&self, t: f64, k: u32, out: &[f64]) -> Result<c_int, Error> {
        finite("time", t)?;
        length("interpolated values", self.dimension(), out.len())?;
        if self.status != SolverStatus::Stepped {
            let time = self.time;
            let message = format!("no step has been taken since t = {time}, so there is nothing to interpolate");
            return Err(Error::new(ErrorKind::NoStep, time, message));
        }
        c_int::try_from(k).map_err(|_| refused("derivative", f64::from(k)))
    }

    /// The dense output may have called the right-hand side.
    pub(super) fn end_interpolation(
        &mut self,
        function: &'static str,
        family: FlagFamily,
        code: c_int,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let shared = self.shared_mut();
        shared.reset_watch();
        if let Some(payload) = shared.take_panic() {
            self.context.clear_messages();
            resume_unwind(payload);
        }
        self.check(function, family, code)?;
        out.copy_from_slice(self.work.values());
        Ok(())
    }
}

impl<S> Drop for Core<S> {
    fn drop(&mut self) {
        // SAFETY: from a Box in `new`; the C memory that uses it, an earlier field of the owner, is already freed.
        drop(unsafe { Box::from_raw(self.shared.as_ptr()) });
    }
}

// CVODE and ARKODE use the same numbers for tasks and for the distinguished results.
const _: () = assert!(
    ffi::CV_NORMAL == ffi::ARK_NORMAL
        && ffi::CV_ONE_STEP == ffi::ARK_ONE_STEP
        && ffi::CV_SUCCESS == ffi::ARK_SUCCESS
        && ffi::CV_TSTOP_RETURN == ffi::ARK_TSTOP_RETURN
        && ffi::CV_ROOT_RETURN == ffi::ARK_ROOT_RETURN
        && ffi::CV_TOO_MUCH_WORK == ffi::ARK_TOO_MUCH_WORK
        && ffi::CV_TOO_MUCH_ACC == ffi::ARK_TOO_MUCH_ACC
        && ffi::CV_ILL_INPUT == ffi::ARK_ILL_INPUT
        && ffi::CV_TOO_CLOSE == ffi::ARK_TOO_CLOSE
);

/// These errors are found before or between steps, so that the solver can continue.
fn leaves_the_solver_intact(code: c_int) -> bool {
    [
        ffi::CV_TOO_MUCH_WORK,
        ffi::CV_TOO_MUCH_ACC,
        ffi::CV_ILL_INPUT,
        ffi::CV_TOO_CLOSE,
    ]
    .contains(&code)
}

fn refused(what: &str, value: f64) -> Error {
    Error::new(ErrorKind::Argument, f64::NAN, format!("{what} cannot be {value}"))
}

fn allowed(what: &str, value: f64, allowed: bool) -> Result<(), Error> {
    match allowed && value.is_finite() {
        true => Ok(()),
        false => Err(refused(what, value)),
    }
}

pub(super) fn finite(what: &str, value: f64) -> Result<(), Error> {
    allowed(what, value, true)
}

pub(super) fn not_negative(what: &str, value: f64) -> Result<(), Error> {
    allowed(what, value, value >= 0.0)
}

pub(super) fn positive(what: &str, value: f64) -> Result<(), Error> {
    allowed(what, value, value > 0.0)
}

pub(super) fn length(what: &str, expected: usize, found: usize) -> Result<(), Error> {
    if expected == found {
        return Ok(());
    }
    let message = format!("{what}: expected {expected} values, got {found}");
    Err(Error::new(ErrorKind::Length { expected, found }, f64::NAN, message))
}

fn initial_state(dimension: usize, y0: &[f64]) -> Result<(), Error> {
    if dimension == 0 {
        return Err(refused("dimension", 0.0));
    }
    length("initial state", dimension, y0.len())?;
    y0.iter().try_for_each(|&value| finite("initial state", value))
}
