//! Explicit Butcher tables of ARKODE.

use super::ffi;
use nalgebra::Complex;

/// Reads a table and frees it.
///
/// # Safety
/// `table` is null or a new table.
unsafe fn taken<T>(table: ffi::ARKodeButcherTable, read: impl FnOnce(&ffi::ARKodeButcherTableMem) -> T) -> T {
    assert!(!table.is_null(), "ARKODE has each table that its header names");
    // SAFETY: not null, and freed after the read.
    unsafe {
        let found = read(&*table);
        ffi::ARKodeButcherTable_Free(table);
        found
    }
}

/// Declares [`ErkTable`]. The digits of a name: stages `s`, embedded order, order.
macro_rules! tables {
    ($($variant:ident = $c_name:ident),* $(,)?) => {
        /// Explicit Runge-Kutta methods with an error estimate. (`ARKODE_ERKTableID`)
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum ErkTable {
            $(#[doc = concat!("`", stringify!($c_name), "`")] $variant),*
        }

        impl ErkTable {
            /// All tables, in the order of the C header.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// Name in C, such as `ARKODE_DORMAND_PRINCE_7_4_5`.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($c_name)),*
                }
            }

            /// Order of the method.
            pub fn order(self) -> u32 {
                self.read(|table| table.q.unsigned_abs())
            }

            /// Order of the embedded method, which estimates the error.
            pub fn embedded_order(self) -> u32 {
                self.read(|table| table.p.unsigned_abs())
            }

            /// Number of stages.
            pub fn stages(self) -> u32 {
                self.read(|table| table.stages.unsigned_abs())
            }

            pub(super) fn id(self) -> ffi::ARKODE_ERKTableID {
                match self {
                    $(Self::$variant => ffi::$c_name),*
                }
            }

            fn read<T>(self, read: impl FnOnce(&ffi::ARKodeButcherTableMem) -> T) -> T {
                // SAFETY: the function makes a table, whose ownership is taken.
                unsafe { taken(ffi::ARKodeButcherTable_LoadERK(self.id()), read) }
            }
        }

        impl std::fmt::Display for ErkTable {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

tables! {
    HeunEuler2s12 = ARKODE_HEUN_EULER_2_1_2,
    BogackiShampine4s23 = ARKODE_BOGACKI_SHAMPINE_4_2_3,
    Ark324L2sa4s23 = ARKODE_ARK324L2SA_ERK_4_2_3,
    Zonneveld5s34 = ARKODE_ZONNEVELD_5_3_4,
    Ark436L2sa6s34 = ARKODE_ARK436L2SA_ERK_6_3_4,
    SayfyAburub6s34 = ARKODE_SAYFY_ABURUB_6_3_4,
    CashKarp6s45 = ARKODE_CASH_KARP_6_4_5,
    Fehlberg6s45 = ARKODE_FEHLBERG_6_4_5,
    DormandPrince7s45 = ARKODE_DORMAND_PRINCE_7_4_5,
    Ark548L2sa8s45 = ARKODE_ARK548L2SA_ERK_8_4_5,
    Verner8s56 = ARKODE_VERNER_8_5_6,
    Fehlberg13s78 = ARKODE_FEHLBERG_13_7_8,
    Ark437L2sa7s34 = ARKODE_ARK437L2SA_ERK_7_3_4,
    Ark548L2sab8s45 = ARKODE_ARK548L2SAb_ERK_8_4_5,
    Ark2Erk3s12 = ARKODE_ARK2_ERK_3_1_2,
    SofroniouSpaletta5s34 = ARKODE_SOFRONIOU_SPALETTA_5_3_4,
    ShuOsher3s23 = ARKODE_SHU_OSHER_3_2_3,
    Verner9s56 = ARKODE_VERNER_9_5_6,
    Verner10s67 = ARKODE_VERNER_10_6_7,
    Verner13s78 = ARKODE_VERNER_13_7_8,
    Verner16s89 = ARKODE_VERNER_16_8_9,
    RalstonEuler2s12 = ARKODE_RALSTON_EULER_2_1_2,
    ExplicitMidpointEuler2s12 = ARKODE_EXPLICIT_MIDPOINT_EULER_2_1_2,
}

/// Coefficients of an explicit method in ARKODE. (`ARKodeButcherTableMem`)
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    /// Stage i is f(t + c_i h, y + h sum of a_ij k_j). Row i has the i coefficients below the diagonal.
    pub a: Vec<Vec<f64>>,
    /// Weights of the stages in the solution.
    pub b: Vec<f64>,
    /// Times of the stages, in units of the step.
    pub c: Vec<f64>,
    /// Weights of the stages in the embedded solution.
    pub d: Vec<f64>,
}

impl Coefficients {
    /// R(z), the factor of a step for y' = lambda y, with z = h lambda.
    pub(crate) fn stability_function(&self, z: Complex<f64>) -> Complex<f64> {
        let mut slopes: Vec<Complex<f64>> = Vec::with_capacity(self.b.len());
        for row in &self.a {
            let sum: Complex<f64> = row.iter().zip(&slopes).map(|(a, k)| k * *a).sum();
            slopes.push(z * sum + 1.0);
        }
        let sum: Complex<f64> = self.b.iter().zip(&slopes).map(|(b, k)| k * *b).sum();
        z * sum + 1.0
    }
}

impl ErkTable {
    /// The coefficients. (`ARKodeButcherTable_LoadERK`)
    pub fn coefficients(self) -> Coefficients {
        self.read(|table| {
            let stages = table.stages.unsigned_abs() as usize;
            // SAFETY: a table's arrays have `stages` values, A has `stages` rows, and every table of `Self::ALL` has an
            // embedding.
            let row = |values: *const f64, count: usize| unsafe { std::slice::from_raw_parts(values, count) }.to_vec();
            Coefficients {
                a: (0..stages).map(|i| row(unsafe { *table.A.add(i) }, i)).collect(),
                b: row(table.b, stages),
                c: row(table.c, stages),
                d: row(table.d, stages),
            }
        })
    }
}
