//! Phase portraits, each in the window that the events give it.

use super::entry::{Entry, NO_CYCLE, Outcome, PORTRAIT, Subject, View, too_sparse};
use super::error::PlotError;
use super::own::phase;
use super::run::{Run, SAMPLES_PER_PERIOD};
use super::spiral::{Turns, factor_per_turn};
use crate::analysis::stability::SystemModes;
use crate::model::system::{End, System, Train};

/// Turns of the fast mode that a portrait shows before the first stick.
const TURNS: f64 = 24.0;
/// Turns of the slow swing that a portrait shows of the last stick.
const SWINGS: f64 = 20.0;

/// Amplitudes turn by turn of a channel in a window.
///
/// # Errors
/// Unknown channel, no sample in the window, or a file that cannot be read.
pub fn turn_amplitudes(run: &Run, channel: &str, window: (f64, f64)) -> Result<Vec<f64>, PlotError> {
    let mut turns = Turns::default();
    run.each_sample(&[channel], window, |row| turns.push(row[0]))?;
    Ok(turns.amplitudes())
}

/// A portrait of a spiral: of a single run, whether it converges stands in its title.
fn spiral(entry: &Entry, subject: &Subject, axes: (&str, &str), window: (f64, f64)) -> Result<Outcome, PlotError> {
    let factor = match subject.runs {
        [run] => factor_per_turn(&turn_amplitudes(run, axes.1, window)?),
        _ => None,
    };
    let title = match factor {
        Some(factor) if factor > 1.0 => format!("{}: diverges, ×{factor:.3} per turn", entry.title),
        Some(factor) => format!("{}: converges, ×{factor:.3} per turn", entry.title),
        None => entry.title.to_owned(),
    };
    phase(subject.runs, entry.name, &title, axes, window).map(Ok)
}

fn in_window(entry: &Entry, subject: &Subject, axes: (&str, &str), view: View) -> Result<Outcome, PlotError> {
    match subject.resolved(view)? {
        Ok(window) => spiral(entry, subject, axes, window),
        Err(reason) => Ok(Err(reason)),
    }
}

pub(super) fn after_corner(
    entry: &Entry,
    subject: &Subject,
    axes: (&str, &str),
    period: f64,
) -> Result<Outcome, PlotError> {
    let corner = subject.last_corner();
    let view = corner.map(|corner| ((corner, corner + 6.0 * subject.axial_period), period));
    in_window(entry, subject, axes, view)
}

pub(super) fn before_onset(entry: &Entry, subject: &Subject, axes: (&str, &str)) -> Result<Outcome, PlotError> {
    let (onset, period) = (subject.first_stick(), subject.period);
    in_window(
        entry,
        subject,
        axes,
        onset.map(|onset| ((onset - TURNS * period, onset), period)),
    )
}

/// From the first stick to the last: no spiral, but an orbit for each cycle.
pub(super) fn during(entry: &Entry, subject: &Subject, axes: (&str, &str)) -> Result<Outcome, PlotError> {
    let end = subject.end();
    let view = subject.first_stick().and_then(|onset| match end <= onset {
        true => Err(NO_CYCLE.into()),
        false => Ok(((onset, end), subject.period)),
    });
    match subject.resolved(view)? {
        Ok(window) => phase(subject.runs, entry.name, entry.title, axes, window).map(Ok),
        Err(reason) => Ok(Err(reason)),
    }
}

/// The last stick, as long as the samples resolve the swing of the rotor on both springs, which is some twenty times
/// slower than the surfaces' own mode and decays as slowly; two turns at least.
pub(super) fn final_stick(entry: &Entry, subject: &Subject, axes: (&str, &str)) -> Result<Outcome, PlotError> {
    let Some(start) = subject.final_stick else {
        return Ok(Err("the run does not end in a stick".into()));
    };
    let states = SystemModes::of_case(&subject.run.system).states;
    let in_stick = states.iter().filter(|state| state.state == "stick");
    let frequencies = in_stick
        .flat_map(|state| &state.modes)
        .filter_map(|mode| mode.frequency);
    let Some(slow) = frequencies.reduce(f64::min) else {
        return Ok(Err("the rotor does not swing: it is overdamped".into()));
    };
    let window = (start, start + SWINGS / slow);
    match subject.run.dense_until(window, 1.0 / (slow * SAMPLES_PER_PERIOD))? {
        Some(end) if end - start > 2.0 / slow => spiral(entry, subject, axes, (start, end)),
        _ => Ok(Err(too_sparse(window, 1.0 / slow))),
    }
}

/// The figures of a motion that does not stop.
pub const ENTRIES: &[Entry] = &[Entry {
    name: PORTRAIT,
    title: "Relative velocity over position",
    paper_figure: None,
    draw: portrait,
}];

/// The bounded position of a surface, beside the far end of its train: the stator's if that has shafts.
fn position(trains: &System) -> &'static str {
    let is_fixed = |train: &Train| matches!(train.end, End::Fixed) && !train.is_rigid();
    if is_fixed(&trains.stator) {
        "phi1"
    } else if trains.stator.shafts() > 0 {
        "stator_twist_0"
    } else if is_fixed(&trains.rotor) {
        "phi2"
    } else if trains.rotor.shafts() > 0 {
        "rotor_twist_0"
    } else {
        "slip_displacement"
    }
}

/// Over the last period of a motion that repeats itself, else over the whole run.
fn portrait(entry: &Entry, subject: &Subject) -> Result<Outcome, PlotError> {
    let Shown { axes, window, periodic } = shown(subject.run);
    let over = format!("Relative velocity over {}", subject.run.axis(axes.0)?.name);
    let mut title = if periodic { format!("{over}, last period") } else { over };
    if let Some(few) = few_samples(subject.run, window)? {
        title = format!("{title}; {few}");
    }
    phase(subject.runs, entry.name, &title, axes, window).map(Ok)
}

/// What the phase portrait of a run shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shown {
    /// Two channels: that of the horizontal axis and that of the vertical one.
    pub(super) axes: (&'static str, &'static str),
    /// When it begins and ends, s.
    pub(super) window: (f64, f64),
    /// Whether that is one period of a motion that repeats itself.
    pub(super) periodic: bool,
}

/// Samples from which on a portrait is seen as a curve.
const MANY: usize = 60;

/// What is to be said of a portrait in a window with few samples.
pub(super) fn few_samples(run: &Run, window: (f64, f64)) -> Result<Option<String>, PlotError> {
    let samples = run.rows_in(window)?.len();
    let few = || format!("it has {samples} samples, joined by straight lines; a smaller output.interval gives more");
    Ok((samples < MANY).then(few))
}

/// What the phase portrait of a run shows.
pub(super) fn shown(run: &Run) -> Shown {
    let (first, last) = run.times;
    let axes = (position(&run.system), "relative_velocity");
    match run.attractor_period {
        Some(period) if period < last - first => Shown {
            axes,
            // One sample more, so that it closes.
            window: ((last - period - run.case.output.interval).max(first), last),
            periodic: true,
        },
        _ => Shown {
            axes,
            window: (first, last),
            periodic: false,
        },
    }
}
