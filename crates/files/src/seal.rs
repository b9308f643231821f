//! Seal of a file: its last line holds the CRC-32 of all bytes before it.
//!
//! HDF5 has no checksum for most of its metadata. The line follows the HDF5 file, so that damage is found without
//! HDF5. HDF5 ignores the line, and cuts it off when it opens the file for changes. A missing line is no damage.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

const START: &str = "stickslip CRC-32 ";
const LENGTH: usize = START.len() + 9;
/// Bytes from which on a truncated line is recognised.
const SHORTEST: usize = 6;
const BLOCK: usize = 1 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seal {
    /// The file has no seal: it is of an earlier version, changed by another program, or left by a killed run.
    Absent,
    Intact,
    Broken,
}

pub(super) fn write(path: &Path) -> io::Result<()> {
    let mut file = OpenOptions::new().read(true).append(true).open(path)?;
    let length = file.metadata()?.len();
    let line = line(sum(&mut file, length)?);
    let written = file.write_all(line.as_bytes());
    if written.is_err() {
        // Half a line would make an intact file look damaged.
        let _ = file.set_len(length);
    }
    written
}

pub(super) fn read(path: &Path) -> io::Result<Seal> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    if let Some(end) = end_of_hdf5(&mut file)?
        && end.checked_add(LENGTH as u64).is_some_and(|end| end < length)
        && line_at(&mut file, end)?.starts_with(START.as_bytes())
    {
        // HDF5 would not notice the appended bytes.
        return Ok(Seal::Broken);
    }
    let Some(length) = length.checked_sub(LENGTH as u64) else {
        return Ok(Seal::Absent);
    };
    let last = line_at(&mut file, length)?;
    if !is_line(&last) {
        return Ok(Seal::Absent);
    }
    file.rewind()?;
    let sound = last == *line(sum(&mut file, length)?).as_bytes();
    Ok(if sound { Seal::Intact } else { Seal::Broken })
}

/// End of the HDF5 file according to its superblock.
fn end_of_hdf5(file: &mut File) -> io::Result<Option<u64>> {
    let mut head = [0; 48];
    file.rewind()?;
    if file.metadata()?.len() < head.len() as u64 {
        return Ok(None);
    }
    file.read_exact(&mut head)?;
    // The offset depends on the superblock's version. Addresses have eight bytes.
    let at = match head[8] {
        0 if head[13] == 8 => 40,
        2 | 3 if head[9] == 8 => 28,
        _ => return Ok(None),
    };
    Ok(head[at..].first_chunk().map(|end| u64::from_le_bytes(*end)))
}

fn line_at(file: &mut File, place: u64) -> io::Result<[u8; LENGTH]> {
    file.seek(SeekFrom::Start(place))?;
    let mut line = [0; LENGTH];
    file.read_exact(&mut line)?;
    Ok(line)
}

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
