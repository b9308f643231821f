//! Chunks as HDF5 stores them. The filters shuffle, deflate and Fletcher-32 are applied outside the library, whose
//! zlib needs twice the instructions of libdeflate. Readers see ordinary filters.

use libdeflater::{CompressionLvl, Compressor};

use super::raw::RowRange;
use super::table::StoredNumber;

/// The lowest level compresses shuffled doubles almost as well as the others, in a third of the time.
pub(super) const DEFLATE_LEVEL: u8 = 1;

/// Start of a zlib stream: deflate with a window of 32 KiB, fast compression.
const ZLIB_HEADER: [u8; 2] = [0x78, 0x01];

const LONGEST_STORED: usize = 65_535;

/// Number of sampled bytes of a plane, evenly spread so that stretches of equal values are found.
const LOOKED_AT: usize = 512;

/// A plane with more pairs of equal sampled bytes than this is not noise. Noise has 511 +- 23 (standard deviation).
const NOISE_PAIRS: u32 = 600;

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

    /// Writes the chunk of `length` rows of `dataset` at row `start`: `values`, followed by zeros.
    pub(super) fn write<T: StoredNumber>(
        &mut self,
        dataset: &RowRange,
        start: usize,
        length: usize,
        values: &[T],
    ) -> hdf5::Result<()> {
        self.shuffled.resize(size_of::<T>() * length, 0);
        shuffle(values, length, &mut self.shuffled);
        let size = self.deflate(length)?;
        dataset.write_chunk(start, &self.packed[..size])
    }

    /// Packs planes of `plane` bytes, and returns the packed length. The last digits of a measured or computed value
    /// are noise: a third of the planes is incompressible. These planes come first, and are stored unchanged.
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
            // A stored block that is not the last: its length, and the complement of the length.
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

fn put(packed: &mut [u8], end: &mut usize, bytes: &[u8]) {
    packed[*end..*end + bytes.len()].copy_from_slice(bytes);
    *end += bytes.len();
}

/// Splits the values into planes of `length` bytes, one for each byte of a value, padded with zeros.
fn shuffle<T: StoredNumber>(values: &[T], length: usize, planes: &mut [u8]) {
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

/// Checksum of HDF5's Fletcher-32 filter: a sum of 16-bit words, high byte first. A multiple of 65535 becomes 65535
/// unless every word is 0. Swapping the bytes of a word is a multiplication by 256 modulo 65535, so that the words
/// are summed as they are stored.
pub fn fletcher32(bytes: &[u8]) -> u32 {
    let (words, last) = bytes.as_chunks::<2>();
    let (mut first, mut second) = (0_u64, 0_u64);
    // So few words cannot overflow the sum.
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

/// Remainder modulo 65535; from 1 to 65535 unless the sum is 0.
fn folded(sum: u64) -> u64 {
    match sum {
        0 => 0,
        _ => (sum - 1) % 65_535 + 1,
    }
}
