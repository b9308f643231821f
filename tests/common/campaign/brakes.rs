//! The brakes of the campaign: a wide family, and families that go where its ranges end.

use crate::common::random_brakes::Random;
use std::fmt::Write;
use stickslip::case::Override;

/// What a brake is drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    Wide,
    ConstantInSpeed,
    SteepFriction,
    NoTorsionalDamping,
    StrongTorsionalDamping,
    EqualCoefficients,
    Step,
    KickAtCorner,
    KickAtRelease,
    KickInStick,
    LargeKick,
    ReversingKick,
    TwoKicksInAPeriod,
    LightRotor,
    AxialUnderdamped,
    AxialOverdamped,
    HundredCorners,
    ReleaseToZero,
    ReleaseBesideZero,
    TouchZero,
    CloseCorners,
    StepAtZero,
    PulseAtZero,
    KickAtZero,
}

use Family::*;

/// The families of the odd brakes, in turn.
const BEYOND: [Family; 16] = [
    ConstantInSpeed,
    SteepFriction,
    NoTorsionalDamping,
    StrongTorsionalDamping,
    EqualCoefficients,
    Step,
    KickAtCorner,
    KickAtRelease,
    KickInStick,
    LargeKick,
    ReversingKick,
    TwoKicksInAPeriod,
    LightRotor,
    AxialUnderdamped,
    AxialOverdamped,
    HundredCorners,
];

impl Family {
    /// What is special about it.
    pub fn name(self) -> &'static str {
        match self {
            Wide => "wide ranges",
            ConstantInSpeed => "alpha = 0",
            SteepFriction => "alpha 90 to 500",
            NoTorsionalDamping => "c_t = 0",
            StrongTorsionalDamping => "c_t 120 to 2000",
            EqualCoefficients => "mu_s = mu_d",
            Step => "rise_time = 0",
            KickAtCorner => "kick at a corner",
            KickAtRelease => "kicks at a release and at the grip after it",
            KickInStick => "kick in stick",
            LargeKick => "kick of the size of the sliding speed",
            ReversingKick => "kick that reverses the slip",
            TwoKicksInAPeriod => "two kicks within a period",
            LightRotor => "rotor as light as its surface",
            AxialUnderdamped => "c_a 0 to 500",
            AxialOverdamped => "c_a above critical",
            HundredCorners => "table with 100 corners",
            ReleaseToZero => "release to zero",
            ReleaseBesideZero => "release to almost zero",
            TouchZero => "force that touches zero",
            CloseCorners => "two corners close by at zero",
            StepAtZero => "step from zero",
            PulseAtZero => "pulse at zero",
            KickAtZero => "kick where the force is zero",
        }
    }
}

/// A brake by its number: what is changed in `paper-si`.
pub struct Drawn {
    pub family: Family,
    pub settings: Vec<String>,
}

impl Drawn {
    pub fn overrides(&self) -> Vec<Override> {
        self.settings
            .iter()
            .map(|text| Override::parse(text).expect("a setting of the campaign"))
            .collect()
    }

    /// As options of the program.
    pub fn command(&self) -> String {
        let mut words = String::from("stickslip certify paper-si --oracle");
        for setting in &self.settings {
            let _ = write!(words, " --set '{setting}'");
        }
        words
    }
}

pub(super) struct Brake {
    speed: f64,
    decay: f64,
    high: f64,
    low: f64,
    breakaway: f64,
    damping: f64,
    stiffness: f64,
    surface: f64,
    rotor: f64,
    pub(super) axial_damping: f64,
    force: f64,
    rise: f64,
    /// Corners, if F is a table.
    pub(super) table: Option<Vec<(f64, f64)>>,
    pub(super) kicks: Vec<(String, f64)>,
    pub(super) end: f64,
}

pub(super) fn logarithmic(random: &mut Random, low: f64, high: f64) -> f64 {
    random.within(low.ln(), high.ln()).exp()
}

/// To so many digits behind the point: what is written is what is meant.
pub(super) fn rounded(value: f64, digits: i32) -> f64 {
    let unit = 10f64.powi(digits);
    (value * unit).round() / unit
}

impl Brake {
    /// Decay 0.6 to 90 s/rad, damping 3 to 120 N m s/rad, ramps, releases and grips after them (every other brake), early and
    /// late kicks of either sign, one or two of them.
    pub(super) fn wide(random: &mut Random, released: bool, total_release: bool, speeds: (f64, f64)) -> Brake {
        let speed = rounded(logarithmic(random, speeds.0, speeds.1), 4);
        let decay = rounded(logarithmic(random, 0.6, 90.0), 4);
        let high = rounded(random.within(0.12, 0.42), 4);
        let low = rounded(random.within(high + 0.05, 0.65), 4);
        let above = if random.next() < 0.5 {
            0.0
        } else {
            random.within(0.01, 0.2)
        };
        let damping = rounded(logarithmic(random, 3.0, 120.0), 3);
        let stiffness = rounded(logarithmic(random, 1.5e6, 3e7), 1);
        let surface = rounded(logarithmic(random, 0.002, 0.03), 6);
        let (force, rise) = (
            rounded(random.within(800.0, 6000.0), 2),
            rounded(logarithmic(random, 0.004, 0.4), 4),
        );
        let mut brake = Brake {
            speed,
            decay,
            high,
            low,
            breakaway: rounded(low + above, 4),
            damping,
            stiffness,
            surface,
            rotor: 2.262,
            axial_damping: 8760.0,
            force,
            rise,
            table: None,
            kicks: Vec::new(),
            end: 0.0,
        };
        brake.set_end();
        if released {
            brake.release(random, total_release);
        }
        brake.kick_somewhere(random);
        brake
    }

