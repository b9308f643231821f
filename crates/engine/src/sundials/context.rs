//! Owners of SUNDIALS' objects: context, vectors, nonlinear solvers.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::{self, NonNull};

use super::ffi;
use super::flags::{Flag, FlagFamily};
use crate::error::{Error, ErrorKind};

type Messages = Vec<String>;

/// A `SUNContext` for each integrator, so that integrators in different threads share nothing. Error messages are kept
/// for the [`Error`] instead of being printed. It must outlive every object made with it: an owner keeps it as
/// its last field.
pub(super) struct Context {
    raw: ffi::SUNContext,
    /// From a `Box`; the error handler writes there while C runs.
    messages: NonNull<Messages>,
}

impl Context {
    pub(super) fn new() -> Result<Self, Error> {
        let mut raw = ptr::null_mut();
        // SAFETY: `raw` is a place for the result; without MPI the communicator is a constant.
        let code = unsafe { ffi::SUNContext_Create(ffi::SUN_COMM_NULL, &mut raw) };
        if code != 0 || raw.is_null() {
            return Err(no_memory("SUNContext_Create"));
        }
        let context = Self {
            raw,
            messages: NonNull::from(Box::leak(Box::default())),
        };
        // SAFETY: the handler's data lives until `Context::drop`, where the SUNContext goes first.
        unsafe {
            context.check("SUNContext_ClearErrHandlers", ffi::SUNContext_ClearErrHandlers(raw))?;
            let data = context.messages.as_ptr().cast();
            context.check(
                "SUNContext_PushErrHandler",
                ffi::SUNContext_PushErrHandler(raw, Some(keep_message), data),
            )?;
        }
        Ok(context)
    }

    pub(super) fn raw(&self) -> ffi::SUNContext {
        self.raw
    }

    fn check(&self, function: &'static str, code: c_int) -> Result<(), Error> {
        self.verdict(function, FlagFamily::Core, code, f64::NAN)
    }

    pub(super) fn verdict(
        &self,
        function: &'static str,
        family: FlagFamily,
        code: c_int,
        time: f64,
    ) -> Result<(), Error> {
        if code == 0 {
            return Ok(());
        }
        let flag = Flag { family, number: code };
        let mut text = format!("{function} returned {flag} at t = {time}");
        let message = self.take_messages();
        if !message.is_empty() {
            text += &format!(": {message}");
        }
        Err(Error::new(ErrorKind::Flag(flag), time, text))
    }

    #[cold]
    pub(super) fn take_messages(&self) -> String {
        // SAFETY: only the error handler uses it too, and only while a C function runs.
        let messages = unsafe { &mut *self.messages.as_ptr() };
        let mut text = messages.join("; ");
        messages.clear();
        text.truncate(text.trim_end().len());
        text
    }

