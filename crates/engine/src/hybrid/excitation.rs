//! External inputs of a system as functions of time: drives, external torques, and the normal force.

use stickslip_system::model::axial::{AxialMotion, ChangeCause, ContactChange, Ringing};
use stickslip_system::model::breakaway::Bounded;
use stickslip_system::model::equations::{Driving, Outside};
use stickslip_system::model::stability::SmoothForce;
use stickslip_system::model::system::{End, Pressing, System};
use stickslip_system::numerics::polynomial_roots::first_falling;
use stickslip_system::numerics::{Number, taylor};
use stickslip_system::signal::{Drive, Timeline};

/// Number of coefficients in the expansions that locate zeros of the normal force.
pub const TERMS: usize = 20;

/// Phase (rad) over which a harmonic equals its first [`TERMS`] coefficients: 0.5^20/20! = 4e-25.
const REACH: f64 = 0.5;

/// A force below this share of its change over a step counts as zero.
const ROUNDING: f64 = 1e-12;

/// Rounding of the normal force, relative to its largest value: the contact opens only if the force falls deeper below
/// zero.
const TOUCHING: f64 = 8.0 * f64::EPSILON;

/// An input below this share of its later magnitude does not show the size of the motion, because it begins at zero.
const WEAK: f64 = 1e-3;

const SEARCH: u32 = 100_000;

#[derive(Debug, Clone, Default)]
struct Places {
    speed: Option<usize>,
    torque: Option<usize>,
}

#[derive(Debug, Clone)]
enum NormalForce {
    Direct(usize, Vec<(f64, f64)>),
    Axial(Box<AxialMotion>, Vec<usize>),
}

/// All signals of a system, as functions of time.
#[derive(Debug, Clone)]
pub struct Excitation {
    timeline: Timeline,
    rotor: Places,
    stator: Places,
    normal_force: NormalForce,
    /// Largest |F_n| or |F|, N.
    largest_force: f64,
}

/// Taylor coefficients of all external inputs, by powers of time over a unit.
#[derive(Debug, Clone)]
pub struct OutsideSeries<T, const N: usize> {
    /// Rotor first.
    pub sides: [DrivingSeries<T, N>; 2],
    pub normal_force: [T; N],
    /// Degree of F_n.
    pub degree: usize,
}

#[derive(Debug, Clone)]
pub struct DrivingSeries<T, const N: usize> {
    pub speed: [T; N],
    /// Degree of the speed; `None` if the end is fixed or free.
    pub speed_degree: Option<usize>,
    pub acceleration: [T; N],
    pub torque: [T; N],
    pub torque_degree: usize,
}

impl<T: Number, const N: usize> OutsideSeries<T, N> {
    pub fn new() -> Self {
        let nothing = taylor::zeros();
        let side = DrivingSeries {
            speed: nothing,
            speed_degree: None,
            acceleration: nothing,
            torque: nothing,
            torque_degree: 0,
        };
        OutsideSeries {
            sides: [side.clone(), side],
            normal_force: nothing,
            degree: 0,
        }
    }

    pub fn coefficient(&self, n: usize) -> Outside<T> {
        let [rotor, stator] = self.sides.each_ref().map(|side| Driving {
            speed: side.speed[n],
            acceleration: side.acceleration[n],
            torque: side.torque[n],
        });
        Outside {
            rotor,
            stator,
            normal_force: self.normal_force[n],
        }
    }
}

impl Excitation {
    /// The signals of a system.
    pub fn new(system: &System) -> Excitation {
        // In the order of `System::drives`.
        let mut count = 0;
        let mut next = |is_there: bool| {
            is_there.then(|| {
                count += 1;
                count - 1
            })
        };
        let [rotor, stator] = [&system.rotor, &system.stator].map(|train| Places {
            speed: next(matches!(train.end, End::Driven(_))),
            torque: next(train.torque.is_some()),
        });
        let direct = count;
        let actuation = match &system.pressing {
            Pressing::Force(_) => None,
            Pressing::Axial { actuation, .. } => Some(Drive::Linear(actuation.clone())),
        };
        // The last drive is the normal force or its actuation.
        let mut drives = system.drives();
        drives.extend(&actuation);
        let timeline = Timeline::new(&drives);
        let (normal_force, largest_force) = match &system.pressing {
            Pressing::Force(force) => (
                NormalForce::Direct(direct, bounds_after(&timeline, direct)),
                force.largest(),
            ),
            Pressing::Axial { axial, actuation } => {
                let motion = AxialMotion::new(axial, actuation);
                let largest = motion.force.largest();
                let stretches = 0..=timeline.corners().len();
                let pieces = stretches.map(|stretch| motion.force.index(timeline.start(stretch)));
                let pieces = pieces.collect();
                (NormalForce::Axial(Box::new(motion), pieces), largest)
            }
        };
        Excitation {
            timeline,
            rotor,
            stator,
            normal_force,
            largest_force,
        }
    }

