//! Invariants, over random or damaged inputs.

#[path = "../common/mod.rs"]
mod common;

mod attractors;
mod calibrate;
mod callbacks;
mod certificate;
mod closed_form;
mod compare;
mod compare_belt;
mod compare_causes;
mod compare_faults;
mod compare_headline;
mod compare_resolution;
mod deadline;
mod executor;
mod figures;
mod messages;
mod multipliers;
mod names;
mod npy;
mod paper_procedure;
mod planted;
mod runs;
mod sampling;
mod sensitivity;
mod short_sticks;
mod studies;
mod study_tolerance;
mod sweep_points;
mod warnings;
