//! Held against earlier behaviour.

#[path = "../common/mod.rs"]
mod common;

mod calibrate;
mod memory;
mod solver_counters;
