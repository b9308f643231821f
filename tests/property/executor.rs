//! A sweep by an executor gives the same file as a sweep by threads, in any order of completion and after any failure.

use std::time::Duration;
use stickslip::Sweep;
use stickslip::sweep::{Executor, Study, StudySource, evaluate};
use stickslip_analysis::ErrorKind;

const MAP: &str = r#"
case = "paper"
keep = { events = true }
set = { solver.method = "series", initial.speed = 3,
    actuation = { profile = "ramp", force = 2225, rise_time = "20 ms" },
    perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-4 }] }
axis = [
    { key = "friction.decay", from = 1, to = 120, count = 7, spacing = "log" },
    { key = "friction.breakaway", values = [0.5, 0.6, 0.7] },
    { key = "torsion.damping", values = ["20 N m s/rad", 0.1] },
    { key = "contact.breakaway_test", values = ["transmitted", "rotor"] },
]
"#;

const BOUNDARY: &str = r#"
case = "paper"
set = { perturbation = [], axial.damping = "20000 lbf s/in", actuation.rise_time = 0, torsion.rotor_inertia = 0.002,
    initial.speed = 10, output.end_time = 0.01 }
axis = [
    { key = "friction.decay", from = 0.05, to = 0.8, count = 5, spacing = "log" },
    { key = "torsion.damping", from = 5, to = 40, count = 4 },
]
boundary = { criterion = "instability_time > 0", refinements = 1 }
"#;

/// Runs tasks at once and returns them in reverse order, until its lives are used up.
#[derive(Debug)]
struct Backwards {
    done: Vec<Vec<u8>>,
    lives: usize,
    cancelled: bool,
}

impl Executor for Backwards {
    fn submit(&mut self, study: &str, points: &str) -> Result<(), String> {
        let outcomes = evaluate(study, points, &())?;
        self.done.push(outcomes.expect("nobody stops it"));
        Ok(())
    }

    fn finished(&mut self, _wait: Duration) -> Result<Option<Vec<u8>>, String> {
        self.lives = self.lives.checked_sub(1).ok_or("a worker died")?;
        Ok(self.done.pop())
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

fn executor(lives: usize) -> Backwards {
    let (done, cancelled) = (Vec::new(), false);
    Backwards { done, lives, cancelled }
}

#[test]
fn property_an_executor_gives_the_file_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for text in [MAP, BOUNDARY] {
        let study = Study::parse(StudySource::text("study", text), &[]).unwrap();
        let report = Sweep::new(&study, &path("one.h5")).workers(2).start().unwrap();
        let many = path("many.h5");
        let mut failures = 0;
        let found = loop {
            assert!(failures < 100);
            let mut executor = executor(30);
            match Sweep::new(&study, &many).resume(true).executor(&mut executor).start() {
                Ok(report) => break report,
                Err(error) => {
                    assert!(matches!(error.kind, ErrorKind::Executor), "{error}");
                    assert_eq!(error.to_string(), "the executor failed: a worker died");
                    assert!(executor.cancelled);
                    failures += 1;
                }
            }
        };
        assert!(failures > 0, "{} points", report.points);
        assert_eq!((found.points, found.failed), (report.points, report.failed));
        assert!(std::fs::read(path("one.h5")).unwrap() == std::fs::read(&many).unwrap());
        std::fs::remove_file(path("one.h5")).unwrap();
        std::fs::remove_file(many).unwrap();
    }
}
