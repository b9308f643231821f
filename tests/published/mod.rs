//! Tests against printed numbers.

mod benchmark_set;
mod cycles;
mod figures;
mod problems;
