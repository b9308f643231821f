//! The result file, and the page that is made of it.

#[path = "../common/mod.rs"]
mod common;

mod format;
mod kept;
mod kill;
mod page;
mod page_channels;
mod roundtrip;
mod target;
