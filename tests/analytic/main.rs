//! Held against closed forms and exact solutions.

#[path = "../common/mod.rs"]
mod common;

mod boundary;
mod calibrate;
mod dense;
mod drives;
mod expansion;
mod fixed_step;
mod friction;
mod growth;
mod linear_part;
mod model;
mod modes;
mod runs;
mod short_form;
mod signal;
mod train_modes;
mod trains;
