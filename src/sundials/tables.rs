//! The Butcher tables that come with ARKODE.

use super::ffi;
use nalgebra::Complex;

/// What `read` finds in a table.
///
/// # Safety
/// `table` is null or a new table.
unsafe fn taken<T>(table: ffi::ARKodeButcherTable, read: impl FnOnce(&ffi::ARKodeButcherTableMem) -> T) -> T {
    assert!(!table.is_null(), "ARKODE has each table that its header names");
    // SAFETY: not null, and freed only after it was read.
    unsafe {
        let found = read(&*table);
        ffi::ARKodeButcherTable_Free(table);
        found
    }
}

/// An enum of tables. The digits of a name are stages `s`, order of the embedding and order of the method.
macro_rules! tables {
    ($(#[$doc:meta])* $name:ident: $id:ident, $load:ident { $($variant:ident = $c_name:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum $name {
            $(#[doc = concat!("`", stringify!($c_name), "`")] $variant),*
        }

        impl $name {
            /// All of them, in the order of the C header.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// Its name in C, such as `ARKODE_ESDIRK436L2SA_6_3_4`.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($c_name)),*
                }
            }

            /// Order of the method.
            pub fn order(self) -> u32 {
                self.read(|table| table.q.unsigned_abs())
            }

            /// Order of the embedded method, by which the error is estimated.
            pub fn embedded_order(self) -> u32 {
                self.read(|table| table.p.unsigned_abs())
            }

            /// Number of stages.
            pub fn stages(self) -> u32 {
                self.read(|table| table.stages.unsigned_abs())
            }

            pub(super) fn id(self) -> ffi::$id {
                match self {
                    $(Self::$variant => ffi::$c_name),*
                }
            }

            fn read<T>(self, read: impl FnOnce(&ffi::ARKodeButcherTableMem) -> T) -> T {
                // SAFETY: the function makes a table, which is taken over.
                unsafe { taken(ffi::$load(self.id()), read) }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

tables! {
    /// The explicit Runge-Kutta methods with an error estimate. (`ARKODE_ERKTableID`)
    ErkTable: ARKODE_ERKTableID, ARKodeButcherTable_LoadERK {
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
}

tables! {
    /// The singly diagonally implicit Runge-Kutta methods with an explicit first stage and an error estimate.
    /// (`ARKODE_DIRKTableID`)
    EsdirkTable: ARKODE_DIRKTableID, ARKodeButcherTable_LoadDIRK {
        Trbdf2_3s32 = ARKODE_TRBDF2_3_3_2,
        Kvaerno4s23 = ARKODE_KVAERNO_4_2_3,
        Ark324L2sa4s23 = ARKODE_ARK324L2SA_DIRK_4_2_3,
        Kvaerno5s34 = ARKODE_KVAERNO_5_3_4,
        Ark436L2sa6s34 = ARKODE_ARK436L2SA_DIRK_6_3_4,
        Kvaerno7s45 = ARKODE_KVAERNO_7_4_5,
        Ark548L2sa8s45 = ARKODE_ARK548L2SA_DIRK_8_4_5,
        Ark437L2sa7s34 = ARKODE_ARK437L2SA_DIRK_7_3_4,
        Ark548L2sab8s45 = ARKODE_ARK548L2SAb_DIRK_8_4_5,
        Esdirk324L2sa4s23 = ARKODE_ESDIRK324L2SA_4_2_3,
        Esdirk325L2sa5s23 = ARKODE_ESDIRK325L2SA_5_2_3,
        Esdirk32I5L2sa5s23 = ARKODE_ESDIRK32I5L2SA_5_2_3,
        Esdirk436L2sa6s34 = ARKODE_ESDIRK436L2SA_6_3_4,
        Esdirk43I6L2sa6s34 = ARKODE_ESDIRK43I6L2SA_6_3_4,
        Qesdirk436L2sa6s34 = ARKODE_QESDIRK436L2SA_6_3_4,
        Esdirk437L2sa7s34 = ARKODE_ESDIRK437L2SA_7_3_4,
        Esdirk547L2sa7s45 = ARKODE_ESDIRK547L2SA_7_4_5,
        Esdirk547L2sa2_7s45 = ARKODE_ESDIRK547L2SA2_7_4_5,
        Ark2Dirk3s12 = ARKODE_ARK2_DIRK_3_1_2,
    }
}

/// The coefficients of an explicit method, as ARKODE has them. (`ARKodeButcherTableMem`)
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    /// Stage i is f(t + c_i h, y + h sum of a_ij k_j); row i has the i coefficients below the diagonal.
    pub a: Vec<Vec<f64>>,
    /// Weights of the stages in the solution.
    pub b: Vec<f64>,
    /// Times of the stages, in steps.
    pub c: Vec<f64>,
    /// Weights of the stages in the embedded solution.
    pub d: Vec<f64>,
}

impl Coefficients {
    /// R(z) by which a step multiplies y' = lambda y, z = h lambda.
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
            // SAFETY: the arrays of a table have `stages` values each, A `stages` rows of them, and every explicit table of
            // `Self::ALL` has an embedding.
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
