//! The equations of two chains of inertias as recurrences of Taylor coefficients.
//!
//! Both chains share one form, with a sign: +1 for the rotor, whose twists are outer minus inner angle, and -1 for the
//! stator. With the speeds w from the contact outwards, w_i = w_(i+1) - sign times the rate of shaft i. The torque S_i
//! of a shaft acts with that sign on its inner inertia and against it on its outer one. The torque T of the contact
//! acts against the sign on the surface.

use super::axial::ExactAxialMotion;
use super::contact::{ContactSeries, ExactContact};
use super::courses::{CourseSeries, SignalCourse};
use super::elementary::Elementary;
use super::float::Float;
use super::margin::twice_resistance;
use super::roots::evaluate;
use super::scales::Scales;
use super::steps::largest_order;
use num_rational::BigRational;
use stickslip_system::model::system::{End, ExactSystem, Pressing, Train};

pub(super) const ROTOR: usize = 0;
pub(super) const STATOR: usize = 1;

/// The regime of the equations. Slip and contacts without stick have the sign of omega_r and the piece of the friction
/// law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ExactRegime {
    Open,
    Stick,
    Slip(i8, usize),
    Engaged(i8, usize),
}

#[derive(Debug, Clone)]
pub(super) struct State<const N: usize> {
    pub chains: [ChainState<N>; 2],
    /// z and z' of an axial mode, m and m/s.
    pub axial: Option<[Float<N>; 2]>,
    pub deflection: Float<N>,
}

impl<const N: usize> State<N> {
    pub fn is_lost(&self) -> bool {
        let chains = self.chains.iter();
        let mut all = chains.flat_map(|chain| chain.twist.iter().chain(&chain.rate).chain(&chain.free));
        let axial = self.axial.iter().flatten();
        all.any(|value| !value.is_finite()) || axial.chain([&self.deflection]).any(|value| !value.is_finite())
    }

