//! The return flags of the C functions, by name.

use std::ffi::CStr;
use std::fmt;

use super::ffi;

include!(concat!(env!("OUT_DIR"), "/sundials_flags.rs"));

/// What a C function returned. A number that the headers do not name is a value like any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Flag {
    /// From `CVode*`.
    Cvode(CvodeFlag),
    /// From CVODE's linear solver interface.
    CvodeLinear(CvodeLinearFlag),
    /// From `ARKode*`, `ERKStep*` or `ARKStep*`.
    Arkode(ArkodeFlag),
    /// From ARKODE's linear solver interface.
    ArkodeLinear(ArkodeLinearFlag),
    /// A `SUNErrCode`, from SUNDIALS' own objects.
    Core(i32),
    /// A number that the headers do not name.
    Unknown(i32),
}

/// Which table of names a C function's return value belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    Cvode,
    CvodeLinear,
    Arkode,
    ArkodeLinear,
    Core,
}

impl Flag {
    pub(super) fn new(family: Family, number: i32) -> Self {
        match family {
            Family::Cvode => CvodeFlag::from_number(number).map(Self::Cvode),
            Family::CvodeLinear => CvodeLinearFlag::from_number(number).map(Self::CvodeLinear),
            Family::Arkode => ArkodeFlag::from_number(number).map(Self::Arkode),
            Family::ArkodeLinear => ArkodeLinearFlag::from_number(number).map(Self::ArkodeLinear),
            Family::Core => Some(Self::Core(number)),
        }
        .unwrap_or(Self::Unknown(number))
    }

    /// The number that the C function returned.
    pub fn number(self) -> i32 {
        match self {
            Self::Cvode(flag) => flag as i32,
            Self::CvodeLinear(flag) => flag as i32,
            Self::Arkode(flag) => flag as i32,
            Self::ArkodeLinear(flag) => flag as i32,
            Self::Core(number) | Self::Unknown(number) => number,
        }
    }

    /// Its name in the C header, such as `CV_TOO_MUCH_WORK`; for [`Flag::Core`] the text of `SUNGetErrMsg`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cvode(flag) => flag.name(),
            Self::CvodeLinear(flag) => flag.name(),
            Self::Arkode(flag) => flag.name(),
            Self::ArkodeLinear(flag) => flag.name(),
            Self::Core(number) => {
                // SAFETY: the function returns a literal for each code, for unknown codes too.
                let text = unsafe { ffi::SUNGetErrMsg(number) };
                if text.is_null() {
                    return "unknown flag";
                }
                // SAFETY: a literal of the C library: terminated, and alive for ever.
                unsafe { CStr::from_ptr(text) }.to_str().unwrap_or("unknown flag")
            }
            Self::Unknown(_) => "unknown flag",
        }
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

    #[test]
    fn sundials_flag_names_are_those_of_the_headers() {
        assert_eq!(
            Flag::new(Family::Cvode, ffi::CV_TOO_MUCH_WORK).to_string(),
            "CV_TOO_MUCH_WORK (-1)"
        );
        assert_eq!(
            Flag::new(Family::Arkode, ffi::ARK_CONTROLLER_ERR).to_string(),
            "ARK_CONTROLLER_ERR (-47)"
        );
        assert_eq!(Flag::new(Family::CvodeLinear, -9).to_string(), "CVLS_SUNLS_FAIL (-9)");
        assert_eq!(
            Flag::new(Family::ArkodeLinear, -8).to_string(),
            "ARKLS_JACFUNC_RECVR (-8)"
        );
        // The numbers of modes and choices are not flags.
        assert_eq!(CvodeFlag::from_number(1), Some(CvodeFlag::TstopReturn));
        assert_eq!(ArkodeFlag::from_number(-1), Some(ArkodeFlag::TooMuchWork));
    }

    #[test]
    fn an_unknown_flag_is_a_value() {
        assert_eq!(Flag::new(Family::Cvode, -12345), Flag::Unknown(-12345));
        assert_eq!(Flag::new(Family::Cvode, -12345).to_string(), "unknown flag (-12345)");
        assert_eq!(Flag::new(Family::Core, 17).number(), 17);
    }
}
