//! Reading what others wrote: never more than its kind of file can need.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// A case, a study or a mapping is no larger, bytes: as a tree of values it takes a hundred times that.
pub(crate) const LARGEST_TEXT: u64 = 8 << 20;

/// A line of a table is no longer, bytes.
pub(crate) const LONGEST_LINE: usize = 16 << 20;

/// The text of a small file, and what is wrong with it: the operating system's error, or the line that is not UTF-8, if
/// it is a text of some other encoding.
pub(crate) fn text(path: &Path) -> io::Result<Result<String, Option<usize>>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LARGEST_TEXT + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_TEXT {
        let largest = LARGEST_TEXT >> 20;
        let what = format!("it is larger than {largest} MB, which no such file is; check the name");
        return Err(io::Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let is_binary = error.as_bytes().iter().any(|byte| matches!(byte, 0..=8 | 14..=26));
        (!is_binary).then(|| valid.iter().filter(|&&byte| byte == b'\n').count() + 1)
    }))
}

/// A file of lines; one longer than [`LONGEST_LINE`] is an error, as a line is kept in memory as a whole.
pub(crate) struct Lines<R> {
    inner: R,
    since_end: usize,
}

impl<R: Read> Lines<R> {
    pub(crate) fn new(inner: R) -> Self {
        Lines { inner, since_end: 0 }
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.since_end = match buffer[..count].iter().rposition(|&byte| byte == b'\n') {
            Some(last) => count - last - 1,
            None => self.since_end + count,
        };
        if self.since_end > LONGEST_LINE {
            let what = format!("a line of more than {} MB, which no table has", LONGEST_LINE >> 20);
            return Err(io::Error::new(ErrorKind::InvalidData, what));
        }
        Ok(count)
    }
}
