//! Friction through given points.

use super::parameters::parameter;
use super::polynomial::{Cubic, CubicSeries};
use super::{Bounds, Factors, Law, LawParameter, LawParameters, LawSeries, LawValue};
use crate::numerics::Number;
use crate::numerics::taylor::Unfolding;

/// Interpolation between the points of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines.
    Linear,
    /// Cubics with the slopes of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984), as in PCHIP of MATLAB and
    /// SciPy. They satisfy the condition of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980): the curve rises and
    /// falls only where the points do.
    MonotoneCubic,
}

impl Interpolation {
    /// All interpolations; the first is the default.
    pub const ALL: [Interpolation; 2] = [Interpolation::MonotoneCubic, Interpolation::Linear];

    /// The word of `friction.interpolation`.
    pub fn name(self) -> &'static str {
        match self {
            Interpolation::Linear => "linear",
            Interpolation::MonotoneCubic => "monotone-cubic",
        }
    }
}

/// mu(x) through points (x, mu), x = |omega_r|, the first at standstill; constant above the last.
///
/// The points are knots, where a derivative of the law jumps. Each piece between them is a cubic that continues beyond
/// its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// x, rad/s, increasing from 0.
    speed: Vec<f64>,
    coefficient: Vec<f64>,
    interpolation: Interpolation,
    /// All speeds except the first; empty for a continued piece.
    knots: Vec<f64>,
    /// The piece after each point, the last one included; a single one without knots.
    pieces: Vec<Cubic>,
    /// The largest |mu''| over the largest |mu'|, s/rad.
    steepness: f64,
}

/// Most steps to the last point of a method that follows the law, however many points there are.
const MOST_FOLLOWED: f64 = 500.0;

impl Table {
    /// A law through these points. [`LawParameters::complaints`] reports errors; the law is NaN if the points make no
    /// curve.
    pub fn new(speed: Vec<f64>, coefficient: Vec<f64>, interpolation: Interpolation) -> Table {
        let mut table = Table {
            speed,
            coefficient,
            interpolation,
            knots: Vec::new(),
            pieces: vec![constant(0.0, f64::NAN)],
            steepness: 0.0,
        };
        let (x, y) = (&table.speed, &table.coefficient);
        let increasing = x.windows(2).all(|pair| pair[0] < pair[1]);
        if x.len() > 1 && x.len() == y.len() && x[0] == 0.0 && increasing {
            table.knots = table.speed[1..].to_vec();
            table.pieces = table.cubics();
            table.steepness = table.largest_steepness();
        }
        table
    }

    fn cubics(&self) -> Vec<Cubic> {
        let (x, y) = (&self.speed, &self.coefficient);
        let intervals = x.len() - 1;
        let width: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let secant: Vec<f64> = (0..intervals).map(|k| (y[k + 1] - y[k]) / width[k]).collect();
        let slopes = match self.interpolation {
            Interpolation::Linear => None,
            Interpolation::MonotoneCubic => Some(monotone_slopes(&width, &secant)),
        };
        let piece = |k: usize| {
            let (h, s) = (width[k], secant[k]);
            let [b, c, e] = match &slopes {
                None => [s, 0.0, 0.0],
                Some(m) => [
                    m[k],
                    (3.0 * s - 2.0 * m[k] - m[k + 1]) / h,
                    (m[k] + m[k + 1] - 2.0 * s) / (h * h),
                ],
            };
            Cubic {
                origin: x[k],
                coefficients: [y[k], b, c, e],
            }
        };
        let last = constant(x[intervals], y[intervals]);
        (0..intervals).map(piece).chain([last]).collect()
    }

    /// The piece for a speed; at a knot the lower one.
    #[inline]
    fn piece_at(&self, x: f64) -> &Cubic {
        &self.pieces[self.knots.partition_point(|knot| *knot < x)]
    }

    /// Pieces with their parts of the speeds from `from` to `to`; the piece above the last knot has a single speed.
    fn pieces_within(&self, from: f64, to: f64) -> impl Iterator<Item = (&Cubic, f64, f64)> {
        let last = self.knots.last().copied().unwrap_or(0.0);
        let start = |k: usize| if k == 0 { 0.0 } else { self.knots[k - 1] };
        self.pieces.iter().enumerate().filter_map(move |(k, piece)| {
            let end = self.knots.get(k).copied().unwrap_or(f64::INFINITY);
            let (a, b) = (start(k).max(from), end.min(to).min(last.max(from)));
            (a <= b).then_some((piece, a, b))
        })
    }

    fn largest_steepness(&self) -> f64 {
        let all = self.slope_bounds(0.0, f64::INFINITY);
        let slope = all.most.abs().max(all.least.abs());
        let curvature = self
            .pieces_within(0.0, f64::INFINITY)
            .map(|(piece, a, b)| piece.largest_curvature(a, b))
            .fold(0.0, f64::max);
        if slope > 0.0 { curvature / slope } else { 0.0 }
    }

