//! Comparison of two event sequences ("words"): matched, missing and spurious events.

use super::rows::{Event, EventKind};
use serde::Serialize;

/// One event of an event sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SequenceEvent {
    /// Time, s.
    pub time: f64,
    /// Kind of event.
    pub kind: EventKind,
}

impl From<&Event> for SequenceEvent {
    fn from(event: &Event) -> SequenceEvent {
        SequenceEvent {
            time: event.time,
            kind: event.kind,
        }
    }
}

/// A reference event and its candidate, or one of them alone; indices into the words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// Index in the reference's word.
    pub reference: Option<usize>,
    /// Index in the candidate's word.
    pub candidate: Option<usize>,
}

impl Pair {
    fn new(reference: Option<usize>, candidate: Option<usize>) -> Pair {
        Pair { reference, candidate }
    }

    /// Both indices of a matched pair.
    pub fn matched(&self) -> Option<(usize, usize)> {
        self.reference.zip(self.candidate)
    }
}

/// Kind of difference in an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// In the reference only.
    Missing,
    /// In the candidate only.
    Spurious,
    /// Twice in the candidate, immediately after (or before) the first.
    Doubled,
    /// Two events in exchanged order.
    Swapped,
    /// Present as another kind.
    Renamed,
}

/// A difference between the words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Kind of difference.
    pub fault: Fault,
    /// Kind of the event, in the reference if it is there.
    pub kind: &'static str,
    /// Kind of a renamed event in the candidate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub candidate_kind: Option<&'static str>,
    /// 0-based position in the reference's word; a spurious or doubled event stands before this position.
    pub position: usize,
    /// 0-based position in the candidate's word, if it is there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub candidate_position: Option<usize>,
    /// Time in the reference if the event is there, otherwise in the candidate, s.
    pub time: f64,
    /// The event begins or ends a stick or slip of the reference that is too short for the candidate's sample interval.
    pub shorter_than_interval: bool,
}

/// The best agreement between two words.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// Pairs in the order of both words.
    pub pairs: Vec<Pair>,
    /// Differences in the order of the words.
    pub differences: Vec<Difference>,
}

/// Times that differ by more than this part of the natural period are unrelated.
const RELATED: f64 = 0.25;
/// A repeated event within this part of the natural period is doubled: no stick or slip is as short.
const AT_ONCE: f64 = 0.02;
/// Most cells (bytes) of the alignment's table. Words with longer unequal middles are aligned as far as it reaches.
const MOST_CELLS: usize = 64 << 20;
/// Most consecutive unmatched events in either word of a drifting alignment: four cycles of a slip and a stick.
const MOST_UNMATCHED: usize = 8;
/// Most events by which the words may be ahead of each other in a drifting alignment.
const BAND: usize = 32;

impl Alignment {
    /// Marks differences that samples of this interval (s) cannot show.
    pub fn mark_unseen(&mut self, reference: &[SequenceEvent], interval: f64) {
        let shorter = |pair: &[SequenceEvent]| pair[1].time - pair[0].time < interval;
        for difference in &mut self.differences {
            let k = difference.position;
            let is_of_reference = matches!(difference.fault, Fault::Missing | Fault::Renamed);
            let beside = &reference[k.saturating_sub(1)..reference.len().min(k + 2)];
            difference.shorter_than_interval = is_of_reference && beside.windows(2).any(shorter);
        }
    }

    /// Aligns two words, each in order of time; `natural_period` (s) is the scale of time differences.
    ///
    /// The alignment has the least cost: an unmatched event costs 1, a matched pair up to 1, in proportion to its time
    /// difference up to a quarter of the natural period. Times are compared directly, and shifted by the difference of
    /// the first or the last events; the least cost wins.
    pub fn of(reference: &[SequenceEvent], candidate: &[SequenceEvent], natural_period: f64) -> Alignment {
        let mut shifts = vec![0.0];
        for ends in [
            reference.first().zip(candidate.first()),
            reference.last().zip(candidate.last()),
        ] {
            shifts.extend(ends.map(|(r, c)| c.time - r.time));
        }
        let mut best: Option<(f64, Vec<Pair>)> = None;
        for shift in shifts {
            let (cost, pairs) = align(reference, candidate, shift, RELATED * natural_period);
            if best.as_ref().is_none_or(|(least, _)| cost < least - 1e-9) {
                best = Some((cost, pairs));
            }
        }
        let pairs = best.map(|(_, pairs)| pairs).unwrap_or_default();
        let differences = differences(reference, candidate, &pairs, natural_period);
        Alignment { pairs, differences }
    }

