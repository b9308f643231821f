//! A grid of the unit square whose cells are halved where a condition changes, and the lines along which it changes.

use std::collections::{BTreeMap, BTreeSet};

/// A node of the finest grid, by its whole coordinates.
pub(super) type Node = (u32, u32);

/// An edge between neighbours on the finest grid: its lower node, and whether it runs along x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Edge {
    pub(super) node: Node,
    pub(super) along_x: bool,
}

impl Edge {
    /// Around the cell with this lower corner, on the finest grid: below, right, above, left.
    pub(super) fn around((i, j): Node) -> [Edge; 4] {
        [((i, j), true), ((i + 1, j), false), ((i, j + 1), true), ((i, j), false)]
            .map(|(node, along_x)| Edge { node, along_x })
    }

    /// Both ends, the lower first.
    pub(super) fn ends(self) -> [Node; 2] {
        let (i, j) = self.node;
        [self.node, if self.along_x { (i + 1, j) } else { (i, j + 1) }]
    }
}

/// The grid of one plane.
#[derive(Debug, Clone)]
pub(super) struct Lattice {
    /// Cells of the finest grid along x and y.
    pub(super) size: [u32; 2],
    /// Length of a cell's side at present, in cells of the finest grid.
    step: u32,
    /// Cells of that side that may be crossed, by their lower corner.
    cells: BTreeSet<Node>,
    met: BTreeMap<Node, bool>,
}

impl Lattice {
    /// A first grid of so many nodes, whose cells can be halved so many times.
    pub(super) fn new(nodes: [usize; 2], refinements: u32) -> Self {
        let step = 1 << refinements;
        let size = nodes.map(|count| (count as u32 - 1) * step);
        let mut cells = BTreeSet::new();
        for i in (0..size[0]).step_by(step as usize) {
            for j in (0..size[1]).step_by(step as usize) {
                cells.insert((i, j));
            }
        }
        Lattice {
            size,
            step,
            cells,
            met: BTreeMap::new(),
        }
    }

    /// Where a node is in the unit square.
    pub(super) fn share(&self, node: Node) -> [f64; 2] {
        [
            f64::from(node.0) / f64::from(self.size[0]),
            f64::from(node.1) / f64::from(self.size[1]),
        ]
    }

    /// The nodes of the present cells that are not yet known.
    pub(super) fn unknown(&self) -> Vec<Node> {
        let nodes: BTreeSet<Node> = self.cells.iter().flat_map(|&cell| corners(cell, self.step)).collect();
        nodes.into_iter().filter(|node| !self.met.contains_key(node)).collect()
    }

    pub(super) fn set(&mut self, node: Node, met: bool) {
        self.met.insert(node, met);
    }

    pub(super) fn is_met(&self, node: Node) -> bool {
        self.met.get(&node).copied().unwrap_or(false)
    }

    fn is_mixed(&self, cell: Node) -> bool {
        let known = corners(cell, self.step).map(|node| self.is_met(node));
        known.iter().any(|&met| met != known[0])
    }

    /// Halves the cells in which the condition changes, and keeps those alone; false where they are the finest. The
    /// neighbours of such a cell are halved with it: what it finds on a common side may reach into them.
    pub(super) fn refine(&mut self) -> bool {
        if self.step == 1 {
            return false;
        }
        let (step, half) = (self.step, self.step / 2);
        let mut crossed: BTreeSet<Node> = BTreeSet::new();
        for &(i, j) in self.cells.iter().filter(|&&cell| self.is_mixed(cell)) {
            for i in [i.saturating_sub(step), i, i + step] {
                for j in [j.saturating_sub(step), j, j + step] {
                    if i < self.size[0] && j < self.size[1] {
                        crossed.insert((i, j));
                    }
                }
            }
        }
        self.cells = crossed.into_iter().flat_map(|cell| corners(cell, half)).collect();
        self.step = half;
        true
    }

