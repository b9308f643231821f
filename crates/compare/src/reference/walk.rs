//! Walks through a reference from its start to its end, gap by gap.
//!
//! A gap lies between two neighbouring samples or events. The Taylor series of the equations gives the motion in the
//! gap, in as many steps as it takes.

use super::super::Channel;
use super::{INTERVAL, Node, Nodes, Physics, Rerun};
use stickslip_engine::simulation::{Course, TERMS};
use stickslip_files::{ResultError, ResultFile};
use stickslip_system::model::Mode;
use stickslip_system::record::Event;

/// Largest relative miss of the next sample; beyond it the motion is not the file's.
const LARGEST_MISS: f64 = 1e-6;

/// Above this miss a repeated run is used, if it has samples in between.
const GOOD_MISS: f64 = 1e-9;

const MOST_STEPS: usize = 100_000;

/// A channel in one gap, as a polynomial of the passed part of the gap.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GapPolynomial {
    coefficients: [f64; TERMS],
    terms: usize,
}

impl GapPolynomial {
    fn line(from: f64, to: f64) -> GapPolynomial {
        let mut coefficients = [0.0; TERMS];
        (coefficients[0], coefficients[1]) = (from, to - from);
        GapPolynomial { coefficients, terms: 2 }
    }

    #[inline]
    pub fn at(&self, s: f64) -> f64 {
        self.coefficients[..self.terms]
            .iter()
            .rev()
            .fold(0.0, |sum, c| sum * s + c)
    }

    /// Integral from `a` to `b`, both parts of the gap in [0, 1], over the part.
    pub fn integral(&self, a: f64, b: f64) -> f64 {
        let up_to = |s: f64| {
            let terms = self.coefficients[..self.terms].iter().enumerate().rev();
            s * terms.fold(0.0, |sum, (n, c)| sum * s + c / (n + 1) as f64)
        };
        up_to(b) - up_to(a)
    }
}

#[derive(Debug)]
pub(crate) struct Walk<'a> {
    nodes: Nodes<'a>,
    physics: &'a Physics,
    rerun: &'a Rerun,
    events: &'a [Event],
    course: Course,
    channels: Vec<Channel>,
    /// The channels in the present interval, which [`Self::expand`] finds.
    pub curves: Vec<GapPolynomial>,
    inserted: Vec<Node>,
    filled: f64,
    left: Option<Node>,
    right: Option<Node>,
    /// Times and states at the steps of the series between the two nodes; empty before they are needed.
    steps: Vec<(f64, Vec<f64>)>,
    /// Miss of the right node by the series, in parts of its size; infinite if the series does not reach it.
    miss: f64,
    step: usize,
    expanded: Option<usize>,
    pub integrated: bool,
}