    /// Aligns two words whose times drift apart, as in cyclic motions; `natural_period` (s) as in [`Self::of`].
    ///
    /// An unmatched event costs 1, a matched pair the change of its error since the pair before, over a quarter of the
    /// natural period. A drift, however large, then costs little for each cycle, and a skipped cycle a whole unit. The
    /// result is the cheaper one, by this measure, of `by_time` and the best alignment with at most eight consecutive
    /// unmatched events.
    pub fn drifting(
        reference: &[SequenceEvent],
        candidate: &[SequenceEvent],
        natural_period: f64,
        by_time: Alignment,
    ) -> Alignment {
        let related = RELATED * natural_period;
        let Some(pairs) = follow(reference, candidate, related) else {
            return by_time;
        };
        let cost = |pairs: &[Pair]| {
            let mut last = 0.0;
            let of_pair = |pair: &Pair| match pair.matched() {
                Some((r, c)) => {
                    let error = candidate[c].time - reference[r].time;
                    (error - std::mem::replace(&mut last, error)).abs() / related
                }
                None => 1.0,
            };
            pairs.iter().map(of_pair).sum::<f64>()
        };
        if cost(&pairs) >= cost(&by_time.pairs) - 1e-9 {
            return by_time;
        }
        let differences = differences(reference, candidate, &pairs, natural_period);
        Alignment { pairs, differences }
    }

    /// Indices (reference, candidate) of the matched pairs.
    pub fn matched(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.pairs.iter().filter_map(Pair::matched)
    }

    /// Number of reference events without a partner.
    pub fn missing(&self) -> usize {
        self.pairs.iter().filter(|p| p.candidate.is_none()).count()
    }

    /// Number of candidate events without a partner.
    pub fn spurious(&self) -> usize {
        self.pairs.iter().filter(|p| p.reference.is_none()).count()
    }
}

/// Cost of matching two events; `None` for different kinds.
fn match_cost(r: &SequenceEvent, c: &SequenceEvent, shift: f64, related: f64) -> Option<f64> {
    (r.kind == c.kind).then(|| ((c.time - r.time - shift).abs() / related).min(1.0))
}

fn align(reference: &[SequenceEvent], candidate: &[SequenceEvent], shift: f64, related: f64) -> (f64, Vec<Pair>) {
    let equal =
        |(r, c): (&SequenceEvent, &SequenceEvent)| match_cost(r, c, shift, related).is_some_and(|cost| cost < 1e-3);
    let head = reference.iter().zip(candidate).take_while(|&pair| equal(pair)).count();
    let (r_rest, c_rest) = (&reference[head..], &candidate[head..]);
    let tail = r_rest
        .iter()
        .rev()
        .zip(c_rest.iter().rev())
        .take_while(|&pair| equal(pair))
        .count();
    let (r_mid, c_mid) = (&r_rest[..r_rest.len() - tail], &c_rest[..c_rest.len() - tail]);
    let mut pairs: Vec<Pair> = (0..head).map(|k| Pair::new(Some(k), Some(k))).collect();
    let cost = align_middle(r_mid, c_mid, shift, related, head, &mut pairs);
    let (r_end, c_end) = (reference.len() - tail, candidate.len() - tail);
    pairs.extend((0..tail).map(|k| Pair::new(Some(r_end + k), Some(c_end + k))));
    (cost, pairs)
}

