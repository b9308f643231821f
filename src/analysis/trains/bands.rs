//! How far the rows of a trajectory of two trains can be off: by the runs of the ladder, row by row at the same time.
//!
//! A row is held against that of another run where both are in the same stretch between events and in the same mode. A row that
//! is nearer to an event than the uncertainty of its time may be on the other side of it; no band tells of that.

use crate::analysis::bands::{Bands, ChannelBand, Stretch, roundings, same_row};
use crate::analysis::verdict::{CertifiedEvent, Verdict};
use crate::case::Case;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::trains::system::TrainSystem;
use crate::provenance::extension;
use crate::record::{Event, EventKind, MemoryRecorder, Sample, State};
use crate::results::schema::extended_tables;
use crate::simulation::trains::Excitation;

/// A row of a trajectory: state, channels, and the further columns, in the order of a file.
struct Row {
    /// s.
    time: f64,
    mode: Mode,
    values: Vec<f64>,
}

fn rows_of(record: &MemoryRecorder) -> Vec<Row> {
    let row = |(index, sample): (usize, &Sample)| Row {
        time: sample.time,
        mode: sample.mode,
        values: record.values(index),
    };
    record.samples.iter().enumerate().map(row).collect()
}

/// Name and unit of every column of a row.
pub fn columns(case: &Case) -> impl Iterator<Item = (String, String)> + use<> {
    let [trajectory, ..] = extended_tables(&extension(case));
    // Time, mode and segment stand before the values.
    let first = State::DESCRIPTIONS[0].0;
    let variables = trajectory.variables.into_iter().skip_while(move |v| v.name != first);
    variables.map(|variable| (variable.name, variable.units.to_owned()))
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
fn difference(rows: &[Row], other: &[Row], (start, end): (f64, f64)) -> Option<Vec<f64>> {
    let from = other.partition_point(|row| row.time <= start);
    let to = other.partition_point(|row| row.time < end);
    let mut theirs = other[from..to.max(from)].iter().peekable();
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

/// The bands of a result, whose events are so well known, by the runs of the ladder that share no errors with it: the sum of
/// the distances to the two nearest, and the rounding of the channel or of what it is the difference of.
pub(in crate::analysis) fn bands(
    case: &Case,
    result: &MemoryRecorder,
    known: &[CertifiedEvent],
    others: &[&MemoryRecorder],
) -> Bands {
    let names: Vec<(String, String)> = columns(case).collect();
    let own = rows_of(result);
    let uncertainty = |event: &CertifiedEvent| (event.verdict == Verdict::Converged).then_some(event.uncertainty);
    let uncertainties: Vec<Option<f64>> = known.iter().map(uncertainty).collect();
    // Of each other run the events that are the result's, from the first on.
    let agrees = |(own, other): &(&Event, &Event)| own.kind == other.kind && own.mode_after == other.mode_after;
    let others: Vec<(usize, &[Event], Vec<Row>)> = others
        .iter()
        .map(|other| {
            let agreeing = result.events.iter().zip(&other.events).take_while(agrees).count();
            (agreeing, other.events.as_slice(), rows_of(other))
        })
        .collect();
    if own.is_empty() {
        return Bands::default();
    }
    let end_time = case.output.end_time;
    let mut largest = vec![0.0f64; names.len()];
    for row in &own {
        for (largest, value) in largest.iter_mut().zip(&row.values) {
            *largest = largest.max(value.abs());
        }
    }
    // The kinetic energies at the kicks, of which the rows tell, and by how much a kick may exceed theirs.
    let of = |wanted: &str| {
        let found = names.iter().position(|(name, _)| name == wanted);
        found.map_or(0.0, |column| largest[column])
    };
    let kicks = result
        .events
        .iter()
        .filter(|event| event.kind == EventKind::Kick)
        .count();
    let at_kicks = 2.0 * kicks as f64 * (of("energy_kinetic") + of("work_perturbation"));
    // The normal force is a sum of signals, which may be far larger than it is while the contact is closed.
    let system = TrainSystem::new(&case.system);
    let force = Excitation::new(&case.system).largest_force();
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
    let first_mode = own[0].mode;
    let stretches: Vec<Stretch> = (0..=result.events.len())
        .filter_map(|index| {
            let (start, end) = span(&result.events, index, end_time)?;
            // The run up to the first event that is not converged, and no further.
            let converged = uncertainties.iter().take(index + 1).all(Option::is_some);
            let ends = &uncertainties[index.saturating_sub(1)..uncertainties.len().min(index + 1)];
            let from = own.partition_point(|row| row.time <= start);
            let to = own.partition_point(|row| row.time < end);
            let rows = &own[from..to.max(from)];
            let mut distances: Vec<Vec<f64>> = others
                .iter()
                // The stretch to an event that the other run does not have is another stretch.
                .filter(|(agreeing, events, _)| {
                    index < *agreeing || (index == result.events.len() && events.len() == result.events.len())
                })
                .filter_map(|(_, events, other)| difference(rows, other, span(events, index, end_time)?))
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
            Some(Stretch {
                start,
                end,
                mode: match index {
                    0 => first_mode,
                    _ => result.events[index - 1].mode_after,
                },
                time_uncertainty: match converged {
                    true => ends.iter().flatten().copied().fold(0.0, f64::max),
                    false => f64::NAN,
                },
                converged,
                bands,
                rates: Vec::new(),
            })
        })
        .collect();
    // A stretch with rows that no two runs bear out leaves the channel open.
    let over = |column: usize| {
        let rows_of = |stretch: &&Stretch| {
            let from = own.partition_point(|row| row.time <= stretch.start);
            own.get(from).is_some_and(|row| row.time < stretch.end)
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
    let channels = names.into_iter().enumerate().map(|(column, (name, unit))| {
        let band = over(column).filter(|band| !band.is_nan()).unwrap_or(f64::INFINITY);
        ChannelBand {
            name,
            unit,
            band,
            at_fixed_time: band,
            largest: largest[column],
        }
    });
    Bands {
        channels: channels.collect(),
        stretches,
    }
}