    /// Width of the piece at a speed; above the last point the speed itself, rad/s.
    fn width_at(&self, x: f64) -> f64 {
        let index = self.knots.partition_point(|knot| *knot < x);
        let below = if index == 0 { 0.0 } else { self.knots[index - 1] };
        match self.knots.get(index) {
            Some(above) => above - below,
            None => x.max(below),
        }
    }
}

fn constant(origin: f64, value: f64) -> Cubic {
    Cubic {
        origin,
        coefficients: [value, 0.0, 0.0, 0.0],
    }
}

fn monotone_slopes(width: &[f64], secant: &[f64]) -> Vec<f64> {
    let intervals = width.len();
    let inside = |k: usize| {
        let (before, after) = (secant[k - 1], secant[k]);
        if before * after <= 0.0 {
            return 0.0;
        }
        let (a, b) = (2.0 * width[k] + width[k - 1], width[k] + 2.0 * width[k - 1]);
        (a + b) / (a / before + b / after)
    };
    let at_end = |near: usize, next: usize| {
        let (h, g) = (width[near], width[next]);
        let slope = ((2.0 * h + g) * secant[near] - h * secant[next]) / (h + g);
        if slope * secant[near] <= 0.0 {
            0.0
        } else if secant[near] * secant[next] <= 0.0 && slope.abs() > 3.0 * secant[near].abs() {
            3.0 * secant[near]
        } else {
            slope
        }
    };
    let end = |near: usize, next: usize| if intervals == 1 { secant[0] } else { at_end(near, next) };
    let next = 1.min(intervals - 1);
    let mut slopes = vec![end(0, next)];
    slopes.extend((1..intervals).map(inside));
    slopes.push(end(intervals - 1, intervals.saturating_sub(2)));
    slopes
}

impl LawParameters for Table {
    const NAME: &'static str = "table";
    const PARAMETERS: &'static [LawParameter] = &[
        parameter!(
            speed,
            LawParameter::new(
                LawValue::List,
                1,
                "sliding speeds of the points, increasing from 0; above the last its coefficient holds",
            )
        ),
        parameter!(
            coefficient,
            LawParameter::new(LawValue::List, 0, "friction coefficients at these speeds")
        ),
        parameter!(
            interpolation,
            LawParameter::new(
                LawValue::Word(|| Interpolation::ALL.map(Interpolation::name).to_vec()),
                0,
                "what goes through the points",
            )
            .or("monotone-cubic")
        ),
    ];
    const AT_VANISHING_SPEED: &'static str = "coefficient.0";

    fn unset() -> Self {
        Table::new(Vec::new(), Vec::new(), Interpolation::ALL[0])
    }

    fn number(&self, _: &str) -> Option<f64> {
        None
    }

    fn set_number(&mut self, _: &str, _: f64) {}

    fn list(&self, key: &str) -> Option<&[f64]> {
        match key {
            "speed" => Some(&self.speed),
            "coefficient" => Some(&self.coefficient),
            _ => None,
        }
    }

    fn set_list(&mut self, key: &str, values: Vec<f64>) {
        let mut table = std::mem::replace(self, Table::new(Vec::new(), Vec::new(), self.interpolation));
        match key {
            "speed" => table.speed = values,
            "coefficient" => table.coefficient = values,
            _ => {}
        }
        *self = Table::new(table.speed, table.coefficient, table.interpolation);
    }

    fn word(&self, key: &str) -> Option<&'static str> {
        (key == "interpolation").then(|| self.interpolation.name())
    }

    fn set_word(&mut self, key: &str, word: &str) {
        let known = Interpolation::ALL.into_iter().find(|known| known.name() == word);
        if let ("interpolation", Some(interpolation)) = (key, known) {
            let table = std::mem::replace(self, Table::new(Vec::new(), Vec::new(), interpolation));
            *self = Table::new(table.speed, table.coefficient, interpolation);
        }
    }

    fn complaints(&self) -> Vec<(String, String)> {
        let (x, y) = (&self.speed, &self.coefficient);
        let mut found = Vec::new();
        let mut complain = |key: String, message: String| found.push((key, message));
        if x.len() < 2 {
            complain(
                "speed".to_owned(),
                "must hold at least two speeds, the first of them 0".to_owned(),
            );
        } else if x[0] != 0.0 {
            complain(
                "speed.0".to_owned(),
                format!(
                    "the first point must be at standstill: write 0 in place of {:?} rad/s, or add such a point",
                    x[0]
                ),
            );
        }
        if let Some(k) = x.windows(2).position(|pair| pair[1] <= pair[0]) {
            complain(
                format!("speed.{}", k + 1),
                format!("speeds must increase: {:?} rad/s follows {:?} rad/s", x[k + 1], x[k]),
            );
        }
        if x.len() != y.len() {
            complain(
                "coefficient".to_owned(),
                format!(
                    "must be as long as friction.speed: {} coefficients for {} speeds",
                    y.len(),
                    x.len()
                ),
            );
        }
        if let Some(k) = y.iter().position(|mu| *mu < 0.0) {
            complain(
                format!("coefficient.{k}"),
                format!("must not be negative, but is {:?}", y[k]),
            );
        }
        found
    }
}