fn align_middle(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    shift: f64,
    related: f64,
    offset: usize,
    pairs: &mut Vec<Pair>,
) -> f64 {
    const BOTH: u8 = 0;
    const REFERENCE: u8 = 1;
    const CANDIDATE: u8 = 2;
    let rows = reference.len().min(MOST_CELLS);
    let columns = candidate.len().min(MOST_CELLS / (rows + 1));
    let width = columns + 1;
    let mut steps = vec![CANDIDATE; (rows + 1) * width];
    let mut above: Vec<f64> = (0..=columns).map(|j| j as f64).collect();
    for i in 1..=rows {
        let mut left = i as f64;
        let mut diagonal = above[0];
        above[0] = left;
        steps[i * width] = REFERENCE;
        for j in 1..=columns {
            let mut best = (above[j] + 1.0, REFERENCE);
            if left + 1.0 < best.0 {
                best = (left + 1.0, CANDIDATE);
            }
            if let Some(cost) = match_cost(&reference[i - 1], &candidate[j - 1], shift, related)
                && diagonal + cost <= best.0
            {
                best = (diagonal + cost, BOTH);
            }
            diagonal = above[j];
            above[j] = best.0;
            left = best.0;
            steps[i * width + j] = best.1;
        }
    }
    let cost = above[columns] + (candidate.len() - columns) as f64 + (reference.len() - rows) as f64;
    let (mut i, mut j) = (rows, columns);
    let start = pairs.len();
    while i > 0 || j > 0 {
        let step = steps[i * width + j];
        let (r, c) = (step != CANDIDATE, step != REFERENCE);
        i -= usize::from(r);
        j -= usize::from(c);
        pairs.push(Pair::new(r.then_some(offset + i), c.then_some(offset + j)));
    }
    pairs[start..].reverse();
    pairs.extend((rows..reference.len()).map(|k| Pair::new(Some(offset + k), None)));
    pairs.extend((columns..candidate.len()).map(|k| Pair::new(None, Some(offset + k))));
    cost
}

/// The cheapest alignment by the changes of the errors; `None` if the words are too long.
fn follow(reference: &[SequenceEvent], candidate: &[SequenceEvent], related: f64) -> Option<Vec<Pair>> {
    const SPAN: usize = MOST_UNMATCHED + 1;
    const FIRST: u8 = u8::MAX;
    let (rows, width) = (reference.len(), 2 * BAND + 1);
    // Eight bytes for the cost and one for the step.
    if rows.saturating_mul(width) > MOST_CELLS / 8 {
        return None;
    }
    let column = |i: usize, b: usize| (i + b).checked_sub(BAND).filter(|&j| j < candidate.len());
    let error = |i: usize, j: usize| (candidate[j].time - reference[i].time) / related;
    // Cost up to the pair of event i and event i + b - BAND, and the number of events left out before it.
    let mut costs = vec![f64::INFINITY; rows * width];
    let mut steps = vec![FIRST; rows * width];
    let mut end = ((rows + candidate.len()) as f64, None);
    for (i, event) in reference.iter().enumerate() {
        for b in 0..width {
            let Some(j) = column(i, b).filter(|&j| event.kind == candidate[j].kind) else {
                continue;
            };
            let here = error(i, j);
            let mut best = ((i + j) as f64 + here.abs(), FIRST);
            for left in 0..SPAN.min(i) {
                for out in 0..SPAN.min(j) {
                    let (k, l) = (i - 1 - left, j - 1 - out);
                    let Some(at) = (l + BAND).checked_sub(k).filter(|&at| at < width) else {
                        continue;
                    };
                    let known = costs[k * width + at] + (left + out) as f64;
                    if known < best.0 {
                        let cost = known + (here - error(k, l)).abs();
                        if cost < best.0 {
                            best = (cost, (left * SPAN + out) as u8);
                        }
                    }
                }
            }
            (costs[i * width + b], steps[i * width + b]) = best;
            let whole = best.0 + (rows - 1 - i + candidate.len() - 1 - j) as f64;
            if whole < end.0 {
                end = (whole, Some((i, j)));
            }
        }
    }
    let mut matched = Vec::new();
    let mut place = end.1;
    while let Some((i, j)) = place {
        matched.push((i, j));
        let step = steps[i * width + j + BAND - i];
        let (left, out) = (usize::from(step) / SPAN, usize::from(step) % SPAN);
        place = (step != FIRST).then(|| (i - 1 - left, j - 1 - out));
    }
    let mut pairs = Vec::new();
    let (mut r, mut c) = (0, 0);
    for (i, j) in matched.into_iter().rev().chain([(rows, candidate.len())]) {
        // Alternate the words, so that neighbours can explain each other.
        while r < i || c < j {
            pairs.extend((r < i).then_some(Pair::new(Some(r), None)));
            pairs.extend((c < j).then_some(Pair::new(None, Some(c))));
            (r, c) = ((r + 1).min(i), (c + 1).min(j));
        }
        if i < rows && j < candidate.len() {
            pairs.push(Pair::new(Some(i), Some(j)));
        }
        (r, c) = (i + 1, j + 1);
    }
    Some(pairs)
}

