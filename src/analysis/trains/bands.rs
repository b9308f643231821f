//! How far the rows of a trajectory of two trains can be off: by the runs of the ladder, row by row at the same time.
//!
//! A row is held against that of another run where both are in the same stretch between events and in the same mode. A row that
//! is nearer to an event than the uncertainty of its time may be on the other side of it; no band tells of that.

use crate::analysis::bands::{Compared, compared_output, roundings, same_row};
use crate::case::TrainCase;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::trains::system::TrainSystem;
use crate::provenance::extension;
use crate::record::{Channels, Event, EventKind, Recorder, RecorderError, Sample, Segment, State};
use crate::results::schema::extended_tables;
use crate::results::{BandColumns, ResultError, ResultFile};
use crate::simulation::OutputOptions;
use crate::simulation::trains::Excitation;

/// Rows of a file that are read together.
const ROWS_AT_A_TIME: usize = 65_536;

/// A row of a trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainRow {
    /// s.
    pub time: f64,
    /// What the contact does.
    pub mode: Mode,
    /// State, channels, and the further columns, in the order of a file.
    pub values: Vec<f64>,
}

/// The events of a run, and those of its rows that are compared.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrainRecord {
    /// All, in order of time.
    pub events: Vec<Event>,
    /// In order of time; none where only the events are of interest.
    pub rows: Vec<TrainRow>,
    further: Vec<f64>,
}

impl TrainRecord {
    /// A run of which the events alone are known.
    pub fn of_events(events: Vec<Event>) -> TrainRecord {
        TrainRecord {
            events,
            ..TrainRecord::default()
        }
    }

    /// What is certified of a result file of this case.
    ///
    /// # Errors
    /// If the file cannot be read, or holds numbers that are none.
    pub fn read(file: &ResultFile, case: &TrainCase) -> Result<TrainRecord, ResultError> {
        let mut compared = Compared::new(&compared_output(&case.output));
        let further: Vec<String> = columns(case)
            .skip(State::COUNT + Channels::COUNT)
            .map(|(name, _)| name)
            .collect();
        let count = file.sample_count()?;
        let mut rows = Vec::new();
        for from in (0..count).step_by(ROWS_AT_A_TIME) {
            let range = from..count.min(from + ROWS_AT_A_TIME);
            let samples = file.finite_samples(range.clone())?;
            let beyond = further.iter().map(|name| file.column(name, range.clone()));
            let beyond = beyond.collect::<Result<Vec<_>, _>>()?;
            for (index, sample) in samples.iter().enumerate() {
                if compared.takes(sample.time) {
                    let further = beyond.iter().map(|column| column[index]);
                    rows.push(TrainRow::new(sample, further));
                }
            }
        }
        Ok(TrainRecord {
            rows,
            ..TrainRecord::of_events(file.events()?)
        })
    }
}

impl TrainRow {
    fn new(sample: &Sample, further: impl IntoIterator<Item = f64>) -> TrainRow {
        let known = sample.state.values().into_iter().chain(sample.channels.values());
        TrainRow {
            time: sample.time,
            mode: sample.mode,
            values: known.chain(further).collect(),
        }
    }
}

impl Recorder for TrainRecord {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.clear();
        self.further.extend_from_slice(values);
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.rows.push(TrainRow::new(sample, self.further.iter().copied()));
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.events.push(*event);
        Ok(())
    }

    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }
}

/// Name and unit of every column of a row.
fn columns(case: &TrainCase) -> impl Iterator<Item = (String, String)> {
    let [trajectory, ..] = extended_tables(&extension(case));
    // Time, mode and segment stand before the values.
    let first = State::DESCRIPTIONS[0].0;
    let variables = trajectory.variables.into_iter().skip_while(move |v| v.name != first);
    variables.map(|variable| (variable.name, variable.units.to_owned()))
}

/// The stretch before an event, from the one before it; the last goes to the end of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainStretch {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
    /// What the contact does in it.
    pub mode: Mode,
    /// The larger uncertainty of the events at its ends, s; NaN where the stretch is not converged.
    pub time_uncertainty: f64,
    /// For each column, in its unit: how far the exact solution can be at the time of a row. NaN where nothing can be said.
    pub bands: Vec<f64>,
}

/// How far a channel of the trajectory can be off, over all stretches that are converged.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainBand {
    /// Of the channel.
    pub name: String,
    /// UDUNITS.
    pub unit: String,
    /// In that unit; infinite if nothing can be said.
    pub band: f64,
    /// Largest magnitude of the channel in the rows.
    pub largest: f64,
}

/// The bands of a result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrainBands {
    /// One for each event, and one to the end of the run.
    pub stretches: Vec<TrainStretch>,
    /// Of each column.
    pub channels: Vec<TrainBand>,
}

/// The rows that are compared, as [`compared_output`] has it.
pub(super) fn output(case: &TrainCase) -> OutputOptions {
    compared_output(&case.output)
}

/// Start and end of the stretch of this index in a run with these events; `None` where it has not so many.
fn span(events: &[Event], index: usize, end: f64) -> Option<(f64, f64)> {
    let start = match index {
        0 => 0.0,
        _ => events.get(index - 1)?.time,
    };
    Some((start, events.get(index).map_or(end, |event| event.time)))
}