    /// When the least friction stops it under the full force, s.
    fn stop(&self) -> f64 {
        self.rotor * self.speed / (self.high * 0.052388 * self.force) + self.rise / 2.0
    }

    fn set_end(&mut self) {
        self.end = self.stop() * 1.5 + self.rise + 0.2;
    }

    /// Lets go, to nothing or to a part of the force, and grips again with another.
    fn release(&mut self, random: &mut Random, total: bool) {
        let stop = self.stop();
        let mut at = |low: f64, high: f64| rounded(self.rise + random.within(low, high) * stop, 5);
        let (fall, open, grip) = (at(0.05, 0.3), at(0.35, 0.5), at(0.55, 0.7));
        let again = rounded(random.within(800.0, 6000.0), 2);
        let between = match total {
            true => 0.0,
            false => rounded(self.force * random.within(0.2, 0.8), 2),
        };
        self.table = Some(vec![
            (0.0, 0.0),
            (rounded(self.rise, 5), self.force),
            (fall, self.force),
            (open, between),
            (grip, between),
            (rounded(grip + 0.01, 5), again),
        ]);
        self.end = (stop * 2.0 + self.rotor * self.speed / (self.high * 0.052388 * again)) * 1.3 + 0.3;
    }

    fn kick_somewhere(&mut self, random: &mut Random) {
        let size = 10f64.powf(random.within(-6.0, -1.5));
        let signed = if random.next() < 0.5 { size } else { -size };
        let share = random.next();
        self.kicks = if share < 0.55 {
            vec![("\"instability\"".to_owned(), signed)]
        } else if share < 0.9 {
            vec![(self.moment(random, 0.6, 1.02), signed)]
        } else {
            vec![
                (self.moment(random, 0.3, 0.9), signed),
                ("\"instability\"".to_owned(), size / 3.0),
            ]
        };
    }

    fn moment(&self, random: &mut Random, low: f64, high: f64) -> String {
        format!("{:.6}", self.stop() * random.within(low, high))
    }

    /// About the sliding speed at a time, rad/s.
    pub(super) fn speed_at(&self, time: f64) -> f64 {
        let lost = (time - self.rise / 2.0).max(0.0) / (self.stop() - self.rise / 2.0);
        self.speed * (1.0 - lost).max(0.05)
    }

    pub(super) fn settings(&self) -> Vec<String> {
        let list = |values: &mut dyn Iterator<Item = f64>| {
            let values: Vec<String> = values.map(|value| format!("{value:?}")).collect();
            format!("[{}]", values.join(", "))
        };
        let mut settings = vec![
            format!("initial.speed={:?}", self.speed),
            format!("friction.decay={:?}", self.decay),
            format!("friction.high_speed={:?}", self.high),
            format!("friction.low_speed={:?}", self.low),
            format!("friction.breakaway={:?}", self.breakaway),
            format!("torsion.damping={:?}", self.damping),
            format!("torsion.stiffness={:?}", self.stiffness),
            format!("torsion.surface_inertia={:?}", self.surface),
            format!("torsion.rotor_inertia={:?}", self.rotor),
            format!("axial.damping={:?}", self.axial_damping),
        ];
        match &self.table {
            None => {
                settings.push(format!("actuation.force={:?}", self.force));
                settings.push(format!("actuation.rise_time={:?}", self.rise));
            }
            Some(table) => settings.push(format!(
                "actuation={{profile=\"table\", time={}, force={}}}",
                list(&mut table.iter().map(|corner| corner.0)),
                list(&mut table.iter().map(|corner| corner.1))
            )),
        }
        let kicks = self.kicks.iter();
        let kicks = kicks.map(|(time, size)| format!("{{kind=\"kick\", time={time}, relative_velocity={size:.6e}}}"));
        let kicks: Vec<String> = kicks.collect();
        settings.push(format!("perturbation=[{}]", kicks.join(", ")));
        settings.push(format!("output.end_time={:.4}", self.end));
        settings.push("output.interval=0.05".to_owned());
        settings.extend(["output.window=[]", "output.around=none"].map(str::to_owned));
        settings
    }
}

