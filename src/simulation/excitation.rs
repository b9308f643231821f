//! What acts on a system from outside as functions of time: drives, external torques, and the normal force.

use crate::model::axial::{AxialMotion, ChangeCause, ContactChange, Ringing};
use crate::model::breakaway::Bounded;
use crate::model::equations::{Driving, Outside};
use crate::model::stability::SmoothForce;
use crate::model::system::{End, Pressing, System};
use crate::numerics::polynomial_roots::first_falling;
use crate::numerics::{Number, taylor};
use crate::signal::{Drive, Timeline};

/// Coefficients of the expansions by which zeros of the normal force are found.
const TERMS: usize = 20;

/// A share of its period over which a harmonic is as good as its first [`TERMS`] coefficients: 0.5 rad, 0.5^20/20! = 4e-25.
const REACH: f64 = 0.5;

/// A force that stands at zero is zero to this share of what it changes by over a step.
const ROUNDING: f64 = 1e-12;

/// What a force may fall below zero by, as a share of the largest, before a contact opens: its rounding.
const TOUCHING: f64 = 8.0 * f64::EPSILON;

/// A search for a zero ends after so many steps, and goes on from there.
const SEARCH: u32 = 100_000;

/// Where the signals of one train are among those of the timeline.
#[derive(Debug, Clone, Default)]
struct Places {
    speed: Option<usize>,
    torque: Option<usize>,
}

/// Where the normal force comes from.
#[derive(Debug, Clone)]
enum NormalForce {
    /// A signal, by its index; with a lower and an upper bound after each stretch.
    Direct(usize, Vec<(f64, f64)>),
    /// An axial motion, with the piece of the actuating force that each stretch is on.
    Axial(Box<AxialMotion>, Vec<usize>),
}

/// All signals of a case.
#[derive(Debug, Clone)]
pub struct Excitation {
    timeline: Timeline,
    rotor: Places,
    stator: Places,
    normal_force: NormalForce,
    /// The largest |F_n| or |F|, N.
    largest_force: f64,
}

/// Taylor coefficients of everything from outside, by powers of time over a unit.
#[derive(Debug, Clone)]
pub struct OutsideSeries<T, const N: usize> {
    /// Speed, its rate (per second), and torque of each side, rotor first.
    pub sides: [DrivingSeries<T, N>; 2],
    /// F_n, N.
    pub normal_force: [T; N],
    /// The degree beyond which F_n has no coefficients.
    pub degree: usize,
}

/// Of one side.
#[derive(Debug, Clone)]
pub struct DrivingSeries<T, const N: usize> {
    /// rad/s.
    pub speed: [T; N],
    /// The degree beyond which the speed has no coefficients; `None` of an end that stands or is free.
    pub speed_degree: Option<usize>,
    /// rad/s^2.
    pub acceleration: [T; N],
    /// N m.
    pub torque: [T; N],
    /// The degree beyond which the torque has no coefficients.
    pub torque_degree: usize,
}

impl<T: Number, const N: usize> OutsideSeries<T, N> {
    /// Nothing.
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

    /// Coefficient `n` of all of them.
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
    /// Of a case.
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
        // The last is the force that presses, or what actuates it.
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

    /// What rounding can make of the normal force, N.
    fn rounding(&self) -> f64 {
        TOUCHING * self.largest_force
    }

    /// By how much rounding of the normal force can move its zero at `t`, s: in every method alike. 0 at a corner, whose time is
    /// that of the case.
    pub fn rounding_of_zero(&self, t: f64) -> f64 {
        if self.corners().contains(&t) {
            return 0.0;
        }
        let mut series = OutsideSeries::<_, 4>::new();
        self.series(self.ringing_in_doubles(), self.stretch(t), t, 1.0, &mut series);
        let powers = series.normal_force.iter().enumerate().skip(1);
        powers
            .map(|(n, c)| (self.rounding() / c.abs()).powf(1.0 / n as f64))
            .fold(f64::INFINITY, f64::min)
    }

    /// Corners of any signal, s, increasing.
    pub fn corners(&self) -> &[f64] {
        self.timeline.corners()
    }

    /// The largest magnitude of the force that presses, N.
    pub fn largest_force(&self) -> f64 {
        self.largest_force
    }

    /// The stretch between corners of the signals that begins at `t` or holds it.
    pub fn stretch(&self, t: f64) -> usize {
        self.timeline.stretch(t)
    }

    /// The largest angular frequency of a harmonic in a stretch, rad/s; 0 without one.
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