    /// The edges across which the condition changes, linked to lines through the finest cells.
    pub(super) fn lines(&self) -> Vec<Vec<Edge>> {
        let mut links: Vec<[Edge; 2]> = Vec::new();
        for &cell in &self.cells {
            let edges @ [bottom, right, top, left] = Edge::around(cell);
            let crosses = |edge: &Edge| self.is_met(edge.ends()[0]) != self.is_met(edge.ends()[1]);
            let crossed: Vec<Edge> = edges.into_iter().filter(crosses).collect();
            match crossed[..] {
                [a, b] => links.push([a, b]),
                // Two opposite corners meet the condition: taken as two regions that do not touch here.
                [..] if crossed.len() == 4 => {
                    let pairs = if self.is_met(cell) {
                        [[bottom, left], [right, top]]
                    } else {
                        [[bottom, right], [top, left]]
                    };
                    links.extend(pairs);
                }
                _ => {}
            }
        }
        join(&links)
    }
}

/// Links to lines: open ones from end to end first, then closed ones, whose first edge is also their last.
pub(super) fn join<E: Copy + Ord>(links: &[[E; 2]]) -> Vec<Vec<E>> {
    let mut neighbours: BTreeMap<E, Vec<E>> = BTreeMap::new();
    for &[a, b] in links {
        neighbours.entry(a).or_default().push(b);
        neighbours.entry(b).or_default().push(a);
    }
    let mut left: BTreeSet<E> = neighbours.keys().copied().collect();
    let ends = neighbours
        .iter()
        .filter(|(_, linked)| linked.len() == 1)
        .map(|(edge, _)| *edge);
    let starts: Vec<E> = ends.chain(neighbours.keys().copied()).collect();
    let mut lines = Vec::new();
    for start in starts {
        if !left.remove(&start) {
            continue;
        }
        let mut line = vec![start];
        let mut at = start;
        while let Some(&next) = neighbours[&at].iter().find(|next| left.contains(next)) {
            left.remove(&next);
            line.push(next);
            at = next;
        }
        if line.len() > 2 && neighbours[&at].contains(&start) {
            line.push(start);
        }
        lines.push(line);
    }
    lines
}

fn corners((i, j): Node, step: u32) -> [Node; 4] {
    [(i, j), (i + step, j), (i, j + step), (i + step, j + step)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines of a condition, with every point that was asked for.
    fn traced(nodes: [usize; 2], refinements: u32, condition: impl Fn([f64; 2]) -> bool) -> (Lattice, Vec<Vec<Edge>>) {
        let mut lattice = Lattice::new(nodes, refinements);
        loop {
            for node in lattice.unknown() {
                let met = condition(lattice.share(node));
                lattice.set(node, met);
            }
            if !lattice.refine() {
                break;
            }
        }
        let lines = lattice.lines();
        (lattice, lines)
    }

    #[test]
    fn analytic_a_disk_has_one_closed_line_around_it() {
        let disk = |[x, y]: [f64; 2]| (x - 0.5).hypot(y - 0.4) < 0.3;
        let (lattice, lines) = traced([9, 7], 3, disk);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        for edge in &lines[0] {
            let [a, b] = edge.ends().map(|node| disk(lattice.share(node)));
            assert_ne!(a, b);
        }
        // A convex region crosses each column and row that it meets twice: 2 (2 r) (64 + 48) edges, up to the ends.
        let expected = 2.0 * 0.6 * f64::from(lattice.size[0] + lattice.size[1]);
        assert!(
            (lines[0].len() as f64 - expected).abs() < 6.0,
            "{} {expected}",
            lines[0].len()
        );
    }

    #[test]
    fn analytic_a_strip_has_two_open_lines() {
        let (lattice, lines) = traced([9, 9], 2, |[x, y]| (0.3..0.7).contains(&(x + 0.1 * y)));
        assert_eq!(lines.len(), 2);
        for line in lines {
            let rows: Vec<u32> = line
                .iter()
                .filter(|edge| edge.along_x)
                .map(|edge| edge.node.1)
                .collect();
            assert_eq!(
                (rows.iter().min(), rows.iter().max()),
                (Some(&0), Some(&lattice.size[1]))
            );
        }
    }
}
