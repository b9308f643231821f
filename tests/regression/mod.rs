//! Tests against earlier behaviour.

mod calibrate;
mod memory;
mod solver_counters;