    fn rounding(&self) -> f64 {
        TOUCHING * self.largest_force
    }

    /// Shift (s) of the normal force's zero at `t` (s) by rounding, the same in every method. The time of a corner is
    /// exact.
    pub fn rounding_of_zero(&self, t: f64) -> f64 {
        if self.corners().contains(&t) {
            return self.axial().map_or(0.0, |motion| motion.rounding_at_corner(t));
        }
        let mut series = OutsideSeries::<_, 4>::new();
        self.series(self.ringing_in_doubles(), self.stretch(t), t, 1.0, &mut series);
        let powers = series.normal_force.iter().enumerate().skip(1);
        let rounding = self.rounding() + self.axial().map_or(0.0, |motion| motion.rounding_of_times(t));
        powers
            .map(|(n, c)| (rounding / c.abs()).powf(1.0 / n as f64))
            .fold(f64::INFINITY, f64::min)
    }

    /// Corners of any signal, s, increasing.
    pub fn corners(&self) -> &[f64] {
        self.timeline.corners()
    }

    /// Largest magnitude of the normal force, N.
    pub fn largest_force(&self) -> f64 {
        self.largest_force
    }

    /// Index of the stretch between corners of the signals that begins at `t` (s) or contains it.
    pub fn stretch(&self, t: f64) -> usize {
        self.timeline.stretch(t)
    }

    /// Largest angular frequency of a harmonic in a stretch, rad/s; 0 without one.
    pub fn fastest(&self, stretch: usize) -> f64 {
        self.timeline.fastest(stretch)
    }

