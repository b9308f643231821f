//! A bare solver of any case of two trains, by a method of choice, with switches for the mistakes that such solvers have.
//!
//! It has the numbers of a case from the program, and nothing else: laws, signals and equations are written down again.

use stickslip::friction::FrictionLaw;
use stickslip::model::KickTime;
use stickslip::model::system::{End, KickSide, Pressing, System, Train};
use stickslip::signal::{Drive, Frequency, HarmonicShape, Signal};

/// Entries of a state: twists and speeds of the rotor, the same of the stator, axial displacement and velocity.
const MOST: usize = 14;

pub type Y = [f64; MOST];

/// Events beyond this are chattering.
const MOST_EVENTS: usize = 4000;

/// Steps beyond this are too many for a test.
const MOST_STEPS: usize = 3_000_000;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The classical one, of order 4.
    Rk4,
    /// The midpoint rule.
    Rk2,
    Euler,
    /// Speeds by the forces at the old twists, then twists by the new speeds.
    SemiImplicitEuler,
    ImplicitEuler,
    /// Dormand and Prince, of order 5, with this relative tolerance.
    Adaptive(f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smooth {
    Tanh,
    Arctan,
    /// x/(|x| + 1).
    Ratio,
}

/// What is held against the limit in stick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tested {
    Interface,
    Rotor,
    Stator,
}

/// What the contact does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doing {
    Stick,
    Slip(f64),
    /// A regularised law.
    Engaged,
}

/// A solver and its mistakes.
#[derive(Debug, Clone)]
pub struct Solver {
    pub system: System,
    pub method: Method,
    /// s; of an adaptive method the largest.
    pub step: f64,
    /// Events within a step, not at its end.
    pub located: bool,
    /// Instead of the sign, with eps.
    pub smooth: Option<(Smooth, f64)>,
    /// Of mu_0 r F_n, at which a stick ends.
    pub breakaway: f64,
    pub tested: Tested,
    /// |omega_r| up to which a slip counts as a stick.
    pub band: f64,
    /// The surfaces keep the relative velocity that a stick begins with.
    pub frozen: bool,
    /// The event of this place is late by so much, s.
    pub late: Option<(usize, f64)>,
    /// mu is taken at the speed of one surface.
    pub wrong_speed: bool,
    /// A torque that the case does not have, on the surface that has inertia.
    pub torque: f64,
    /// Of the same surface: a torque against the speed, and one against its cube.
    pub drag: f64,
    /// k u (1 + hardening u^2), of the shaft next to the contact on each side.
    pub hardening: [f64; 2],
    /// Kicks are left out.
    pub unkicked: bool,
    /// The normal force is that of so much later, s.
    pub ahead: f64,
    /// Slips begin at the ends of steps, while sticks are located.
    pub late_slips: bool,
    /// The event of this place, a slip, is stepped over: it comes when the limit is exceeded the next time.
    pub skipped: Option<usize>,
}

