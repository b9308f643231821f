//! Callbacks for C, one set for each type of system.
//!
//! C gets a raw pointer to a [`Shared`], from a `Box` that the solver owns. While a C function runs, Rust holds no
//! reference to it, so that the reference of the callback is the only one. A callback neither unwinds nor aborts: its
//! panic is stored, and resumed after C has returned.

use std::any::Any;
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use nalgebra::DMatrixViewMut;

use super::OdeSystem;
use super::context::{values, values_mut};
use super::ffi;
use super::non_finite::{Callback, NonFinite};

pub(super) type Payload = Box<dyn Any + Send>;

pub(super) struct Shared<S> {
    pub(super) system: S,
    pub(super) dimension: usize,
    pub(super) crossings: usize,
    /// End of the last completed step, which ARKODE forgets if a step fails.
    pub(super) mesh_time: f64,
    /// CVODE's memory, which knows its time; null for ARKODE, whose callback sets `mesh_time`.
    pub(super) clock: *mut c_void,
    watch: ProgressWatch,
    panic: Option<Payload>,
    /// Dimension for which the system is called: the length of the vectors, or 0 after a panic. No system has
    /// dimension 0, so that one comparison covers both.
    admitted: usize,
    pub(super) non_finite: Option<NonFinite>,
}

/// Checks that time advances: before a singularity SUNDIALS may take ever shorter steps for ever.
struct ProgressWatch {
    calls_left: u32,
    seen: Option<f64>,
    stalled: bool,
}

impl ProgressWatch {
    const CALLS: u32 = 1 << 14;
}

impl<S> Shared<S> {
    pub(super) fn new(system: S, dimension: usize, t0: f64) -> Self {
        Self {
            system,
            dimension,
            crossings: 0,
            mesh_time: t0,
            clock: std::ptr::null_mut(),
            watch: ProgressWatch {
                calls_left: ProgressWatch::CALLS,
                seen: None,
                stalled: false,
            },
            panic: None,
            admitted: dimension,
            non_finite: None,
        }
    }

    pub(super) fn has_panicked(&self) -> bool {
        self.panic.is_some()
    }

    pub(super) fn take_panic(&mut self) -> Option<Payload> {
        self.admitted = self.dimension;
        self.panic.take()
    }

    pub(super) fn take_stalled(&mut self) -> bool {
        std::mem::take(&mut self.watch.stalled)
    }

    /// To be called after a new start, and after calls outside of steps (dense output).
    pub(super) fn reset_watch(&mut self) {
        self.watch.seen = None;
    }

    fn time_moves(&mut self) -> bool {
        self.watch.calls_left = ProgressWatch::CALLS;
        let mut now = self.mesh_time;
        if !self.clock.is_null() {
            // SAFETY: the memory of the running CVODE; the function only reads its time.
            unsafe { ffi::CVodeGetCurrentTime(self.clock, &mut now) };
        }
        let before = self.watch.seen.replace(now);
        // Steps of the size of rounding would advance as far as this; part of the time may belong to a tentative step.
        let least = f64::from(ProgressWatch::CALLS) * f64::EPSILON * now.abs();
        self.watch.stalled = before.is_some_and(|before| (now - before).abs() <= least);
        !self.watch.stalled
    }

    #[inline]
    fn judge_slopes(&mut self, time: f64, ydot: &[f64]) -> c_int {
        self.watch.calls_left -= 1;
        if seem_finite(ydot) && self.watch.calls_left > 0 {
            SUCCESS
        } else {
            self.examine_slopes(time, ydot)
        }
    }

    /// Out of line, like the next functions: inlined, they would make every call save registers.
    #[cold]
    #[inline(never)]
    fn examine_slopes(&mut self, time: f64, ydot: &[f64]) -> c_int {
        let verdict = self.examine(Callback::RightHandSide, time, ydot);
        if self.watch.calls_left > 0 || self.time_moves() {
            verdict
        } else {
            UNRECOVERABLE
        }
    }

    #[inline]
    fn judge(&mut self, callback: Callback, time: f64, values: &[f64]) -> c_int {
        if seem_finite(values) {
            SUCCESS
        } else {
            self.examine(callback, time, values)
        }
    }

    /// Refuses infinite values and NaN: they pass comparisons in C, and can trap its root search in a loop.
    #[cold]
    #[inline(never)]
    fn examine(&mut self, callback: Callback, time: f64, values: &[f64]) -> c_int {
        let Some(index) = values.iter().position(|value| !value.is_finite()) else {
            return SUCCESS;
        };
        // Only a Jacobian can have more values than components.
        let (component, column) = match callback {
            Callback::Jacobian => (index % self.dimension, index / self.dimension),
            Callback::RightHandSide | Callback::Crossing => (index, 0),
        };
        self.refuse(callback, time, (component, column), values[index])
    }

    pub(super) fn refuse(
        &mut self,
        callback: Callback,
        time: f64,
        (component, column): (usize, usize),
        value: f64,
    ) -> c_int {
        self.non_finite = Some(NonFinite {
            callback,
            component,
            column,
            time,
            value,
        });
        RECOVERABLE
    }

    #[cold]
    fn park(&mut self, payload: Payload) -> c_int {
        self.panic = Some(payload);
        self.admitted = 0;
        UNRECOVERABLE
    }

