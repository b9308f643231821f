//! Tests against closed forms and exact solutions.

#[path = "../common/mod.rs"]
mod common;

mod analysis;
mod attractors;
mod belts_and_clutches;
mod boundary;
mod calibrate;
mod compare;
mod dense;
mod drives;
mod equations;
mod expansion;
mod fixed_step;
mod friction;
mod growth;
mod linear_part;
mod loss_of_stability;
mod model;
mod modes;
mod numerics;
mod plot;
mod record;
mod runs;
mod signal;
mod simulation;
mod steady_sliding;
mod studies;
