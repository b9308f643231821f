//! Held against printed numbers.

#[path = "../common/mod.rs"]
mod common;

mod benchmark_set;
mod cycles;
mod figures;
mod problems;
