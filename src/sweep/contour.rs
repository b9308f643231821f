//! Contours of a quantity on a grid of a plane.

use super::lattice::{Edge, join};

/// Rounds of the Illinois method on an edge: each gains a digit or more on a smooth quantity.
const ROUNDS: usize = 5;

/// The lines on which `values` (node (i, j) at `i + j * nodes[0]`) take `level`, in shares of the unit square. A cell with
/// a node that has no value has none. Between the nodes a contour is where `exact`, if it is given, takes the level, and
/// else where a straight line does.
pub(super) fn contours(
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A bilinear function is reproduced on the edges: on every contour x + 2 y is the level.
    #[test]
    fn analytic_contours_of_a_plane_are_straight() {
        let nodes = [7, 5];
        let values: Vec<f64> = (0..35)
            .map(|k| (k % 7) as f64 / 6.0 + 2.0 * (k / 7) as f64 / 4.0)
            .collect();
        let lines = contours(nodes, &values, 1.23, None);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() > 7);
        for [x, y] in &lines[0] {
            assert!((x + 2.0 * y - 1.23).abs() < 1e-14);
        }
    }

    /// A circle about a corner of the grid: the points are on it, however coarse the grid.
    #[test]
    fn analytic_contours_of_a_known_function_are_exact() {
        let radius = |[x, y]: [f64; 2]| x.hypot(y);
        let nodes = [4, 4];
        let values: Vec<f64> = (0..16)
            .map(|k| radius([(k % 4) as f64 / 3.0, (k / 4) as f64 / 3.0]))
            .collect();
        let lines = contours(nodes, &values, 0.8, Some(&radius));
        assert_eq!(lines.len(), 1);
        for &point in &lines[0] {
            assert!((radius(point) - 0.8).abs() < 1e-6, "{point:?}");
        }
    }
}