    /// All of it at a time, as the stretch has it, but a normal force of 0.
    pub(super) fn driving_alone(&self, stretch: usize, t: f64) -> Outside {
        Outside {
            rotor: self.driving(&self.rotor, stretch, t),
            stator: self.driving(&self.stator, stretch, t),
            normal_force: 0.0,
        }
    }

    /// All of it at a time, as the stretch has it.
    pub fn at(&self, stretch: usize, t: f64) -> Outside {
        Outside {
            normal_force: self.normal_force(stretch, t),
            ..self.driving_alone(stretch, t)
        }
    }

    /// F_n, N, without the clamp at zero.
    #[inline]
    pub fn normal_force(&self, stretch: usize, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Direct(index, _) => self.timeline.value(*index, stretch, t),
            NormalForce::Axial(motion, pieces) => motion.pressing_on(pieces[stretch], t),
        }
    }

    /// The external torques of rotor and stator (N m) in a stretch in which they are constant and the ends rest; `None` in
    /// others.
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

    /// F_n without the clamp at zero, its rate (N/s), and a bound of its |second derivative| (N/s^2) from `t` to the end of the
    /// stretch.
    pub(super) fn pressing(&self, stretch: usize, t: f64) -> Bounded {
        match &self.normal_force {
            NormalForce::Direct(index, _) => Bounded {
                value: self.timeline.value(*index, stretch, t),
                rate: self.timeline.slope(*index, stretch, t),
                curvature: self.timeline.amplitude(*index, stretch, 2),
            },
            NormalForce::Axial(motion, _) => motion.bounded(t),
        }
    }

    /// A lower bound of F_n from `t` to `until` (s) in a stretch, N.
    pub(super) fn lowest_pressing(&self, stretch: usize, t: f64, until: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Direct(index, _) => {
                let mean = |t: f64| self.timeline.mean(*index, stretch, t);
                mean(t).min(mean(until)) - self.timeline.amplitude(*index, stretch, 0)
            }
            NormalForce::Axial(motion, _) => motion.lowest_pressing_force_after(t),
        }
    }

    /// The angles that the driven ends have turned through since t = 0, rad.
    pub fn angles(&self, t: f64) -> (f64, f64) {
        let of = |places: &Places| places.speed.map_or(0.0, |index| self.timeline.integral(index, t));
        (of(&self.rotor), of(&self.stator))
    }

    /// How far the rotor's driven end turns against the stator's in the `tau` (s) after `from`, within a stretch, rad: to the
    /// rounding of that angle.
    pub fn turned(&self, stretch: usize, from: f64, tau: f64) -> f64 {
        let of = |places: &Places| {
            let drive = places.speed.into_iter();
            drive
                .map(|index| self.timeline.integral_from(index, stretch, from, tau))
                .sum::<f64>()
        };
        of(&self.rotor) - of(&self.stator)
    }

    /// The ringing of the axial motion in any numbers, for [`Self::series`].
    pub(super) fn ringing<T: Number>(&self) -> Option<Ringing<T>> {
        self.axial().map(AxialMotion::ringing)
    }

    pub(super) fn ringing_in_doubles(&self) -> Option<&Ringing> {
        self.axial().map(AxialMotion::ringing_in_doubles)
    }

    /// Its Taylor coefficients about `t`, by powers of time over `unit` (s), with the [ringing](Self::ringing) of the axial
    /// motion. An enclosure is that of the [signals](Timeline::series) and of the [force](AxialMotion::pressing_series) in doubles.
    pub(super) fn series<T: Number, const N: usize>(
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

    /// F_n (N) at `t` (s) and its rate (N/s), where it is a straight line.
    pub fn line(&self, stretch: usize, t: f64) -> [f64; 2] {
        let mut series = OutsideSeries::<_, 2>::new();
        self.series(self.ringing_in_doubles(), stretch, t, 1.0, &mut series);
        series.normal_force
    }

    /// Whether the contact is closed from t = 0 on.
    pub(super) fn starts_closed(&self) -> bool {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.force.starts_positive(),
            NormalForce::Direct(index, _) => {
                let mut c = [0.0; TERMS];
                self.timeline.series(*index, self.stretch(0.0), 0.0, 1.0, &mut c);
                c.into_iter().find(|&c| c != 0.0).is_some_and(|first| first > 0.0)
            }
        }
    }

    /// The first corner of the force that presses after `t`, s.
    pub(crate) fn next_corner(&self, t: f64) -> Option<f64> {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.force.next_corner(t),
            NormalForce::Direct(..) => Some(self.timeline.end(self.timeline.stretch(t))).filter(|end| end.is_finite()),
        }
    }

    /// A lower bound of F_n from `t` on, for ever, N.
    pub(crate) fn lowest_pressing_force_after(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.lowest_pressing_force_after(t),
            NormalForce::Direct(index, later) => {
                let stretch = self.timeline.stretch(t);
                later[stretch].0.min(self.timeline.bounds(*index, stretch, t).0)
            }
        }
    }

    /// An upper bound of F_n from `t` on, for ever, N.
    pub(crate) fn highest_pressing_force_after(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.highest_pressing_force_after(t),
            NormalForce::Direct(index, later) => {
                let stretch = self.timeline.stretch(t);
                later[stretch].1.max(self.timeline.bounds(*index, stretch, t).1)
            }
        }
    }

    /// A bound on |d^2/dt^2| of F_n from `t` to the next corner, N/s^2.
    pub(crate) fn curvature_bound(&self, t: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.curvature_bound(t),
            NormalForce::Direct(index, _) => self.timeline.amplitude(*index, self.timeline.stretch(t), 2),
        }
    }

    /// Whether F_n is a straight line from `t` to the next corner, up to rounding.
    pub(crate) fn is_silent(&self, t: f64) -> bool {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.is_silent(t),
            NormalForce::Direct(..) => t >= self.silent_from(t),
        }
    }

    /// From when on F_n is a straight line in the stretch that holds `t`, s; infinite if it never is.
    pub(crate) fn silent_from(&self, t: f64) -> f64 {
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

    /// When what rings in F_n since its last corner has died by so many e-folds, s; infinite if it never does.
    pub(crate) fn dies_by(&self, t: f64, e_folds: f64) -> f64 {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.dies_by(t, e_folds),
            NormalForce::Direct(..) => self.silent_from(t),
        }
    }

    /// The force that presses at `t`, as a forecast needs it: of an axial mode the actuating one.
    pub(crate) fn smooth_force(&self, t: f64) -> SmoothForce {
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

    /// The next time after `t`, no later than `until`, at which the contact opens (`closed`) or closes; see
    /// [`AxialMotion::next_contact_change`].
    pub fn next_contact_change(&self, t: f64, closed: bool, departing: bool, until: f64) -> Option<ContactChange> {
        match &self.normal_force {
            NormalForce::Axial(motion, _) => motion.next_contact_change(t, closed, departing, until),
            NormalForce::Direct(index, _) => self.next_zero(*index, t, closed, departing, until),
        }
    }

    /// The same of a signal: in each stretch by the roots of its series, at each corner by the side to which it goes on.
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
                    // It leaves zero here.
                    c.rotate_left(1);
                    c[TERMS - 1] = 0.0;
                } else {
                    // A force that touches zero does not let go by rounding.
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
                // A force that is nothing presses nobody.
                None if closed => return Some(ContactChange::new(end, ChangeCause::Corner)),
                Some(_) if c[0] == 0.0 => departing = true,
                _ => {}
            }
            from = end;
        }
    }
}

