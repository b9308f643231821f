//! Figures of a run.

pub mod page;