fn differences(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    pairs: &[Pair],
    natural_period: f64,
) -> Vec<Difference> {
    let mut found = Vec::new();
    let mut used = vec![false; pairs.len()];
    let mut position = 0;
    for k in 0..pairs.len() {
        let here = position;
        position += usize::from(pairs[k].reference.is_some());
        if used[k] || pairs[k].matched().is_some() {
            continue;
        }
        let partner = partner(reference, candidate, pairs, &used, k, natural_period);
        let (mut r, mut c) = (pairs[k].reference, pairs[k].candidate);
        let mut fault = if r.is_some() { Fault::Missing } else { Fault::Spurious };
        if let Some((other, with)) = partner {
            used[other] = true;
            r = r.or(pairs[other].reference);
            c = c.or(pairs[other].candidate);
            fault = with;
        } else if let Some(c) = c
            && is_doubled(candidate, c, natural_period)
        {
            fault = Fault::Doubled;
        }
        let event = r.map_or_else(|| candidate[c.unwrap_or(0)], |r| reference[r]);
        found.push(Difference {
            fault,
            kind: event.kind.name(),
            candidate_kind: (fault == Fault::Renamed)
                .then(|| c.map(|c| candidate[c].kind.name()))
                .flatten(),
            position: r.unwrap_or(here),
            candidate_position: c,
            time: event.time,
            shorter_than_interval: false,
        });
    }
    found
}

/// The unmatched event of the other word that explains the one at `k`, and the joint fault.
fn partner(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    pairs: &[Pair],
    used: &[bool],
    k: usize,
    natural_period: f64,
) -> Option<(usize, Fault)> {
    let event = |pair: &Pair| match (pair.reference, pair.candidate) {
        (Some(r), _) => reference[r],
        (None, Some(c)) => candidate[c],
        (None, None) => unreachable!("a pair has at least one event"),
    };
    let opposite = |other: usize| {
        pairs.get(other).is_some_and(|p| {
            !used[other] && p.matched().is_none() && p.reference.is_some() != pairs[k].reference.is_some()
        })
    };
    let this = event(&pairs[k]);
    // If two events are exchanged, one is matched, and the other appears once on each side.
    if pairs.get(k + 1).is_some_and(|p| p.matched().is_some())
        && opposite(k + 2)
        && event(&pairs[k + 2]).kind == this.kind
        && (event(&pairs[k + 2]).time - this.time).abs() < 4.0 * natural_period
    {
        return Some((k + 2, Fault::Swapped));
    }
    if opposite(k + 1) {
        let other = event(&pairs[k + 1]);
        if other.kind != this.kind && (other.time - this.time).abs() < RELATED * natural_period {
            return Some((k + 1, Fault::Renamed));
        }
    }
    None
}

/// Whether a neighbour of the same kind is almost simultaneous.
fn is_doubled(word: &[SequenceEvent], k: usize, natural_period: f64) -> bool {
    let same = |other: &SequenceEvent| {
        other.kind == word[k].kind && (other.time - word[k].time).abs() <= AT_ONCE * natural_period
    };
    (k > 0 && same(&word[k - 1])) || word.get(k + 1).is_some_and(same)
}
