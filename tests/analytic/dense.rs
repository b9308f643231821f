//! Dense output and the samples around events: they equal the run at the times of the run itself.

use crate::common::cases::{built_in, parsed};
use crate::common::truth;
use stickslip::Run;
use stickslip::SavedRun;
use stickslip::case::{Case, CaseSource};
use stickslip::model::system::System;
use stickslip::numerics::chebyshev::{COEFFICIENTS, place, value};
use stickslip::record::{
    Channels, DensePiece, Event, EventKind, MemoryRecorder, Recorder, RecorderError, Sample, Segment, State,
};
use stickslip::results::{EventSide, ResultFile};
use stickslip::simulation::natural_period;
use stickslip::simulation::{Around, Following, Method};

/// Columns with polynomials: the power is the product of two of them, and the last channel.
const COLUMNS: usize = State::COUNT + Channels::COUNT - 1;

/// A clutch that is engaged at once: it locks while engine and vehicle exchange momentum.
const CLUTCH: &str = r#"[rotor]
inertia = 0.2
end = "free"
torque = 80

[stator]
inertia = 1.5
end = "free"

[contact]
radius = 0.1
normal_force = 57e3

[friction]
law = "coulomb"
breakaway = 0.3
kinetic = 0.3

[initial]
speed = 200

[output]
end_time = 5
"#;

#[derive(Default)]
struct Followed {
    rows: MemoryRecorder,
    /// Start, end, segment, coefficients.
    pieces: Vec<(f64, f64, u32, Vec<f64>)>,
}

impl Recorder for Followed {
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.rows.sample(sample)
    }
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.rows.event(event)
    }
    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.rows.segment(segment)
    }
    fn piece(&mut self, piece: &DensePiece<'_>) -> Result<(), RecorderError> {
        self.pieces
            .push((piece.start, piece.end, piece.segment, piece.coefficients.to_vec()));
        Ok(())
    }
}

fn columns(sample: &Sample) -> [f64; COLUMNS] {
    let (state, channels) = (sample.state.values(), sample.channels.values());
    std::array::from_fn(|k| {
        if k < State::COUNT {
            state[k]
        } else {
            channels[k - State::COUNT]
        }
    })
}

fn followed(case: &Case) -> Followed {
    let mut followed = Followed::default();
    Run::new(case).record(&mut followed).start().unwrap();
    followed
}

fn paper(overrides: &[&str]) -> Case {
    built_in("paper-si", overrides)
}

fn trains(source: &CaseSource, overrides: &[&str]) -> Vec<f64> {
    let overrides = parsed(overrides);
    let case = Case::read(source, &overrides).unwrap();
    let threshold = case.threshold;
    let mut recorder = MemoryRecorder::default();
    let run = Run::of_system(&case.system, threshold, &case.solver, &case.output);
    run.record(&mut recorder).start().unwrap();
    recorder.samples.iter().map(|sample| sample.time).collect()
}

/// A case of trains also has dense samples around its events, even in a slip that is short compared with the interval
/// of the samples, of trains without a natural period.
#[test]
fn analytic_a_short_slip_of_trains_has_samples() {
    let times = trains(&CaseSource::text(CLUTCH), &[]);
    // The torque of the contact is 1710 N m: 200 rad/s/(1710/0.2 - 80/0.2 + 1710/1.5) rad/s^2 = 21.5 ms. Twenty
    // samples between its ends; the first is at t = 0 and the last is an event.
    let locked = 200.0 / (1710.0 / 0.2 - 80.0 / 0.2 + 1710.0 / 1.5);
    let inside = times.iter().filter(|t| **t > 0.0 && **t < locked).count();
    assert!(inside >= 19, "{inside} samples in {locked} s");
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
}

/// A run that would have more samples around its events than a file can have is dense at its beginning and at its end.
#[test]
fn property_too_many_samples_around_events_are_the_first_and_the_last() {
    // 16 periods of the mass on its spring, with 1e5 samples each.
    let belt = CaseSource::built_in("belt-coulomb").unwrap();
    let times = trains(&belt, &["output.samples_per_period=1e5"]);
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    // 5001 plain samples and 300,000 others, minus those lost to rounding and to equal times.
    assert!((299_000..=305_002).contains(&times.len()), "{}", times.len());
    let count = |from: f64, to: f64| times.iter().filter(|t| **t >= from && **t < to).count();
    // 150,000 samples are 0.94 s of this belt.
    assert!(count(0.0, 0.8) > 100_000, "{}", count(0.0, 0.8));
    assert!(count(9.2, 10.0) > 100_000, "{}", count(9.2, 10.0));
    assert_eq!(count(4.0, 5.0), 500);
}