impl Law for Table {
    type Series<T: Number, const N: usize> = TableSeries<T, N>;

    #[inline]
    fn coefficient_and_slope(&self, x: f64) -> (f64, f64) {
        let piece = self.piece_at(x);
        (piece.value(x), piece.slope(x))
    }

    fn at_vanishing_speed(&self) -> f64 {
        self.coefficient.first().copied().unwrap_or(f64::NAN)
    }

    fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds {
        let of = self.pieces_within(from, to).map(|(piece, a, b)| piece.bounds(a, b));
        joined(of)
    }

    /// The slope at a knot is taken from both sides.
    fn slope_bounds(&self, from: f64, to: f64) -> Bounds {
        let of = self
            .pieces_within(from, to)
            .map(|(piece, a, b)| piece.slope_bounds(a, b));
        joined(of)
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn continued(&self, piece: usize) -> Table {
        let last = self.pieces.len() - 1;
        // The points are left out: otherwise each of thousands of pieces would hold thousands of points.
        Table {
            speed: Vec::new(),
            coefficient: Vec::new(),
            interpolation: self.interpolation,
            knots: Vec::new(),
            pieces: vec![self.pieces[piece.min(last)]],
            steepness: self.steepness,
        }
    }

    /// Inside the pieces, and at knots where the sign jumps.
    fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64> {
        let value = |piece: &Cubic, x: f64| damping + weight * piece.slope(x);
        let mut zeros = Vec::new();
        let mut sign: Option<bool> = None;
        for (piece, from, to) in self.pieces_within(0.0, f64::INFINITY) {
            let inside = piece.speeds_of_slope(-damping / weight, from, to);
            // The sign is constant between these ends.
            let ends: Vec<f64> = std::iter::once(from).chain(inside).chain([to]).collect();
            for pair in ends.windows(2) {
                let here = value(piece, f64::midpoint(pair[0], pair[1])) >= 0.0;
                if sign.is_some_and(|before| before != here) {
                    zeros.push(pair[0]);
                }
                sign = Some(here);
            }
        }
        zeros.reverse();
        zeros
    }

    /// The slope of the first piece at rest may be zero, and decides nothing.
    fn damped_from(&self, damping: f64, weight: f64) -> f64 {
        // Friction does not fall above the last point.
        self.damping_zeros(damping, weight).first().copied().unwrap_or(0.0)
    }

    /// The largest |mu''| over the largest |mu'|, at least the inverse width of the piece.
    fn steepness_rate(&self, x: f64) -> f64 {
        self.steepness.max(1.0 / self.width_at(x).max(f64::MIN_POSITIVE.sqrt()))
    }

    fn followed_fall(&self, x: f64, _: f64) -> f64 {
        let last = self.knots.last().copied().unwrap_or(x);
        self.width_at(x).max(last / MOST_FOLLOWED)
    }

    fn speed_of_derivative(&self, _: i32, _: f64) -> f64 {
        self.speed.last().copied().unwrap_or(0.0)
    }

    fn extent(&self) -> f64 {
        1.2 * self.speed.last().copied().unwrap_or(0.0)
    }

    fn series<T: Number, const N: usize>(&self) -> TableSeries<T, N> {
        TableSeries {
            series: CubicSeries::new(&self.pieces[0]),
            knots: self.knots.iter().map(|knot| T::of(*knot)).collect(),
            pieces: self.pieces.clone(),
        }
    }
}

fn joined(of: impl Iterator<Item = Bounds>) -> Bounds {
    of.reduce(|all, piece| all.with(piece.least).with(piece.most))
        .unwrap_or(Bounds {
            least: f64::NAN,
            most: f64::NAN,
        })
}

/// Taylor coefficients of the piece on which a motion starts.
#[derive(Debug, Clone)]
pub struct TableSeries<T, const N: usize> {
    series: CubicSeries<T, N>,
    knots: Vec<T>,
    pieces: Vec<Cubic>,
}

impl<T: Number, const N: usize> LawSeries<T, N> for TableSeries<T, N> {
    #[inline(always)]
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T> {
        self.series.factors(of_coefficient, of_slope)
    }

    #[inline(always)]
    fn start(&mut self, x: T, unit: T) {
        let piece = self.knots.partition_point(|knot| *knot < x);
        self.series.follow(&self.pieces[piece]);
        self.series.start(x, unit);
    }

    #[inline(always)]
    fn extend(&mut self, n: usize, rate: T, reciprocal: T) {
        self.series.extend(n, rate, reciprocal);
    }

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        self.series.shapes()
    }
}
