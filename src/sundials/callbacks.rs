//! The functions that C calls, one set for each system type.
//!
//! C gets a raw pointer to a [`Shared`], from a `Box` that the integrator owns. Rust holds no
//! reference to it while a C function runs, so that the callback's is the only one.
//! A callback neither unwinds nor aborts: a panic is parked and resumed when C has returned.

use std::any::Any;
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use nalgebra::DMatrixViewMut;

use super::OdeSystem;
use super::context::{values, values_mut};
use super::error::{Callback, NonFinite};
use super::ffi;

/// What callbacks and integrator have in common.
pub(super) struct Shared<S> {
    pub(super) system: S,
    pub(super) dimension: usize,
    /// How many crossing functions are set.
    pub(super) crossings: usize,
    /// End of the last completed step: ARKODE itself forgets it when a step fails.
    pub(super) mesh_time: f64,
    /// CVODE's memory, to ask it for its time; null for ARKODE, which tells `mesh_time` by itself.
    pub(super) clock: *mut c_void,
    watch: Watch,
    /// The payload of a panic that waits to be resumed.
    pub(super) panic: Option<Box<dyn Any + Send>>,
    /// The last value of a callback that was not finite.
    pub(super) non_finite: Option<NonFinite>,
}

/// Sees that time goes on. In front of a wall that no step gets over, SUNDIALS may take steps for ever that are too
/// short to be seen in the time.
#[derive(Default)]
struct Watch {
    calls: u32,
    /// Where the mesh stood when it was looked at last.
    seen: Option<f64>,
    stalled: bool,
}

impl<S> Shared<S> {
    pub(super) fn new(system: S, dimension: usize, t0: f64) -> Self {
        Self {
            system,
            dimension,
            crossings: 0,
            mesh_time: t0,
            clock: std::ptr::null_mut(),
            watch: Watch::default(),
            panic: None,
            non_finite: None,
        }
    }

    /// Whether the solver was stopped because its time did not move.
    pub(super) fn take_stalled(&mut self) -> bool {
        std::mem::take(&mut self.watch.stalled)
    }

    /// Calls from elsewhere than steps (dense output), or a new start: the watch begins anew.
    pub(super) fn reset_watch(&mut self) {
        self.watch.seen = None;
    }

    /// So many calls of the right-hand side are between two looks at the time.
    const MANY: u32 = 1 << 14;

    /// At each call of the right-hand side: whether to go on.
    #[inline]
    fn watch(&mut self) -> bool {
        self.watch.calls = self.watch.calls.wrapping_add(1);
        !self.watch.calls.is_multiple_of(Self::MANY) || self.time_moves()
    }

    #[cold]
    fn time_moves(&mut self) -> bool {
        let mut now = self.mesh_time;
        if !self.clock.is_null() {
            // SAFETY: the memory of the running CVODE; the function only reads its time.
            unsafe { ffi::CVodeGetCurrentTime(self.clock, &mut now) };
        }
        let before = self.watch.seen.replace(now);
        // Steps of the size of a rounding error would do as much; some of the time may be a step that is being tried.
        let least = f64::from(Self::MANY) * f64::EPSILON * now.abs();
        self.watch.stalled = before.is_some_and(|before| (now - before).abs() <= least);
        !self.watch.stalled
    }

    /// Infinite values and not-a-numbers would pass through comparisons in C, and can send its root search round for
    /// ever.
    #[inline]
    fn judge(&mut self, callback: Callback, time: f64, values: &[f64]) -> c_int {
        // Zero times a value that is not finite is not a number, and so is the sum. A branch for each value would cost
        // a short right-hand side a good part of its time.
        let sum = values.iter().fold(0.0, |sum, value| sum + value * 0.0);
        if sum == 0.0 {
            SUCCESS
        } else {
            self.refuse(callback, time, values)
        }
    }

