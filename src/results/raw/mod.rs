//! The few HDF5 calls that the binding does not have, each behind a safe function.
#![allow(unsafe_code)]

mod look;

pub(super) use look::{Class, Opened, class_of, external_count, forget_external_links, open_object, virtual_sources};

use std::ffi::{c_char, c_uint};

use hdf5::types::TypeDescriptor;
use hdf5::{Container, Dataset, Datatype, Group};
use hdf5_sys::h5::herr_t;
use hdf5_sys::h5a::H5Aread;
use hdf5_sys::h5d::{H5Dread, H5Dwrite};
use hdf5_sys::h5i::{H5I_type_t, hid_t};
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::H5S_ALL;

unsafe extern "C" {
    fn H5DSset_scale(dataset: hid_t, dimension_name: *const c_char) -> herr_t;
    fn H5DSattach_scale(dataset: hid_t, scale: hid_t, index: c_uint) -> herr_t;
}

/// Runs one HDF5 call and turns its negative status into the error on HDF5's stack.
fn call(function: impl FnOnce() -> herr_t) -> hdf5::Result<()> {
    hdf5::sync::sync(|| {
        if function() < 0 {
            Err(hdf5::Error::query()?)
        } else {
            Ok(())
        }
    })
}

/// Makes `dataset` a dimension scale: the netCDF dimension `name` with its coordinate variable.
pub(super) fn set_scale(dataset: &Dataset, name: &str) -> hdf5::Result<()> {
    let name = std::ffi::CString::new(name).map_err(|error| error.to_string())?;
    // SAFETY: both arguments outlive the call; `sync` holds the library's lock.
    call(|| unsafe { H5DSset_scale(dataset.id(), name.as_ptr()) })
}

/// Puts a dimension of `dataset`, counted from 0, on `scale`.
pub(super) fn attach_scale(dataset: &Dataset, scale: &Dataset, dimension: u32) -> hdf5::Result<()> {
    // SAFETY: both handles are open; `sync` holds the library's lock.
    call(|| unsafe { H5DSattach_scale(dataset.id(), scale.id(), dimension) })
}

/// Stores `texts` as a column of fixed-length UTF-8 strings, as long as the longest.
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

/// Writes every element of `dataset`, whose type is that of `descriptor`.
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

/// Reads what [`write_texts`] writes.
pub(super) fn read_texts(dataset: &Dataset) -> hdf5::Result<Vec<String>> {
    let (length, bytes) = read_bytes(dataset)?.ok_or("not a column of texts")?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned();
    Ok(bytes.chunks(length.max(1)).map(text).collect())
}

/// Stores `text` as a scalar, fixed-length UTF-8 string: of the forms that hold more than the 64 KiB
/// of an attribute, the one that every reader shows as a text.
pub(super) fn write_text(group: &Group, name: &str, text: &str) -> hdf5::Result<Dataset> {
    // HDF5 has no string of length 0.
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len().max(1), 0);
    let descriptor = TypeDescriptor::FixedUnicode(bytes.len());
    let dataset = group.new_dataset_builder().empty_as(&descriptor).create(name)?;
    write_all(&dataset, &descriptor, &bytes)?;
    Ok(dataset)
}

/// Reads a scalar, fixed-length string, such as [`write_text`] writes, of a dataset or an attribute; `None` if it is
/// something else, or not UTF-8.
pub(super) fn read_text(object: &Container) -> hdf5::Result<Option<String>> {
    Ok(read_scalar(object)?.and_then(|bytes| String::from_utf8(bytes).ok()))
}

/// The same of any encoding, for people to read: what is not UTF-8 is replaced.
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

/// Every string of a dataset or an attribute one after the other, and the length of each; `None` if that is not fixed.
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