/// States at the times asked for, with the mode of each, and the events.
#[derive(Debug, Clone, Default)]
pub struct Solved {
    pub rows: Vec<(f64, Y, Doing)>,
    pub events: Vec<(f64, &'static str)>,
}

/// The value and the slope of a signal.
fn signal(drive: &Drive, t: f64) -> (f64, f64) {
    match drive {
        Drive::Value(value) => (*value, 0.0),
        Drive::Linear(signal) => linear(signal, t),
        Drive::Wave(wave) => {
            let omega = match wave.frequency {
                Frequency::Cycles(frequency) => std::f64::consts::TAU * frequency,
                Frequency::Angular(omega) => omega,
                Frequency::Sweep { .. } => unimplemented!("no case here has a chirp"),
            };
            let acts = wave.from.is_none_or(|from| t >= from) && wave.to.is_none_or(|to| t < to);
            let size = if acts { wave.amplitude } else { 0.0 };
            let (sine, cosine) = (omega * t + wave.phase).sin_cos();
            match wave.shape {
                HarmonicShape::Sine => (wave.mean + size * sine, size * omega * cosine),
                HarmonicShape::Cosine => (wave.mean + size * cosine, -size * omega * sine),
            }
        }
        Drive::Sum(terms) => terms.iter().fold((0.0, 0.0), |sum, term| {
            let (value, slope) = signal(term, t);
            (sum.0 + value, sum.1 + slope)
        }),
    }
}

fn linear(signal: &Signal, t: f64) -> (f64, f64) {
    match signal {
        Signal::Ramp(ramp) if t < ramp.rise_time => (ramp.value * t / ramp.rise_time, ramp.value / ramp.rise_time),
        Signal::Ramp(ramp) => (ramp.value, 0.0),
        Signal::TimeTable(_) => unimplemented!("no case here has a table"),
    }
}

/// Where the slope of a signal jumps.
fn corners(drive: &Drive) -> Vec<f64> {
    match drive {
        Drive::Value(_) => Vec::new(),
        Drive::Linear(Signal::Ramp(ramp)) => vec![ramp.rise_time],
        Drive::Linear(Signal::TimeTable(_)) => unimplemented!("no case here has a table"),
        Drive::Wave(wave) => wave.from.iter().chain(&wave.to).copied().collect(),
        Drive::Sum(terms) => terms.iter().flat_map(corners).collect(),
    }
}

fn coefficient(law: &FrictionLaw, x: f64) -> f64 {
    match law {
        FrictionLaw::Exponential(l) => l.high_speed + (l.low_speed - l.high_speed) * (-l.decay * x).exp(),
        FrictionLaw::Coulomb(l) => l.kinetic,
        FrictionLaw::Hyperbolic(l) => l.high_speed + (l.low_speed - l.high_speed) / (1.0 + x / l.scale),
        FrictionLaw::Stribeck(l) => {
            let power = (x / l.scale).powi(l.exponent as i32);
            l.high_speed + (l.low_speed - l.high_speed) * (-power).exp() + l.viscous * x
        }
        FrictionLaw::Polynomial(l) => l.low_speed + x * (l.linear + x * (l.quadratic + x * l.cubic)),
        FrictionLaw::Asymmetric(_) | FrictionLaw::Table(_) => unimplemented!("no case here has such a law"),
    }
}

fn plus(y: &Y, terms: &[(f64, &Y)]) -> Y {
    std::array::from_fn(|n| y[n] + terms.iter().map(|(h, k)| h * k[n]).sum::<f64>())
}

impl Solver {
    /// Without a mistake, with steps so short that its events err by some 1e-10 of a period.
    pub fn sound(system: &System) -> Solver {
        let mut solver = Solver {
            system: system.clone(),
            method: Method::Rk4,
            step: 0.0,
            located: true,
            smooth: None,
            breakaway: 1.0,
            tested: Tested::Interface,
            band: 0.0,
            frozen: false,
            late: None,
            wrong_speed: false,
            torque: 0.0,
            drag: 0.0,
            hardening: [0.0; 2],
            unkicked: false,
            ahead: 0.0,
            late_slips: false,
            skipped: None,
        };
        solver.step = solver.period() / 1200.0;
        solver
    }

    /// The shortest period of shafts and signals, s.
    pub fn period(&self) -> f64 {
        let mut fastest: f64 = 0.0;
        for train in [&self.system.rotor, &self.system.stator] {
            for (i, stiffness) in train.stiffness.iter().enumerate() {
                let outer = train.inertia.get(i + 1).map_or(0.0, |inertia| 1.0 / inertia);
                fastest = fastest.max((stiffness * (1.0 / train.inertia[i] + outer)).sqrt());
            }
        }
        for drive in self.system.drives() {
            if let Drive::Wave(wave) = drive {
                fastest = fastest.max(wave.angular_frequency());
            }
        }
        match fastest {
            0.0 => 0.2,
            _ => std::f64::consts::TAU / fastest,
        }
    }

    fn rotor(&self) -> (&Train, usize, usize, f64) {
        let train = &self.system.rotor;
        (train, 0, train.shafts(), 1.0)
    }

    fn stator(&self) -> (&Train, usize, usize, f64) {
        let (train, rotor) = (&self.system.stator, &self.system.rotor);
        let twist = rotor.shafts() + rotor.inertia.len();
        (train, twist, twist + train.shafts(), -1.0)
    }

