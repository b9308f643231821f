//! Reads a page as a browser does: the document in its script element, and the arrays in it. Written apart from
//! the program's encoder.

use crate::common::json::*;
use std::path::Path;

use base64::Engine;
use serde_json::Value;

/// The error that the page promises, as part of the range of a block.
pub const PROMISED: f64 = 1.0 / 8_388_608.0;

/// The page of a run: its text, its document, and the trajectory in that.
pub struct Page {
    pub html: String,
    pub run: Value,
    pub trajectory: Value,
}

/// The document of a page.
pub fn document(html: &str) -> Value {
    let (_, rest) = html
        .split_once("<script type=\"application/json\" id=\"page-data\">")
        .expect("the document");
    serde_json::from_str(rest.split_once("</script>").expect("its end").0).unwrap()
}

impl Page {
    pub fn read(path: &Path) -> Page {
        let html = std::fs::read_to_string(path).unwrap();
        let mut run = document(&html);
        let trajectory = run["trajectory"].take();
        Page { html, run, trajectory }
    }

    /// (values or least values for each entry, largest values for each bucket) of a channel.
    pub fn channel(&self, name: &str) -> (Vec<f64>, Vec<f64>) {
        let channels = self.trajectory["channels"].list();
        let channel = channels.with("name", name);
        let block = self.trajectory["block"].whole() as usize;
        (
            unpacked(&channel["value"], block),
            unpacked(&channel["bucket_high"], block),
        )
    }

    pub fn channel_names(&self) -> Vec<String> {
        let channels = self.trajectory["channels"].list();
        let values = channels.iter().map(|c| c["name"].text().to_owned());
        values.collect()
    }

    pub fn block(&self) -> usize {
        self.trajectory["block"].whole() as usize
    }

    pub fn times(&self) -> Vec<f64> {
        doubles(&self.trajectory["time"])
    }

    /// The rows of the file that each entry stands for, and whether it is a bucket. `times` are those of the file: an
    /// entry begins with the row of its time, and ends where the next begins.
    pub fn entries(&self, times: &[f64]) -> Vec<(std::ops::Range<usize>, bool)> {
        let row = |time: f64| {
            times
                .binary_search_by(|t| t.total_cmp(&time))
                .expect("a time of the file")
        };
        let mut starts: Vec<usize> = self.times().into_iter().map(row).collect();
        starts.push(times.len());
        let stretches = self.trajectory["stretches"].list();
        let buckets = stretches.iter().flat_map(|stretch| {
            let count = stretch["entries"].whole() as usize;
            std::iter::repeat_n(stretch["bucket"].as_bool().unwrap(), count)
        });
        let ranges = starts.windows(2).map(|pair| pair[0]..pair[1]);
        ranges.zip(buckets).collect()
    }
}

pub fn bytes(text: &Value) -> Vec<u8> {
    let text = text.text();
    base64::engine::general_purpose::STANDARD.decode(text).unwrap()
}

pub fn doubles(text: &Value) -> Vec<f64> {
    let bytes = bytes(text);
    let chunks_exact = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap()));
    chunks_exact.collect()
}

pub fn codes(text: &Value) -> Vec<i8> {
    bytes(text).into_iter().map(|byte| byte as i8).collect()
}

pub fn unpacked(packed: &Value, block: usize) -> Vec<f64> {
    let (bases, offsets) = (doubles(&packed["base"]), bytes(&packed["offset"]));
    let offsets = offsets
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()));
    offsets
        .enumerate()
        .map(|(i, offset)| bases[i / block] + f64::from(offset))
        .collect()
}

/// Holds `decoded` against the values in the file, block by block, to what the page promises.
pub fn assert_decoded(what: &str, decoded: &[f64], stored: &[f64], block: usize) {
    assert_eq!(decoded.len(), stored.len(), "{what}");
    for (decoded, stored) in decoded.chunks(block).zip(stored.chunks(block)) {
        let finite = || stored.iter().copied().filter(|v| v.is_finite());
        let range = finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min);
        for (&decoded, &stored) in decoded.iter().zip(stored) {
            // To which base and offset each add a rounding as a double, and single precision its least number.
            let tolerance = PROMISED * range + stored.abs() * f64::EPSILON + 1.5e-45;
            let same = decoded == stored || (decoded.is_nan() && stored.is_nan());
            assert!(
                same || (decoded - stored).abs() <= tolerance,
                "{what}: {decoded} for {stored}, range {range}"
            );
        }
    }
}
