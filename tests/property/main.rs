//! Invariants, over random or damaged inputs.

#[path = "../common/mod.rs"]
mod common;

mod attractors;
mod calibrate;
mod callbacks;
mod certificate;
mod compare;
mod compare_belt;
mod compare_causes;
mod compare_faults;
mod compare_resolution;
mod ensemble;
mod figures;
mod layers;
mod paper_procedure;
mod planted;
mod runs;
mod sampling;
mod sensitivity;
mod short_sticks;
mod study_tolerance;
mod warnings;