    fn axial(&self) -> usize {
        let stator = &self.system.stator;
        self.stator().2 + stator.inertia.len()
    }

    /// Speed and acceleration of the far end.
    fn end(train: &Train, t: f64) -> (f64, f64) {
        match &train.end {
            End::Driven(speed) => signal(speed, t),
            _ => (0.0, 0.0),
        }
    }

    fn surface(&self, (train, _, speed, _): (&Train, usize, usize, f64), t: f64, y: &Y) -> f64 {
        match train.inertia.is_empty() {
            true => Solver::end(train, t).0,
            false => y[speed],
        }
    }

    pub fn relative_velocity(&self, t: f64, y: &Y) -> f64 {
        self.surface(self.rotor(), t, y) - self.surface(self.stator(), t, y)
    }

    fn normal_force(&self, t: f64, y: &Y) -> f64 {
        match &self.system.pressing {
            Pressing::Force(force) => signal(force, t + self.ahead).0.max(0.0),
            Pressing::Axial { axial, .. } => {
                let z = self.axial();
                (-axial.damping * y[z + 1] - axial.stiffness * y[z]).max(0.0)
            }
        }
    }

    /// Fills in the rates of a train without contact, and gives the torque on its surface.
    fn train(&self, of: (&Train, usize, usize, f64), t: f64, y: &Y, out: &mut Y) -> f64 {
        let (train, twist, speed, sign) = of;
        let count = train.inertia.len();
        let end = Solver::end(train, t).0;
        let mut torques = [0.0; MOST];
        for i in 0..train.shafts() {
            let outer = if i + 1 < count { y[speed + i + 1] } else { end };
            let rate = sign * (outer - y[speed + i]);
            let u = y[twist + i];
            let hardening = if i == 0 {
                self.hardening[usize::from(sign < 0.0)]
            } else {
                0.0
            };
            let torque = train.stiffness[i] * u * (1.0 + hardening * u * u) + train.damping[i] * rate;
            torques[i] += sign * torque;
            torques[i + 1] -= sign * torque;
            out[twist + i] = rate;
        }
        if let Some(torque) = &train.torque {
            torques[torque.on] += signal(&torque.signal, t).0;
        }
        let bare = sign < 0.0 || self.system.stator.inertia.is_empty();
        if bare && count > 0 {
            torques[0] += self.torque - self.drag * y[speed];
        }
        for i in 0..count {
            torques[i] -= train.viscous[i] * y[speed + i];
            out[speed + i] = torques[i] / train.inertia[i];
        }
        torques[0]
    }

    /// T_r, T_s and T_f.
    fn torques(&self, t: f64, y: &Y, out: &mut Y) -> (f64, f64, f64) {
        let rotor = self.train(self.rotor(), t, y, out);
        let stator = -self.train(self.stator(), t, y, out);
        let surfaces = [&self.system.rotor, &self.system.stator].map(|train| train.inertia.first());
        let interface = match surfaces {
            [Some(two), Some(one)] => (one * rotor + two * stator) / (one + two),
            [None, Some(one)] => stator + one * Solver::end(&self.system.rotor, t).1,
            [Some(two), None] => rotor - two * Solver::end(&self.system.stator, t).1,
            [None, None] => unimplemented!("two rigid surfaces"),
        };
        (rotor, stator, interface)
    }

    fn rates(&self, t: f64, y: &Y, doing: Doing) -> Y {
        let mut out = [0.0; MOST];
        let (.., interface) = self.torques(t, y, &mut out);
        let w = self.relative_velocity(t, y);
        let law = |x: f64| match self.wrong_speed {
            true => coefficient(&self.system.law, self.lone_speed(t, y).abs()),
            false => coefficient(&self.system.law, x),
        };
        let limit = self.system.radius * self.normal_force(t, y);
        let torque = match doing {
            Doing::Stick => interface,
            Doing::Slip(sense) => sense * law(sense * w) * limit,
            Doing::Engaged => {
                let (smooth, eps) = self.smooth.unwrap();
                let share = match smooth {
                    Smooth::Tanh => (w / eps).tanh(),
                    Smooth::Arctan => std::f64::consts::FRAC_2_PI * (w / eps).atan(),
                    Smooth::Ratio => w / (w.abs() + eps),
                };
                law(w.abs()) * share * limit
            }
        };
        for ((train, _, speed, _), sign) in [(self.rotor(), -1.0), (self.stator(), 1.0)] {
            if let Some(inertia) = train.inertia.first() {
                out[speed] += sign * torque / inertia;
            }
        }
        if let Pressing::Axial { axial, actuation } = &self.system.pressing {
            let z = self.axial();
            let force = -linear(actuation, t).0 - axial.damping * y[z + 1] - axial.stiffness * y[z];
            (out[z], out[z + 1]) = (y[z + 1], force / axial.mass);
        }
        out
    }

