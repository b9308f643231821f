//! Names of the C functions' return flags.

use std::ffi::CStr;
use std::fmt;

use super::ffi;

include!(concat!(env!("OUT_DIR"), "/sundials_flags.rs"));

/// Table of names for a C function's return value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlagFamily {
    /// `CV_...`, of CVODE.
    Cvode,
    /// `CVLS_...`, of CVODE's interface to linear solvers.
    CvodeLinear,
    /// `ARK_...`, of ARKODE.
    Arkode,
    /// `ARKLS_...`, of ARKODE's interface to linear solvers.
    ArkodeLinear,
    /// A `SUNErrCode`, from SUNDIALS' own objects.
    Core,
}

/// Return value of a C function, possibly without a name in the headers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flag {
    /// Table that has its name.
    pub family: FlagFamily,
    /// Number returned by the C function.
    pub number: i32,
}

impl Flag {
    /// Number returned by the C function.
    pub fn number(self) -> i32 {
        self.number
    }

    /// Name in the C header, such as `CV_TOO_MUCH_WORK`; for SUNDIALS' own objects the text of `SUNGetErrMsg`.
    pub fn name(self) -> &'static str {
        let names = match self.family {
            FlagFamily::Cvode => CVODE_FLAGS,
            FlagFamily::CvodeLinear => CVODE_LINEAR_FLAGS,
            FlagFamily::Arkode => ARKODE_FLAGS,
            FlagFamily::ArkodeLinear => ARKODE_LINEAR_FLAGS,
            FlagFamily::Core => {
                // SAFETY: the function returns a terminated static literal for every code, even an unknown one.
                let text = unsafe { ffi::SUNGetErrMsg(self.number).as_ref().map(|text| CStr::from_ptr(text)) };
                return text.and_then(|text| text.to_str().ok()).unwrap_or("unknown flag");
            }
        };
        let found = names.iter().find(|(number, _)| *number == self.number);
        found.map_or("unknown flag", |(_, name)| name)
    }
}

impl fmt::Display for Flag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name(), self.number())
    }
}
