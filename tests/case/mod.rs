//! The case file: keys, units, overrides, built-in cases, and messages about mistakes.

mod builtin;
mod errors;
mod general_form;
mod overrides;
mod resolved;
mod units;