/// Largest differences of each column between the rows of a stretch and those of another run; `None` without a row in common.
fn difference(rows: &[TrainRow], other: &TrainRecord, (start, end): (f64, f64)) -> Option<Vec<f64>> {
    let from = other.rows.partition_point(|row| row.time <= start);
    let to = other.rows.partition_point(|row| row.time < end);
    let mut theirs = other.rows[from..to.max(from)].iter().peekable();
    let mut largest: Option<Vec<f64>> = None;
    for row in rows {
        while theirs
            .next_if(|near| near.time < row.time && !same_row(near.time, row.time))
            .is_some()
        {}
        let Some(near) = theirs
            .peek()
            .filter(|near| same_row(near.time, row.time) && near.mode == row.mode)
        else {
            continue;
        };
        let largest = largest.get_or_insert_with(|| vec![0.0; row.values.len()]);
        for (largest, (own, other)) in largest.iter_mut().zip(row.values.iter().zip(&near.values)) {
            *largest = largest.max((own - other).abs());
        }
    }
    largest
}

/// The bands of a result, whose events have these uncertainties (s; `None`: not converged), by the runs of the ladder that share no errors with it, of which each is given with the events that
/// agree with the result's: the sum of the distances to the two nearest, and the rounding of the channel or of what it is the difference of.
pub(super) fn bands(
    case: &TrainCase,
    own: &TrainRecord,
    uncertainties: &[Option<f64>],
    others: &[(usize, TrainRecord)],
) -> TrainBands {
    let names: Vec<(String, String)> = columns(case).collect();
    if own.rows.is_empty() {
        return TrainBands::default();
    }
    let end_time = case.output.end_time;
    let mut largest = vec![0.0f64; names.len()];
    for row in &own.rows {
        for (largest, value) in largest.iter_mut().zip(&row.values) {
            *largest = largest.max(value.abs());
        }
    }
    // The kinetic energies at the kicks, of which the rows tell, and by how much a kick may exceed theirs.
    let of = |wanted: &str| {
        let found = names.iter().position(|(name, _)| name == wanted);
        found.map_or(0.0, |column| largest[column])
    };
    let kicks = own.events.iter().filter(|event| event.kind == EventKind::Kick).count();
    let at_kicks = 2.0 * kicks as f64 * (of("energy_kinetic") + of("work_perturbation"));
    // The normal force is a sum of signals, which may be far larger than it is while the contact is closed.
    let system = TrainSystem::new(&case.parameters);
    let force = Excitation::new(&case.parameters).largest_force();
    let coefficient = system
        .breakaway
        .max(system.law.typical_coefficient(of("relative_velocity")));
    let terms = [
        ("applied_force", force),
        ("normal_force", force),
        ("friction_torque", coefficient * system.radius * force),
    ];
    let size = |((name, _), largest): (&(String, String), &f64)| {
        let of_terms = terms.iter().find(|(of, _)| of == name);
        of_terms.map_or(*largest, |(_, size)| largest.max(*size))
    };
    let sizes: Vec<f64> = names.iter().zip(&largest).map(size).collect();
    let least = roundings(names.iter().map(|(name, _)| name.as_str()), &sizes, at_kicks);
    let first_mode = own.rows[0].mode;
    let stretches: Vec<TrainStretch> = (0..=own.events.len())
        .filter_map(|index| {
            let (start, end) = span(&own.events, index, end_time)?;
            // The run up to the first event that is not converged, and no further.
            let converged = uncertainties.iter().take(index + 1).all(Option::is_some);
            let ends = &uncertainties[index.saturating_sub(1)..uncertainties.len().min(index + 1)];
            let from = own.rows.partition_point(|row| row.time <= start);
            let to = own.rows.partition_point(|row| row.time < end);
            let rows = &own.rows[from..to.max(from)];
            let mut distances: Vec<Vec<f64>> = others
                .iter()
                // The stretch to an event that the other run does not have is another stretch.
                .filter(|(agreeing, other)| {
                    index < *agreeing || (index == own.events.len() && other.events.len() == own.events.len())
                })
                .filter_map(|(_, other)| difference(rows, other, span(&other.events, index, end_time)?))
                .collect();
            let bands = (0..names.len())
                .map(|column| {
                    distances.sort_by(|a, b| a[column].total_cmp(&b[column]));
                    match &distances[..] {
                        [nearest, second, ..] if converged => nearest[column] + second[column] + least[column],
                        _ => f64::NAN,
                    }
                })
                .collect();
            Some(TrainStretch {
                start,
                end,
                mode: match index {
                    0 => first_mode,
                    _ => own.events[index - 1].mode_after,
                },
                time_uncertainty: match converged {
                    true => ends.iter().flatten().copied().fold(0.0, f64::max),
                    false => f64::NAN,
                },
                bands,
            })
        })
        .collect();
    // A stretch with rows that no two runs bear out leaves the channel open.
    let over = |column: usize| {
        let rows_of = |stretch: &&TrainStretch| {
            let from = own.rows.partition_point(|row| row.time <= stretch.start);
            own.rows.get(from).is_some_and(|row| row.time < stretch.end)
        };
        let converged = stretches.iter().filter(|stretch| !stretch.time_uncertainty.is_nan());
        let bands = converged.filter(rows_of).map(|stretch| stretch.bands[column]);
        bands.reduce(|one, other| {
            if one.is_nan() || other.is_nan() {
                f64::NAN
            } else {
                one.max(other)
            }
        })
    };
    let channels = names.into_iter().enumerate().map(|(column, (name, unit))| TrainBand {
        name,
        unit,
        band: over(column).filter(|band| !band.is_nan()).unwrap_or(f64::INFINITY),
        largest: largest[column],
    });
    TrainBands {
        channels: channels.collect(),
        stretches,
    }
}

impl TrainBands {
    /// For the file.
    pub(super) fn columns(&self) -> Vec<BandColumns> {
        let column = |(index, channel): (usize, &TrainBand)| BandColumns {
            name: channel.name.clone(),
            unit: channel.unit.clone(),
            band: self.stretches.iter().map(|stretch| stretch.bands[index]).collect(),
            rate: None,
        };
        self.channels.iter().enumerate().map(column).collect()
    }
}
