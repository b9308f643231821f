//! HDF5 files that a test makes, changes or reads itself, without HDF5's lock. The programs that other tests of the
//! same process start in the meantime inherit every open file, and with it its lock: the file would be "in use" for as
//! long as they run.

use std::path::Path;

use hdf5::{File, Group, H5Type, OpenMode, Result};
use ndarray::{ArrayView, Dimension};

pub fn create(path: impl AsRef<Path>) -> Result<File> {
    in_mode(path.as_ref(), OpenMode::Create)
}

/// Opens a file to change it. HDF5 cuts its seal off: it is then read as it is.
pub fn open_rw(path: impl AsRef<Path>) -> Result<File> {
    in_mode(path.as_ref(), OpenMode::ReadWrite)
}

pub fn open(path: impl AsRef<Path>) -> Result<File> {
    in_mode(path.as_ref(), OpenMode::Read)
}

/// Writes an array as a variable of a group, and holds nothing of the file open.
pub fn store<'d, T: H5Type, D: Dimension>(group: &Group, name: &str, values: impl Into<ArrayView<'d, T, D>>) {
    let builder = group.new_dataset_builder();
    builder.with_data(values).create(name).unwrap();
}

fn in_mode(path: &Path, mode: OpenMode) -> Result<File> {
    File::with_options()
        .with_fapl(|access| access.file_locking(false))
        .open_as(path, mode)
}
