//! Tests against the oracle, or against the files of data/truth.

#[path = "../common/mod.rs"]
mod common;

mod bands;
mod built_in;
mod campaign_of_brakes;
mod campaign_of_trains;
mod certificate;
mod closed_form;
mod contact;
mod corners;
mod events;
mod explicit;
mod growth;
mod laws;
mod long_steps;
mod oracle;
mod oracle_closed_forms;
mod oracle_numbers;
mod sensitivities;
mod series_brakes;
mod shared_errors;
mod slopes;
