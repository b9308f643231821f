//! A run as a function of time: its dense output if there is some, else the equations of motion between its samples.

use super::reference::Walk;
use super::{Channel, CompareError, Reference};
use stickslip_files::{DenseOutput, EventSide, ResultError};

/// Columns of a run's trajectory at increasing times. At the time of an event they have the values before it.
#[derive(Debug)]
pub struct Trajectory<'a> {
    reference: &'a Reference,
    columns: Vec<String>,
    source: TrajectorySource<'a>,
}

#[derive(Debug)]
enum TrajectorySource<'a> {
    Dense(DenseOutput<'a>),
    Equations(Box<Evaluator<'a>>),
}

/// Channels at increasing times by the equations of motion; never across an event.
///
/// Channels between two samples are Taylor series. The case is run again where an instability would amplify the rounding
/// of samples that are too far apart.
#[derive(Debug)]
pub(crate) struct Evaluator<'a> {
    walk: Walk<'a>,
    gap: Option<(f64, f64)>,
    sound: bool,
}

impl Reference {
    /// Whether [`Trajectory`] has this column of /trajectory; the others are known at the samples only.
    ///
    /// # Errors
    /// An unreadable file.
    pub fn evaluates(&self, column: &str) -> Result<bool, ResultError> {
        let of_axial = column == "applied_force" && self.physics.course.axial().is_some();
        let known = of_axial || matches!(column, "time" | "mode") || self.channel_of_column(column).is_some();
        Ok(known || self.dense()?.is_some())
    }

    /// Columns of /trajectory as functions of time, from the start of the run on. Without dense output, columns that the
    /// equations do not give are NaN.
    ///
    /// # Errors
    /// An unreadable file.
    pub fn trajectory(&self, columns: Vec<String>) -> Result<Trajectory<'_>, CompareError> {
        let source = match self.dense()? {
            Some(dense) => TrajectorySource::Dense(dense),
            None => {
                let channels = columns.iter().filter_map(|name| self.channel_of_column(name));
                let channels: Vec<Channel> = channels.collect();
                TrajectorySource::Equations(Box::new(self.evaluator(&channels)?))
            }
        };
        Ok(Trajectory {
            reference: self,
            columns,
            source,
        })
    }

    fn dense(&self) -> Result<Option<DenseOutput<'_>>, ResultError> {
        Ok(self.file.dense()?.filter(|dense| dense.covers(self.start, self.end)))
    }

    fn channel_of_column(&self, name: &str) -> Option<Channel> {
        // Without an axial mode z is an alias of the bristles' deflection, but the file's z is a displacement.
        if self.physics.course.axial().is_none() && matches!(name, "z" | "z_dot") {
            return None;
        }
        self.physics.vocabulary().find(name)
    }

    /// Times of the first and the last sample, s.
    pub fn times(&self) -> (f64, f64) {
        (self.start, self.end)
    }

    /// The result file.
    pub fn file(&self) -> &stickslip_files::ResultFile {
        &self.file
    }

    pub(super) fn was_repeated(&self) -> bool {
        self.rerun.was_made()
    }

    pub(super) fn evaluator(&self, channels: &[Channel]) -> Result<Evaluator<'_>, CompareError> {
        Ok(Evaluator {
            walk: self.walk(channels)?,
            gap: None,
            sound: false,
        })
    }

    pub(super) fn walk(&self, channels: &[Channel]) -> Result<Walk<'_>, ResultError> {
        Walk::new(&self.file, &self.physics, &self.rerun, &self.events, channels)
    }
}

impl Trajectory<'_> {
    /// The columns at `times` (s), which must not decrease, also not from call to call.
    ///
    /// # Errors
    /// A time outside the samples, or between samples that are too far apart in a run that cannot be repeated; an unreadable
    /// file.
    pub fn at(&mut self, times: &[f64]) -> Result<Vec<Vec<f64>>, CompareError> {
        let evaluator = match &mut self.source {
            TrajectorySource::Dense(dense) => {
                let values = |name: &String| dense.column(name, times, EventSide::Before);
                return Ok(self.columns.iter().map(values).collect::<Result<_, _>>()?);
            }
            TrajectorySource::Equations(evaluator) => evaluator,
        };
        let axial = self.reference.physics.course.axial();
        let mut values = vec![0.0; evaluator.walk.channels().len()];
        let mut block = vec![Vec::with_capacity(times.len()); self.columns.len()];
        for &time in times {
            if !evaluator.known_at(time, &mut values)? {
                return Err(self.reference.unknown_at(time, evaluator.gap));
            }
            let mut next = values.iter();
            for (name, column) in self.columns.iter().zip(&mut block) {
                column.push(match name.as_str() {
                    "time" => time,
                    "mode" => f64::from(evaluator.walk.mode().code()),
                    "applied_force" => axial.map_or(f64::NAN, |axial| axial.at(time).force),
                    name if self.reference.channel_of_column(name).is_some() => {
                        next.next().copied().unwrap_or(f64::NAN)
                    }
                    _ => f64::NAN,
                });
            }
        }
        Ok(block)
    }

    /// The source of the values, in words.
    pub fn source(&self) -> &'static str {
        match self.source {
            TrajectorySource::Dense(_) => "by the dense output of the run",
            TrajectorySource::Equations(_) if self.reference.was_repeated() => {
                "by the equations of motion between the samples of the run, which was repeated where they are sparse"
            }
            TrajectorySource::Equations(_) => "by the equations of motion between the samples of the run",
        }
    }
}

impl Reference {
    fn unknown_at(&self, time: f64, gap: Option<(f64, f64)>) -> CompareError {
        let path = self.file.path();
        let (what, remedy) = match gap {
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
                    path.display()
                ),
            ),
        };
        CompareError::whole(path, what, remedy)
    }
}

impl Evaluator<'_> {
    /// The values of the channels in their order at `time` (s), which must not decrease; `false` if they are unknown, which
    /// is outside of the run and between samples that are too far apart.
    pub(super) fn known_at(&mut self, time: f64, values: &mut [f64]) -> Result<bool, ResultError> {
        if self.gap.is_none_or(|(_, to)| time > to) {
            self.gap = self.walk.at(time)?.map(|(from, to, _)| (from, to));
            self.sound = self.gap.is_some() && self.walk.expand();
        }
        let Some((from, to)) = self.gap.filter(|&(from, to)| self.sound || time == from || time == to) else {
            return Ok(false);
        };
        let part = if to > from { (time - from) / (to - from) } else { 0.0 };
        for (value, curve) in values.iter_mut().zip(&self.walk.curves) {
            *value = curve.at(part);
        }
        Ok(true)
    }
}
