//! Points of a critical curve: runs a second on one thread and on two, what writing takes of it, and a run by its phases.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use stickslip::results::{Overwrite, SweepHeader};
use stickslip::simulation::{Event, EventKind, Recorder, RecorderError, Sample, Segment, simulate};
use stickslip::sweep::{Study, StudySource, SweepOptions, run_points, sweep, without_a_file};

/// Points on both sides of the critical curve, as its tracing asks for them.
fn study(method: &str, count: usize) -> Study {
    let text = format!(
        "case = \"paper\"\n[keep]\nevents = true\n[set]\nsolver.method = \"{method}\"\n\
         perturbation = [{{ kind = \"kick\", time = \"instability\", relative_velocity = 1e-6 }}]\n\
         [sample]\nmethod = \"sobol\"\ncount = {count}\n\
         [[axis]]\nkey = \"friction.decay\"\nfrom = 1\nto = 200\nspacing = \"log\"\n\
         [[axis]]\nkey = \"torsion.damping\"\nfrom = 10\nto = 60\n"
    );
    let source = StudySource {
        text,
        path: None,
        name: "bench".to_owned(),
    };
    Study::parse(source, &[]).expect("a valid study")
}

/// Stamps the kick and the last stick.
#[derive(Default)]
struct Stopwatch {
    kick: Option<Instant>,
    last_stick: Option<Instant>,
}

impl Recorder for Stopwatch {
    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        match event.kind {
            EventKind::Kick => self.kick = Some(Instant::now()),
            EventKind::Stick => self.last_stick = Some(Instant::now()),
            _ => {}
        }
        Ok(())
    }
    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }
}

/// Mean time of: making the case, sliding to the kick, from there to the last stick, that one, and the summary.
fn phases(study: &Study) -> [Duration; 5] {
    let mut sums = [Duration::ZERO; 5];
    let count = study.point_count().expect("a sample");
    for number in 0..count {
        let point = study.point(number).expect("a point");
        let start = Instant::now();
        let case = study.case_at(&point.coordinates).expect("a valid point");
        let made = Instant::now();
        let mut stopwatch = Stopwatch::default();
        let report = simulate(
            &case.parameters,
            &case.solver,
            &case.output,
            &mut stopwatch,
            &mut |_| ControlFlow::Continue(()),
        )
        .expect("a run");
        let end = Instant::now();
        std::hint::black_box(stickslip::analysis::Summary::of_run(&case.parameters, &report));
        let kick = stopwatch.kick.unwrap_or(made);
        let stick = stopwatch.last_stick.unwrap_or(kick).max(kick);
        let parts = [made - start, kick - made, stick - kick, end - stick, end.elapsed()];
        for (sum, part) in sums.iter_mut().zip(parts) {
            *sum += part;
        }
    }
    sums.map(|sum| sum / count as u32)
}

/// Seconds for the points of the study on so many threads, without writing.
fn computing(study: &Study, workers: usize) -> f64 {
    let points = (0..study.point_count().expect("a sample")).filter_map(|number| study.point(number));
    let clock = Instant::now();
    let stop = AtomicBool::new(false);
    let ended = run_points(study, points, workers, &stop, &without_a_file, |_| Ok::<(), ()>(()));
    assert!(ended.is_ok());
    clock.elapsed().as_secs_f64()
}

/// Seconds for the whole sweep, with its journal and its file.
fn sweeping(study: &Study, workers: usize) -> f64 {
    let folder = tempfile::tempdir().expect("a folder");
    let clock = Instant::now();
    let options = SweepOptions {
        shard: None,
        path: &folder.path().join("bench.h5"),
        overwrite: Overwrite::OwnResults,
        resume: false,
        workers,
        header: SweepHeader::default(),
        integrate: &without_a_file,
        stop: &AtomicBool::new(false),
    };
    sweep(study, &options, &mut |_| {}).expect("a sweep");
    clock.elapsed().as_secs_f64()
}

fn main() {
    for method in ["auto", "series"] {
        let few = study(method, 64);
        let [case, sliding, stick_slip, last, summary] = phases(&few).map(|part| part.as_secs_f64() * 1e3);
        println!(
            "{method}: ms a run: case {case:.3}, sliding {sliding:.3}, stick-slip {stick_slip:.3}, last stick {last:.3}, \
             summary {summary:.3}"
        );
        for count in [128, 1024] {
            let study = study(method, count);
            let [one, two] = [1, 2].map(|workers| computing(&study, workers));
            let whole = sweeping(&study, 2);
            println!(
                "{method}: {count} points: {:.1} runs a second on one thread, {:.1} on two ({:.2} times), with journal and \
                 file {:.1}",
                count as f64 / one,
                count as f64 / two,
                one / two,
                count as f64 / whole
            );
        }
    }
}
