//! Held against SUNDIALS' own examples, or one engine against another.

mod cvode;
mod integrators;
mod names;
mod published;
mod series;
