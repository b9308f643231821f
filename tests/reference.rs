//! Held against numbers that others have computed: printed ones, those of SUNDIALS and of its examples, those of earlier versions.

mod common;
mod published;
mod regression;
mod sundials;