    /// The speed of the surface that has an inertia, the stator's if both have.
    fn lone_speed(&self, t: f64, y: &Y) -> f64 {
        match self.system.stator.inertia.is_empty() {
            true => self.surface(self.rotor(), t, y),
            false => self.surface(self.stator(), t, y),
        }
    }

    /// The state after a step, and of an adaptive method the size of its error in tolerances.
    fn advance(&self, t: f64, y: &Y, doing: Doing, h: f64) -> (Y, f64) {
        let f = |t: f64, y: &Y| self.rates(t, y, doing);
        let a = f(t, y);
        let next = match self.method {
            Method::Euler => plus(y, &[(h, &a)]),
            Method::SemiImplicitEuler => {
                let is_speed = |n: usize| {
                    let of = |(train, _, speed, _): (&Train, usize, usize, f64)| {
                        (speed..speed + train.inertia.len()).contains(&n)
                    };
                    of(self.rotor()) || of(self.stator()) || n == self.axial() + 1
                };
                let faster: Y = std::array::from_fn(|n| if is_speed(n) { y[n] + h * a[n] } else { y[n] });
                let b = f(t + h, &faster);
                std::array::from_fn(|n| if is_speed(n) { faster[n] } else { y[n] + h * b[n] })
            }
            Method::Rk2 => plus(y, &[(h, &f(t + h / 2.0, &plus(y, &[(h / 2.0, &a)])))]),
            Method::Rk4 => {
                let b = f(t + h / 2.0, &plus(y, &[(h / 2.0, &a)]));
                let c = f(t + h / 2.0, &plus(y, &[(h / 2.0, &b)]));
                let d = f(t + h, &plus(y, &[(h, &c)]));
                plus(y, &[(h / 6.0, &a), (h / 3.0, &b), (h / 3.0, &c), (h / 6.0, &d)])
            }
            Method::ImplicitEuler => {
                let mut next = *y;
                for _ in 0..40 {
                    next = plus(y, &[(h, &f(t + h, &next))]);
                }
                next
            }
            Method::Adaptive(tolerance) => return self.dormand_prince(t, y, &a, doing, h, tolerance),
        };
        (next, 0.0)
    }

    fn dormand_prince(&self, t: f64, y: &Y, a: &Y, doing: Doing, h: f64, tolerance: f64) -> (Y, f64) {
        let f = |c: f64, y: &Y| self.rates(t + c * h, y, doing);
        let at = |terms: &[(f64, &Y)]| {
            let scaled: Vec<(f64, &Y)> = terms.iter().map(|(factor, k)| (h * factor, *k)).collect();
            plus(y, &scaled)
        };
        let b = f(0.2, &at(&[(0.2, a)]));
        let c = f(0.3, &at(&[(3.0 / 40.0, a), (9.0 / 40.0, &b)]));
        let d = f(0.8, &at(&[(44.0 / 45.0, a), (-56.0 / 15.0, &b), (32.0 / 9.0, &c)]));
        let e = f(
            8.0 / 9.0,
            &at(&[
                (19372.0 / 6561.0, a),
                (-25360.0 / 2187.0, &b),
                (64448.0 / 6561.0, &c),
                (-212.0 / 729.0, &d),
            ]),
        );
        let g = f(
            1.0,
            &at(&[
                (9017.0 / 3168.0, a),
                (-355.0 / 33.0, &b),
                (46732.0 / 5247.0, &c),
                (49.0 / 176.0, &d),
                (-5103.0 / 18656.0, &e),
            ]),
        );
        let next = at(&[
            (35.0 / 384.0, a),
            (500.0 / 1113.0, &c),
            (125.0 / 192.0, &d),
            (-2187.0 / 6784.0, &e),
            (11.0 / 84.0, &g),
        ]);
        let last = f(1.0, &next);
        let mut error: f64 = 0.0;
        for n in 0..MOST {
            let off = 71.0 / 57600.0 * a[n] - 71.0 / 16695.0 * c[n] + 71.0 / 1920.0 * d[n] - 17253.0 / 339200.0 * e[n]
                + 22.0 / 525.0 * g[n]
                - last[n] / 40.0;
            let size = tolerance * (y[n].abs().max(next[n].abs()) + 1e-3 * (h * a[n]).abs() + 1e-12);
            error = error.max((h * off).abs() / size);
        }
        (next, error)
    }