/// The samples of a window come from the engines themselves, at times that the fit of the pieces did not use. The
/// error of each channel is relative to the channel's largest value. The energy residual is a difference of sums known
/// to that accuracy.
#[test]
fn analytic_every_channel_is_that_of_the_run_at_every_time() {
    for method in [Method::Arkode, Method::Series, Method::Cvode] {
        let mut case = paper(&["output.dense=true"]);
        case.solver.method = method;
        let run = followed(&case);
        let got = run.pieces.len();
        assert!(got < 20_000, "{}: {got} pieces", method.name());
        assert_eq!(run.pieces[0].0, 0.0);
        assert_eq!(run.pieces.last().unwrap().1, case.output.end_time);
        for pair in run.pieces.windows(2) {
            assert_eq!(pair[0].1, pair[1].0, "there is no gap");
        }
        // No piece crosses an event.
        for event in &run.rows.events {
            let mut pieces = run.pieces.iter();
            let over = pieces.find(|piece| piece.0 < event.time && event.time < piece.1);
            assert!(over.is_none(), "{event:?}");
        }
        let mut largest = [0.0f64; COLUMNS];
        for sample in &run.rows.samples {
            for (largest, value) in largest.iter_mut().zip(columns(sample)) {
                *largest = largest.max(value.abs());
            }
        }
        let residual = COLUMNS - 1;
        largest[residual] = largest[State::COUNT + 4];
        let mut worst = (0.0, 0, 0.0);
        for sample in &run.rows.samples {
            let index = run.pieces.partition_point(|piece| piece.0 <= sample.time).max(1) - 1;
            let (start, end, segment, coefficients) = &run.pieces[index];
            assert_eq!(*segment, sample.segment, "{}", sample.time);
            let x = place(sample.time, *start, *end);
            for (k, expected) in columns(sample).into_iter().enumerate() {
                let found = value(&coefficients[k * COEFFICIENTS..][..COEFFICIENTS], x);
                let error = (found - expected).abs() / largest[k].max(f64::MIN_POSITIVE);
                if error > worst.0 {
                    worst = (error, k, sample.time);
                }
            }
        }
        println!("{}: {} pieces, {worst:?}", method.name(), run.pieces.len());
        // States inside a step of the SUNDIALS solvers are smooth to a part of the tolerance of 1e-10.
        let bound = if method == Method::Series { 2e-12 } else { 3e-11 };
        assert!(worst.0 < bound, "{}: {worst:?}", method.name());
    }
}

/// Dense output changes no bit of any event.
#[test]
fn regression_events_are_those_of_the_run_that_is_not_followed() {
    for method in [Method::Arkode, Method::Series, Method::CvodeBdf] {
        let mut case = paper(&["output.window=[]", "output.around=\"none\""]);
        case.solver.method = method;
        let plain = followed(&case);
        case.output.follow = Following {
            around: Some(Around::Events),
            dense: true,
            ..Following::default()
        };
        let with = followed(&case);
        assert_eq!(plain.rows.events, with.rows.events);
        assert_eq!(plain.rows.segments, with.rows.segments);
        // The plain samples are among the others.
        let mut all = with.rows.samples.iter();
        for sample in &plain.rows.samples {
            assert!(all.any(|other| other == sample), "{}", sample.time);
        }
    }
}

