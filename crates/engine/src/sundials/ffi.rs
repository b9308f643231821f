//! The C interface: sundials-sys, and the bindings that build.rs generates for the parts it leaves out.
#![allow(missing_docs, non_camel_case_types, non_snake_case, non_upper_case_globals)]
#![allow(dead_code, unused_imports, unnameable_types)]
#![allow(clippy::all, rustdoc::all)]

pub use sundials_sys::*;

include!(concat!(env!("OUT_DIR"), "/sundials_rest.rs"));
