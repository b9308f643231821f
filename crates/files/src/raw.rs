//! HDF5 calls that the binding lacks, each behind a safe function.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::sync::OnceLock;

use hdf5::plist::DatasetCreate;
use hdf5::types::TypeDescriptor;
use hdf5::{Container, Dataset, Dataspace, Datatype, Group, Location};
use hdf5_sys::h5::{herr_t, hsize_t};
use hdf5_sys::h5a::{H5Acreate2, H5Aget_type, H5Aread, H5Awrite};
use hdf5_sys::h5d::{H5Dcreate2, H5Dget_create_plist, H5Dget_type, H5Dread, H5Dwrite, H5Dwrite_chunk};
use hdf5_sys::h5i::{H5I_type_t, H5Idec_ref, H5Iget_type, hid_t};
use hdf5_sys::h5l::{H5L_type_t, H5Lunregister};
use hdf5_sys::h5o::H5Oopen;
use hdf5_sys::h5p::{
    H5P_CLS_LINK_ACCESS, H5P_DEFAULT, H5Pcreate, H5Pget_external_count, H5Pget_virtual_count, H5Pget_virtual_dsetname,
    H5Pget_virtual_filename, H5Pset_elink_cb,
};
use hdf5_sys::h5s::H5S_ALL;
use hdf5_sys::h5t::{
    H5T_class_t, H5T_cset_t, H5T_sign_t, H5Tget_class, H5Tget_cset, H5Tget_sign, H5Tget_size, H5Tis_variable_str,
};

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
    write_fixed(group, name, texts, Some(texts.len()))
}

