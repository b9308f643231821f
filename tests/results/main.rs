//! The result file, and the page that is made of it.

#[path = "../common/mod.rs"]
mod common;

mod format;
mod kept;
mod kill;
mod page;
mod roundtrip;
mod target;
mod train_pages;