    /// Both surfaces get their mean speed by momentum.
    fn join(&self, t: f64, y: &mut Y) {
        let (rotor, stator) = (self.rotor(), self.stator());
        let speeds = [self.surface(rotor, t, y), self.surface(stator, t, y)];
        match (rotor.0.inertia.first(), stator.0.inertia.first()) {
            (Some(two), Some(one)) => {
                let mean = (two * speeds[0] + one * speeds[1]) / (two + one);
                (y[rotor.2], y[stator.2]) = (mean, mean);
            }
            (None, Some(_)) => y[stator.2] = speeds[0],
            (Some(_), None) => y[rotor.2] = speeds[1],
            (None, None) => {}
        }
    }

    /// Tested torque less limit, and the sense of the slip that it would cause.
    fn excess(&self, t: f64, y: &Y) -> (f64, f64) {
        let (rotor, stator, interface) = self.torques(t, y, &mut [0.0; MOST]);
        let tested = match self.tested {
            Tested::Interface => interface,
            Tested::Rotor => rotor,
            Tested::Stator => stator,
        };
        let limit = self.breakaway * self.system.breakaway * self.system.radius * self.normal_force(t, y);
        (tested.abs() - limit, interface.signum())
    }

    /// At t = 0.
    pub fn initial(&self) -> Y {
        let mut y = [0.0; MOST];
        let initial = &self.system.initial;
        for ((_, twist, speed, _), twists, speeds) in [
            (self.rotor(), &initial.rotor_twist, &initial.rotor_speed),
            (self.stator(), &initial.stator_twist, &initial.stator_speed),
        ] {
            y[twist..twist + twists.len()].copy_from_slice(twists);
            y[speed..speed + speeds.len()].copy_from_slice(speeds);
        }
        y
    }

    fn doing(&self, t: f64, y: &Y) -> Doing {
        if self.smooth.is_some() {
            return Doing::Engaged;
        }
        let w = self.relative_velocity(t, y);
        match self.excess(t, y) {
            _ if w.abs() > 1e-14 => Doing::Slip(w.signum()),
            (excess, sense) if excess > 0.0 => Doing::Slip(sense),
            _ => Doing::Stick,
        }
    }

    fn kick(&self, t: f64, y: &mut Y) {
        for kick in self.system.kicks.iter().filter(|kick| kick.time == KickTime::At(t)) {
            let (rotor, stator) = (self.rotor(), self.stator());
            let inertia = |train: &Train| train.inertia.first().copied().unwrap_or(f64::INFINITY);
            let (two, one) = (inertia(rotor.0), inertia(stator.0));
            let share = match kick.on {
                KickSide::Both if two.is_infinite() => 0.0,
                KickSide::Both if one.is_infinite() => 1.0,
                KickSide::Both => one / (one + two),
                KickSide::Rotor => 1.0,
                KickSide::Stator => 0.0,
            };
            if share > 0.0 {
                y[rotor.2] += share * kick.relative_velocity;
            }
            if share < 1.0 {
                y[stator.2] -= (1.0 - share) * kick.relative_velocity;
            }
        }
    }