    #[cold]
    #[inline(never)]
    fn turn_away(&self, dimension: usize) -> c_int {
        assert!(
            self.has_panicked(),
            "OdeSystem::dimension returned {dimension}, but {} when the integrator was made",
            self.dimension
        );
        UNRECOVERABLE
    }
}

/// A sum is finite only if all terms are, and seldom overflows; zero times infinity is NaN. A branch for each term
/// would cost a short right-hand side much of its time.
#[inline]
fn seem_finite(values: &[f64]) -> bool {
    let sum: f64 = values.iter().sum();
    !(sum * 0.0).is_nan()
}

pub(super) const SUCCESS: c_int = 0;
/// SUNDIALS tries a shorter step.
pub(super) const RECOVERABLE: c_int = 1;
const UNRECOVERABLE: c_int = -1;

/// Runs a callback with the length of the vectors, and stores its panic.
///
/// The length comes from the system: if it is a constant, the compiler drops bounds checks and unrolls loops. It is
/// compared with the length of the vectors, because the slices depend on it.
///
/// # Safety
/// `data` points to a `Shared<S>` that nobody else uses meanwhile.
pub(super) unsafe fn guarded<S: OdeSystem>(
    data: *mut c_void,
    callback: impl FnOnce(&mut Shared<S>, usize) -> c_int,
) -> c_int {
    let shared = unsafe { &mut *data.cast::<Shared<S>>() };
    catch_unwind(AssertUnwindSafe(|| {
        let length = shared.system.dimension();
        if length == shared.admitted {
            callback(shared, length)
        } else {
            shared.turn_away(length)
        }
    }))
    .unwrap_or_else(|payload| shared.park(payload))
}

/// `CVRhsFn` and `ARKRhsFn`
pub(super) unsafe extern "C" fn rhs<S: OdeSystem>(
    t: f64,
    y: ffi::N_Vector,
    ydot: ffi::N_Vector,
    data: *mut c_void,
) -> c_int {
    // SAFETY: SUNDIALS passes its data, and two different vectors of the system's length.
    unsafe {
        guarded::<S>(data, |shared, n| {
            let ydot = values_mut(ydot, n);
            shared.system.rhs(t, values(y, n), ydot);
            shared.judge_slopes(t, ydot)
        })
    }
}

/// `CVLsJacFn` and `ARKLsJacFn` of a dense matrix, which arrives zeroed.
#[allow(clippy::too_many_arguments)] // the C signature
pub(super) unsafe extern "C" fn jacobian<S: OdeSystem>(
    t: f64,
    y: ffi::N_Vector,
    ydot: ffi::N_Vector,
    matrix: ffi::SUNMatrix,
    data: *mut c_void,
    _: ffi::N_Vector,
    _: ffi::N_Vector,
    _: ffi::N_Vector,
) -> c_int {
    // SAFETY: as in `rhs`; the matrix is that of `Newton::dense`, whose columns are contiguous.
    unsafe {
        guarded::<S>(data, |shared, n| {
            let content = (*matrix).content.cast::<ffi::_SUNMatrixContent_Dense>();
            let entries = std::slice::from_raw_parts_mut((*content).data, n * n);
            let view = DMatrixViewMut::from_slice(entries, n, n);
            shared.system.jacobian(t, values(y, n), values(ydot, n), view);
            shared.judge(Callback::Jacobian, t, entries)
        })
    }
}

/// `CVRootFn` or `ARKRootFn` for this number of crossings.
pub(super) fn roots<S: OdeSystem>(crossings: usize) -> ffi::CVRootFn {
    // With a known number the compiler avoids loops and a call of memset, which would take longer than the crossing
    // functions.
    Some(match crossings {
        1 => known_roots::<S, 1>,
        2 => known_roots::<S, 2>,
        _ => any_roots::<S>,
    })
}

unsafe extern "C" fn known_roots<S: OdeSystem, const CROSSINGS: usize>(
    t: f64,
    y: ffi::N_Vector,
    gout: *mut f64,
    data: *mut c_void,
) -> c_int {
    // SAFETY: as in `rhs`; `gout` has a place for each crossing.
    unsafe { guarded::<S>(data, |shared, n| write_roots(shared, t, values(y, n), gout, CROSSINGS)) }
}

unsafe extern "C" fn any_roots<S: OdeSystem>(t: f64, y: ffi::N_Vector, gout: *mut f64, data: *mut c_void) -> c_int {
    // SAFETY: as above.
    unsafe {
        guarded::<S>(data, |shared, n| {
            write_roots(shared, t, values(y, n), gout, shared.crossings)
        })
    }
}

/// # Safety
/// `gout` has a place for each value, possibly uninitialised.
#[inline(always)] // for constant propagation
unsafe fn write_roots<S: OdeSystem>(shared: &mut Shared<S>, t: f64, y: &[f64], gout: *mut f64, count: usize) -> c_int {
    let g = unsafe {
        std::ptr::write_bytes(gout, 0, count);
        std::slice::from_raw_parts_mut(gout, count)
    };
    shared.system.roots(t, y, g);
    shared.judge(Callback::Crossing, t, g)
}

/// `ARKPostProcessFn`: stores the end of the completed step.
pub(super) unsafe extern "C" fn step_completed<S: OdeSystem>(t: f64, _y: ffi::N_Vector, data: *mut c_void) -> c_int {
    // SAFETY: ARKODE passes its data.
    unsafe { (*data.cast::<Shared<S>>()).mesh_time = t };
    SUCCESS
}
