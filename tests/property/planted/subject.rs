//! The cases that mistakes are planted in: the built-in ones, and some that are drawn at random.

use super::written::Written;
use crate::common::cases::{parsed, source};
use crate::common::planted_solver::{Solved, Solver, Y};
use crate::common::random_brakes::Random;
use std::cell::OnceCell;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use stickslip::SavedRun;
use stickslip::case::{Case, CaseSource, Override, WrittenCase};
use stickslip::compare::{Reference, Vocabulary};
use stickslip::model::system::{Pressing, System};
use stickslip::record::EventKind;
use stickslip::results::{Overwrite, ResultFile};

pub(super) const BUILT_IN: [&str; 11] = [
    "belt-coulomb",
    "belt-exponential",
    "belt-leine",
    "block",
    "clutch",
    "den-hartog",
    "drill-string",
    "groan",
    "hairer",
    "paper-si",
    "paper",
];

/// A case, its run, and what is known of it.
pub(super) struct Subject {
    pub name: String,
    pub source: CaseSource,
    pub case: Case,
    pub file: PathBuf,
    pub reference: Reference,
    /// Its events.
    pub word: Vec<(f64, &'static str)>,
    /// Of a brake that coasts for seconds: its state shortly before the kick, by the sound solver.
    pub coasted: OnceCell<Y>,
}

/// A choice.
pub(super) fn pick<'a, T>(random: &mut Random, of: &'a [T]) -> &'a T {
    &of[((random.next() * of.len() as f64) as usize).min(of.len() - 1)]
}

/// The same of what is copied.
pub(super) fn one_of<T: Copy>(random: &mut Random, of: &[T]) -> T {
    *pick(random, of)
}

/// Uniform in the logarithm.
pub(super) fn scale(random: &mut Random, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.next())
}

/// A law with its keys, whose coefficient at rest is `high` and falls towards `low` over speeds of the size of `speed`.
fn random_law(random: &mut Random, high: f64, low: f64, speed: f64) -> String {
    let breakaway = if random.next() < 0.4 {
        high * random.within(1.02, 1.2)
    } else {
        high
    };
    let scale = speed * random.within(0.7, 3.0);
    let law = match (random.next() * 5.0) as usize {
        0 => format!("low_speed = {high:?}\nhigh_speed = {low:?}\ndecay = {:?}", 1.0 / scale),
        1 => return format!("law = \"coulomb\"\nbreakaway = {high:?}\nkinetic = {low:?}\n"),
        2 => format!("law = \"hyperbolic\"\nlow_speed = {high:?}\nhigh_speed = {low:?}\nscale = {scale:?}"),
        3 => format!(
            "law = \"stribeck\"\nlow_speed = {high:?}\nhigh_speed = {low:?}\nscale = {scale:?}\nviscous = {:?}",
            0.02 * high / speed * random.next()
        ),
        _ => {
            // Falls to `low` at 6 speeds, and rises no higher than that up to 20.
            let slope = (low - high) / (6.0 * speed);
            format!(
                "law = \"polynomial\"\nlow_speed = {high:?}\nlinear = {:?}\ncubic = {:?}\nvalid_below = {:?}",
                1.5 * slope,
                -0.5 * slope / (36.0 * speed * speed),
                30.0 * speed
            )
        }
    };
    format!("breakaway = {breakaway:?}\n{law}\n")
}