    /// Corners and kicks after `from`.
    fn stops(&self, from: f64) -> Vec<f64> {
        let mut stops: Vec<f64> = self.system.drives().into_iter().flat_map(corners).collect();
        if let Pressing::Axial { actuation, .. } = &self.system.pressing {
            stops.extend(corners(&Drive::Linear(actuation.clone())));
        }
        if !self.unkicked {
            stops.extend(self.system.kicks.iter().filter_map(|kick| kick.time.at().copied()));
        }
        stops.retain(|&stop| stop > from);
        stops.sort_by(f64::total_cmp);
        stops
    }

    /// The motion from a state on, at these times; `None` if it chatters or takes too long.
    pub fn run(&self, from: f64, start: &Y, times: &[f64]) -> Option<Solved> {
        let (mut t, mut y) = (from, *start);
        let mut doing = self.doing(t, &y);
        let mut solved = Solved::default();
        let mut stops = self.stops(from).into_iter().peekable();
        let mut grid = 0usize;
        let mut pending = times.iter().copied().peekable();
        let mut size = self.step / 10.0;
        let period = self.period();
        let mut instants = 0;
        // A slip that has just begun is not over before it has moved forwards: with another test than that of the torque through the
        // interface it goes back a little at first.
        let mut begins = None;
        let (mut skipped, mut stays) = (self.skipped, false);
        let end = *times.last()?;
        while pending.peek().is_some_and(|&time| time <= from) {
            solved.rows.push((pending.next()?, y, doing));
        }
        for _ in 0..MOST_STEPS {
            if t >= end || pending.peek().is_none() {
                return Some(solved);
            }
            let planned = match self.method {
                Method::Adaptive(_) => t + size,
                _ => from + (grid + 1) as f64 * self.step,
            };
            let (to, stopped) = match stops.peek() {
                Some(&stop) if stop <= planned => (stop, true),
                _ => (planned, false),
            };
            let mut h = to - t;
            let (mut next, error) = self.advance(t, &y, doing, h);
            if let Method::Adaptive(_) = self.method {
                let factor = (0.9 * error.max(1e-6).powf(-0.2)).clamp(0.2, 5.0);
                size = (h * factor).min(self.step);
                if error > 1.0 {
                    continue;
                }
            }
            if !next.iter().all(|value| value.is_finite()) {
                return None;
            }
            stays &= self.excess(t, &y).0 > 0.0;
            let held = stays;
            let happens = |h: f64, next: &Y| match doing {
                Doing::Stick if held => false,
                Doing::Stick => self.excess(t + h, next).0 > 0.0,
                Doing::Slip(sense) => {
                    let w = sense * self.relative_velocity(t + h, next);
                    if begins.is_some() {
                        return false;
                    }
                    let slows = || w < sense * self.relative_velocity(t, &y) && self.excess(t + h, next).0 <= 0.0;
                    w < 0.0 || w <= self.band && slows()
                }
                Doing::Engaged => false,
            };
            let mut event = happens(h, &next);
            if event && doing == Doing::Stick && skipped == Some(solved.events.len()) {
                (event, skipped, stays) = (false, None, true);
            }
            let located = self.located && !(self.late_slips && doing == Doing::Stick);
            if event && located {
                let (mut low, mut high) = (0.0, h);
                for _ in 0..55 {
                    let middle = 0.5 * (low + high);
                    if happens(middle, &self.advance(t, &y, doing, middle).0) {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                h = high;
                next = self.advance(t, &y, doing, h).0;
                // A contact whose stick is weaker than its slip goes nowhere.
                instants = if h < 1e-9 * self.step { instants + 1 } else { 0 };
                if instants > 20 {
                    return None;
                }
            }
            if event && self.late.is_some_and(|(place, _)| place == solved.events.len()) {
                // The mode goes on for as long as the event is late, and the event is where it then is.
                let (_, late) = self.late?;
                let steps = (late / (2.0 * self.step)).ceil().max(1.0);
                let (mut time, mut state) = (t + h, next);
                self.sample(&mut solved, &mut pending, (t, &y, doing), time);
                for _ in 0..steps as usize {
                    let to = time + late / steps;
                    self.sample(&mut solved, &mut pending, (time, &state, doing), to);
                    state = self.advance(time, &state, doing, late / steps).0;
                    time = to;
                }
                (t, y) = (time, state);
            } else {
                let to = if event && located { t + h } else { to };
                self.sample(&mut solved, &mut pending, (t, &y, doing), to);
                (t, y) = (to, next);
            }
            if event {
                doing = self.happened(t, &mut y, doing, &mut solved.events);
                let began = solved.events.last().is_some_and(|(_, kind)| *kind == "slip");
                begins = began.then_some(t);
            } else if let (Some(begun), Doing::Slip(sense)) = (begins, doing)
                && (sense * self.relative_velocity(t, &y) > 0.0 || t - begun > 0.1 * period)
            {
                begins = None;
            }
            while t >= from + (grid + 1) as f64 * self.step * (1.0 - 1e-12) {
                grid += 1;
            }
            if stopped && !(event && located) {
                stops.next();
                // Opposite impulses on surfaces that stick cancel.
                if !self.unkicked && doing != Doing::Stick {
                    let before = y;
                    self.kick(t, &mut y);
                    if y != before {
                        doing = self.doing(t, &y);
                    }
                }
            }
            while stops.peek().is_some_and(|&stop| stop <= t) {
                stops.next();
            }
            if solved.events.len() > MOST_EVENTS {
                return None;
            }
        }
        None
    }

    /// The samples up to a time, from the state where a step begins.
    fn sample(
        &self,
        solved: &mut Solved,
        pending: &mut std::iter::Peekable<impl Iterator<Item = f64>>,
        (t, y, doing): (f64, &Y, Doing),
        to: f64,
    ) {
        while let Some(time) = pending.next_if(|&time| time <= to * (1.0 + 1e-15)) {
            solved.rows.push((time, self.advance(t, y, doing, time - t).0, doing));
        }
    }

    fn happened(&self, t: f64, y: &mut Y, doing: Doing, events: &mut Vec<(f64, &'static str)>) -> Doing {
        match doing {
            Doing::Slip(sense) => {
                let (excess, to) = self.excess(t, y);
                if excess > 0.0 {
                    if self.located {
                        self.join(t, y);
                    }
                    let after = if self.located { to } else { -sense };
                    if after != sense {
                        events.push((t, "reversal"));
                    }
                    return Doing::Slip(after);
                }
                if !self.frozen {
                    self.join(t, y);
                }
                events.push((t, "stick"));
                Doing::Stick
            }
            Doing::Stick => {
                self.join(t, y);
                events.push((t, "slip"));
                Doing::Slip(self.excess(t, y).1)
            }
            Doing::Engaged => Doing::Engaged,
        }
    }

    /// The names of channels, the likeliest of each first.
    pub fn channels(&self) -> Vec<Vec<String>> {
        let mut found = vec![vec!["relative_velocity".to_owned()]];
        let speed = |side: &str, i: usize, last: bool| {
            let mut names = vec![format!("{side}_speed_{i}")];
            let of_rotor = side == "rotor";
            if last && of_rotor {
                names.push("theta_dot".to_owned());
            }
            if i == 0 {
                names.push(if of_rotor { "phi2_dot" } else { "phi1_dot" }.to_owned());
            }
            names
        };
        for (side, train) in [("rotor", &self.system.rotor), ("stator", &self.system.stator)] {
            for i in 0..train.shafts() {
                for what in ["twist", "twist_rate"] {
                    let mut names = vec![format!("{side}_{what}_{i}")];
                    if i == 0 && side == "rotor" {
                        names.push(format!("{side}_{what}"));
                    }
                    found.push(names);
                }
            }
            let count = train.inertia.len();
            found.extend((0..count).map(|i| speed(side, i, i + 1 == count)));
        }
        found
    }

    /// The values of the channels, in their order.
    pub fn row(&self, t: f64, y: &Y, doing: Doing) -> Vec<f64> {
        let w = match doing {
            Doing::Stick if !self.frozen => 0.0,
            _ => self.relative_velocity(t, y),
        };
        let mut row = vec![w];
        let mut rates = [0.0; MOST];
        for of in [self.rotor(), self.stator()] {
            let (train, twist, speed, _) = of;
            self.train(of, t, y, &mut rates);
            for i in 0..train.shafts() {
                row.extend([y[twist + i], rates[twist + i]]);
            }
            row.extend(&y[speed..speed + train.inertia.len()]);
        }
        row
    }
}
