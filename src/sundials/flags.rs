//! The return flags of the C functions, by name.

use std::ffi::CStr;
use std::fmt;

use super::ffi;

include!(concat!(env!("OUT_DIR"), "/sundials_flags.rs"));

/// Which table of names a C function's return value belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    Cvode,
    CvodeLinear,
    Arkode,
    ArkodeLinear,
    /// A `SUNErrCode`, from SUNDIALS' own objects.
    Core,
}

/// What a C function returned. A number that the headers do not name is a value like any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flag {
    pub(super) family: Family,
    pub(super) number: i32,
}

impl Flag {
    /// The number that the C function returned.
    pub fn number(self) -> i32 {
        self.number
    }

    /// Its name in the C header, such as `CV_TOO_MUCH_WORK`; of SUNDIALS' own objects the text of `SUNGetErrMsg`.
    pub fn name(self) -> &'static str {
        let names = match self.family {
            Family::Cvode => CVODE_FLAGS,
            Family::CvodeLinear => CVODE_LINEAR_FLAGS,
            Family::Arkode => ARKODE_FLAGS,
            Family::ArkodeLinear => ARKODE_LINEAR_FLAGS,
            Family::Core => {
                // SAFETY: the function returns a literal for each code, for unknown codes too: terminated, and alive for ever.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn said(family: Family, number: i32) -> String {
        Flag { family, number }.to_string()
    }

    #[test]
    fn sundials_flag_names_are_those_of_the_headers() {
        assert_eq!(said(Family::Cvode, ffi::CV_TOO_MUCH_WORK), "CV_TOO_MUCH_WORK (-1)");
        assert_eq!(
            said(Family::Arkode, ffi::ARK_CONTROLLER_ERR),
            "ARK_CONTROLLER_ERR (-47)"
        );
        assert_eq!(said(Family::CvodeLinear, -9), "CVLS_SUNLS_FAIL (-9)");
        assert_eq!(said(Family::ArkodeLinear, -8), "ARKLS_JACFUNC_RECVR (-8)");
        // The numbers of modes and choices are not flags.
        assert_eq!(said(Family::Cvode, 1), "CV_TSTOP_RETURN (1)");
        assert_eq!(said(Family::Arkode, -1), "ARK_TOO_MUCH_WORK (-1)");
    }

    #[test]
    fn an_unknown_flag_is_a_value() {
        assert_eq!(said(Family::Cvode, -12345), "unknown flag (-12345)");
        assert!(said(Family::Core, 17).ends_with("(17)"));
    }
}
