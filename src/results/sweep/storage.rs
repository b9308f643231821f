//! A sweep file whose points stay in the files of its shards: HDF5's virtual datasets over them.

use std::path::{Component, Path, PathBuf};

use hdf5::{Dataset, Group, Hyperslab, Selection, SliceOrIndex};

use super::partition::{Patch, Stride};
use crate::results::disk::folder_of;
use crate::results::values::Number;

/// The files of the shards of a sweep, in their order.
pub(super) struct Shards {
    pub(super) points: Vec<Source>,
    pub(super) events: Vec<Source>,
}

/// Rows of the file of one shard.
pub(super) struct Source {
    /// As the virtual dataset names it: relative to the folder of the file that has it.
    pub(super) path: String,
    pub(super) rows: usize,
    /// Where they are in the whole.
    pub(super) patches: Vec<Patch>,
}

/// Creates the variable `name` of a group, made of the variables of that name in the shards.
pub(super) fn create_virtual<T: Number>(
    group: &Group,
    name: &str,
    shape: &[usize],
    sources: &[Source],
) -> hdf5::Result<Dataset> {
    let inside = format!("{}/{name}", group.name().trim_end_matches('/'));
    let mut builder = group
        .new_dataset_builder()
        .obj_track_times(false)
        .fill_value(T::ABSENT)
        .empty::<T>()
        .shape(shape.to_vec());
    // HDF5 has no empty mapping.
    for source in sources.iter().filter(|source| source.rows > 0) {
        for patch in &source.patches {
            // HDF5 takes `%b` in the name of a source for a number that it fills in.
            builder = builder.virtual_map(
                source.path.replace('%', "%%"),
                &inside,
                [source.rows],
                selection(std::slice::from_ref(&patch.rows)),
                shape.to_vec(),
                selection(&patch.cells),
            );
        }
    }
    builder.create(name)
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
