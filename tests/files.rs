//! What is read and written: the case file, the result file, and the page.

mod case;
mod common;
mod results;
