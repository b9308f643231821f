//! Held against SUNDIALS' own examples, or one engine against another.

#[path = "../common/mod.rs"]
mod common;

mod cvode;
mod integrators;
mod published;
mod series;
