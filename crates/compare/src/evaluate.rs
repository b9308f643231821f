//! A run as a function of time: its channels at any time, by the equations of motion between its samples.

use super::reference::{GapPolynomial, Walk};
use super::{Channel, CompareError, Reference};
use std::path::PathBuf;
use stickslip_files::ResultError;
use stickslip_system::model::Mode;

/// Evaluates channels of a run at increasing times; never across an event.
///
/// Channels between two samples are Taylor series of the equations of motion. The case is run again where an
/// instability would amplify the rounding of samples that are too far apart. Values at the time of an event are those
/// just before it.
#[derive(Debug)]
pub struct Evaluator<'a> {
    path: PathBuf,
    walk: Walk<'a>,
    channels: Vec<Channel>,
    curves: Vec<GapPolynomial>,
    gap: Option<(f64, f64)>,
    mode: Mode,
    sound: bool,
}

impl Reference {
    /// The channel of a variable of /trajectory; `None` for variables that are known at the samples only.
    pub fn channel_of_column(&self, name: &str) -> Option<Channel> {
        let vocabulary = self.physics.vocabulary();
        // Without an axial mode z is an alias of the bristles' deflection, but the file's z is a displacement.
        if self.physics.course.axial().is_none() && matches!(name, "z" | "z_dot") {
            return None;
        }
        vocabulary.find(name)
    }

    /// The actuating force F of the axial mode at a time (s), N; `None` without an axial mode.
    pub fn applied_force(&self, time: f64) -> Option<f64> {
        self.physics.course.axial().map(|axial| axial.at(time).force)
    }

    /// Times of the first and the last sample, s.
    pub fn times(&self) -> (f64, f64) {
        (self.start, self.end)
    }

    /// Whether the run was repeated where its samples are too sparse.
    pub fn was_repeated(&self) -> bool {
        self.rerun.was_made()
    }

    /// The result file.
    pub fn file(&self) -> &stickslip_files::ResultFile {
        &self.file
    }

    /// An evaluator of channels that begins at the start of the run.
    pub fn evaluator(&self, channels: &[Channel]) -> Result<Evaluator<'_>, CompareError> {
        Ok(Evaluator {
            path: self.file.path().to_owned(),
            walk: self.walk()?,
            channels: channels.to_vec(),
            curves: Vec::new(),
            gap: None,
            mode: Mode::Separated,
            sound: false,
        })
    }

    pub(super) fn walk(&self) -> Result<Walk<'_>, ResultError> {
        Walk::new(&self.file, &self.physics, &self.rerun, &self.events)
    }
}

impl Evaluator<'_> {
    /// The mode, and the values of the channels in their order, at `time` (s). Times must not decrease.
    ///
    /// # Errors
    /// A time outside the samples, or between samples that are too far apart in a run that cannot be repeated; an unreadable
    /// file.
    pub fn at(&mut self, time: f64, values: &mut [f64]) -> Result<Mode, CompareError> {
        if self.known_at(time, values)? {
            return Ok(self.mode);
        }
        let (what, remedy) = match self.gap {
            None => (
                format!("the run has no state at t = {time:?} s"),
                "ask for times from its first to its last sample".to_owned(),
            ),
            Some((from, to)) => (
                format!(
                    "the samples at t = {from:?} s and {to:?} s are too far apart for the equations of motion to lead from one to \
                     the other"
                ),
                format!(
                    "repeat the run with polynomials, which give every channel at every time: stickslip run {} --set \
                     output.dense=true",
                    self.path.display()
                ),
            ),
        };
        Err(CompareError::whole(&self.path, what, remedy))
    }

    /// Like [`Self::at`]; `false` if the values are unknown, which is outside of the run and between samples that are
    /// too far apart.
    pub(super) fn known_at(&mut self, time: f64, values: &mut [f64]) -> Result<bool, ResultError> {
        if self.gap.is_none_or(|(_, to)| time > to) {
            self.gap = self.walk.at(time)?.map(|(from, to, _)| (from, to));
            self.mode = self.walk.mode();
            self.sound = self.gap.is_some() && self.walk.curves(&self.channels, &mut self.curves).unwrap_or(false);
        }
        let Some((from, to)) = self.gap.filter(|&(from, to)| self.sound || time == from || time == to) else {
            return Ok(false);
        };
        let part = if to > from { (time - from) / (to - from) } else { 0.0 };
        for (value, curve) in values.iter_mut().zip(&self.curves) {
            *value = curve.at(part);
        }
        Ok(true)
    }
}
