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

pub(super) type Payload = Box<dyn Any + Send>;

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
    panic: Option<Payload>,
    /// A system of this dimension is called: that of the vectors, or 0, which no system has, while a panic waits. So one
    /// comparison sees to both.
    admitted: usize,
    /// The last value of a callback that was not finite.
    pub(super) non_finite: Option<NonFinite>,
}

/// Sees that time goes on. In front of a wall that no step gets over, SUNDIALS may take steps for ever that are too
/// short to be seen in the time.
struct Watch {
    /// Calls of the right-hand side until the next look at the time.
    calls_left: u32,
    /// Where the mesh stood when it was looked at last.
    seen: Option<f64>,
    stalled: bool,
}

impl Watch {
    /// So many calls of the right-hand side are between two looks at the time.
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
            watch: Watch {
                calls_left: Watch::CALLS,
                seen: None,
                stalled: false,
            },
            panic: None,
            admitted: dimension,
            non_finite: None,
        }
    }

    /// Whether a callback panicked since the last call of [`take_panic`](Self::take_panic).
    pub(super) fn has_panicked(&self) -> bool {
        self.panic.is_some()
    }

    /// The payload of a callback's panic, to go on with it. The system is called again from here on.
    pub(super) fn take_panic(&mut self) -> Option<Payload> {
        self.admitted = self.dimension;
        self.panic.take()
    }

    /// Whether the solver was stopped because its time did not move.
    pub(super) fn take_stalled(&mut self) -> bool {
        std::mem::take(&mut self.watch.stalled)
    }

    /// Calls from elsewhere than steps (dense output), or a new start: the watch begins anew.
    pub(super) fn reset_watch(&mut self) {
        self.watch.seen = None;
    }

    /// Whether the time has moved since it was looked at last.
    fn time_moves(&mut self) -> bool {
        self.watch.calls_left = Watch::CALLS;
        let mut now = self.mesh_time;
        if !self.clock.is_null() {
            // SAFETY: the memory of the running CVODE; the function only reads its time.
            unsafe { ffi::CVodeGetCurrentTime(self.clock, &mut now) };
        }
        let before = self.watch.seen.replace(now);
        // Steps of the size of a rounding error would do as much; some of the time may be a step that is being tried.
        let least = f64::from(Watch::CALLS) * f64::EPSILON * now.abs();
        self.watch.stalled = before.is_some_and(|before| (now - before).abs() <= least);
        !self.watch.stalled
    }

    /// After each call of the right-hand side: looks at its values, and at times at the time.
    #[inline]
    fn judge_slopes(&mut self, time: f64, ydot: &[f64]) -> c_int {
        self.watch.calls_left -= 1;
        if seem_finite(ydot) && self.watch.calls_left > 0 {
            SUCCESS
        } else {
            self.examine_slopes(time, ydot)
        }
    }

    /// Out of line, as what follows: inlined, they would cost every call the saving of registers.
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

    /// After each call of another callback.
    #[inline]
    fn judge(&mut self, callback: Callback, time: f64, values: &[f64]) -> c_int {
        if seem_finite(values) {
            SUCCESS
        } else {
            self.examine(callback, time, values)
        }
    }

    /// Refuses infinite values and not-a-numbers: they would pass through comparisons in C, and can send its root search
    /// round for ever.
    #[cold]
    #[inline(never)]
    fn examine(&mut self, callback: Callback, time: f64, values: &[f64]) -> c_int {
        let Some(index) = values.iter().position(|value| !value.is_finite()) else {
            return SUCCESS;
        };
        // Only of a Jacobian there can be more values than components.
        let (component, column) = match callback {
            Callback::Jacobian => (index % self.dimension, index / self.dimension),
            Callback::RightHandSide | Callback::Crossing => (index, 0),
        };
        self.refuse(callback, time, (component, column), values[index])
    }

    /// Notes a value that is not finite.
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

    /// A dimension is not the one admitted.
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

/// A sum is finite only if all its terms are, and seldom overflows; zero times infinity is not a number. A branch for each
/// term would cost a short right-hand side a good part of its time.
#[inline]
fn seem_finite(values: &[f64]) -> bool {
    let sum: f64 = values.iter().sum();
    !(sum * 0.0).is_nan()
}

pub(super) const SUCCESS: c_int = 0;
/// SUNDIALS tries again with a shorter step.
pub(super) const RECOVERABLE: c_int = 1;
const UNRECOVERABLE: c_int = -1;

/// Runs a callback, and parks its panic. The callback gets the length of the vectors.
///
/// It is asked of the system: where the answer is a constant, the compiler leaves out bounds checks and unrolls loops.
/// But the slices' memory hangs on it, so it is compared.
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
    // SAFETY: SUNDIALS passes the data it was given, and two different vectors of the system's length.
    unsafe {
        guarded::<S>(data, |shared, n| {
            let ydot = values_mut(ydot, n);
            shared.system.rhs(t, values(y, n), ydot);
            shared.judge_slopes(t, ydot)
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
    // SAFETY: as in `rhs`; the matrix is the dense square one of `Newton::dense`, whose columns lie one after the other.
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

/// `CVRootFn` or `ARKRootFn` for that many crossings.
pub(super) fn roots<S: OdeSystem>(crossings: usize) -> ffi::CVRootFn {
    // Of a known number the compiler makes neither loops nor a call of memset, which would take longer than the functions.
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
    // SAFETY: as in `rhs`; `gout` has a place for each crossing that was set.
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
/// `gout` has a place for each value, but not always a value yet.
#[inline(always)] // for the sake of the constant
unsafe fn write_roots<S: OdeSystem>(shared: &mut Shared<S>, t: f64, y: &[f64], gout: *mut f64, count: usize) -> c_int {
    let g = unsafe {
        std::ptr::write_bytes(gout, 0, count);
        std::slice::from_raw_parts_mut(gout, count)
    };
    shared.system.roots(t, y, g);
    shared.judge(Callback::Crossing, t, g)
}

/// `ARKPostProcessFn`: notes where the step that was just completed ended.
pub(super) unsafe extern "C" fn step_completed<S: OdeSystem>(t: f64, _y: ffi::N_Vector, data: *mut c_void) -> c_int {
    // SAFETY: ARKODE passes the data it was given.
    unsafe { (*data.cast::<Shared<S>>()).mesh_time = t };
    SUCCESS
}
