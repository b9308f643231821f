//! Chunks as HDF5 stores them: its filters shuffle, deflate and Fletcher-32 in this order, applied outside of the library.
//!
//! The library's own deflate is zlib, which takes twice the instructions of libdeflate and clears its tables anew for each
//! chunk. Readers undo the filters as those of any other file.

use libdeflater::{CompressionLvl, Compressor};

use super::raw::Rows;
use super::values::Number;

/// The smallest level does nearly all that can be done to shuffled doubles, at a third of the time.
pub(super) const DEFLATE_LEVEL: u8 = 1;

/// The first two bytes of a zlib stream: deflate with a window of 32 KiB, compressed fast.
const ZLIB_HEADER: [u8; 2] = [0x78, 0x01];

/// The longest block that deflate stores as it is, bytes.
const LONGEST_STORED: usize = 65_535;

/// Bytes of a plane that are looked at: evenly spread, so that a stretch of equal values is met.
const LOOKED_AT: usize = 512;

/// Pairs of equal bytes among them that say that a plane is no noise. Of noise they are 511 on average, with a standard
/// deviation of 23.
const NOISE_PAIRS: u32 = 600;

/// Packs chunks, and writes them.
pub(super) struct Packer {
    compressor: Compressor,
    shuffled: Vec<u8>,
    packed: Vec<u8>,
}

impl Packer {
    pub(super) fn new() -> Self {
        Packer {
            compressor: Compressor::new(CompressionLvl::new(DEFLATE_LEVEL.into()).unwrap_or_default()),
            shuffled: Vec::new(),
            packed: Vec::new(),
        }
    }

    /// Writes the chunk of `dataset` that begins at row `start` and has `length` rows: `values`, and zeros where the rows
    /// end before.
    pub(super) fn write<T: Number>(
        &mut self,
        dataset: &Rows,
        start: usize,
        length: usize,
        values: &[T],
    ) -> hdf5::Result<()> {
        self.shuffled.resize(size_of::<T>() * length, 0);
        shuffle(values, length, &mut self.shuffled);
        let size = self.deflate(length)?;
        dataset.write_chunk(start, &self.packed[..size])
    }

    /// Packs the planes of so many bytes, and returns the length of what is packed.
    ///
    /// The last places of a measured or computed number are noise: a third of the planes, which no compression makes
    /// shorter. They come first, and are stored as they are.
    fn deflate(&mut self, plane: usize) -> hdf5::Result<usize> {
        let noise = self
            .shuffled
            .chunks_exact(plane)
            .take_while(|plane| is_noise(plane))
            .count();
        let (stored, rest) = self.shuffled.split_at(noise * plane);
        let blocks = stored.chunks(LONGEST_STORED);
        let most = ZLIB_HEADER.len() + stored.len() + 5 * blocks.len();
        let most = most + self.compressor.deflate_compress_bound(rest.len()) + 8;
        if self.packed.len() < most {
            self.packed.resize(most, 0);
        }
        let packed = &mut self.packed[..];
        let mut end = 0;
        put(packed, &mut end, &ZLIB_HEADER);
        for block in blocks {
            // Not the last block, stored; its length, and the complement of that.
            let length = block.len() as u16;
            put(packed, &mut end, &[0]);
            put(packed, &mut end, &length.to_le_bytes());
            put(packed, &mut end, &(!length).to_le_bytes());
            put(packed, &mut end, block);
        }
        let deflated = self.compressor.deflate_compress(rest, &mut packed[end..]);
        end += deflated.map_err(|error| error.to_string())?;
        put(packed, &mut end, &libdeflater::adler32(&self.shuffled).to_be_bytes());
        let sum = fletcher32(&packed[..end]);
        put(packed, &mut end, &sum.to_le_bytes());
        Ok(end)
    }
}

/// Writes bytes behind those that are there, which end at `end`.
fn put(packed: &mut [u8], end: &mut usize, bytes: &[u8]) {
    packed[*end..*end + bytes.len()].copy_from_slice(bytes);
    *end += bytes.len();
}

/// A plane for each byte of the values, `length` bytes long, with zeros behind the values.
fn shuffle<T: Number>(values: &[T], length: usize, planes: &mut [u8]) {
    let (blocks, rest) = values.as_chunks::<8>();
    for (block, start) in blocks.iter().zip((0..).step_by(8)) {
        let bytes = transposed(block.map(T::bytes));
        for (plane, bytes) in planes.chunks_exact_mut(length).zip(bytes) {
            plane[start..start + 8].copy_from_slice(&bytes.to_le_bytes());
        }
    }
    let start = values.len() - rest.len();
    for (plane, k) in planes.chunks_exact_mut(length).zip(0..) {
        plane[start..].fill(0);
        for (byte, value) in plane[start..].iter_mut().zip(rest) {
            *byte = value.bytes().to_le_bytes()[k];
        }
    }
}

