//! Contours of a quantity on the first grid of a plane, linear between its nodes.

use super::lattice::{Edge, join};

/// The lines on which `values` (node (i, j) at `i + j * nodes[0]`) take `level`, in shares of the unit square. A cell with
/// a node that has no value has none.
pub(super) fn contours(nodes: [usize; 2], values: &[f64], level: f64) -> Vec<Vec<[f64; 2]>> {
    let value = |(i, j): (u32, u32)| values[i as usize + j as usize * nodes[0]];
    let above = |node| value(node) >= level;
    let mut links: Vec<[Edge; 2]> = Vec::new();
    for j in 0..nodes[1] as u32 - 1 {
        for i in 0..nodes[0] as u32 - 1 {
            let edges = [
                Edge {
                    node: (i, j),
                    along_x: true,
                },
                Edge {
                    node: (i + 1, j),
                    along_x: false,
                },
                Edge {
                    node: (i, j + 1),
                    along_x: true,
                },
                Edge {
                    node: (i, j),
                    along_x: false,
                },
            ];
            if edges
                .iter()
                .any(|edge| edge.ends().iter().any(|&node| value(node).is_nan()))
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
        let part = (level - value(a)) / (value(b) - value(a));
        let at = |a: u32, b: u32| f64::from(a) + part * (f64::from(b) - f64::from(a));
        [at(a.0, b.0) / last[0], at(a.1, b.1) / last[1]]
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
        let lines = contours(nodes, &values, 1.23);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() > 7);
        for [x, y] in &lines[0] {
            assert!((x + 2.0 * y - 1.23).abs() < 1e-14);
        }
    }
}