/// The degree beyond which a series has no coefficients.
fn degree<T: Number>(series: &[T]) -> usize {
    series.iter().rposition(|&c| c != T::of(0.0)).unwrap_or(0)
}

/// A lower and an upper bound of a drive after the end of each stretch.
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

/// The zero of a polynomial near `share`, where it falls through zero with `lift` added; `c` has it. Where the polynomial hardly
/// falls there, its zero is not to be told from `share`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Coulomb;
    use crate::model::system::{ContactLaw, Initial, Train};
    use crate::model::{Axial, BreakawayTest};
    use crate::signal::{Drive, Frequency, Ramp, Shape, Signal, Wave};

    /// A free inertia on the ground, pressed so.
    fn pressed(pressing: Pressing) -> Excitation {
        let free = Train {
            inertia: vec![1.0],
            stiffness: Vec::new(),
            damping: Vec::new(),
            viscous: vec![0.0],
            end: End::Free,
            torque: None,
        };
        let ground = Train {
            inertia: Vec::new(),
            viscous: Vec::new(),
            end: End::Fixed,
            ..free.clone()
        };
        Excitation::new(&System {
            rotor: free,
            stator: ground,
            radius: 1.0,
            pressing,
            breakaway: 0.3,
            breakaway_test: BreakawayTest::Transmitted,
            law: Coulomb { kinetic: 0.3 }.into(),
            contact: ContactLaw::StickSlip,
            initial: Initial {
                rotor_twist: Vec::new(),
                rotor_speed: vec![1.0],
                stator_twist: Vec::new(),
                stator_speed: Vec::new(),
            },
            kicks: Vec::new(),
        })
    }

    fn wave(amplitude: f64, from: Option<f64>, to: Option<f64>) -> Drive {
        Drive::Wave(Wave {
            shape: Shape::Sine,
            mean: 10.0,
            amplitude,
            frequency: Frequency::Angular(20.0),
            phase: 0.3,
            from,
            to,
        })
    }

    /// A force, and whether it is a straight line at 0.7 s and at 2.5 s.
    fn forces() -> Vec<(Pressing, [bool; 2])> {
        let ramp = |value: f64| Signal::Ramp(Ramp { value, rise_time: 1.0 });
        let axial = Axial {
            mass: 4.54,
            stiffness: 55.38e6,
            damping: 8760.0,
            ringing_floor: Axial::RINGING_FLOOR,
        };
        let actuation = ramp(2000.0);
        let linear = Drive::Linear(ramp(100.0));
        let waving = Drive::Sum(vec![linear.clone(), wave(-30.0, Some(0.5), Some(2.0))]);
        vec![
            (Pressing::Force(Drive::Value(5.0)), [true, true]),
            (Pressing::Force(linear), [true, true]),
            (Pressing::Force(waving), [false, true]),
            (Pressing::Force(wave(30.0, None, None)), [false, false]),
            (Pressing::Axial { axial, actuation }, [false, true]),
        ]
    }

    /// Bounds against samples. They are no wider than by the harmonic on a line, or the ringing of 2 N that a corner sets going.
    #[test]
    fn property_the_force_keeps_its_bounds() {
        for (pressing, silent) in forces() {
            let excitation = pressed(pressing);
            let force = |t: f64| excitation.normal_force(excitation.stretch(t), t);
            for from in [0.0, 0.3, 0.7, 1.5, 2.5] {
                let samples = (0..4000).map(|k| from + 1e-3 * f64::from(k));
                let least = samples.clone().map(force).fold(f64::INFINITY, f64::min);
                let most = samples.map(force).fold(f64::NEG_INFINITY, f64::max);
                let low = excitation.lowest_pressing_force_after(from);
                let high = excitation.highest_pressing_force_after(from);
                let (rounding, wide) = (1e-12 * most, 65.0);
                let said = format!("{from}: {least} to {most} in {low} to {high}");
                assert!(low <= least + rounding && most <= high + rounding, "{said}");
                assert!(least - low <= wide && high - most <= wide, "{said}");
                let next = excitation.corners().iter().copied().find(|corner| *corner > from);
                assert_eq!(excitation.next_corner(from), next);
                let smooth = excitation.smooth_force(from);
                if excitation.axial().is_none() {
                    assert!((smooth.value - force(from)).abs() <= smooth.swing + rounding, "{from}");
                }
                if excitation.is_silent(from) {
                    assert!(
                        (smooth.value - force(from)).abs() <= rounding && smooth.swing == 0.0,
                        "{from}"
                    );
                    assert!(excitation.silent_from(from) <= from);
                }
            }
            assert_eq!([0.7, 2.5].map(|t| excitation.is_silent(t)), silent);
        }
    }

    /// The bound of the curvature against differences, whose own error is that of the second-next derivative.
    #[test]
    fn property_the_force_bends_no_more_than_is_said() {
        let h = 1e-4;
        for (number, (pressing, _)) in forces().into_iter().enumerate() {
            let excitation = pressed(pressing);
            let force = |t: f64| excitation.normal_force(excitation.stretch(t), t);
            let mut sharpest: f64 = 0.0;
            for from in [0.0, 0.6, 1.2, 2.5] {
                let end = excitation.next_corner(from).unwrap_or(from + 1.0);
                let curvature = excitation.curvature_bound(from);
                let times = (1..400).map(|k| from + (end - from) * f64::from(k) / 400.0);
                for t in times.filter(|t| t + h < end && t - h > from) {
                    let bend = ((force(t + h) - 2.0 * force(t) + force(t - h)) / (h * h)).abs();
                    // Rounding of a force of up to 2000 N, over h^2.
                    let rounding = 8.0 * f64::EPSILON * force(t).abs() / (h * h);
                    assert!(bend <= curvature + rounding, "{t}: {bend} and {curvature}");
                    sharpest = sharpest.max(bend / curvature);
                }
            }
            // A harmonic alone attains it.
            assert!(number != 3 || sharpest > 0.99, "{sharpest}");
        }
    }
}