    /// The axial motion, if the normal force comes from one.
    pub fn axial(&self) -> Option<&AxialMotion> {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => Some(motion),
            NormalForce::Direct(..) => None,
        }
    }

    fn driving(&self, places: &Places, stretch: usize, t: f64) -> Driving {
        let value = |place: Option<usize>| place.map_or(0.0, |index| self.timeline.value(index, stretch, t));
        Driving {
            speed: value(places.speed),
            acceleration: places.speed.map_or(0.0, |index| self.timeline.slope(index, stretch, t)),
            torque: value(places.torque),
        }
    }

    pub(crate) fn driving_alone(&self, stretch: usize, t: f64) -> Outside {
        Outside {
            rotor: self.driving(&self.rotor, stretch, t),
            stator: self.driving(&self.stator, stretch, t),
            normal_force: 0.0,
        }
    }

    /// Inputs at `t` (s) by the functions of a stretch.
    pub fn at(&self, stretch: usize, t: f64) -> Outside {
        Outside {
            normal_force: self.normal_force(stretch, t),
            ..self.driving_alone(stretch, t)
        }
    }

    /// Inputs that show the size of a motion from `t` (s) on: the inputs at `t`, but for an input that is still weak
    /// its largest magnitude up to the end of the stretch.
    pub(crate) fn ahead(&self, stretch: usize, t: f64) -> Outside {
        let mut outside = self.at(stretch, t);
        let grow = |now: &mut f64, most: f64| {
            if now.abs() < WEAK * most {
                *now = most;
            }
        };
        let most = |index: usize| {
            let (low, high) = self.timeline.bounds(index, stretch, t);
            low.abs().max(high.abs())
        };
        let sides = [(&self.rotor, &mut outside.rotor), (&self.stator, &mut outside.stator)];
        for (places, driving) in sides {
            grow(&mut driving.speed, places.speed.map_or(0.0, most));
            grow(&mut driving.torque, places.torque.map_or(0.0, most));
        }
        let force = match &self.normal_force {
            NormalForce::Direct(index, _) => most(*index),
            NormalForce::Axial(..) => self.largest_force,
        };
        grow(&mut outside.normal_force, force);
        outside
    }

    /// F_n, N, without the clamp at zero.
    #[inline]
    pub fn normal_force(&self, stretch: usize, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Direct(index, _) => self.timeline.value(*index, stretch, t),
            NormalForce::Axial(motion, pieces) => motion.pressing_on(pieces[stretch], t),
        }
    }

    /// External torques of rotor and stator (N m) in a stretch in which they are constant and the ends rest; `None` in
    /// other stretches.
    pub fn at_rest(&self, stretch: usize) -> Option<[f64; 2]> {
        let start = self.timeline.start(stretch);
        let constant = |index: usize| {
            let value = self.timeline.value(index, stretch, start);
            self.timeline.is_constant(index, stretch).then_some(value)
        };
        let of = |places: &Places| {
            let rests = places.speed.is_none_or(|index| constant(index) == Some(0.0));
            rests.then(|| places.torque.map_or(Some(0.0), constant)).flatten()
        };
        Some([of(&self.rotor)?, of(&self.stator)?])
    }

    /// F_n without the clamp at zero (N), its rate (N/s), and a bound on |F_n''| (N/s^2) from `t` to the end of the
    /// stretch.
    pub(crate) fn pressing(&self, stretch: usize, t: f64) -> Bounded {
        match &self.normal_force {
            NormalForce::Direct(index, _) => Bounded {
                value: self.timeline.value(*index, stretch, t),
                rate: self.timeline.slope(*index, stretch, t),
                curvature: self.timeline.amplitude(*index, stretch, 2),
            },
            NormalForce::Axial(motion, _) => motion.bounded(t),
        }
    }

    /// Lower bound of F_n from `t` to `until` (s) in a stretch, N.
    pub(crate) fn lowest_pressing(&self, stretch: usize, t: f64, until: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Direct(index, _) => {
                let mean = |t: f64| self.timeline.mean(*index, stretch, t);
                mean(t).min(mean(until)) - self.timeline.amplitude(*index, stretch, 0)
            }
            NormalForce::Axial(motion, _) => motion.lowest_pressing_force_after(t),
        }
    }

    /// Angles of the driven ends since t = 0, rad.
    pub fn angles(&self, t: f64) -> (f64, f64) {
        let of = |places: &Places| places.speed.map_or(0.0, |index| self.timeline.integral(index, t));
        (of(&self.rotor), of(&self.stator))
    }

    /// Angle (rad) by which the rotor's driven end turns relative to the stator's in the `tau` (s) after `from`,
    /// within a stretch. Its error is the rounding of this angle.
    pub fn turned(&self, stretch: usize, from: f64, tau: f64) -> f64 {
        let of = |places: &Places| {
            let drive = places.speed.into_iter();
            drive
                .map(|index| self.timeline.integral_from(index, stretch, from, tau))
                .sum::<f64>()
        };
        of(&self.rotor) - of(&self.stator)
    }

    pub(crate) fn ringing<T: Number>(&self) -> Option<Ringing<T>> {
        self.axial().map(AxialMotion::ringing)
    }

    pub(crate) fn ringing_in_doubles(&self) -> Option<&Ringing> {
        self.axial().map(AxialMotion::ringing_in_doubles)
    }

    /// Taylor coefficients about `t` by powers of time over `unit` (s), with the [ringing](Self::ringing) of the axial
    /// motion. Enclosures contain the values that the [signals](Timeline::series) and the
    /// [force](AxialMotion::pressing_series) have in doubles.
    pub(crate) fn series<T: Number, const N: usize>(
        &self,
        ringing: Option<&Ringing<T>>,
        stretch: usize,
        t: f64,
        unit: f64,
        out: &mut OutsideSeries<T, N>,
    ) {
        for (places, side) in [&self.rotor, &self.stator].into_iter().zip(&mut out.sides) {
            if let Some(index) = places.speed {
                self.timeline.series(index, stretch, t, unit, &mut side.speed);
                let degree = degree(&side.speed);
                side.speed_degree = Some(degree);
                side.acceleration[degree..].fill(T::of(0.0));
                for n in 0..degree {
                    side.acceleration[n] = T::of((n + 1) as f64) * side.speed[n + 1] / T::of(unit);
                }
            }
            if let Some(index) = places.torque {
                self.timeline.series(index, stretch, t, unit, &mut side.torque);
                side.torque_degree = degree(&side.torque);
            }
        }
        match &self.normal_force {
            NormalForce::Direct(index, _) => {
                self.timeline.series(*index, stretch, t, unit, &mut out.normal_force);
                out.degree = degree(&out.normal_force);
            }
            NormalForce::Axial(motion, _) => {
                let ringing = ringing.expect("an axial motion comes with its ringing");
                out.degree = motion.pressing_series(ringing, t, unit, &mut out.normal_force);
            }
        }
    }

    /// F_n (N) and its rate (N/s) at `t` (s), where F_n is a straight line.
    pub fn line(&self, stretch: usize, t: f64) -> [f64; 2] {
        let mut series = OutsideSeries::<_, 2>::new();
        self.series(self.ringing_in_doubles(), stretch, t, 1.0, &mut series);
        series.normal_force
    }

    pub(crate) fn starts_closed(&self) -> bool {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.force.starts_positive(),
            NormalForce::Direct(index, _) => {
                let mut c = [0.0; TERMS];
                self.timeline.series(*index, self.stretch(0.0), 0.0, 1.0, &mut c);
                c.into_iter().find(|&c| c != 0.0).is_some_and(|first| first > 0.0)
            }
        }
    }

    /// First corner of the normal force's signal after `t`, s.
    pub fn next_corner(&self, t: f64) -> Option<f64> {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.force.next_corner(t),
            NormalForce::Direct(..) => Some(self.timeline.end(self.timeline.stretch(t))).filter(|end| end.is_finite()),
        }
    }

    /// Lower bound of F_n from `t` on, N.
    pub fn lowest_pressing_force_after(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.lowest_pressing_force_after(t),
            NormalForce::Direct(index, later) => {
                let stretch = self.timeline.stretch(t);
                later[stretch].0.min(self.timeline.bounds(*index, stretch, t).0)
            }
        }
    }

    /// Upper bound of F_n from `t` on, N.
    pub fn highest_pressing_force_after(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.highest_pressing_force_after(t),
            NormalForce::Direct(index, later) => {
                let stretch = self.timeline.stretch(t);
                later[stretch].1.max(self.timeline.bounds(*index, stretch, t).1)
            }
        }
    }

    /// Bound on |F_n''| from `t` to the next corner, N/s^2.
    pub fn curvature_bound(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.curvature_bound(t),
            NormalForce::Direct(index, _) => self.timeline.amplitude(*index, self.timeline.stretch(t), 2),
        }
    }

    /// Whether F_n is a straight line from `t` to the next corner, up to rounding.
    pub fn is_silent(&self, t: f64) -> bool {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.is_silent(t),
            NormalForce::Direct(..) => t >= self.silent_from(t),
        }
    }

    /// Time from which F_n is a straight line in the stretch that contains `t`, s; infinite if it never is.
    pub fn silent_from(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.silent_from(t),
            NormalForce::Direct(index, _) => {
                let stretch = self.timeline.stretch(t);
                if self.timeline.amplitude(*index, stretch, 0) > 0.0 {
                    f64::INFINITY
                } else {
                    self.timeline.start(stretch)
                }
            }
        }
    }

    /// Time at which the ringing of F_n since its last corner has decayed by this many e-folds, s; infinite if never.
    pub(crate) fn dies_by(&self, t: f64, e_folds: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.dies_by(t, e_folds),
            NormalForce::Direct(..) => self.silent_from(t),
        }
    }

    /// Normal force at `t` (s) for a forecast. With an axial mode it is the actuating force.
    pub fn smooth_force(&self, t: f64) -> SmoothForce {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => SmoothForce {
                value: motion.force.value(t),
                swing: 0.0,
            },
            NormalForce::Direct(index, _) => {
                let stretch = self.timeline.stretch(t);
                SmoothForce {
                    value: self.timeline.mean(*index, stretch, t),
                    swing: self.timeline.amplitude(*index, stretch, 0),
                }
            }
        }
    }

    /// Next time after `t`, at most `until`, at which the contact opens (`closed`) or closes; see
    /// [`AxialMotion::next_contact_change`].
    pub fn next_contact_change(&self, t: f64, closed: bool, departing: bool, until: f64) -> Option<ContactChange> {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.next_contact_change(t, closed, departing, until),
            NormalForce::Direct(index, _) => self.next_zero(*index, t, closed, departing, until),
        }
    }

    /// [`Self::next_contact_change`] for a signal: roots of its series in each stretch; at a corner, the sign after
    /// it.
    fn next_zero(&self, index: usize, t: f64, closed: bool, departing: bool, until: f64) -> Option<ContactChange> {
        let sign = if closed { 1.0 } else { -1.0 };
        let (mut from, mut departing) = (t, departing);
        let mut steps = SEARCH;
        let corners = self.timeline.corners();
        loop {
            let stretch = self.timeline.stretch(from);
            let end = corners.get(stretch).copied().unwrap_or(f64::INFINITY).min(until);
            let fastest = self.timeline.fastest(stretch);
            while from < end {
                if steps == 0 {
                    return Some(ContactChange::new(from, ChangeCause::Searched));
                }
                steps -= 1;
                let longest = if fastest > 0.0 { REACH / fastest } else { f64::INFINITY };
                let step = longest.min(end - from);
                let unit = if step.is_finite() { step } else { 1.0 };
                let mut c = [0.0; TERMS];
                self.timeline.series(index, stretch, from, unit, &mut c);
                c.iter_mut().for_each(|c| *c *= sign);
                let size: f64 = c.iter().map(|c| c.abs()).sum();
                let mut lift = 0.0;
                if departing && c[0].abs() <= ROUNDING * size {
                    c.rotate_left(1);
                    c[TERMS - 1] = 0.0;
                } else {
                    // A force that touches zero does not open the contact by rounding.
                    lift = self.rounding();
                    c[0] += lift;
                }
                departing = false;
                let zero = if c[0] < 0.0 { Some(0.0) } else { first_falling(&c) };
                if let Some(share) = zero {
                    let share = without_lift(&c, lift, share);
                    return Some(ContactChange::new((from + share * unit).min(end), ChangeCause::Zero));
                }
                if !step.is_finite() {
                    return None;
                }
                from = if step < end - from { from + step } else { end };
            }
            departing = false;
            if end >= until {
                return None;
            }
            let mut c = [0.0; TERMS];
            self.timeline.series(index, stretch + 1, end, 1.0, &mut c);
            let swing = self.timeline.amplitude(index, stretch + 1, 0);
            if c[0].abs() <= TOUCHING * swing {
                // The value of a harmonic is rounded.
                c[0] = 0.0;
            }
            match c.into_iter().find(|&c| c != 0.0) {
                Some(first) if sign * first < 0.0 => {
                    let stood = c[0] != 0.0;
                    let cause = if stood {
                        ChangeCause::Beyond
                    } else {
                        ChangeCause::Corner
                    };
                    return Some(ContactChange::new(end, cause));
                }
                None if closed => return Some(ContactChange::new(end, ChangeCause::Corner)),
                Some(_) if c[0] == 0.0 => departing = true,
                _ => {}
            }
            from = end;
        }
    }
}

fn degree<T: Number>(series: &[T]) -> usize {
    series.iter().rposition(|&c| c != T::of(0.0)).unwrap_or(0)
}

fn bounds_after(timeline: &Timeline, drive: usize) -> Vec<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut bounds = vec![(low, high); timeline.corners().len() + 1];
    for stretch in (0..bounds.len()).rev() {
        bounds[stretch] = (low, high);
        let (least, most) = timeline.bounds(drive, stretch, timeline.start(stretch));
        (low, high) = (low.min(least), high.max(most));
    }
    bounds
}

/// Zero of the polynomial `c` (which includes `lift`) without `lift`, near `share`. It is `share` itself if the
/// polynomial hardly falls there.
fn without_lift(c: &[f64], lift: f64, share: f64) -> f64 {
    let slope = c.iter().enumerate().skip(1).rev();
    let slope = slope.fold(0.0, |sum, (n, c)| sum * share + n as f64 * c);
    let earlier = (share + lift / slope).max(0.0);
    if earlier < share && taylor::value(c, earlier) <= 2.0 * lift {
        earlier
    } else {
        share
    }
}