/// A case of a random family.
fn random_case(random: &mut Random) -> (String, String) {
    let family = (random.next() * 6.0) as usize;
    let m = scale(random, 0.3, 5.0);
    let k = scale(random, 10.0, 2000.0);
    let omega = (k / m).sqrt();
    let force = scale(random, 4.0, 40.0);
    let high = random.within(0.3, 0.7);
    let low = high * random.within(0.45, 0.85);
    // The belt moves by some part of what friction does in a period.
    let speed = (high - low) * force / k * omega * random.within(0.15, 0.9);
    let damping = if random.next() < 0.5 {
        0.0
    } else {
        2.0 * random.within(0.002, 0.02) * m * omega
    };
    let law = random_law(random, high, low, speed);
    let period = TAU / omega + 2.0 * (high - low) * force / (k * speed);
    let end = random.within(7.0, 12.0) * period;
    let mut text = "title = \"drawn at random\"\nmotion = \"translation\"\n".to_owned();
    let mut normal = format!("{force:?}");
    let mut belt = format!("{speed:?}");
    let mut stator = format!("inertia = {m:?}\nstiffness = {k:?}\ndamping = {damping:?}\nend = \"fixed\"\n");
    let name = match family {
        1 => {
            let (amplitude, omega) = (force * random.within(0.05, 0.3), omega * random.within(0.3, 2.5));
            normal = format!(
                "{{ profile = \"{}\", mean = {force:?}, amplitude = {amplitude:?}, angular_frequency = {omega:?} }}",
                one_of(random, &["sine", "cosine"])
            );
            "a belt under a harmonic force"
        }
        2 => {
            let (amplitude, omega) = (speed * random.within(0.1, 0.5), omega * random.within(0.2, 1.5));
            belt = format!(
                "{{ profile = \"sine\", mean = {speed:?}, amplitude = {amplitude:?}, angular_frequency = {omega:?}, phase = {:?} }}",
                random.within(0.1, 1.5)
            );
            "a belt of harmonic speed"
        }
        3 => {
            let (second, stiffer) = (m * random.within(0.4, 2.0), k * random.within(0.5, 2.0));
            stator = format!(
                "inertia = [{m:?}, {second:?}]\nstiffness = [{k:?}, {stiffer:?}]\ndamping = [{damping:?}, {:?}]\nend = \"fixed\"\n",
                0.02 * (stiffer * second).sqrt()
            );
            "two masses on a belt"
        }
        _ => "a belt",
    };
    let rest = format!("[contact]\nnormal_force = {normal}\n[friction]\n{law}");
    match family {
        4 => {
            // A mass on the ground at a spring and under a harmonic force.
            let (size, omega) = (force * high * random.within(1.5, 4.0), omega * random.within(0.4, 1.8));
            let shape = one_of(random, &["sine", "cosine"]);
            let phase = random.within(0.0, 1.5);
            write!(
                text,
                "[rotor]\nend = \"fixed\"\n[stator]\n{stator}torque = {{ profile = \"{shape}\", amplitude = {size:?}, angular_frequency = \
                 {omega:?}, phase = {phase:?} }}\n{rest}[initial]\nstator_twist = {:?}\n[output]\nend_time = {:?}\ninterval = {:?}\n",
                random.within(-1.0, 1.0) * size / k,
                8.0 * TAU / omega,
                TAU / omega / 150.0
            )
            .unwrap();
            return (text, "a driven oscillator".to_owned());
        }
        5 => {
            // A mass and one more, pulled along the ground by a spring.
            let second = m * random.within(0.3, 3.0);
            write!(
                text,
                "[rotor]\ninertia = [{m:?}, {second:?}]\nstiffness = [{:?}, {k:?}]\ndamping = [{:?}, {damping:?}]\nend = \
                 \"driven\"\nspeed = {speed:?}\n[stator]\nend = \"fixed\"\n{rest}[output]\nend_time = {end:?}\ninterval = {:?}\n",
                k * random.within(1.0, 8.0),
                0.02 * (k * m).sqrt(),
                period / 200.0
            )
            .unwrap();
            return (text, "two masses pulled by a spring".to_owned());
        }
        _ => {}
    }
    let kick = match random.next() < 0.25 {
        true => format!(
            "[[perturbation]]\nkind = \"kick\"\ntime = {:?}\nrelative_velocity = {:?}\n",
            period * random.within(1.0, 4.0),
            speed * random.within(0.2, 2.0)
        ),
        false => String::new(),
    };
    write!(
        text,
        "[rotor]\nend = \"driven\"\nspeed = {belt}\n[stator]\n{stator}{rest}{kick}[output]\nend_time = {end:?}\ninterval = {:?}\n",
        period / 200.0
    )
    .unwrap();
    (text, name.to_owned())
}

impl Subject {
    pub fn of(name: String, source: CaseSource, folder: &Path) -> Option<Subject> {
        let overrides = parsed(&["output.around=none"]);
        let case = Case::read(&source, &overrides).ok()?;
        let file = folder.join(format!("{}.h5", name.replace(' ', "-")));
        let report = SavedRun::new(&case, &file).overwrite(Overwrite::Force).start().ok()?;
        let events = ResultFile::open(&file).ok()?.events().ok()?;
        let word = events.iter().filter(|event| event.kind.in_event_sequence());
        let word: Vec<_> = word.map(|event| (event.time, event.kind.name())).collect();
        if report.run.failure.is_some() || !(1..600).contains(&word.len()) {
            return None;
        }
        let reference = Reference::open(&file).ok()?;
        Some(Subject {
            name,
            source,
            case,
            file,
            reference,
            word,
            coasted: OnceCell::new(),
        })
    }

    pub fn built_in(name: &str, folder: &Path) -> Subject {
        Subject::of(name.to_owned(), CaseSource::built_in(name).unwrap(), folder).unwrap()
    }

    /// The first of random cases that runs and has some events.
    pub fn drawn(number: u64, seed: u64, folder: &Path) -> Subject {
        let mut random = Random(seed ^ (0x5eed_0000 + number));
        loop {
            let (text, name) = random_case(&mut random);
            let of = Subject::of(format!("random {number} {name}"), source(&text), folder);
            if let Some(system) = of.filter(|system| system.word.len() >= 6) {
                return system;
            }
        }
    }

