//! Held against printed numbers.

#[path = "../common/mod.rs"]
mod common;

mod benchmark_set;
mod figures;
mod problems;
