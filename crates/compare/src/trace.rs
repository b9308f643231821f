//! Samples of a candidate with its reference at the same times, for figures.

use super::candidate::Block;
use super::{Candidate, Channel, CompareError, Mapping, Reference};
use std::path::Path;

/// A sample of a candidate.
#[derive(Debug, Clone, Copy)]
pub struct SamplePair<'a> {
    /// Time, s.
    pub time: f64,
    /// Candidate's channels, in SI units, in the order of [`Reference::traced`].
    pub candidate: &'a [f64],
    /// Reference's channels at that time; `None` outside the reference, and where it is unknown between samples.
    pub reference: Option<&'a [f64]>,
}

impl Reference {
    /// The time scale, s.
    pub fn natural_period(&self) -> f64 {
        self.physics.natural_period()
    }

    /// The channels of a candidate that [`Self::trace`] gives; none for an event table.
    ///
    /// # Errors
    /// If the candidate cannot be read.
    pub fn traced(&self, path: &Path, mapping: &Mapping) -> Result<Vec<Channel>, CompareError> {
        let candidate = Candidate::open(path, mapping, &self.physics)?;
        Ok(match candidate.has_rows() {
            true => of_rows(candidate.channels(&self.physics)),
            false => Vec::new(),
        })
    }

    /// Passes every sample of a candidate to `take`, with the reference at the same time. Errors of states in a
    /// comparison are timed from the last matched event instead.
    ///
    /// # Errors
    /// If the candidate or the reference cannot be read.
    pub fn trace(&self, path: &Path, mapping: &Mapping, take: &mut dyn FnMut(SamplePair)) -> Result<(), CompareError> {
        let candidate = Candidate::open(path, mapping, &self.physics)?;
        if !candidate.has_rows() {
            return Ok(());
        }
        let channels = of_rows(candidate.channels(&self.physics));
        let mut reference = self.evaluator(&channels)?;
        let mut rows = candidate.rows(&channels, &self.physics)?;
        let mut block = Block::default();
        let (mut own, mut other) = (vec![0.0; channels.len()], vec![0.0; channels.len()]);
        while rows.next(&mut block)? {
            for (row, &time) in block.time.iter().enumerate() {
                for (value, column) in own.iter_mut().zip(&block.columns) {
                    *value = column[row];
                }
                let known = reference.known_at(time, &mut other)?;
                take(SamplePair {
                    time,
                    candidate: &own,
                    reference: known.then_some(&other[..]),
                });
            }
        }
        Ok(())
    }
}

fn of_rows(mut channels: Vec<Channel>) -> Vec<Channel> {
    channels.retain(|channel| !channel.is_impulse());
    channels
}
