//! The last line of a file: the CRC-32 of all bytes before it.
//!
//! HDF5 keeps no checksum of most of what it needs to find values and attributes. The line is not part of the HDF5 file
//! but follows it, so that any damage to that file is found without HDF5. HDF5 ignores the line, and cuts it off when
//! it opens the file to change it: a file without the line is not damaged for that.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

const START: &str = "stickslip CRC-32 ";
/// Bytes of the line: its start, eight digits, and the end of the line.
const LENGTH: usize = START.len() + 9;
/// Of a line whose end is lost, fewer bytes can be by chance.
const SHORTEST: usize = 6;
/// Bytes read at a time.
const BLOCK: usize = 1 << 20;

/// What the last line says of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seal {
    /// There is none: an earlier version wrote the file, another program has changed it, or its run was killed.
    Absent,
    /// Every byte is as it was written.
    Intact,
    /// Some byte is not.
    Broken,
}

/// Seals a file that is whole and closed.
///
/// # Errors
/// Of the operating system.
pub(super) fn write(path: &Path) -> io::Result<()> {
    let mut file = OpenOptions::new().read(true).append(true).open(path)?;
    let length = file.metadata()?.len();
    let line = line(sum(&mut file, length)?);
    let written = file.write_all(line.as_bytes());
    if written.is_err() {
        // Half a line would condemn a file that is whole without it.
        let _ = file.set_len(length);
    }
    written
}

/// Reads the whole file, if it has a seal.
///
/// # Errors
/// Of the operating system.
pub(super) fn read(path: &Path) -> io::Result<Seal> {
    let mut file = File::open(path)?;
    let Some(length) = file.metadata()?.len().checked_sub(LENGTH as u64) else {
        return Ok(Seal::Absent);
    };
    file.seek(SeekFrom::Start(length))?;
    let mut last = [0; LENGTH];
    file.read_exact(&mut last)?;
    if !is_line(&last) {
        return Ok(Seal::Absent);
    }
    file.rewind()?;
    let sound = last == *line(sum(&mut file, length)?).as_bytes();
    Ok(if sound { Seal::Intact } else { Seal::Broken })
}

/// Whether these last bytes are a line, or were one: damage to the line, or a lost end of it, does not hide it.
fn is_line(last: &[u8; LENGTH]) -> bool {
    let alike = |lost: usize| {
        last[lost..]
            .iter()
            .zip(START.bytes())
            .filter(|(a, b)| **a == *b)
            .count()
    };
    2 * alike(0) >= START.len() || (1..=LENGTH - SHORTEST).any(|lost| alike(lost) == START.len().min(LENGTH - lost))
}

fn line(sum: u32) -> String {
    format!("{START}{sum:08x}\n")
}

/// The CRC-32 of the next `length` bytes.
fn sum(file: &mut File, length: u64) -> io::Result<u32> {
    let mut sum = crc32fast::Hasher::new();
    let mut left = file.take(length);
    let mut block = vec![0; BLOCK.min(length as usize)];
    loop {
        match left.read(&mut block)? {
            0 => return Ok(sum.finalize()),
            count => sum.update(&block[..count]),
        }
    }
}
