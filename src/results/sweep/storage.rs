//! A sweep file whose points stay in the files of its shards: HDF5's virtual datasets over them.

use std::path::{Component, Path, PathBuf};

use hdf5::{Dataset, Group, Hyperslab, Selection, SliceOrIndex};

use super::partition::{Patch, Stride};
use crate::results::disk::folder_of;
use crate::results::values::Number;

/// Where the points of a sweep file are stored.
#[derive(Clone, Copy)]
pub(super) enum Storage<'a> {
    /// In the file.
    Own,
    /// In the files of its shards.
    Shards(Shards<'a>),
}

/// Which rows of the shards a variable is made of.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rows {
    Points,
    Events,
}

/// The shards in their order, and which of their rows are meant.
#[derive(Clone, Copy)]
pub(super) struct Shards<'a> {
    pub(super) sources: &'a [Source],
    pub(super) rows: Rows,
}

/// The file of one shard.
pub(super) struct Source {
    /// As the virtual dataset names it: relative to the folder of the file that has it.
    pub(super) path: String,
    pub(super) points: usize,
    pub(super) events: usize,
    /// Where its points are in the whole.
    pub(super) patches: Vec<Patch>,
}

impl<'a> Storage<'a> {
    pub(super) fn is_own(self) -> bool {
        matches!(self, Storage::Own)
    }

    /// Events in all shards.
    pub(super) fn events(self) -> usize {
        match self {
            Storage::Own => 0,
            Storage::Shards(shards) => shards.sources.iter().map(|source| source.events).sum(),
        }
    }

    /// The same for other rows.
    pub(super) fn of(self, rows: Rows) -> Storage<'a> {
        match self {
            Storage::Own => Storage::Own,
            Storage::Shards(shards) => Storage::Shards(Shards { rows, ..shards }),
        }
    }
}

impl Shards<'_> {
    /// Creates the variable `name` of a group, made of the variables of that name in the shards.
    pub(super) fn create<T: Number>(&self, group: &Group, name: &str, shape: &[usize]) -> hdf5::Result<Dataset> {
        let inside = format!("{}/{name}", group.name().trim_end_matches('/'));
        let mut builder = group
            .new_dataset_builder()
            .obj_track_times(false)
            .fill_value(T::ABSENT)
            .empty::<T>()
            .shape(shape.to_vec());
        let mut before = 0;
        for source in self.sources {
            let (length, whole);
            let patches: &[Patch] = match self.rows {
                Rows::Points => {
                    length = source.points;
                    &source.patches
                }
                Rows::Events => {
                    length = source.events;
                    let rows = |start| Stride {
                        start,
                        step: 1,
                        count: 1,
                        block: length,
                    };
                    whole = [Patch {
                        rows: rows(0),
                        cells: vec![rows(before)],
                    }];
                    &whole
                }
            };
            before += length;
            // HDF5 has no empty mapping.
            for patch in patches.iter().filter(|_| length > 0) {
                // HDF5 takes `%b` in the name of a source for a number that it fills in.
                builder = builder.virtual_map(
                    source.path.replace('%', "%%"),
                    &inside,
                    [length],
                    selection(std::slice::from_ref(&patch.rows)),
                    shape.to_vec(),
                    selection(&patch.cells),
                );
            }
        }
        builder.create(name)
    }
}

fn selection(strides: &[Stride]) -> Selection {
    let slices: Vec<SliceOrIndex> = strides
        .iter()
        .map(|stride| SliceOrIndex::SliceCount {
            start: stride.start,
            // Blocks must not overlap, even where there is one only.
            step: stride.step.max(stride.block),
            count: stride.count,
            block: stride.block,
        })
        .collect();
    Selection::Hyperslab(Hyperslab::from(slices))
}

/// The way from the folder of `file` to `other`, so that both can be moved together; absolute where there is none.
pub(super) fn relative_path(file: &Path, other: &Path) -> PathBuf {
    let (Ok(from), Ok(to)) = (folder_of(file).canonicalize(), other.canonicalize()) else {
        return other.to_owned();
    };
    let from: Vec<Component> = from.components().collect();
    let to: Vec<Component> = to.components().collect();
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return other.to_owned();
    }
    let up = from[common..].iter().map(|_| Component::ParentDir);
    up.chain(to[common..].iter().copied()).collect()
}