/// Brake `index`, the same everywhere. Even ones are of the wide family, odd ones of the others in turn.
pub fn draw(index: u64) -> Drawn {
    let mut random = Random(90_000 + index);
    let r = &mut random;
    if index.is_multiple_of(2) {
        let number = index / 2 % 4;
        let brake = Brake::wide(r, number >= 2, number == 2, (1.5, 25.0));
        return Drawn {
            family: Wide,
            settings: brake.settings(),
        };
    }
    let family = BEYOND[(index / 2) as usize % BEYOND.len()];
    // Every other brake of a family lets go and grips again.
    let released = index / 2 / BEYOND.len() as u64 % 2 == 1;
    let brake = beyond(family, r, released);
    Drawn {
        family,
        settings: brake.settings(),
    }
}

fn beyond(family: Family, r: &mut Random, released: bool) -> Brake {
    // Short runs: what is special about them does not last.
    let speeds = (1.5, 8.0);
    let mut brake = match family {
        KickAtRelease => Brake::wide(r, true, true, speeds),
        LightRotor | Step | HundredCorners | KickAtCorner => Brake::wide(r, false, false, speeds),
        AxialUnderdamped | AxialOverdamped => Brake::wide(r, released, true, speeds),
        _ => Brake::wide(r, released, r.0.is_multiple_of(2), speeds),
    };
    let size = brake.kicks[0].1.abs();
    match family {
        Wide | ReleaseToZero | ReleaseBesideZero | TouchZero | CloseCorners | StepAtZero | PulseAtZero | KickAtZero => {
        }
        ConstantInSpeed => brake.decay = 0.0,
        SteepFriction => brake.decay = rounded(logarithmic(r, 90.0, 500.0), 3),
        NoTorsionalDamping => {
            brake.damping = 0.0;
            brake.decay = if r.next() < 0.5 {
                0.0
            } else {
                rounded(logarithmic(r, 0.6, 5.0), 4)
            };
            // Nothing is ever damped: what is long is only long.
            brake.speed = rounded(r.within(1.0, 2.5), 4);
            brake.force = rounded(r.within(2000.0, 6000.0), 2);
            brake.table = None;
            brake.set_end();
            brake.kicks = vec![(brake.moment(r, 0.3, 0.9), size)];
        }
        StrongTorsionalDamping => brake.damping = rounded(logarithmic(r, 120.0, 2000.0), 3),
        EqualCoefficients => {
            brake.low = brake.high;
            brake.breakaway = rounded(brake.low + if r.next() < 0.5 { 0.0 } else { r.within(0.01, 0.2) }, 4);
        }
        Step => {
            brake.rise = 0.0;
            brake.set_end();
        }
        KickAtCorner => brake.kicks = vec![(format!("{:?}", brake.rise), brake.kicks[0].1)],
        KickAtRelease => {
            let corners = brake.table.clone().expect("a table");
            // The open corner, the grip, and the end of the grip; the last may turn the slip.
            let turning = -brake.speed_at(corners[4].0) * r.within(0.5, 1.5);
            brake.kicks = vec![
                (format!("{:?}", corners[3].0), size),
                (
                    format!("{:?}", corners[4].0),
                    if r.next() < 0.5 { turning } else { -size },
                ),
                (format!("{:?}", corners[5].0), size),
            ];
        }
        KickInStick => {
            brake.kicks.push((brake.moment(r, 1.05, 1.4), size));
            brake.kicks.push((brake.moment(r, 0.97, 1.02), -size));
        }
        LargeKick | ReversingKick => {
            let time = brake.stop() * r.within(0.2, 0.9);
            let share = match family {
                LargeKick => r.within(0.3, 0.95),
                _ => r.within(1.1, 2.0),
            };
            brake.kicks = vec![(format!("{time:.6}"), -share * brake.speed_at(time))];
        }
        TwoKicksInAPeriod => {
            let period = std::f64::consts::TAU * (brake.surface / brake.stiffness).sqrt();
            let time = brake.stop() * r.within(0.5, 1.0);
            let next = time + period * r.within(0.05, 0.95);
            brake.kicks = vec![
                (format!("{time:.8}"), size),
                (format!("{next:.8}"), -size * r.within(0.5, 1.5)),
            ];
        }
        LightRotor => {
            brake.rotor = rounded(brake.surface * r.within(0.3, 3.0), 6);
            brake.rise = rounded(logarithmic(r, 2e-4, 1e-2), 6);
            brake.set_end();
            brake.kicks = vec![(brake.moment(r, 0.3, 0.95), size)];
        }
        AxialUnderdamped => {
            brake.axial_damping = if r.next() < 0.2 {
                0.0
            } else {
                rounded(logarithmic(r, 5.0, 500.0), 3)
            }
        }
        AxialOverdamped => brake.axial_damping = rounded(logarithmic(r, 33_000.0, 1e6), 1),
        HundredCorners => {
            let (stop, mut time) = (brake.stop(), 0.0);
            let mut table = vec![(0.0, 0.0)];
            for _ in 0..100 {
                time = rounded(time + 0.02 * stop * r.within(0.1, 1.9), 6);
                table.push((time, rounded(brake.force * r.within(0.3, 1.0), 2)));
            }
            brake.table = Some(table);
            brake.end = stop * 3.5 + 0.2;
        }
    }
    brake
}
