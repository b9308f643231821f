//! A made-up run to feed a recorder with: no solver, but rows of every kind.

use std::path::Path;

use libtest_mimic::{Completion, Failed};
use stickslip::model::Mode;
use stickslip::record::{Channels, Counters, Cycle, Event, EventKind, Recorder, RecorderError, Sample, Segment, State};
use stickslip::results::{AttributeValue, Extra, Header, Overwrite, ResultWriter, Status, StickSlipTable};

pub use stickslip::record::MemoryRecorder as Rows;

fn state(seed: f64) -> State {
    State::from_values(std::array::from_fn(|k| {
        (seed * (k as f64 + 1.0)).sin() * 10_f64.powi(k as i32 - 6)
    }))
}

/// The sample at a row, of channels that a compressor cannot guess.
pub fn sample(row: usize) -> Sample {
    let seed = row as f64;
    let mut state = state(seed);
    let mut channels = Channels::from_values(std::array::from_fn(|k| (seed + k as f64).cos() * 1e3));
    // What a careless writer loses.
    match row {
        3 => state.z = f64::NAN,
        4 => state.z = -0.0,
        5 => channels.normal_force = f64::INFINITY,
        6 => channels.energy_residual = f64::MIN_POSITIVE / 8.0,
        _ => {}
    }
    Sample {
        time: seed * 1e-4,
        mode: Mode::ALL[row / 100 % 4],
        segment: (row / 100) as u32,
        state,
        channels,
    }
}

pub fn event(number: usize) -> Event {
    let seed = number as f64 + 0.5;
    Event {
        time: seed * 1e-2,
        kind: EventKind::ALL[number % 9],
        mode_after: Mode::ALL[number % 4],
        segment: number as u32,
        before: state(seed),
        after: state(-seed),
        internal_force: 1e3 / seed,
    }
}

pub fn segment(number: usize) -> Segment {
    let steps = number as u64 * 17;
    Segment {
        start: number as f64 * 1e-2,
        end: (number + 1) as f64 * 1e-2,
        mode: Mode::ALL[number % 4],
        solver: ["cvode-bdf", "cvode-adams", "erk", "esdirk", "closed-form"][number % 5],
        resolved: None,
        counters: Counters {
            steps,
            rhs_evaluations: steps * 9,
            jacobian_evaluations: steps / 10,
            linear_solver_setups: steps / 5,
            error_test_failures: steps / 3,
            nonlinear_iterations: steps * 2,
            nonlinear_convergence_failures: 1,
            root_evaluations: 5 << 33,
            last_order: number as u32 % 6,
            last_step: 1e-6 / (number as f64 + 1.0),
        },
    }
}

/// Records `count` samples with an event and a segment every 100 of them.
pub fn record(recorder: &mut dyn Recorder, count: usize) -> Result<(), RecorderError> {
    for row in 0..count {
        recorder.sample(&sample(row))?;
        if row % 100 == 99 {
            recorder.segment(&segment(row / 100))?;
            recorder.event(&event(row / 100))?;
        }
    }
    Ok(())
}

pub fn header() -> Header {
    Header {
        title: "A made-up brake µ".to_owned(),
        source: "stickslip 0.0.0".to_owned(),
        references: "doi:10.1155/2016/9275147".to_owned(),
        history: "2024-01-01T00:00:00Z stickslip run made-up.toml".to_owned(),
        case_text: "title = \"A made-up brake µ\"\n[axial]\nmass = 4.54 # kg\n".to_owned(),
        resolved: format!("# {}\n[axial]\nmass = 4.54\n", "padding ".repeat(20_000)),
        events: Vec::new(),
        extension: Default::default(),
        meta: vec![
            (
                "program".to_owned(),
                AttributeValue::Text("stickslip 0.0.0 (0123abc)".to_owned()),
            ),
            ("method".to_owned(), AttributeValue::Text("arkode".to_owned())),
            ("rtol".to_owned(), AttributeValue::Number(1e-10)),
        ],
        ..Header::default()
    }
}

fn cycle(stick_duration: f64, slip_duration: f64, period: f64) -> Cycle {
    Cycle {
        stick_duration,
        slip_duration,
        period,
    }
}

pub fn stick_slip() -> StickSlipTable {
    // In alphabetical order, in which they are read.
    let attributes = [
        ("e_folds_gained", "1", 14.25),
        ("energy_residual_max", "J", -0.0),
        ("final_stick_time", "s", 6.9896),
        ("first_period", "s", 2.4e-4),
        ("growth_exponent", "1", f64::NAN),
        ("last_period", "s", 2.41e-4),
        ("natural_period", "s", 2.406e-4),
        ("onset_time", "s", 6.975),
        ("slip_count", "1", 3.0),
        ("stick_count", "1", 4.0),
        ("stick_growth", "s-1", 3.5),
    ];
    let attributes = attributes.map(|(name, unit, value)| Extra {
        whole: name.ends_with("_count"),
        ..Extra::new(name, unit, "made up", Some(value))
    });
    StickSlipTable {
        cycles: vec![
            cycle(5e-5, 1.9e-4, 2.4e-4),
            cycle(6e-5, 1.8e-4, 2.4e-4),
            cycle(7e-5, 1.7e-4, f64::NAN),
        ],
        attributes: attributes.into(),
    }
}

/// A complete file of `count` samples.
pub fn write(path: &Path, count: usize) {
    let mut writer = ResultWriter::create(path, Overwrite::OwnResults, &[], &header()).unwrap();
    record(&mut writer, count).unwrap();
    let written = writer.finish(Status::Complete, &stick_slip(), 0.25).unwrap();
    assert_eq!(written, path);
}

/// Bit by bit, so that NaN equals NaN and -0.0 does not equal 0.0.
pub fn bits(rows: &Rows) -> (Vec<Vec<u64>>, Vec<Vec<u64>>, Vec<String>) {
    let sample = |row: &Sample| {
        let head = [row.time.to_bits(), row.mode.code() as u64, u64::from(row.segment)];
        let values = row.state.values().into_iter().chain(row.channels.values());
        let rest = values.map(f64::to_bits);
        head.into_iter().chain(rest).collect()
    };
    let event = |row: &Event| {
        let head = [
            row.time.to_bits(),
            row.kind.code() as u64,
            row.mode_after.code() as u64,
            u64::from(row.segment),
        ];
        let values = row.before.values().into_iter().chain(row.after.values());
        let rest = values.chain([row.internal_force]);
        head.into_iter().chain(rest.map(f64::to_bits)).collect()
    };
    // Debug prints a double so that it reads back the same.
    let segments = rows.segments.iter().map(|row| format!("{row:?}")).collect();
    (
        rows.samples.iter().map(sample).collect(),
        rows.events.iter().map(event).collect(),
        segments,
    )
}

/// How a test ends that this machine cannot run: ignored, for the reason given; failed where STICKSLIP_IGNORE_NONE says
/// that all is there.
pub fn missing(reason: &str) -> Result<Completion, Failed> {
    if std::env::var_os("STICKSLIP_IGNORE_NONE").is_some() {
        return Err(format!("{reason}, and STICKSLIP_IGNORE_NONE is set").into());
    }
    Ok(Completion::ignored_with(reason))
}
