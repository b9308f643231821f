//! Held against printed numbers.

#[path = "../common/mod.rs"]
mod common;

mod figures;
mod problems;
