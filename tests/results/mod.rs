//! The result file, and the page that shows it.

mod format;
mod kept;
mod kill;
mod packed;
mod page;
mod page_channels;
mod probe;
mod roundtrip;
mod target;
