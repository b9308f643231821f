//! Points of a critical curve: runs per second, the cost of a run by phase, how cost and memory depend on the number
//! of points, and the cost of writing. Processor time is printed next to wall time, which other programs disturb.
//! `STICKSLIP_BENCH_POINTS` is the largest number of points (default 1000; 100,000 takes minutes).

use std::path::Path;
use std::time::Instant;
use stickslip::Run;
use stickslip::record::{Event, EventKind, Recorder, RecorderError, Sample, Segment};
use stickslip::sweep::{
    Existing, Journal, PointOutcome, Study, StudySource, Sweep, journal_path, run_points, without_a_file,
};

/// Points on both sides of the critical curve, like those of its tracing.
fn study(method: &str, count: usize) -> Study {
    let text = format!(
        "case = \"paper\"\n[keep]\nevents = true\n[set]\nsolver.method = \"{method}\"\n\
         perturbation = [{{ kind = \"kick\", time = \"instability\", relative_velocity = 1e-6 }}]\n\
         [sample]\nmethod = \"latin-hypercube\"\ncount = {count}\n\
         [[axis]]\nkey = \"friction.decay\"\nfrom = 1\nto = 200\nspacing = \"log\"\n\
         [[axis]]\nkey = \"torsion.damping\"\nfrom = 10\nto = 60\n"
    );
    let source = StudySource::text("bench", &text);
    Study::parse(source, &[]).expect("a valid study")
}

/// Wall time and processor time of all threads, s.
#[derive(Clone, Copy)]
struct Clock(Instant, f64);

impl Clock {
    fn start() -> Clock {
        Clock(Instant::now(), processor())
    }

    fn stop(self) -> [f64; 2] {
        [self.0.elapsed().as_secs_f64(), processor() - self.1]
    }
}

/// Processor time of this process, s; NaN without /proc.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The fields are in hundredths of a second, and follow the name in brackets.
    let fields: Vec<&str> = text.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |k: usize| fields.get(k).and_then(|field| field.parse::<f64>().ok());
    match (ticks(11), ticks(12)) {
        (Some(user), Some(system)) => (user + system) / 100.0,
        _ => f64::NAN,
    }
}

fn peak_memory() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |kilobytes| kilobytes / 1e3)
}

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

/// Medians in ms for: making the case, sliding to the kick, from the kick to the last stick, the last stick, and the
/// summary.
fn phases(study: &Study) -> [f64; 5] {
    let count = study.point_count().expect("a sample");
    let mut parts: [Vec<f64>; 5] = Default::default();
    for number in 0..count {
        let point = study.point(number).expect("a point");
        let start = Instant::now();
        let case = study.case_at(&point.coordinates).expect("a valid point");
        let made = Instant::now();
        let mut stopwatch = Stopwatch::default();
        let report = Run::new(&case).record(&mut stopwatch).start().expect("a run");
        let end = Instant::now();
        std::hint::black_box(stickslip::analysis::Summary::of_run(&case.system, &report));
        let kick = stopwatch.kick.unwrap_or(made);
        let stick = stopwatch.last_stick.unwrap_or(kick).max(kick);
        let spans = [made - start, kick - made, stick - kick, end - stick, end.elapsed()];
        for (part, span) in parts.iter_mut().zip(spans) {
            part.push(span.as_secs_f64() * 1e3);
        }
    }
    parts.map(|mut part| {
        part.sort_by(f64::total_cmp);
        part[part.len() / 2]
    })
}

/// Runs the points of the study on so many threads, without writing.
fn computing(study: &Study, workers: usize, mut keep: impl FnMut(Vec<PointOutcome>)) -> [f64; 2] {
    let points = (0..study.point_count().expect("a sample")).filter_map(|number| study.point(number));
    let clock = Clock::start();
    let ended = run_points(study, points, workers, &(), &without_a_file, |group| {
        keep(group);
        Ok(())
    });
    assert!(ended.is_ok());
    clock.stop()
}

/// Runs the whole sweep, with its journal and its file. With a complete journal it only writes the file.
fn sweeping(study: &Study, workers: usize, path: &Path, resume: bool) -> [f64; 2] {
    let clock = Clock::start();
    let sweep = Sweep::new(study, path).resume(resume).workers(workers);
    sweep.start().expect("a sweep");
    clock.stop()
}

/// What it takes to put the outcomes into the journal, in the groups in which the pool handed them over, and into the file.
fn writing(study: &Study, groups: &[Vec<PointOutcome>]) -> [f64; 2] {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bench.h5");
    let clock = Clock::start();
    let mut journal = Journal::open(&journal_path(&path), &study.digest(), Existing::Discard).expect("a journal");
    for group in groups {
        journal.append(group).expect("room on the disk");
    }
    drop(journal);
    let [by_clock, by_processor] = clock.stop();
    let file = sweeping(study, 1, &path, true);
    [by_clock + file[0], by_processor + file[1]]
}

fn main() {
    let most = std::env::var("STICKSLIP_BENCH_POINTS").map_or(1000, |most| most.parse().expect("a number of points"));
    for method in ["cvode", "series"] {
        let [case, sliding, stick_slip, last, summary] = phases(&study(method, 128));
        println!(
            "{method}: medians, ms: case {case:.3}, sliding {sliding:.3}, stick-slip {stick_slip:.3}, last stick {last:.3}, \
             summary {summary:.3}"
        );
        let mut count = 100;
        while count <= most {
            let study = study(method, count);
            let per_run = 1e3 / count as f64;
            let [one, one_processor] = computing(&study, 1, |_| ());
            let mut groups = Vec::new();
            let [two, two_processor] = computing(&study, 2, |group| {
                // The outcomes of 100,000 points would fill the memory.
                if count == 1000 {
                    groups.push(group);
                }
            });
            println!(
                "{method}: {count} points: {:.1} runs a second on one thread, {:.1} on two, {:.2} times; ms of a processor a \
                 run {:.3} and {:.3}",
                count as f64 / one,
                count as f64 / two,
                one / two,
                one_processor * per_run,
                two_processor * per_run
            );
            let folder = tempfile::tempdir().expect("a folder");
            let [whole, whole_processor] = sweeping(&study, 2, &folder.path().join("bench.h5"), false);
            println!(
                "{method}: {count} points with journal and file: {:.1} runs a second, ms of a processor a run {:.3}, peak \
                 memory {:.1} MB",
                count as f64 / whole,
                whole_processor * per_run,
                peak_memory()
            );
            if count == 1000 {
                let [by_clock, by_processor] = writing(&study, &groups);
                println!(
                    "{method}: writing alone: {:.2} % of the time on two threads, {:.2} % of that of the processor",
                    100.0 * by_clock / whole,
                    100.0 * by_processor / whole_processor
                );
            }
            count *= 10;
        }
    }
}
