//! HDF5 calls that the binding lacks, each behind a safe function.
#![allow(unsafe_code)]

mod look;

pub(super) use look::{Class, Opened, class_of, external_count, forget_external_links, open_object, virtual_sources};

use std::ffi::{CString, c_char, c_uint};
use std::mem::ManuallyDrop;
use std::sync::OnceLock;

use hdf5::types::TypeDescriptor;
use hdf5::{Container, Dataset, Dataspace, Datatype, Group, Location};
use hdf5_sys::h5::{herr_t, hsize_t};
use hdf5_sys::h5a::{H5Acreate2, H5Aread, H5Awrite};
use hdf5_sys::h5d::{H5Dcreate2, H5Dread, H5Dwrite, H5Dwrite_chunk};
use hdf5_sys::h5i::{H5I_type_t, H5Idec_ref, hid_t};
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::H5S_ALL;

unsafe extern "C" {
    fn H5DSset_scale(dataset: hid_t, dimension_name: *const c_char) -> herr_t;
    fn H5DSattach_scale(dataset: hid_t, scale: hid_t, index: c_uint) -> herr_t;
}

/// Runs one HDF5 call. A negative status becomes the error on HDF5's stack.
fn call(function: impl FnOnce() -> herr_t) -> hdf5::Result<()> {
    hdf5::sync::sync(|| {
        if function() < 0 {
            Err(hdf5::Error::query()?)
        } else {
            Ok(())
        }
    })
}

struct Id(hid_t);

impl Id {
    fn new(make: impl FnOnce() -> hid_t) -> hdf5::Result<Id> {
        hdf5::sync::sync(|| match make() {
            id if id < 0 => Err(hdf5::Error::query()?),
            id => Ok(Id(id)),
        })
    }
}

impl Drop for Id {
    fn drop(&mut self) {
        // SAFETY: the identifier is ours, and released once.
        hdf5::sync::sync(|| unsafe { H5Idec_ref(self.0) });
    }
}

pub(super) fn create_dataset(
    group: &Group,
    name: &str,
    kind: &Datatype,
    shape: &Dataspace,
    [link, creation, access]: [hid_t; 3],
) -> hdf5::Result<Dataset> {
    let name = CString::new(name).map_err(|error| error.to_string())?;
    // SAFETY: HDF5 refuses an identifier that is not open; the name ends with NUL and outlives the call.
    let dataset = Id::new(|| unsafe {
        let (group, kind, shape) = (group.id(), kind.id(), shape.id());
        H5Dcreate2(group, name.as_ptr(), kind, shape, link, creation, access)
    })?;
    // SAFETY: the identifier is new and of this type; the handle takes it over.
    unsafe { hdf5::from_id(ManuallyDrop::new(dataset).0) }
}

/// Makes `dataset` a dimension scale: the coordinate variable of the netCDF dimension `name`.
pub(super) fn set_scale(dataset: &Dataset, name: &str) -> hdf5::Result<()> {
    let name = CString::new(name).map_err(|error| error.to_string())?;
    // SAFETY: both arguments outlive the call; `sync` holds the library's lock.
    call(|| unsafe { H5DSset_scale(dataset.id(), name.as_ptr()) })
}

pub(super) fn attach_scale(dataset: &Dataset, scale: &Dataset, dimension: u32) -> hdf5::Result<()> {
    // SAFETY: both handles are open; `sync` holds the library's lock.
    call(|| unsafe { H5DSattach_scale(dataset.id(), scale.id(), dimension) })
}

pub(super) fn write_texts(group: &Group, name: &str, texts: &[String]) -> hdf5::Result<Dataset> {
    let length = texts.iter().map(String::len).max().unwrap_or(0).max(1);
    let mut bytes = Vec::with_capacity(length * texts.len());
    for text in texts {
        bytes.extend_from_slice(text.as_bytes());
        bytes.resize(bytes.len() + length - text.len(), 0);
    }
    let descriptor = TypeDescriptor::FixedUnicode(length);
    let dataset = group
        .new_dataset_builder()
        .obj_track_times(false)
        .empty_as(&descriptor)
        .shape([texts.len()])
        .create(name)?;
    write_all(&dataset, &descriptor, &bytes)?;
    Ok(dataset)
}

pub(super) struct RowRange(Dataset);

impl RowRange {
    pub(super) fn new(dataset: Dataset) -> hdf5::Result<Self> {
        match dataset.ndim() {
            1 => Ok(RowRange(dataset)),
            _ => Err("a column has one dimension".into()),
        }
    }

    /// Stores filtered `bytes` as the existing chunk at row `start`.
    pub(super) fn write_chunk(&self, start: usize, bytes: &[u8]) -> hdf5::Result<()> {
        let offset = [start as hsize_t];
        // SAFETY: `offset` has an entry for the only dimension, and `bytes` the stated length; HDF5 copies both.
        call(|| unsafe {
            let (list, bytes, length) = (H5P_DEFAULT, bytes.as_ptr().cast(), bytes.len());
            H5Dwrite_chunk(self.0.id(), list, 0, offset.as_ptr(), length, bytes)
        })
    }
}