    #[cold]
    fn refuse(&mut self, callback: Callback, time: f64, values: &[f64]) -> c_int {
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            // Only of a Jacobian there can be more values than components.
            let (component, column) = match callback {
                Callback::Jacobian => (index % self.dimension, index / self.dimension),
                Callback::RightHandSide | Callback::Crossing => (index, 0),
            };
            self.non_finite = Some(NonFinite {
                callback,
                component,
                column,
                time,
                value: values[index],
            });
        }
        RECOVERABLE
    }

    #[cold]
    fn park(&mut self, payload: Box<dyn Any + Send>) -> c_int {
        self.panic = Some(payload);
        UNRECOVERABLE
    }
}

const SUCCESS: c_int = 0;
/// SUNDIALS tries again with a shorter step.
const RECOVERABLE: c_int = 1;
const UNRECOVERABLE: c_int = -1;

/// Runs a callback, and parks its panic.
///
/// # Safety
/// `data` points to a `Shared<S>` that nobody else uses meanwhile.
unsafe fn guarded<S>(data: *mut c_void, callback: impl FnOnce(&mut Shared<S>) -> c_int) -> c_int {
    let shared = unsafe { &mut *data.cast::<Shared<S>>() };
    if shared.panic.is_some() {
        return UNRECOVERABLE;
    }
    catch_unwind(AssertUnwindSafe(|| callback(shared))).unwrap_or_else(|payload| shared.park(payload))
}

/// `CVRhsFn` and `ARKRhsFn`
pub(super) unsafe extern "C" fn rhs<S: OdeSystem>(
    t: f64,
    y: ffi::N_Vector,
    ydot: ffi::N_Vector,
    data: *mut c_void,
) -> c_int {
    // SAFETY: SUNDIALS passes the data it was given, and two different vectors of the system's length.
    unsafe {
        guarded::<S>(data, |shared| {
            if !shared.watch() {
                return UNRECOVERABLE;
            }
            let ydot = values_mut(ydot, shared.dimension);
            shared.system.rhs(t, values(y, shared.dimension), ydot);
            shared.judge(Callback::RightHandSide, t, ydot)
        })
    }
}

/// `CVLsJacFn` and `ARKLsJacFn`; the matrix arrives zeroed.
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
    // SAFETY: as in `rhs`; the matrix is the dense square one of `DenseNewton`, whose columns lie one after the other.
    unsafe {
        guarded::<S>(data, |shared| {
            let n = shared.dimension;
            let content = (*matrix).content.cast::<ffi::_SUNMatrixContent_Dense>();
            let entries = std::slice::from_raw_parts_mut((*content).data, n * n);
            let view = DMatrixViewMut::from_slice(entries, n, n);
            shared.system.jacobian(t, values(y, n), values(ydot, n), view);
            shared.judge(Callback::Jacobian, t, entries)
        })
    }
}

/// `CVRootFn` and `ARKRootFn`
pub(super) unsafe extern "C" fn roots<S: OdeSystem>(
    t: f64,
    y: ffi::N_Vector,
    gout: *mut f64,
    data: *mut c_void,
) -> c_int {
    // SAFETY: as in `rhs`; `gout` has a place for each crossing that was set, but not always a value: it is given one.
    unsafe {
        guarded::<S>(data, |shared| {
            std::ptr::write_bytes(gout, 0, shared.crossings);
            let g = std::slice::from_raw_parts_mut(gout, shared.crossings);
            shared.system.roots(t, values(y, shared.dimension), g);
            shared.judge(Callback::Crossing, t, g)
        })
    }
}

/// `ARKPostProcessFn`: notes where the step that was just completed ended.
pub(super) unsafe extern "C" fn step_completed<S: OdeSystem>(t: f64, _y: ffi::N_Vector, data: *mut c_void) -> c_int {
    // SAFETY: ARKODE passes the data it was given.
    unsafe { (*data.cast::<Shared<S>>()).mesh_time = t };
    SUCCESS
}
