//! The case file: keys, units, overrides, built-in cases, and what is said of a mistake.

mod builtin;
mod errors;
mod general_form;
mod overrides;
mod resolved;
mod units;
