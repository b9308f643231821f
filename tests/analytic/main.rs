//! Held against closed forms and exact solutions.

#[path = "../common/mod.rs"]
mod common;

mod attractors;
mod belts_and_clutches;
mod boundary;
mod calibrate;
mod dense;
mod drives;
mod expansion;
mod fixed_step;
mod friction;
mod growth;
mod linear_part;
mod loss_of_stability;
mod model;
mod modes;
mod runs;
mod signal;
mod steady_sliding;
