//! Contours of a quantity on a grid.

use super::lattice::{Edge, join};

/// Illinois iterations on an edge. Each gains at least one digit for a smooth quantity.
const ROUNDS: usize = 5;

/// Lines on which `values` (node (i, j) at `i + j * nodes[0]`) equal `level`, in fractions of the unit square. Cells
/// with a missing value are skipped. Between nodes, contours follow `exact` if given, otherwise linear interpolation.
pub fn contours(
    nodes: [usize; 2],
    values: &[f64],
    level: f64,
    exact: Option<&dyn Fn([f64; 2]) -> f64>,
) -> Vec<Vec<[f64; 2]>> {
    let value = |(i, j): (u32, u32)| values[i as usize + j as usize * nodes[0]];
    let above = |node| value(node) >= level;
    let mut links: Vec<[Edge; 2]> = Vec::new();
    for j in 0..nodes[1] as u32 - 1 {
        for i in 0..nodes[0] as u32 - 1 {
            let edges = Edge::around((i, j));
            if edges
                .iter()
                .flat_map(|edge| edge.ends())
                .any(|node| value(node).is_nan())
            {
                continue;
            }
            let crossed: Vec<Edge> = edges
                .into_iter()
                .filter(|edge| above(edge.ends()[0]) != above(edge.ends()[1]))
                .collect();
            for pair in crossed.chunks_exact(2) {
                links.push([pair[0], pair[1]]);
            }
        }
    }
    let last = nodes.map(|count| (count - 1) as f64);
    let point = |edge: &Edge| {
        let [a, b] = edge.ends();
        let at = |part: f64| {
            let between = |a: u32, b: u32| f64::from(a) + part * (f64::from(b) - f64::from(a));
            [between(a.0, b.0) / last[0], between(a.1, b.1) / last[1]]
        };
        let (mut low, mut high) = ((0.0, value(a) - level), (1.0, value(b) - level));
        let straight = |low: (f64, f64), high: (f64, f64)| low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        let mut part = straight(low, high);
        if let Some(exact) = exact {
            let mut last_side = None;
            for _ in 0..ROUNDS {
                let here = exact(at(part)) - level;
                if here.is_nan() {
                    break;
                }
                let replaces_low = (here < 0.0) == (low.1 < 0.0);
                // An end that stays twice counts half.
                let again = last_side.replace(replaces_low) == Some(replaces_low);
                let weight = if again { 0.5 } else { 1.0 };
                if replaces_low {
                    (low, high.1) = ((part, here), weight * high.1);
                } else {
                    (high, low.1) = ((part, here), weight * low.1);
                }
                part = straight(low, high);
            }
        }
        at(part)
    };
    join(&links)
        .iter()
        .map(|line| line.iter().map(point).collect())
        .collect()
}
