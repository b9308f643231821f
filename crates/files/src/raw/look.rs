//! Queries about objects in files of other programs.

use std::ffi::{CString, c_char, c_uint, c_void};

use super::Id;
use hdf5::plist::DatasetCreate;
use hdf5::{Container, Dataset, Group};
use hdf5_sys::h5::herr_t;
use hdf5_sys::h5a::H5Aget_type;
use hdf5_sys::h5d::{H5Dget_create_plist, H5Dget_type};
use hdf5_sys::h5i::{H5I_type_t, H5Iget_type, hid_t};
use hdf5_sys::h5l::{H5L_type_t, H5Lunregister};
use hdf5_sys::h5o::H5Oopen;
use hdf5_sys::h5p::{
    H5P_CLS_LINK_ACCESS, H5P_DEFAULT, H5Pcreate, H5Pget_external_count, H5Pget_virtual_count, H5Pget_virtual_dsetname,
    H5Pget_virtual_filename, H5Pset_elink_cb,
};
use hdf5_sys::h5t::{
    H5T_class_t, H5T_cset_t, H5T_sign_t, H5Tget_class, H5Tget_cset, H5Tget_sign, H5Tget_size, H5Tis_variable_str,
};

pub(crate) enum Opened {
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
pub(crate) fn open_object(from: &Group, path: &str, follow_external: bool) -> hdf5::Result<Opened> {
    let path = CString::new(path).map_err(|error| error.to_string())?;
    let mut access = None;
    if !follow_external {
        // SAFETY: the class is open.
        let list = Id::new(|| unsafe { H5Pcreate(*H5P_CLS_LINK_ACCESS) })?;
        // SAFETY: the list is open; the function never unwinds.
        super::call(|| unsafe { H5Pset_elink_cb(list.0, Some(refuse), std::ptr::null_mut()) })?;
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
pub(crate) fn forget_external_links() -> hdf5::Result<()> {
    // SAFETY: no identifiers are involved.
    super::call(|| unsafe { H5Lunregister(H5L_type_t::H5L_TYPE_EXTERNAL) })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Class {
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

pub(crate) fn class_of(object: &Container) -> hdf5::Result<(Class, usize)> {
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

pub(crate) fn external_count(creation: &DatasetCreate) -> hdf5::Result<usize> {
    // SAFETY: the list is open.
    let count = hdf5::sync::sync(|| unsafe { H5Pget_external_count(creation.id()) });
    usize::try_from(count).map_err(|_| "no count of external files".into())
}

/// File and dataset of each part of a virtual dataset; `None` if there are more than `limit` parts.
pub(crate) fn virtual_sources(dataset: &Dataset, limit: usize) -> hdf5::Result<Option<Vec<(String, String)>>> {
    // SAFETY: the dataset is open, and the list is closed after use.
    let list = Id::new(|| unsafe { H5Dget_create_plist(dataset.id()) })?;
    let mut count = 0;
    // SAFETY: the list is open, and `count` outlives the call.
    super::call(|| unsafe { H5Pget_virtual_count(list.0, &mut count) })?;
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
