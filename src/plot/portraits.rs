//! Phase portraits in windows that follow from events, and the amplitudes of spirals.

use super::entry::{CatalogueEntry, Drawn, FigureForm, PORTRAIT, Subject, Undrawn, entry, too_sparse};
use super::own::phase_of_each;
use super::run::{DrawnRun, SAMPLES_PER_PERIOD};
use crate::Error;
use stickslip_analysis::analysis::stability::Modes;
use stickslip_system::model::system::{End, System, Train};

/// Number of turns of the slow swing that are shown of the last stick.
const SWINGS: f64 = 20.0;

/// Amplitudes of a channel in a window, turn by turn, in its unit.
///
/// # Errors
/// The channel is unknown, the window contains no sample, or the file is unreadable.
pub fn turn_amplitudes(run: &DrawnRun, channel: &str, window: (f64, f64)) -> Result<Vec<f64>, Error> {
    let mut turns = Turns::default();
    run.each_sample(&[channel], window, |row| turns.push(row[0]))?;
    Ok(turns.amplitudes())
}

/// A portrait of a spiral. The title of a single run says whether the spiral converges.
pub(super) fn spiral(
    entry: &CatalogueEntry,
    subject: &Subject,
    axes: (&str, &str),
    windows: &[Option<(f64, f64)>],
) -> Drawn {
    let factor = match (subject.runs, windows) {
        ([run], [Some(window)]) => factor_per_turn(&turn_amplitudes(run, axes.1, *window)?),
        _ => None,
    };
    let title = match factor {
        Some(factor) if factor > 1.0 => format!("{}: diverges, ×{factor:.3} per turn", entry.title),
        Some(factor) => format!("{}: converges, ×{factor:.3} per turn", entry.title),
        None => entry.title.to_owned(),
    };
    Ok(phase_of_each(subject.runs, entry.name, &title, axes, windows)?)
}

/// Portrait of at least two turns of the last stick, as long as the samples resolve the rotor's swing on both
/// springs. This swing is about twenty times slower than the surfaces' own mode, and decays as slowly.
pub(super) fn final_stick(entry: &CatalogueEntry, subject: &Subject, axes: (&str, &str)) -> Drawn {
    spiral(entry, subject, axes, &subject.windows(swings)?)
}

fn swings(subject: &Subject) -> Result<(f64, f64), Undrawn> {
    let start = subject.final_stick.ok_or("the run does not end in a stick")?;
    let states = Modes::linear(&subject.run.system).states;
    let in_stick = states.iter().filter(|state| state.state == "stick");
    let modes = in_stick.flat_map(|state| &state.modes);
    let slowest = modes.filter_map(|mode| mode.frequency).reduce(f64::min);
    let slow = slowest.ok_or("the rotor does not swing: it is overdamped")?;
    let window = (start, start + SWINGS / slow);
    match subject.run.dense_until(window, 1.0 / (slow * SAMPLES_PER_PERIOD))? {
        Some(end) if end - start > 2.0 / slow => Ok((start, end)),
        _ => Err(too_sparse(window, 1.0 / slow).into()),
    }
}

/// Figures of a motion that does not stop.
pub const ENTRIES: &[CatalogueEntry] = &[entry(
    PORTRAIT,
    "Relative velocity over position",
    FigureForm::Own(portrait),
)];

/// A bounded position of a surface relative to the far end of its train. It is the stator's if the stator has shafts.
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

fn portrait(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
    let ShownPortrait { axes, window, periodic } = shown(subject.run);
    let over = format!("Relative velocity over {}", subject.run.axis(axes.0)?.name);
    let mut title = if periodic { format!("{over}, last period") } else { over };
    if let Some(few) = few_samples(subject.run, window)? {
        title = format!("{title}; {few}");
    }
    let windows: Vec<Option<(f64, f64)>> = subject.runs.iter().map(|run| Some(shown(run).window)).collect();
    Ok(phase_of_each(subject.runs, entry.name, &title, axes, &windows)?)
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShownPortrait {
    pub(super) axes: (&'static str, &'static str),
    /// Start and end, s.
    pub(super) window: (f64, f64),
    pub(super) periodic: bool,
}

const MANY: usize = 60;

pub(super) fn few_samples(run: &DrawnRun, window: (f64, f64)) -> Result<Option<String>, Error> {
    let samples = run.rows_in(window)?.len();
    let few = || format!("it has {samples} samples, joined by straight lines; a smaller output.interval gives more");
    Ok((samples < MANY).then(few))
}

pub(super) fn shown(run: &DrawnRun) -> ShownPortrait {
    let (first, last) = run.times;
    let period = run.attractor_period.filter(|period| *period < last - first);
    // One more sample closes the curve.
    let begin = |period: f64| (last - period - run.case.output.interval).max(first);
    ShownPortrait {
        axes: (position(&run.system), "relative_velocity"),
        window: (period.map_or(first, begin), last),
        periodic: period.is_some(),
    }
}

/// Amplitudes of an oscillation, from its samples in order. A turn lasts from one maximum to the next. Its amplitude
/// is half of the distance between the mean of the maxima and the minimum between them.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    previous: Option<f64>,
    rising: bool,
    top: Option<f64>,
    bottom: f64,
    amplitudes: Vec<f64>,
}

/// Turns smaller than this, relative to the largest, are rounding.
const NOISE: f64 = 1e-9;

impl Turns {
    /// Adds a sample.
    pub fn push(&mut self, value: f64) {
        let Some(previous) = self.previous.replace(value) else {
            self.bottom = value;
            return;
        };
        if self.rising && value < previous {
            // The previous sample was a maximum.
            if let Some(top) = self.top {
                self.amplitudes.push((0.5 * (top + previous) - self.bottom) / 2.0);
            }
            self.top = Some(previous);
            self.bottom = value;
        }
        if value != previous {
            self.rising = value > previous;
        }
        self.bottom = self.bottom.min(value);
    }

    /// Amplitudes of all complete turns, in the unit of the samples.
    pub fn amplitudes(&self) -> Vec<f64> {
        let largest = self.amplitudes.iter().copied().fold(0.0, f64::max);
        let heard = |a: &f64| *a > NOISE * largest;
        self.amplitudes.iter().copied().filter(heard).collect()
    }
}

/// Geometric mean of the ratios of successive amplitudes. The spiral diverges above 1. `None` below two turns.
pub fn factor_per_turn(amplitudes: &[f64]) -> Option<f64> {
    let (first, last) = (amplitudes.first()?, amplitudes.last()?);
    (amplitudes.len() > 1).then(|| (last / first).powf(1.0 / (amplitudes.len() - 1) as f64))
}