impl<'a> Walk<'a> {
    pub fn new(
        file: &'a ResultFile,
        physics: &'a Physics,
        rerun: &'a Rerun,
        events: &'a [Event],
        channels: &[Channel],
    ) -> Result<Walk<'a>, ResultError> {
        let mut walk = Walk {
            nodes: Nodes::new(file, physics, events)?,
            physics,
            rerun,
            events,
            course: physics.course(),
            channels: channels.to_vec(),
            curves: Vec::new(),
            inserted: Vec::new(),
            filled: f64::NEG_INFINITY,
            left: None,
            right: None,
            steps: Vec::new(),
            miss: 0.0,
            step: 0,
            expanded: None,
            integrated: false,
        };
        walk.right = walk.nodes.next()?;
        walk.advance()?;
        Ok(walk)
    }

    fn advance(&mut self) -> Result<bool, ResultError> {
        loop {
            self.left = self.right.take();
            self.right = match self.inserted.pop() {
                Some(node) => Some(node),
                None => self.nodes.next()?,
            };
            self.begin();
            let (Some(left), Some(right)) = (&self.left, &self.right) else {
                return Ok(false);
            };
            if !left.closes && right.time > left.time {
                return Ok(true);
            }
        }
    }

    fn begin(&mut self) {
        self.steps.clear();
        (self.expanded, self.step) = (None, 0);
    }

    fn prepare(&mut self) {
        let (Some(left), Some(right)) = (&self.left, &self.right) else {
            return;
        };
        let (span, mut y) = ((left.time, right.time), left.y.clone());
        let (course, steps) = (&mut self.course, &mut self.steps);
        let arrived = course.go(left.mode, span, &mut y, MOST_STEPS, &mut |time, y| {
            steps.push((time, y.to_vec()));
        });
        self.expanded = Some(self.steps.len().saturating_sub(1));
        self.integrated |= self.steps.len() > 1;
        let sizes = self.course.sizes();
        let miss = |k: usize| (y[k] - right.y[k]).abs() / (sizes[k] + right.y[k].abs());
        let worse = |worst: f64, miss: f64| if miss <= worst || worst.is_nan() { worst } else { miss };
        self.miss = if arrived {
            let all = (0..self.physics.system().mechanical()).map(miss);
            all.fold(0.0, worse)
        } else {
            f64::INFINITY
        };
    }

    fn is_sound(&self) -> bool {
        self.miss <= LARGEST_MISS
    }

    /// Fills the current gap with samples of the repeated run; `false` if this was done or there are none.
    fn fill(&mut self) -> bool {
        let (Some(left), Some(right)) = (&self.left, &self.right) else {
            return false;
        };
        let (from, to) = (left.time, right.time);
        if to <= self.filled {
            return false;
        }
        self.filled = to;
        let Some(dense) = self.rerun.nodes(self.physics, self.events) else {
            return false;
        };
        let first = dense.partition_point(|node| node.time <= from);
        let last = dense.partition_point(|node| node.time < to).max(first);
        self.inserted.extend(self.right.take());
        self.inserted.extend(dense[first..last].iter().rev().cloned());
        self.right = self.inserted.pop();
        self.begin();
        true
    }

    /// Start and end of the interval that contains `time` (s), and whether an event ends it. Times must not decrease;
    /// `None` beyond the end of the reference.
    pub fn at(&mut self, time: f64) -> Result<Option<(f64, f64, bool)>, ResultError> {
        let (from, to, closes) = loop {
            while self.right.as_ref().is_some_and(|right| right.time < time) {
                if !self.advance()? {
                    break;
                }
            }
            let (Some(left), Some(right)) = (&self.left, &self.right) else {
                return Ok(None);
            };
            if left.time > time {
                return Ok(None);
            }
            let (from, to, closes) = (left.time, right.time, right.closes);
            if self.steps.is_empty() {
                self.prepare();
            }
            let wide = to - from > INTERVAL * self.physics.natural_period();
            if self.miss <= GOOD_MISS || !wide || !self.fill() {
                break (from, to, closes);
            }
        };
        if !self.is_sound() {
            return Ok(Some((from, to, closes)));
        }
        while self.end_of(self.step).is_some_and(|end| end < time) {
            self.step += 1;
        }
        let end = self.end_of(self.step);
        Ok(Some((
            self.steps[self.step].0,
            end.unwrap_or(to),
            closes && end.is_none(),
        )))
    }

    /// End of a step, s; `None` for the last step.
    fn end_of(&self, step: usize) -> Option<f64> {
        self.steps.get(step + 1).map(|next| next.0)
    }

    /// Finds the curves of the channels in the interval found by [`Self::at`]; `false` if its inside is unknown.
    pub fn expand(&mut self) -> bool {
        let sound = self.is_sound();
        let (Some(left), Some(right)) = (&self.left, &self.right) else {
            return false;
        };
        let (course, physics) = (&mut self.course, self.physics);
        let (channels, curves) = (&self.channels, &mut self.curves);
        curves.clear();
        if !sound {
            self.expanded = None;
            let ends = [left, right].map(|node| {
                course.expand(left.mode, node.time, &node.y, right.time - left.time);
                let value = |&channel: &Channel| course.series(physics.quantity(channel), 0.0).0[0];
                channels.iter().map(value).collect::<Vec<f64>>()
            });
            let [from, to] = &ends;
            curves.extend(from.iter().zip(to).map(|(&a, &b)| GapPolynomial::line(a, b)));
            return false;
        }
        let end = self.steps.get(self.step + 1).map_or(right.time, |next| next.0);
        let (start, y) = &self.steps[self.step];
        let length = end - start;
        if self.expanded != Some(self.step) {
            course.expand(left.mode, *start, y, length);
            self.expanded = Some(self.step);
        }
        for &channel in channels {
            let (coefficients, terms) = course.series(physics.quantity(channel), length);
            curves.push(GapPolynomial { coefficients, terms });
        }
        if self.step + 1 == self.steps.len() {
            // At the sample itself the file's value is used.
            self.expanded = None;
            course.stand_before(left.mode, right.time, &right.y);
            for (curve, &channel) in curves.iter_mut().zip(channels) {
                let value = course.series(physics.quantity(channel), 0.0).0[0];
                curve.coefficients[1] += value - curve.at(1.0);
                curve.terms = curve.terms.max(2);
            }
        }
        true
    }

    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    pub fn mode(&self) -> Mode {
        self.left.as_ref().map_or(Mode::Separated, |left| left.mode)
    }

    /// theta at the left node, rad, without the motion of a driven end; candidates may compute twists as differences of
    /// such angles.
    pub fn rotor_angle(&self) -> f64 {
        let Some(left) = &self.left else {
            return 0.0;
        };
        let system = self.physics.system();
        let (rotor, stator) = (&system.rotor, &system.stator);
        let twists: f64 = (0..stator.shafts()).map(|i| stator.twist(i, &left.y)).sum();
        let outermost = rotor.inertia.len().saturating_sub(1).min(rotor.shafts());
        twists + left.y[system.slip] + (0..outermost).map(|i| rotor.twist(i, &left.y)).sum::<f64>()
    }
}