    pub fn cut(&mut self, bits: usize) {
        for chain in &mut self.chains {
            let all = chain.twist.iter_mut().chain(&mut chain.rate).chain(&mut chain.free);
            all.chain([&mut chain.angle]).for_each(|value| value.cut(bits));
        }
        let axial = self.axial.iter_mut().flatten();
        axial.chain([&mut self.deflection]).for_each(|value| value.cut(bits));
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct ChainState<const N: usize> {
    pub twist: Vec<Float<N>>,
    pub rate: Vec<Float<N>>,
    /// Speed of a free outermost inertia, rad/s.
    pub free: Option<Float<N>>,
    /// Angle of that inertia, rad: a quadrature, on which nothing else depends.
    pub angle: Float<N>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Far {
    Free,
    Fixed,
    Driven(usize),
}

#[derive(Debug)]
pub(super) struct Chain<const N: usize> {
    rotor: bool,
    per_inertia: Vec<Float<N>>,
    surface_inertia: Option<Float<N>>,
    stiffness: Vec<Float<N>>,
    damping: Vec<Float<N>>,
    viscous: Vec<Float<N>>,
    pub far: Far,
    /// Indices of the signal and of the inertia.
    torque: Option<(usize, usize)>,
}

impl<const N: usize> Chain<N> {
    fn new(train: &Train<BigRational>, rotor: bool, courses: &mut usize) -> Self {
        let numbers = |values: &[BigRational]| values.iter().map(Float::from_rational).collect();
        let mut next = || {
            *courses += 1;
            *courses - 1
        };
        let far = match train.end {
            End::Driven(_) => Far::Driven(next()),
            End::Free if !train.is_rigid() => Far::Free,
            End::Free | End::Fixed => Far::Fixed,
        };
        Chain {
            rotor,
            per_inertia: train.inertia.iter().map(|j| Float::from_rational(&j.recip())).collect(),
            surface_inertia: train.inertia.first().map(Float::from_rational),
            stiffness: numbers(&train.stiffness),
            damping: numbers(&train.damping),
            viscous: numbers(&train.viscous),
            far,
            torque: train.torque.as_ref().map(|torque| (next(), torque.on)),
        }
    }

    pub fn signed(&self, value: &Float<N>) -> Float<N> {
        if self.rotor { *value } else { -value }
    }

    pub fn is_rigid(&self) -> bool {
        self.per_inertia.is_empty()
    }

    /// Speeds from the contact outwards, from the twist rates and the speed of the last shaft's far end.
    fn speeds(&self, rates: impl Fn(usize) -> Float<N>, end: Float<N>) -> Vec<Float<N>> {
        let inertias = self.per_inertia.len();
        let mut speeds = vec![end; inertias];
        for i in (0..inertias).rev() {
            if i + 1 == inertias && self.far == Far::Free {
                continue;
            }
            let outer = if i + 1 < inertias { speeds[i + 1] } else { end };
            speeds[i] = &outer - &self.signed(&rates(i));
        }
        speeds
    }
}

#[derive(Debug)]
pub(super) struct Model<const N: usize> {
    pub chains: [Chain<N>; 2],
    /// Shares of rotor and stator in a jump of omega_r: J_1/(J_1 + J_2) and J_2/(J_1 + J_2).
    pub shares: [Float<N>; 2],
    /// 1/(J_1 + J_2); zero if one of the inertias is infinite.
    per_sum: Float<N>,
    pub axial: Option<ExactAxialMotion<N>>,
    pub force: Option<usize>,
    breakaway: Float<N>,
    /// 2 R of the margin of steady sliding, N m s/rad; `None` if sliding does not slow down by itself, or if no
    /// surface can swing.
    pub twice_resistance: Option<Float<N>>,
    pub contact: ExactContact<N>,
    pub table: Elementary<N>,
}

impl<const N: usize> Model<N> {
    pub fn new(exact: &ExactSystem) -> Self {
        let mut courses = 0;
        let chains = [
            Chain::new(&exact.rotor, true, &mut courses),
            Chain::new(&exact.stator, false, &mut courses),
        ];
        let one = || BigRational::from_integer(1.into());
        let (shares, per_sum) = match [exact.rotor.inertia.first(), exact.stator.inertia.first()] {
            [Some(rotor), Some(stator)] => {
                let sum = rotor + stator;
                ([stator / &sum, rotor / &sum], sum.recip())
            }
            [None, _] => ([BigRational::default(), one()], BigRational::default()),
            [_, None] => ([one(), BigRational::default()], BigRational::default()),
        };
        let (axial, force) = match &exact.pressing {
            Pressing::Force(_) => (None, Some(courses)),
            Pressing::Axial { axial, .. } => {
                let motion = ExactAxialMotion::new(&axial.mass, &axial.stiffness, &axial.damping);
                (Some(motion), None)
            }
        };
        Model {
            chains,
            shares: [&shares[0], &shares[1]].map(Float::from_rational),
            per_sum: Float::from_rational(&per_sum),
            axial,
            force,
            breakaway: Float::from_rational(&(&exact.radius * &exact.breakaway)),
            twice_resistance: twice_resistance(exact),
            contact: ExactContact::new(exact),
            table: Elementary::new(largest_order(Float::<N>::BITS) + 2),
        }
    }
}

#[derive(Debug)]
struct ChainSeries<const N: usize> {
    twist: Vec<Vec<Float<N>>>,
    rate: Vec<Vec<Float<N>>>,
    free: Vec<Float<N>>,
    angle: Vec<Float<N>>,
    speed: Vec<Vec<Float<N>>>,
    /// The newest coefficients: the torque on each inertia, then its acceleration.
    next: Vec<Float<N>>,
}

#[derive(Debug)]
pub(super) struct ExactExpansion<const N: usize> {
    regime: ExactRegime,
    chains: [ChainSeries<N>; 2],
    axial: [Vec<Float<N>>; 2],
    actuation: [Float<N>; 2],
    courses: Vec<CourseSeries<N>>,
    pub normal: Vec<Float<N>>,
    pub relative: Vec<Float<N>>,
    /// T_f, in stick.
    transmitted: Vec<Float<N>>,
    pub contact: ContactSeries<N>,
}

impl<const N: usize> ExactExpansion<N> {
    /// Expansion of order 0 around `time`. `actuation` is F and F' of the axial mode.
    pub fn new(
        model: &Model<N>,
        regime: ExactRegime,
        (state, time): (&State<N>, &Float<N>),
        courses: &[SignalCourse<N>],
        actuation: [Float<N>; 2],
    ) -> Self {
        let each = |values: &[Float<N>]| values.iter().map(|value| vec![*value]).collect::<Vec<_>>();
        let chain = |c: usize| {
            let (state, inertias) = (&state.chains[c], model.chains[c].per_inertia.len());
            ChainSeries {
                twist: each(&state.twist),
                rate: each(&state.rate),
                free: state.free.into_iter().collect(),
                angle: vec![state.angle],
                speed: vec![Vec::new(); inertias],
                next: vec![Float::zero(); inertias],
            }
        };
        ExactExpansion {
            regime,
            chains: [chain(ROTOR), chain(STATOR)],
            axial: match &state.axial {
                Some([z, z_dot]) => [vec![*z], vec![*z_dot]],
                None => [Vec::new(), Vec::new()],
            },
            actuation,
            courses: courses.iter().map(|course| course.series(time, &model.table)).collect(),
            normal: Vec::new(),
            relative: Vec::new(),
            transmitted: Vec::new(),
            contact: ContactSeries::new(&state.deflection),
        }
    }

    /// Extends the coefficients to `order`. The guards then have this order, and the state the next higher one.
    pub fn extend(&mut self, model: &Model<N>, order: usize) {
        for k in self.normal.len()..=order.min(largest_order(Float::<N>::BITS)) {
            self.next(model, k);
        }
    }

    fn next(&mut self, model: &Model<N>, k: usize) {
        let per_next = &model.table.reciprocals[k + 1];
        for course in &mut self.courses {
            course.extend(k + 1, &model.table.reciprocals);
        }
        let normal = match (&model.axial, model.force) {
            (Some(motion), _) => motion.normal_force(&self.axial[0][k], &self.axial[1][k]),
            (None, Some(course)) => self.courses[course].coefficients[k],
            (None, None) => Float::zero(),
        };
        self.normal.push(normal);
        if let Some(motion) = &model.axial {
            let force = self.actuation.get(k).copied().unwrap_or_default();
            let acceleration = motion.acceleration(&normal, &force);
            let next = [&self.axial[1][k] * per_next, &acceleration * per_next];
            for (series, next) in self.axial.iter_mut().zip(next) {
                series.push(next);
            }
        }
        // Speeds, and the sums of all torques without the contact's.
        let [rotor, stator] = [ROTOR, STATOR].map(|c| self.push_speeds(&model.chains[c], c, k));
        let relative = &rotor - &stator;
        self.relative.push(relative);
        for (c, chain) in model.chains.iter().enumerate() {
            self.sum_torques(chain, c, k);
        }
        let far = [ROTOR, STATOR].map(|c| self.far_acceleration(&model.chains[c], k));
        // The torque T, and with it the surfaces.
        let torque = match self.regime {
            ExactRegime::Open => {
                self.contact.rest();
                Float::zero()
            }
            ExactRegime::Stick => {
                let torque = transmitted(model, self.chains.each_ref().map(|chain| chain.next.first()), &far);
                self.transmitted.push(torque);
                torque
            }
            ExactRegime::Slip(sense, piece) => {
                let sides = (sense, piece);
                self.contact
                    .slip(&model.contact, &model.table, sides, (&relative, &self.normal))
            }
            ExactRegime::Engaged(sense, piece) => {
                let sides = (sense, piece);
                self.contact
                    .engaged(&model.contact, &model.table, sides, (&self.relative, &self.normal))
            }
        };
        let joint = (self.regime == ExactRegime::Stick && !model.per_sum.is_zero()).then(|| {
            let sum = &self.chains[ROTOR].next[0] + &self.chains[STATOR].next[0];
            &sum * &model.per_sum
        });
        for (c, chain) in model.chains.iter().enumerate() {
            let series = &mut self.chains[c];
            if let Some(surface) = series.next.first_mut() {
                *surface -= &chain.signed(&torque);
            }
            for (sum, per_inertia) in series.next.iter_mut().zip(&chain.per_inertia) {
                *sum = &*sum * per_inertia;
            }
            let accelerations = &mut series.next;
            if self.regime == ExactRegime::Stick
                && let Some(surface) = accelerations.first_mut()
            {
                *surface = joint.unwrap_or(far[1 - c]);
            }
            for i in 0..series.twist.len() {
                let next = &series.rate[i][k] * per_next;
                series.twist[i].push(next);
                let outer = accelerations.get(i + 1).unwrap_or(&far[c]);
                let change = chain.signed(&(outer - &accelerations[i]));
                series.rate[i].push(&change * per_next);
            }
            if chain.far == Far::Free
                && let Some(last) = accelerations.last()
            {
                let turned = &series.free[k] * per_next;
                series.angle.push(turned);
                series.free.push(last * per_next);
            }
        }
    }

    fn push_speeds(&mut self, chain: &Chain<N>, c: usize, k: usize) -> Float<N> {
        let ChainSeries { rate, speed, free, .. } = &mut self.chains[c];
        let mut outer = match chain.far {
            Far::Free => free[k],
            Far::Fixed => Float::zero(),
            Far::Driven(course) => self.courses[course].coefficients[k],
        };
        let inertias = speed.len();
        for (i, speed) in speed.iter_mut().enumerate().rev() {
            if chain.far != Far::Free || i + 1 < inertias {
                outer = &outer - &chain.signed(&rate[i][k]);
            }
            speed.push(outer);
        }
        outer
    }

    /// Coefficient k of V' of a driven end; zero for other ends.
    fn far_acceleration(&self, chain: &Chain<N>, k: usize) -> Float<N> {
        match chain.far {
            Far::Driven(course) => {
                let next = &self.courses[course].coefficients[k + 1];
                next * &Float::from_f64((k + 1) as f64)
            }
            Far::Free | Far::Fixed => Float::zero(),
        }
    }

    /// Sets coefficient k of the torque on each inertia of a chain, without the contact's torque.
    fn sum_torques(&mut self, chain: &Chain<N>, c: usize, k: usize) {
        let ChainSeries {
            twist,
            rate,
            speed,
            next: sums,
            ..
        } = &mut self.chains[c];
        for ((sum, viscous), speed) in sums.iter_mut().zip(&chain.viscous).zip(&*speed) {
            *sum = -&(viscous * &speed[k]);
        }
        for i in 0..twist.len() {
            let torque = &(&chain.stiffness[i] * &twist[i][k]) + &(&chain.damping[i] * &rate[i][k]);
            let inner = chain.signed(&torque);
            sums[i] += &inner;
            if let Some(outer) = sums.get_mut(i + 1) {
                *outer -= &inner;
            }
        }
        if let Some((course, on)) = chain.torque
            && let Some(sum) = sums.get_mut(on)
        {
            *sum += &self.courses[course].coefficients[k];
        }
    }

    /// mu_0 r F_n - s T_f, the reserve against breakaway in the sense s, N m.
    pub fn reserve(&self, model: &Model<N>, sense: i8) -> Vec<Float<N>> {
        let pairs = self.normal.iter().zip(&self.transmitted);
        pairs
            .map(|(normal, transmitted)| {
                let limit = &model.breakaway * normal;
                if sense < 0 {
                    &limit + transmitted
                } else {
                    &limit - transmitted
                }
            })
            .collect()
    }

    /// The margin of steady sliding, 2 (R + r F_n mu'), N m s/rad; empty outside slip.
    pub fn margin(&self, model: &Model<N>) -> Vec<Float<N>> {
        match (self.regime, &model.twice_resistance) {
            (ExactRegime::Slip(_, piece), Some(resistance)) => {
                self.contact.margin(&model.contact, piece, resistance, &self.normal)
            }
            _ => Vec::new(),
        }
    }

    /// T_f and mu_0 r F_n at the present time in stick, N m.
    pub fn stick_test(&self, model: &Model<N>) -> [Float<N>; 2] {
        [self.transmitted[0], &model.breakaway * &self.normal[0]]
    }

    pub fn ends(&self, model: &Model<N>, step: &Float<N>) -> [Float<N>; 2] {
        [ROTOR, STATOR].map(|c| match model.chains[c].far {
            Far::Driven(course) => evaluate(&self.courses[course].coefficients, step),
            Far::Free | Far::Fixed => Float::zero(),
        })
    }

    pub fn at(&self, step: &Float<N>) -> State<N> {
        let each = |series: &[Vec<Float<N>>]| series.iter().map(|series| evaluate(series, step)).collect();
        let chain = |series: &ChainSeries<N>| ChainState {
            twist: each(&series.twist),
            rate: each(&series.rate),
            free: (!series.free.is_empty()).then(|| evaluate(&series.free, step)),
            angle: evaluate(&series.angle, step),
        };
        let [rotor, stator] = &self.chains;
        let [z, z_dot] = &self.axial;
        State {
            chains: [chain(rotor), chain(stator)],
            axial: (!z.is_empty()).then(|| [evaluate(z, step), evaluate(z_dot, step)]),
            deflection: evaluate(&self.contact.deflection, step),
        }
    }

    /// All series that limit a step, with their least size (log2).
    pub fn deciding<'a>(&'a self, scales: &'a Scales) -> impl Iterator<Item = (&'a [Float<N>], f64)> {
        let of_chain = |c: usize| {
            let (series, scales) = (&self.chains[c], &scales.chains[c]);
            let twists = series.twist.iter().zip(&scales.twist);
            let rates = series.rate.iter().zip(&scales.rate);
            let free = series.free.as_slice();
            let states = twists.chain(rates).map(|(series, least)| (series.as_slice(), *least));
            states.chain((!free.is_empty()).then_some((free, scales.speed)))
        };
        let axial = self
            .axial
            .iter()
            .zip(scales.axial)
            .filter(|(series, _)| !series.is_empty());
        let courses = self
            .courses
            .iter()
            .zip(&scales.courses)
            .filter(|(course, _)| !course.is_linear());
        of_chain(ROTOR)
            .chain(of_chain(STATOR))
            .chain(axial.map(|(series, least)| (series.as_slice(), least)))
            .chain(courses.map(|(course, least)| (course.coefficients.as_slice(), *least)))
            .chain(self.contact.deciding(scales.deflection))
    }
}

/// T_f = (J_1 T_r + J_2 T_s)/(J_1 + J_2). With a rigid rotor surface of acceleration A it is T_s + J_1 A, with a rigid
/// stator surface T_r - J_2 A.
fn transmitted<const N: usize>(model: &Model<N>, sums: [Option<&Float<N>>; 2], far: &[Float<N>; 2]) -> Float<N> {
    let inertia = |c: usize| model.chains[c].surface_inertia.unwrap_or_default();
    match sums {
        [Some(rotor), Some(stator)] => &(&model.shares[0] * rotor) - &(&model.shares[1] * stator),
        // The sum on the stator's surface is -T_s.
        [None, Some(stator)] => &(&inertia(STATOR) * &far[ROTOR]) - stator,
        [Some(rotor), None] => rotor - &(&inertia(ROTOR) * &far[STATOR]),
        [None, None] => Float::zero(),
    }
}

pub(super) fn speeds<const N: usize>(
    model: &Model<N>,
    state: &State<N>,
    ends: &[Float<N>; 2],
) -> [(Vec<Float<N>>, Float<N>); 2] {
    [ROTOR, STATOR].map(|c| {
        let (chain, state) = (&model.chains[c], &state.chains[c]);
        let end = state.free.unwrap_or(ends[c]);
        let speeds = chain.speeds(|i| state.rate[i], end);
        let surface = speeds.first().copied().unwrap_or(end);
        (speeds, surface)
    })
}
