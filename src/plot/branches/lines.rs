//! Lines of a branch: pieces with a single stability. Successive pieces share a point.

use super::quantity::Value;
use stickslip_analysis::continuation::{Branch, BranchPoint};
use stickslip_analysis::cycle::CycleStability;

/// Stability between successive points. It changes at special points: a link has that of its ordinary end.
pub fn links(branch: &Branch) -> Vec<CycleStability> {
    let marks_a_change = |point: &BranchPoint| point.special.is_some() || point.stability == CycleStability::Neutral;
    let between = |pair: &[BranchPoint]| match (marks_a_change(&pair[0]), marks_a_change(&pair[1])) {
        (false, _) => pair[0].stability,
        (true, false) => pair[1].stability,
        (true, true) if pair[0].stability == pair[1].stability => pair[0].stability,
        (true, true) => CycleStability::Neutral,
    };
    branch.points.windows(2).map(between).collect()
}

/// Pieces of a branch with this stability, as points (parameter, value).
pub fn pieces(branch: &Branch, stability: CycleStability, of: Value) -> Vec<Vec<(f64, f64)>> {
    let (mut pieces, mut open): (Vec<Vec<(f64, f64)>>, bool) = (Vec::new(), false);
    for (pair, link) in branch.points.windows(2).zip(links(branch)) {
        let [from, to] = [&pair[0], &pair[1]].map(|point| (point.value, of(branch, point)));
        let drawn = link == stability && from.1.is_finite() && to.1.is_finite();
        match pieces.last_mut().filter(|_| open) {
            Some(piece) if drawn => piece.push(to),
            _ if drawn => pieces.push(vec![from, to]),
            _ => {}
        }
        open = drawn;
    }
    pieces
}

/// Joins pieces that start in one point (both directions of a branch), so that dashes are regular there. `same`: whether
/// two points have one place.
pub fn joined<T>(pieces: Vec<Vec<T>>, same: impl Fn(&T, &T) -> bool) -> Vec<Vec<T>> {
    let mut found: Vec<Vec<T>> = Vec::new();
    for piece in pieces {
        let begins = |other: &&mut Vec<T>| match (other.first(), piece.first()) {
            (Some(a), Some(b)) => same(a, b),
            _ => false,
        };
        match found.iter_mut().find(begins) {
            Some(other) => {
                other.reverse();
                other.extend(piece.into_iter().skip(1));
            }
            None => found.push(piece),
        }
    }
    found
}
