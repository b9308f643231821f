//! Newton's method: the `SUNMatrix` of a system and its `SUNLinearSolver`, dense or a band in coordinates of the system's own.

use std::ffi::{c_int, c_void};
use std::ptr::{self, NonNull};

use super::OdeSystem;
use super::callbacks::{SUCCESS, guarded};
use super::context::{Context, Vector, made, values, values_mut};
use super::error::{Callback, SolverError};
use super::ffi;
use crate::numerics::band::BandMut;

/// The matrix of a system and its linear solver.
pub(super) struct Newton {
    pub(super) matrix: ffi::SUNMatrix,
    pub(super) solver: ffi::SUNLinearSolver,
    band: Option<NonNull<BandSolver>>,
}

/// The content of a linear solver that solves in the coordinates of [`OdeSystem::enter_band`].
struct BandSolver {
    /// `SUNLinSol_Band`.
    inner: ffi::SUNLinearSolver,
    /// A vector in those coordinates.
    z: Vector,
    /// The `Shared` of the system.
    data: *mut c_void,
}

impl Newton {
    /// With a dense matrix.
    pub(super) fn dense(context: &Context, template: &Vector) -> Result<Self, SolverError> {
        let n = template.length as ffi::sunindextype;
        // What has been made is dropped with it if the rest fails.
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

    /// With a band matrix in coordinates of the system's own. `data` is the `Shared` of the system, which outlives this.
    pub(super) fn band<S: OdeSystem>(
        context: &Context,
        template: &Vector,
        half_width: usize,
        data: *mut c_void,
    ) -> Result<Self, SolverError> {
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
        // SAFETY: the solver is new, with a table of functions of its own; its content lives as long as it.
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
        // SAFETY: each was made in `dense` or `band`, or not at all, and their context still lives.
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
    // SAFETY: SUNDIALS passes the data it was given, vectors of the system's length, and the band matrix of `Newton::band`, whose
    // columns lie one after the other.
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
                    // In the coordinates of the band.
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

/// `gettype` of a linear solver: it uses a matrix.
unsafe extern "C" fn solver_type(_: ffi::SUNLinearSolver) -> ffi::SUNLinearSolver_Type {
    ffi::SUNLinearSolver_Type_SUNLINEARSOLVER_DIRECT
}

/// `setup` of a linear solver: factorises the matrix.
unsafe extern "C" fn setup(solver: ffi::SUNLinearSolver, matrix: ffi::SUNMatrix) -> c_int {
    // SAFETY: SUNDIALS passes the solver that was made by `Newton::band`, and its matrix.
    unsafe { ffi::SUNLinSolSetup(content(solver).inner, matrix) }
}

/// `solve` of a linear solver.
unsafe extern "C" fn solve<S: OdeSystem>(
    solver: ffi::SUNLinearSolver,
    matrix: ffi::SUNMatrix,
    x: ffi::N_Vector,
    b: ffi::N_Vector,
    tolerance: f64,
) -> c_int {
    // Of the codes that it does not know SUNDIALS makes a success.
    let failed = |code: c_int| match code {
        SUCCESS => SUCCESS,
        _ => ffi::SUN_ERR_EXT_FAIL as c_int,
    };
    // SAFETY: as above; x and b are different vectors of the system's length, and nobody else has z.
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