    /// The brake of the paper, which slows down for seconds before anything happens.
    pub fn coasts(&self) -> bool {
        self.name.starts_with("paper")
    }

    /// The system with changes.
    pub fn with(&self, changes: &[(&str, f64)]) -> Option<System> {
        let overrides: Vec<Override> = changes
            .iter()
            .map(|(path, value)| Override::number(path, *value))
            .collect();
        Some(Case::read(&self.source, &overrides).ok()?.system)
    }

    /// Its state just after the kick, and the time of it.
    pub fn after_kick(&self) -> (f64, Y) {
        let events = ResultFile::open(&self.file).unwrap().events().unwrap();
        let kick = events.iter().find(|event| event.kind == EventKind::Kick).unwrap();
        let s = &kick.after;
        let mut y = Y::default();
        let values = [s.rotor_twist, s.phi2_dot, s.theta_dot, s.phi1, s.phi1_dot, s.z, s.z_dot];
        y[..7].copy_from_slice(&values);
        (kick.time, y)
    }

    pub fn vocabulary(&self) -> Vocabulary {
        self.reference.mapping().vocabulary
    }

    /// Numbers of the case that may be mistaken: those that are written and not zero.
    pub fn numbers(&self) -> Vec<(String, f64)> {
        let written = WrittenCase::read(&self.source, &[]).unwrap();
        let kept = |path: &str| !path.starts_with("perturbation") && !path.ends_with("valid_below");
        let numbers = written
            .numbers()
            .iter()
            .filter(|number| kept(&number.path) && number.value != 0.0);
        numbers.map(|number| (number.path.clone(), number.value)).collect()
    }

    pub fn largest_normal_force(&self) -> f64 {
        match &self.case.system.pressing {
            Pressing::Force(force) => force.largest(),
            Pressing::Axial { actuation, .. } => actuation.pieces().largest(),
        }
    }

    /// Sizes of the twist next to the contact and of the relative velocity, in the reference.
    pub fn sizes(&self) -> [f64; 2] {
        let file = ResultFile::open(&self.file).unwrap();
        let rows = file.sample_count().unwrap();
        let events = file.events().unwrap();
        let first = events
            .iter()
            .find(|event| event.kind.in_event_sequence())
            .map_or(0.0, |event| event.time);
        let time = file.column("time", 0..rows).unwrap();
        let largest = |name: &str| {
            let values = file.column(name, 0..rows).unwrap_or_default();
            let after = values
                .iter()
                .zip(&time)
                .filter(|(_, time)| !self.coasts() || **time >= first);
            after.fold(0.0, |most: f64, (value, _)| most.max(value.abs()))
        };
        let twist = if self.case.system.stator.stiffness.is_empty() {
            "rotor_twist"
        } else {
            "phi1"
        };
        [largest(twist).max(1e-9), largest("relative_velocity")]
    }
}

/// A motion of the system by a solver, at the samples of a file.
pub(super) fn solve(system: &Subject, solver: &Solver, start: Option<Y>, file: &Written) -> Option<Solved> {
    let end = system.case.output.end_time;
    let times = |from: f64, to: f64| -> Vec<f64> {
        let interval = file.interval_of_motion();
        let count = ((to - from) / interval).floor() as usize;
        (0..=count).map(|n| from + n as f64 * interval).collect()
    };
    if !system.coasts() {
        return solver.run(0.0, &start.unwrap_or_else(|| solver.initial()), &times(0.0, end));
    }
    let (kicked, _) = system.after_kick();
    let stop = 6.9925;
    if let Some(start) = start {
        return solver.run(kicked, &start, &times(kicked, stop));
    }
    // Nothing moves fast before the stick-slip: until then long steps do.
    let coarse = |system: &System, to: f64| -> Option<Solved> {
        let coarse = Solver {
            step: 2e-5,
            ..Solver::sound(system)
        };
        coarse.run(0.0, &coarse.initial(), &[to])
    };
    let before = |events: &[(f64, &str)]| events.first().map_or(kicked, |(time, _)| *time) - 3e-3;
    let same = System {
        kicks: system.case.system.kicks.clone(),
        ..solver.system.clone()
    } == system.case.system;
    let (from, y) = if same {
        let known = || coarse(&system.case.system, before(&[])).unwrap().rows[0].1;
        (before(&[]), *system.coasted.get_or_init(known))
    } else {
        let first = coarse(&solver.system, before(&[]))?;
        match before(&first.events) {
            from if from < before(&[]) => (from, coarse(&solver.system, from)?.rows.last()?.1),
            from => (from, first.rows.last()?.1),
        }
    };
    // What stops earlier is looked at when it does.
    solver.run(from, &y, &times(from, from + (stop - before(&[]))))
}