/// Stores texts in strings of one fixed length: a scalar, or a column of so many rows.
fn write_fixed(group: &Group, name: &str, texts: &[impl AsRef<str>], rows: Option<usize>) -> hdf5::Result<Dataset> {
    let texts = texts.iter().map(AsRef::as_ref);
    // HDF5 has no string of length 0.
    let length = texts.clone().map(str::len).max().unwrap_or(0).max(1);
    let mut bytes = Vec::with_capacity(length * texts.len());
    for text in texts {
        bytes.extend_from_slice(text.as_bytes());
        bytes.resize(bytes.len() + length - text.len(), 0);
    }
    let descriptor = TypeDescriptor::FixedUnicode(length);
    let builder = group.new_dataset_builder().empty_as(&descriptor);
    let dataset = match rows {
        Some(rows) => builder.shape([rows]).create(name)?,
        None => builder.create(name)?,
    };
    assert_eq!(bytes.len(), descriptor.size() * dataset.size());
    let memory = Datatype::from_descriptor(&descriptor)?;
    // SAFETY: `bytes` holds as many elements of `memory`'s size as the dataset takes.
    call(|| unsafe {
        let (id, memory, bytes) = (dataset.id(), memory.id(), bytes.as_ptr().cast());
        H5Dwrite(id, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes)
    })?;
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
    write_fixed(group, name, &[text], None)
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

pub(super) enum Opened {
    Group(Group),
    Dataset(Dataset),
    Other,
}

extern "C" fn refuse(
    _parent_file: *const c_char,
    _parent_group: *const c_char,
    _file: *const c_char,
    _object: *const c_char,
    _flags: *mut c_uint,
    _access: hid_t,
    _data: *mut c_void,
) -> herr_t {
    -1
}

/// Opens the object at a path; links into other files only with `follow_external`.
pub(super) fn open_object(from: &Group, path: &str, follow_external: bool) -> hdf5::Result<Opened> {
    let path = CString::new(path).map_err(|error| error.to_string())?;
    let mut access = None;
    if !follow_external {
        // SAFETY: the class is open.
        let list = Id::new(|| unsafe { H5Pcreate(*H5P_CLS_LINK_ACCESS) })?;
        // SAFETY: the list is open; the function never unwinds.
        call(|| unsafe { H5Pset_elink_cb(list.0, Some(refuse), std::ptr::null_mut()) })?;
        access = Some(list);
    }
    let access = access.as_ref().map_or(H5P_DEFAULT, |list| list.0);
    // SAFETY: every identifier is open, the name ends with NUL and outlives the call.
    let object = Id::new(|| unsafe { H5Oopen(from.id(), path.as_ptr(), access) })?;
    // SAFETY: the identifier is open.
    let kind = hdf5::sync::sync(|| unsafe { H5Iget_type(object.0) });
    let id = object.0;
    match kind {
        H5I_type_t::H5I_GROUP => {
            std::mem::forget(object);
            // SAFETY: the identifier is new and of this type, and the handle takes it over.
            Ok(Opened::Group(unsafe { hdf5::from_id(id) }?))
        }
        H5I_type_t::H5I_DATASET => {
            std::mem::forget(object);
            // SAFETY: as above.
            Ok(Opened::Dataset(unsafe { hdf5::from_id(id) }?))
        }
        _ => Ok(Opened::Other),
    }
}

/// Prevents this process from following links into other files, even where HDF5 would: behind virtual datasets.
pub(super) fn forget_external_links() -> hdf5::Result<()> {
    // SAFETY: no identifiers are involved.
    call(|| unsafe { H5Lunregister(H5L_type_t::H5L_TYPE_EXTERNAL) })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    Integer {
        signed: bool,
    },
    Float,
    Text {
        /// Bytes; `None` if the length varies.
        length: Option<usize>,
        unicode: bool,
    },
    Other(&'static str),
}

pub(super) fn class_of(object: &Container) -> hdf5::Result<(Class, usize)> {
    // SAFETY: the object is open, and its type is closed after use.
    let kind = Id::new(|| unsafe {
        match object.id_type() {
            H5I_type_t::H5I_ATTR => H5Aget_type(object.id()),
            _ => H5Dget_type(object.id()),
        }
    })?;
    let id = kind.0;
    // SAFETY: the type is open.
    let (class, bytes) = hdf5::sync::sync(|| unsafe { (H5Tget_class(id), H5Tget_size(id)) });
    let class = match (class, bytes) {
        (H5T_class_t::H5T_INTEGER, 1 | 2 | 4 | 8) => {
            // SAFETY: as above.
            let sign = hdf5::sync::sync(|| unsafe { H5Tget_sign(id) });
            Class::Integer {
                signed: sign != H5T_sign_t::H5T_SGN_NONE,
            }
        }
        (H5T_class_t::H5T_FLOAT, 2 | 4 | 8) => Class::Float,
        (H5T_class_t::H5T_STRING, length) => {
            // SAFETY: as above.
            let (variable, set) = hdf5::sync::sync(|| unsafe { (H5Tis_variable_str(id), H5Tget_cset(id)) });
            Class::Text {
                length: (variable == 0).then_some(length),
                unicode: set == H5T_cset_t::H5T_CSET_UTF8,
            }
        }
        (H5T_class_t::H5T_INTEGER, _) => Class::Other("integer"),
        (H5T_class_t::H5T_FLOAT, _) => Class::Other("float"),
        (H5T_class_t::H5T_ENUM, _) => Class::Other("enumeration"),
        (H5T_class_t::H5T_COMPOUND, _) => Class::Other("compound"),
        (H5T_class_t::H5T_ARRAY, _) => Class::Other("array"),
        (H5T_class_t::H5T_REFERENCE, _) => Class::Other("reference"),
        (H5T_class_t::H5T_VLEN, _) => Class::Other("variable length"),
        _ => Class::Other("other"),
    };
    Ok((class, bytes))
}

pub(super) fn external_count(creation: &DatasetCreate) -> hdf5::Result<usize> {
    // SAFETY: the list is open.
    let count = hdf5::sync::sync(|| unsafe { H5Pget_external_count(creation.id()) });
    usize::try_from(count).map_err(|_| "no count of external files".into())
}

/// File and dataset of each part of a virtual dataset; `None` if there are more than `limit` parts.
pub(super) fn virtual_sources(dataset: &Dataset, limit: usize) -> hdf5::Result<Option<Vec<(String, String)>>> {
    // SAFETY: the dataset is open, and the list is closed after use.
    let list = Id::new(|| unsafe { H5Dget_create_plist(dataset.id()) })?;
    let mut count = 0;
    // SAFETY: the list is open, and `count` outlives the call.
    call(|| unsafe { H5Pget_virtual_count(list.0, &mut count) })?;
    if count > limit {
        return Ok(None);
    }
    let text = |call: unsafe extern "C" fn(hid_t, usize, *mut c_char, usize) -> isize, index| {
        hdf5::sync::sync(|| {
            let mut bytes = vec![0_u8; 1024];
            // SAFETY: the list is open, and `bytes` has the stated length.
            let length = unsafe { call(list.0, index, bytes.as_mut_ptr().cast(), bytes.len()) };
            match usize::try_from(length) {
                Ok(length) if length < bytes.len() => {
                    bytes.truncate(length);
                    String::from_utf8(bytes).map_err(|_| hdf5::Error::from("the name of a source is not UTF-8"))
                }
                _ => Err("the name of a source cannot be read".into()),
            }
        })
    };
    (0..count)
        .map(|index| {
            Ok((
                text(H5Pget_virtual_filename, index)?,
                text(H5Pget_virtual_dsetname, index)?,
            ))
        })
        .collect::<hdf5::Result<_>>()
        .map(Some)
}