/// A case without windows has dense samples around its events: a hundred in a natural period.
#[test]
fn property_samples_follow_the_events_of_a_case_without_windows() {
    let case = paper(&["output.window=[]"]);
    assert_eq!(case.output.follow.around, Some(Around::Events));
    let run = followed(&case);
    let period = natural_period(&case.system).unwrap();
    let times: Vec<f64> = run.rows.samples.iter().map(|sample| sample.time).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!((times[0], *times.last().unwrap()), (0.0, case.output.end_time));
    for event in &run.rows.events {
        let (from, to) = ((event.time - 20.0 * period).max(0.0), event.time + 20.0 * period);
        let inside = times.partition_point(|t| *t < from)..times.partition_point(|t| *t <= to);
        let gaps = times[inside.clone()].windows(2).map(|pair| pair[1] - pair[0]);
        let widest = gaps.fold(0.0, f64::max);
        let found = inside.len() as f64;
        assert!(found > 99.0 * (to - from) / period, "{event:?}: {}", inside.len());
        assert!(widest < 1.01 * period / 100.0, "{event:?}: {widest:e}");
    }
    assert!(times.len() < 100_000, "{}", times.len());

    // Times increase for any interval of the plain samples, and for any ratio of the margin to the steps.
    for (interval, margin) in [(1e-3, 5e-3), (2e-4, 1e-3), (5e-3, 1e-3), (1e-2, 3e-2), (1.0, 1e-4)] {
        for (name, method) in [
            ("paper", Method::Arkode),
            ("release", Method::Arkode),
            ("unperturbed", Method::Series),
        ] {
            let overrides = [
                "output.window=[]".to_owned(),
                format!("output.interval={interval}"),
                format!("output.margin={margin}"),
            ];
            let overrides = overrides.each_ref().map(String::as_str);
            let mut case = built_in(name, &overrides);
            case.solver.method = method;
            let run = followed(&case);
            let times: Vec<f64> = run.rows.samples.iter().map(|sample| sample.time).collect();
            let back = times.windows(2).find(|pair| pair[0] >= pair[1]);
            assert!(back.is_none(), "{name}, {interval}, {margin}: {back:?}");
            let plain = (case.output.end_time / interval) as usize + 1;
            assert!(times.len() >= plain, "{name}: {} of {plain}", times.len());
        }
    }

    // After the last dense samples the plain ones continue.
    let case = paper(&[
        "output.window=[]",
        "output.samples_per_period=2e4",
        "output.interval=1e-3",
    ]);
    let run = followed(&case);
    let times: Vec<f64> = run.rows.samples.iter().map(|sample| sample.time).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    assert!((300_000..311_000).contains(&times.len()), "{}", times.len());
    assert_eq!(*times.last().unwrap(), case.output.end_time);

    // Around the first stick alone.
    let case = paper(&[
        "output.window=[]",
        "output.around=\"onset\"",
        "output.margin=1e-3",
        "output.samples_per_period=40",
    ]);
    let run = followed(&case);
    let events = run.rows.events;
    let onset = events.iter().find(|event| event.kind == EventKind::Stick).unwrap().time;
    let near = run
        .rows
        .samples
        .iter()
        .filter(|sample| (sample.time - onset).abs() < 1e-3)
        .count();
    let expected = 2e-3 / (period / 40.0);
    assert!((near as f64 - expected).abs() < 2.5, "{near}, {expected}");
    assert!(run.rows.samples.len() < near + 1010);
}

/// The multiprecision truth has states between the events, where this run has no sample. After the onset of the
/// truth's own noise-free growth the run is as close to it as its events are.
#[test]
fn multiprecision_states_between_the_samples_are_the_oracles() {
    let truth = truth("si-kick");
    let mut case = paper(&["output.window=[]", "output.dense=true"]);
    case.system = System::from(&truth.parameters);
    case.output.end_time = truth.end_time;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.h5");
    SavedRun::new(&case, &path).start().unwrap();
    let file = ResultFile::open(&path).unwrap();
    let dense = file.dense().unwrap().unwrap();
    assert_eq!(dense.span(), Some((0.0, case.output.end_time)));
    let mut compared = 0;
    for sample in &truth.samples {
        if sample.time > case.output.end_time {
            continue;
        }
        for (name, expected) in &sample.state {
            // The scale of each channel: the size of a twist, an angle per turn of the fast mode, a speed.
            let (name, scale) = match name.as_str() {
                "stator_twist" => ("phi1", 1e-5),
                "rotor_twist" => ("rotor_twist", 1e-5),
                "z" => ("z", 1e-5),
                name => (name, 1.0),
            };
            let found = dense.values(name, &[sample.time], EventSide::After).unwrap()[0];
            let error = (found - expected).abs() / scale;
            println!("{name} at {}: {found:e}, off by {error:.1e} of {scale:e}", sample.time);
            assert!(error < 1e-8, "{name} at {}: {found} {expected}", sample.time);
            compared += 1;
        }
    }
    assert!(compared > 20, "{compared}");
    // At an event, each side has its own value: where the surfaces stick, the friction torque jumps.
    let events = file.events().unwrap();
    let stick = events.into_iter().find(|event| event.kind == EventKind::Stick).unwrap();
    let torque = |side| dense.values("friction_torque", &[stick.time], side).unwrap()[0];
    assert!((torque(EventSide::Before) - torque(EventSide::After)).abs() > 0.1);
    let before = stick.before;
    for (name, before) in [
        ("theta_dot", before.theta_dot),
        ("phi1", before.phi1),
        ("rotor_twist_rate", before.rotor_twist_rate),
    ] {
        let found = dense.values(name, &[stick.time], EventSide::Before).unwrap()[0];
        let off = (found - before).abs();
        assert!(off <= 1e-12 * before.abs().max(1e-3), "{name}: {found} {before}");
    }
    assert!(dense.values("no_such", &[1.0], EventSide::After).is_err());
    assert!(
        dense
            .values("z", &[case.output.end_time + 1.0], EventSide::After)
            .unwrap()[0]
            .is_nan()
    );
}