    #[inline]
    pub(super) fn clear_messages(&self) {
        // SAFETY: as in `take_messages`.
        let messages = unsafe { &*self.messages.as_ptr() };
        if !messages.is_empty() {
            self.take_messages();
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: both were made in `new`; only the context knows the messages.
        unsafe {
            ffi::SUNContext_Free(&mut self.raw);
            drop(Box::from_raw(self.messages.as_ptr()));
        }
    }
}

unsafe extern "C" fn keep_message(
    _line: c_int,
    _function: *const c_char,
    _file: *const c_char,
    message: *const c_char,
    _code: ffi::SUNErrCode,
    data: *mut c_void,
    _context: ffi::SUNContext,
) {
    // A few messages show the reason, and a solver that repeats them must not fill the memory.
    const MOST: usize = 8;
    let keep = || {
        if message.is_null() || data.is_null() {
            return;
        }
        // SAFETY: SUNDIALS passes a terminated text, and `data` from `Context::new`.
        let (text, messages) = unsafe { (CStr::from_ptr(message), &mut *data.cast::<Messages>()) };
        let text = text.to_string_lossy().trim().to_owned();
        if messages.len() < MOST && !text.is_empty() && messages.last() != Some(&text) {
            messages.push(text);
        }
    };
    // Unwinding out of a C callback would abort.
    let _ = catch_unwind(AssertUnwindSafe(keep));
}

/// `N_VClone_Serial` with zeros. If the highest order is raised between two steps, CVODE reads a vector of its history
/// before it has written it. Uninitialised memory would decide about the next order.
unsafe extern "C" fn clone_of_zeros(vector: ffi::N_Vector) -> ffi::N_Vector {
    unsafe {
        let clone = ffi::N_VClone_Serial(vector);
        if !clone.is_null() {
            ffi::N_VConst(0.0, clone);
        }
        clone
    }
}

pub(super) struct Vector {
    raw: ffi::N_Vector,
    pub(super) length: usize,
}

impl Vector {
    /// Needs at least one value: `Core::new` refuses a dimension of 0.
    pub(super) fn new(context: &Context, values: &[f64]) -> Result<Self, Error> {
        // SUNDIALS gives an empty vector no memory, and a slice needs an address.
        assert!(!values.is_empty(), "a vector has at least one value");
        // SAFETY: the context is alive. A length fits in an i64.
        let raw = unsafe { ffi::N_VNew_Serial(values.len() as ffi::sunindextype, context.raw()) };
        let raw = made(raw, "N_VNew_Serial")?;
        // SAFETY: a new vector has its own table of operations, which its clones copy.
        unsafe { (*(*raw).ops).nvclone = Some(clone_of_zeros) }
        let mut vector = Self {
            raw,
            length: values.len(),
        };
        vector.values_mut().copy_from_slice(values);
        Ok(vector)
    }

    pub(super) fn raw(&self) -> ffi::N_Vector {
        self.raw
    }

    pub(super) fn values(&self) -> &[f64] {
        // SAFETY: a serial vector of this length, initialised in `new`; C writes only during calls that take `&mut
        // self` of the owning integrator.
        unsafe { values(self.raw, self.length) }
    }

    pub(super) fn values_mut(&mut self) -> &mut [f64] {
        // SAFETY: as above, and `&mut self` makes the slice the only one.
        unsafe { values_mut(self.raw, self.length) }
    }
}

impl Drop for Vector {
    fn drop(&mut self) {
        // SAFETY: made in `new`, and its context still lives.
        unsafe { ffi::N_VDestroy(self.raw) }
    }
}

/// # Safety
/// `vector` is a serial vector of `length` (not 0) initialised values that nobody writes during `'a`.
pub(super) unsafe fn values<'a>(vector: ffi::N_Vector, length: usize) -> &'a [f64] {
    unsafe { std::slice::from_raw_parts(data(vector), length) }
}

/// # Safety
/// `vector` is a serial vector of `length` (not 0) initialised values that nobody else touches during `'a`.
pub(super) unsafe fn values_mut<'a>(vector: ffi::N_Vector, length: usize) -> &'a mut [f64] {
    unsafe { std::slice::from_raw_parts_mut(data(vector), length) }
}

/// The macro `NV_DATA_S`.
#[inline]
unsafe fn data(vector: ffi::N_Vector) -> *mut f64 {
    unsafe { (*(*vector).content.cast::<ffi::_N_VectorContent_Serial>()).data }
}

pub(super) fn no_memory(function: &'static str) -> Error {
    let message = format!("{function} made nothing: out of memory");
    Error::new(ErrorKind::Allocation, f64::NAN, message)
}

pub(super) fn made<T>(object: *mut T, function: &'static str) -> Result<*mut T, Error> {
    match object.is_null() {
        true => Err(no_memory(function)),
        false => Ok(object),
    }
}

pub(super) struct FixedPointSolver(pub(super) ffi::SUNNonlinearSolver);

impl FixedPointSolver {
    pub(super) fn new(context: &Context, template: &Vector) -> Result<Self, Error> {
        // SAFETY: the context is alive.
        let raw = unsafe { ffi::SUNNonlinSol_FixedPoint(template.raw(), 0, context.raw()) };
        made(raw, "SUNNonlinSol_FixedPoint").map(Self)
    }
}

impl Drop for FixedPointSolver {
    fn drop(&mut self) {
        // SAFETY: made in `new`, and its context still lives.
        unsafe {
            ffi::SUNNonlinSolFree(self.0);
        }
    }
}