/// The transpose of eight rows of eight bytes, by halves, quarters and eighths.
fn transposed(mut rows: [u64; 8]) -> [u64; 8] {
    for (apart, mask) in [(4, 0xffff_ffff_u64), (2, 0xffff_0000_ffff), (1, 0x00ff_00ff_00ff_00ff)] {
        for upper in (0..8).filter(|row| row & apart == 0) {
            let differing = ((rows[upper] >> (8 * apart)) ^ rows[upper + apart]) & mask;
            rows[upper + apart] ^= differing;
            rows[upper] ^= differing << (8 * apart);
        }
    }
    rows
}

/// Whether every byte is as frequent as any other, so that nothing can be gained by compression.
fn is_noise(plane: &[u8]) -> bool {
    let stride = plane.len() / LOOKED_AT;
    if stride == 0 {
        return false;
    }
    let mut counts = [0_u32; 256];
    let mut pairs = 0;
    for &byte in plane.iter().step_by(stride).take(LOOKED_AT) {
        let count = &mut counts[usize::from(byte)];
        pairs += *count;
        *count += 1;
    }
    pairs < NOISE_PAIRS
}

/// The checksum of HDF5's filter: Fletcher's of words of 16 bits, the high byte first. A sum that is a multiple of 65535 is
/// 65535 unless every word is 0.
///
/// Modulo 65535 a word with its bytes exchanged is 256 times the word, so that the sums are taken of the words as they lie.
fn fletcher32(bytes: &[u8]) -> u32 {
    let (words, last) = bytes.as_chunks::<2>();
    let (mut first, mut second) = (0_u64, 0_u64);
    // No sum of so many overflows.
    for words in words.chunks(1 << 16) {
        for &word in words {
            first += u64::from(u16::from_le_bytes(word));
            second += first;
        }
        (first, second) = (folded(first), folded(second));
    }
    if let [last] = last {
        first += u64::from(*last);
        second += first;
    }
    let [first, second] = [first, second].map(|sum| folded(256 * folded(sum)));
    (second << 16 | first) as u32
}

/// The remainder modulo 65535, of what is not 0 from 1 to 65535.
fn folded(sum: u64) -> u64 {
    match sum {
        0 => 0,
        _ => (sum - 1) % 65_535 + 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The sum as HDF5's documentation states it, word by word.
    fn by_words(bytes: &[u8]) -> u32 {
        let (mut first, mut second) = (0_u32, 0_u32);
        for pair in bytes.chunks(2) {
            let word = u32::from(pair[0]) << 8 | u32::from(pair.get(1).copied().unwrap_or(0));
            first += word;
            first = (first & 0xffff) + (first >> 16);
            second += first;
            second = (second & 0xffff) + (second >> 16);
        }
        second << 16 | first
    }

    proptest! {
        #[test]
        fn sums_are_those_of_single_words(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            prop_assert_eq!(fletcher32(&bytes), by_words(&bytes));
        }
    }

    #[test]
    fn sums_of_long_and_of_full_words() {
        for bytes in [vec![0; 300_000], vec![0xff; 300_001], vec![0xff; 2]] {
            assert_eq!(fletcher32(&bytes), by_words(&bytes));
        }
    }

    /// HDF5 itself undoes what is packed here, a chunk that is not full and one that is written again too.
    #[test]
    fn chunks_are_read_by_the_library() {
        let folder = tempfile::tempdir().unwrap();
        let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
        let mut packer = Packer::new();
        let values: Vec<f64> = (0..1000).map(|k| f64::from(k).sin()).collect();
        let dataset = super::super::table::compressed(&file)
            .chunk(64)
            .empty::<f64>()
            .shape(0..)
            .create("x")
            .and_then(Rows::new)
            .unwrap();
        for rows in [70, 100, 1000] {
            dataset.resize([rows]).unwrap();
            for (chunk, values) in values[..rows].chunks(64).enumerate() {
                packer.write(&dataset, 64 * chunk, 64, values).unwrap();
            }
            assert_eq!(dataset.read_raw::<f64>().unwrap(), values[..rows]);
        }
    }
}
