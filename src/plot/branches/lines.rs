//! The lines of a branch: each piece has one stability, and pieces that follow each other share a point.

use super::quantity::Value;
use crate::continuation::{Branch, BranchPoint};
use crate::cycle::Stability;

/// The stability between each point and the next. A special point is where it changes: what is between two points is as the
/// one that is not special.
pub(super) fn links(branch: &Branch) -> Vec<Stability> {
    let marks_a_change = |point: &BranchPoint| point.special.is_some() || point.stability == Stability::Neutral;
    let between = |pair: &[BranchPoint]| match (marks_a_change(&pair[0]), marks_a_change(&pair[1])) {
        (false, _) => pair[0].stability,
        (true, false) => pair[1].stability,
        (true, true) if pair[0].stability == pair[1].stability => pair[0].stability,
        (true, true) => Stability::Neutral,
    };
    branch.points.windows(2).map(between).collect()
}

/// The pieces of a branch with this stability: (number that varies, value).
pub(super) fn pieces(branch: &Branch, stability: Stability, of: Value) -> Vec<Vec<(f64, f64)>> {
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

/// The same with pieces that start in one point, as the two directions of a branch do, made one: a broken line has one rhythm there.
pub(super) fn joined(pieces: Vec<Vec<(f64, f64)>>) -> Vec<Vec<(f64, f64)>> {
    let mut found: Vec<Vec<(f64, f64)>> = Vec::new();
    for piece in pieces {
        match found.iter_mut().find(|other| other.first() == piece.first()) {
            Some(other) => {
                other.reverse();
                other.extend(piece.into_iter().skip(1));
            }
            None => found.push(piece),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::continuation::{EndReason, Special};

    fn branch(points: &[(Stability, Option<Special>)]) -> Branch {
        let point = |(k, &(stability, special)): (usize, &(Stability, Option<Special>))| BranchPoint {
            value: k as f64,
            period: f64::NAN,
            position: (0.0, 0.0),
            relative_velocity: (1.0, 1.0),
            stability,
            unstable: 0,
            spectrum: Vec::new(),
            sticks: 0,
            shortest_stick: f64::NAN,
            margin: f64::NAN,
            sequence: String::new(),
            special,
            time: 0.0,
            state: Vec::new(),
        };
        Branch {
            steady: true,
            multiple: None,
            parent: None,
            points: points.iter().enumerate().map(point).collect(),
            end: EndReason::Range,
        }
    }

    /// The pieces meet at the Hopf point, and what is stable on one side of it is not drawn on the other.
    #[test]
    fn analytic_pieces_share_the_point_where_stability_changes() {
        use Stability::{Neutral, Stable, Unstable};
        let hopf = branch(&[
            (Unstable, None),
            (Unstable, None),
            (Neutral, Some(Special::Hopf)),
            (Stable, None),
            (Stable, None),
        ]);
        let xs = |stability| {
            let found = pieces(&hopf, stability, |_, _| 0.0);
            let of = |piece: &Vec<(f64, f64)>| piece.iter().map(|point| point.0).collect::<Vec<_>>();
            found.iter().map(of).collect::<Vec<_>>()
        };
        assert_eq!(xs(Unstable), [vec![0.0, 1.0, 2.0]]);
        assert_eq!(xs(Stable), [vec![2.0, 3.0, 4.0]]);
        assert!(xs(Neutral).is_empty());
    }

    /// At a fold rounding decides which stability the point has: the lines beside it do not depend on it.
    #[test]
    fn property_lines_do_not_depend_on_the_stability_of_a_special_point() {
        use Stability::{Neutral, Stable, Unstable};
        for own in [Stable, Unstable, Neutral] {
            let fold = branch(&[
                (Stable, None),
                (Stable, None),
                (own, Some(Special::Fold)),
                (Unstable, None),
            ]);
            assert_eq!(links(&fold), [Stable, Stable, Unstable], "{own:?}");
        }
    }

    /// Where a value is missing there is a gap.
    #[test]
    fn analytic_a_missing_value_is_a_gap() {
        let all = branch(&[(Stability::Stable, None); 5]);
        let of: Value = |_, point| if point.value == 2.0 { f64::NAN } else { point.value };
        let found = pieces(&all, Stability::Stable, of);
        assert_eq!(found, [vec![(0.0, 0.0), (1.0, 1.0)], vec![(3.0, 3.0), (4.0, 4.0)]]);
    }

    /// Both directions from one start are a line from end to end.
    #[test]
    fn analytic_two_directions_are_one_line() {
        let up = vec![(1.0, 0.0), (2.0, 0.0)];
        let down = vec![(1.0, 0.0), (0.5, 0.0), (0.0, 0.0)];
        let apart = vec![(1.0, 3.0), (2.0, 3.0)];
        let found = joined(vec![up, down, apart.clone()]);
        assert_eq!(found, [vec![(2.0, 0.0), (1.0, 0.0), (0.5, 0.0), (0.0, 0.0)], apart]);
    }
}