impl std::ops::Deref for RowRange {
    type Target = Dataset;

    fn deref(&self) -> &Dataset {
        &self.0
    }
}

fn write_all(dataset: &Dataset, descriptor: &TypeDescriptor, bytes: &[u8]) -> hdf5::Result<()> {
    assert_eq!(bytes.len(), descriptor.size() * dataset.size());
    let memory = Datatype::from_descriptor(descriptor)?;
    // SAFETY: `bytes` holds as many elements of `memory`'s size as the dataset takes.
    call(|| unsafe {
        H5Dwrite(
            dataset.id(),
            memory.id(),
            H5S_ALL,
            H5S_ALL,
            H5P_DEFAULT,
            bytes.as_ptr().cast(),
        )
    })?;
    Ok(())
}

/// Stores `text` as a new scalar attribute of variable length, which every reader shows as text. Type and shape are
/// made once: the binding would make them again for each of a file's hundreds of attributes.
pub(super) fn write_text_attribute(location: &Location, name: &str, text: &str) -> hdf5::Result<()> {
    static KIND: OnceLock<(Datatype, Dataspace)> = OnceLock::new();
    let (kind, shape) = match KIND.get() {
        Some(kind) => kind,
        None => {
            let kind = Datatype::from_descriptor(&TypeDescriptor::VarLenUnicode)?;
            let shape = Dataspace::try_new(())?;
            KIND.get_or_init(|| (kind, shape))
        }
    };
    // A C string ends at its first NUL.
    let text = CString::new(text.replace('\0', " ")).map_err(|error| error.to_string())?;
    let name = CString::new(name).map_err(|error| error.to_string())?;
    let value = text.as_ptr();
    // SAFETY: location, type and shape are open; name and text end with NUL and outlive the calls; a value of this type
    // is a pointer to a text, which HDF5 copies.
    let attribute = Id::new(|| unsafe {
        let (location, name) = (location.id(), name.as_ptr());
        H5Acreate2(location, name, kind.id(), shape.id(), H5P_DEFAULT, H5P_DEFAULT)
    })?;
    call(|| unsafe { H5Awrite(attribute.0, kind.id(), (&raw const value).cast()) })
}

pub(super) fn read_texts(dataset: &Dataset) -> hdf5::Result<Vec<String>> {
    let (length, bytes) = read_bytes(dataset)?.ok_or("not a column of texts")?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned();
    Ok(bytes.chunks(length.max(1)).map(text).collect())
}

/// Stores `text` as a scalar UTF-8 string of fixed length. Beyond an attribute's 64 KiB, every reader shows only this
/// form as text.
pub(super) fn write_text(group: &Group, name: &str, text: &str) -> hdf5::Result<Dataset> {
    // HDF5 has no string of length 0.
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len().max(1), 0);
    let descriptor = TypeDescriptor::FixedUnicode(bytes.len());
    let dataset = group.new_dataset_builder().empty_as(&descriptor).create(name)?;
    write_all(&dataset, &descriptor, &bytes)?;
    Ok(dataset)
}

/// Reads a scalar string of fixed length from a dataset or an attribute; `None` if it is of another type, or not
/// UTF-8.
pub(super) fn read_text(object: &Container) -> hdf5::Result<Option<String>> {
    Ok(read_scalar(object)?.and_then(|bytes| String::from_utf8(bytes).ok()))
}

/// Like [`read_text`] for any encoding, for display. Invalid UTF-8 is replaced.
pub(super) fn read_text_lossy(object: &Container) -> hdf5::Result<String> {
    let bytes = read_scalar(object)?.ok_or("not a text")?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn read_scalar(object: &Container) -> hdf5::Result<Option<Vec<u8>>> {
    let read = if object.is_scalar() { read_bytes(object)? } else { None };
    Ok(read.map(|(_, mut bytes)| {
        while bytes.last() == Some(&0) {
            bytes.pop();
        }
        bytes
    }))
}

/// All strings of a dataset or an attribute, and their common length; `None` if the length varies.
fn read_bytes(object: &Container) -> hdf5::Result<Option<(usize, Vec<u8>)>> {
    let Class::Text {
        length: Some(length),
        unicode,
    } = class_of(object)?.0
    else {
        return Ok(None);
    };
    let descriptor = match unicode {
        true => TypeDescriptor::FixedUnicode(length),
        false => TypeDescriptor::FixedAscii(length),
    };
    let mut bytes = vec![0_u8; length * object.size()];
    let memory = Datatype::from_descriptor(&descriptor)?;
    // SAFETY: `bytes` has room for every element of `memory`'s size.
    call(|| unsafe {
        let (buffer, memory) = (bytes.as_mut_ptr().cast(), memory.id());
        match object.id_type() {
            H5I_type_t::H5I_ATTR => H5Aread(object.id(), memory, buffer),
            _ => H5Dread(object.id(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer),
        }
    })?;
    Ok(Some((length, bytes)))
}
