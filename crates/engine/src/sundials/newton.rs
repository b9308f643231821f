//! Newton's method: a system's `SUNMatrix` and `SUNLinearSolver`, dense or as a band in the system's coordinates.

use std::ffi::{c_int, c_void};
use std::ptr::{self, NonNull};

use super::OdeSystem;
use super::callbacks::{SUCCESS, guarded};
use super::context::{Context, Vector, made, values, values_mut};
use super::ffi;
use super::non_finite::Callback;
use crate::Error;
use stickslip_system::numerics::band::BandMut;

pub(super) struct Newton {
    pub(super) matrix: ffi::SUNMatrix,
    pub(super) solver: ffi::SUNLinearSolver,
    band: Option<NonNull<BandSolver>>,
}

struct BandSolver {
    inner: ffi::SUNLinearSolver,
    z: Vector,
    data: *mut c_void,
}

impl Newton {
    pub(super) fn dense(context: &Context, template: &Vector) -> Result<Self, Error> {
        let n = template.length as ffi::sunindextype;
        let mut newton = Self {
            // SAFETY: the context is alive.
            matrix: made(unsafe { ffi::SUNDenseMatrix(n, n, context.raw()) }, "SUNDenseMatrix")?,
            solver: ptr::null_mut(),
            band: None,
        };
        // SAFETY: vector and matrix fit each other.
        let solver = unsafe { ffi::SUNLinSol_Dense(template.raw(), newton.matrix, context.raw()) };
        newton.solver = made(solver, "SUNLinSol_Dense")?;
        Ok(newton)
    }

    /// A band matrix in the system's coordinates. `data` is the system's `Shared`, which outlives the solver.
    pub(super) fn band<S: OdeSystem>(
        context: &Context,
        template: &Vector,
        half_width: usize,
        data: *mut c_void,
    ) -> Result<Self, Error> {
        let n = template.length;
        let [rows, width] = [n, half_width.min(n - 1)].map(|length| length as ffi::sunindextype);
        let z = Vector::new(context, &vec![0.0; n])?;
        let mut newton = Self {
            // SAFETY: the context is alive.
            matrix: made(
                unsafe { ffi::SUNBandMatrix(rows, width, width, context.raw()) },
                "SUNBandMatrix",
            )?,
            solver: ptr::null_mut(),
            band: None,
        };
        // SAFETY: vector and matrix fit each other.
        let inner = unsafe { ffi::SUNLinSol_Band(template.raw(), newton.matrix, context.raw()) };
        let inner = made(inner, "SUNLinSol_Band")?;
        let content = NonNull::from(Box::leak(Box::new(BandSolver { inner, z, data })));
        newton.band = Some(content);
        // SAFETY: the context is alive.
        newton.solver = made(unsafe { ffi::SUNLinSolNewEmpty(context.raw()) }, "SUNLinSolNewEmpty")?;
        // SAFETY: the solver is new, with its own table of functions; its content lives as long.
        unsafe {
            (*newton.solver).content = content.as_ptr().cast();
            let functions = &mut *(*newton.solver).ops;
            functions.gettype = Some(solver_type);
            functions.setup = Some(setup);
            functions.solve = Some(solve::<S>);
        }
        Ok(newton)
    }
}

impl Drop for Newton {
    fn drop(&mut self) {
        // SAFETY: each was made in `dense` or `band`, or is null, and their context still lives.
        unsafe {
            match (self.band, self.solver.is_null()) {
                (Some(_), false) => ffi::SUNLinSolFreeEmpty(self.solver),
                (None, false) => drop(ffi::SUNLinSolFree(self.solver)),
                (_, true) => {}
            }
            if let Some(content) = self.band {
                let content = Box::from_raw(content.as_ptr());
                ffi::SUNLinSolFree(content.inner);
            }
            ffi::SUNMatDestroy(self.matrix);
        }
    }
}

/// `CVLsJacFn` and `ARKLsJacFn` of a band matrix, which arrives zeroed.
#[allow(clippy::too_many_arguments)] // the C signature
pub(super) unsafe extern "C" fn band_jacobian<S: OdeSystem>(
    t: f64,
    y: ffi::N_Vector,
    ydot: ffi::N_Vector,
    matrix: ffi::SUNMatrix,
    data: *mut c_void,
    _: ffi::N_Vector,
    _: ffi::N_Vector,
    _: ffi::N_Vector,
) -> c_int {
    // SAFETY: SUNDIALS passes its data, vectors of the system's length, and the matrix of `Newton::band`, whose columns
    // are contiguous.
    unsafe {
        guarded::<S>(data, |shared, n| {
            let content = &*(*matrix).content.cast::<ffi::_SUNMatrixContent_Band>();
            let [stride, above, width] = [content.ldim, content.s_mu, content.mu].map(|length| length as usize);
            let entries = std::slice::from_raw_parts_mut(content.data, n * stride);
            let mut band = BandMut::new(entries, stride, above, width);
            shared.system.band_jacobian(t, values(y, n), values(ydot, n), &mut band);
            match entries.iter().position(|entry| !entry.is_finite()) {
                None => SUCCESS,
                Some(index) => {
                    let column = index / stride;
                    // Row and column are in band coordinates.
                    let place = ((index % stride + column).saturating_sub(above), column);
                    shared.refuse(Callback::Jacobian, t, place, entries[index])
                }
            }
        })
    }
}

/// # Safety
/// `solver` was made by [`Newton::band`].
unsafe fn content<'a>(solver: ffi::SUNLinearSolver) -> &'a BandSolver {
    unsafe { &*(*solver).content.cast::<BandSolver>() }
}

unsafe extern "C" fn solver_type(_: ffi::SUNLinearSolver) -> ffi::SUNLinearSolver_Type {
    ffi::SUNLinearSolver_Type_SUNLINEARSOLVER_DIRECT
}

unsafe extern "C" fn setup(solver: ffi::SUNLinearSolver, matrix: ffi::SUNMatrix) -> c_int {
    // SAFETY: SUNDIALS passes the solver made by `Newton::band`, and its matrix.
    unsafe { ffi::SUNLinSolSetup(content(solver).inner, matrix) }
}

unsafe extern "C" fn solve<S: OdeSystem>(
    solver: ffi::SUNLinearSolver,
    matrix: ffi::SUNMatrix,
    x: ffi::N_Vector,
    b: ffi::N_Vector,
    tolerance: f64,
) -> c_int {
    // SUNDIALS takes unknown codes for success.
    let failed = |code: c_int| match code {
        SUCCESS => SUCCESS,
        _ => ffi::SUN_ERR_EXT_FAIL as c_int,
    };
    // SAFETY: as above; x and b are different vectors of the system's length, and z is used nowhere else.
    unsafe {
        let BandSolver { inner, z, data } = content(solver);
        let z = z.raw();
        let entered = guarded::<S>(*data, |shared, n| {
            shared.system.enter_band(values(b, n), values_mut(z, n));
            SUCCESS
        });
        if entered != SUCCESS {
            return failed(entered);
        }
        let solved = ffi::SUNLinSolSolve(*inner, matrix, z, z, tolerance);
        if solved != SUCCESS {
            return solved;
        }
        failed(guarded::<S>(*data, |shared, n| {
            shared.system.leave_band(values(z, n), values(b, n), values_mut(x, n));
            SUCCESS
        }))
    }
}
