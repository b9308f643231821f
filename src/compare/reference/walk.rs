//! Walks through a reference from its start to its end, gap by gap.
//!
//! A gap is what lies between two neighbouring samples or events. From its left end on the Taylor series of the equations gives the
//! motion up to the right one, in as many steps as that takes.

use super::super::Channel;
use super::nodes::{Node, Nodes};
use super::rerun::INTERVAL;
use super::{Physics, Rerun};
use crate::model::Mode;
use crate::record::Event;
use crate::results::{ResultError, ResultFile};
use crate::simulation::{Course, TERMS};

/// A motion that misses the next sample by more than this part of its own size is not the file's.
const LARGEST_MISS: f64 = 1e-6;

/// One that misses it by more than this is looked for in a repeated run, if that has samples in between.
const GOOD_MISS: f64 = 1e-9;

/// Steps of the series between two samples at most.
const MOST_STEPS: usize = 100_000;

/// A channel in one gap, by powers of the part of the gap that has passed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve {
    coefficients: [f64; TERMS],
    /// How many of them count.
    terms: usize,
}

impl Curve {
    /// The straight line from one value to another.
    fn line(from: f64, to: f64) -> Curve {
        let mut coefficients = [0.0; TERMS];
        (coefficients[0], coefficients[1]) = (from, to - from);
        Curve { coefficients, terms: 2 }
    }

    /// The channel's value at `s` in [0, 1].
    #[inline]
    pub fn at(&self, s: f64) -> f64 {
        self.coefficients[..self.terms]
            .iter()
            .rev()
            .fold(0.0, |sum, c| sum * s + c)
    }

    /// Its integral from `a` to `b`, parts of the gap in [0, 1], over the part.
    pub fn integral(&self, a: f64, b: f64) -> f64 {
        let up_to = |s: f64| {
            let terms = self.coefficients[..self.terms].iter().enumerate().rev();
            s * terms.fold(0.0, |sum, (n, c)| sum * s + c / (n + 1) as f64)
        };
        up_to(b) - up_to(a)
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct Walk<'a> {
    nodes: Nodes<'a>,
    physics: &'a Physics,
    rerun: &'a Rerun,
    /// The events of the file.
    events: &'a [Event],
    course: Course,
    /// Nodes that stand between the last one and the rest of the file, the next one last.
    inserted: Vec<Node>,
    /// Until here, s, gaps have been filled with them.
    filled: f64,
    left: Option<Node>,
    right: Option<Node>,
    /// Where the steps of the series between the two begin, with the state; empty before it is needed.
    steps: Vec<(f64, Vec<f64>)>,
    /// By what they miss the right one, in parts of its size; infinite if they do not lead there.
    miss: f64,
    /// The step that holds the time asked for last.
    step: usize,
    /// The one that the course stands at.
    expanded: Option<usize>,
    /// The equations were integrated again between two samples in more than one step.
    pub integrated: bool,
}

impl<'a> Walk<'a> {
    /// At the start of the reference.
    ///
    /// # Errors
    /// Of the file.
    pub fn new(
        file: &'a ResultFile,
        physics: &'a Physics,
        rerun: &'a Rerun,
        events: &'a [Event],
    ) -> Result<Walk<'a>, ResultError> {
        let mut walk = Walk {
            nodes: Nodes::new(file, physics, events)?,
            physics,
            rerun,
            events,
            course: physics.course(),
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

    /// The next gap; `false` at the end of the reference.
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

    /// No step of the gap is known.
    fn begin(&mut self) {
        self.steps.clear();
        (self.expanded, self.step) = (None, 0);
    }

    /// Takes the steps of the present gap.
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
        // What is not finite misses by all.
        let worse = |worst: f64, miss: f64| if miss <= worst || worst.is_nan() { worst } else { miss };
        self.miss = if arrived {
            let all = (0..self.physics.system().mechanical()).map(miss);
            all.fold(0.0, worse)
        } else {
            f64::INFINITY
        };
    }

    /// Whether the steps of the present gap lead to its right end.
    fn is_sound(&self) -> bool {
        self.miss <= LARGEST_MISS
    }

    /// Fills the present gap with samples of the repeated run; `false` if that has been done or there are none.
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

    /// Start, end and whether an event ends it, of what holds `time` (s), which may not lie before an earlier one; `None` beyond
    /// the end of the reference.
    ///
    /// # Errors
    /// Of the file.
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

    /// Where a step ends that is not the last, s.
    fn end_of(&self, step: usize) -> Option<f64> {
        self.steps.get(step + 1).map(|next| next.0)
    }

    /// The curves of `channels` in what [`Self::at`] has found; `false` if its inside is not known, `None` past the end.
    pub fn curves(&mut self, channels: &[Channel], curves: &mut Vec<Curve>) -> Option<bool> {
        let sound = self.is_sound();
        let (left, right) = (self.left.as_ref()?, self.right.as_ref()?);
        curves.clear();
        let (course, physics) = (&mut self.course, self.physics);
        if !sound {
            // Its own samples still stand.
            self.expanded = None;
            let ends = [left, right].map(|node| {
                course.expand(left.mode, node.time, &node.y, right.time - left.time);
                let value = |&channel: &Channel| course.series(physics.quantity(channel), 0.0).0[0];
                channels.iter().map(value).collect::<Vec<f64>>()
            });
            let [from, to] = &ends;
            curves.extend(from.iter().zip(to).map(|(&a, &b)| Curve::line(a, b)));
            return Some(false);
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
            curves.push(Curve { coefficients, terms });
        }
        if self.step + 1 == self.steps.len() {
            // At the sample itself the file has the last word.
            self.expanded = None;
            course.stand_before(left.mode, right.time, &right.y);
            for (curve, &channel) in curves.iter_mut().zip(channels) {
                let value = course.series(physics.quantity(channel), 0.0).0[0];
                curve.coefficients[1] += value - curve.at(1.0);
                curve.terms = curve.terms.max(2);
            }
        }
        Some(true)
    }

    /// What the contact does between the two samples.
    pub fn mode(&self) -> Mode {
        self.left.as_ref().map_or(Mode::Separated, |left| left.mode)
    }

    /// theta at the left one, rad: of the angles that twists may be differences of. Without the motion of a driven end.
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
