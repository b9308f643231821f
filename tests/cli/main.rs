//! The program as a user starts it, command by command.

#[path = "../common/mod.rs"]
mod common;

mod benchmark_set;
mod calibrate;
mod capabilities;
mod certify;
mod check;
mod compare;
mod compare_explicit;
mod compare_motions;
mod compare_parameters;
mod compare_twice;
mod cycle;
mod distributions;
mod export;
mod export_studies;
mod hostile;
mod hostile_hdf5;
#[cfg(unix)]
mod manual;
mod methods;
mod modes;
mod odd;
mod older;
mod output;
mod overwrite;
mod page;
mod plot;
mod plot_branches;
mod plot_motions;
mod plot_print;
mod plot_studies;
mod reference_pages;
mod reports;
mod run;
mod shards;
mod signals;
mod stdin;
mod sweep;
mod sweep_numbers;
mod usage;
mod work_precision;
