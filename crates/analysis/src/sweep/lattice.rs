//! Grid of the unit square. Cells in which a condition changes are halved locally and give the lines of change. Contours of
//! a quantity on a grid.

use std::collections::{BTreeMap, BTreeSet};

/// Integer coordinates of a node on the finest grid.
pub type LatticeNode = (u32, u32);

/// Edge between neighbours on the finest grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    /// Lower end.
    pub node: LatticeNode,
    /// Whether the upper end is the next node along x; otherwise along y.
    pub along_x: bool,
}

impl Edge {
    fn around((i, j): LatticeNode) -> [Edge; 4] {
        [((i, j), true), ((i + 1, j), false), ((i, j + 1), true), ((i, j), false)]
            .map(|(node, along_x)| Edge { node, along_x })
    }

    /// Both ends, the lower first.
    pub fn ends(self) -> [LatticeNode; 2] {
        let (i, j) = self.node;
        [self.node, if self.along_x { (i + 1, j) } else { (i, j + 1) }]
    }
}

/// Grid of one plane.
#[derive(Debug, Clone)]
pub struct Lattice {
    /// Cells of the finest grid along x and y.
    pub size: [u32; 2],
    /// Current side length of a cell, in cells of the finest grid.
    step: u32,
    /// Lower corners of current cells that the line may cross.
    cells: BTreeSet<LatticeNode>,
    met: BTreeMap<LatticeNode, bool>,
}

impl Lattice {
    /// First grid with `nodes` along each axis, whose cells can be halved `refinements` times.
    pub fn new(nodes: [usize; 2], refinements: u32) -> Self {
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

    /// Position of a node, as fractions of the unit square.
    pub fn share(&self, node: LatticeNode) -> [f64; 2] {
        [
            f64::from(node.0) / f64::from(self.size[0]),
            f64::from(node.1) / f64::from(self.size[1]),
        ]
    }

    /// Nodes of the current cells at which the condition is unknown.
    pub fn unknown(&self) -> Vec<LatticeNode> {
        let nodes: BTreeSet<LatticeNode> = self.cells.iter().flat_map(|&cell| corners(cell, self.step)).collect();
        nodes.into_iter().filter(|node| !self.met.contains_key(node)).collect()
    }

    /// Sets whether the condition holds at a node.
    pub fn set(&mut self, node: LatticeNode, met: bool) {
        self.met.insert(node, met);
    }

    pub(super) fn is_met(&self, node: LatticeNode) -> bool {
        self.met.get(&node).copied().unwrap_or(false)
    }

    fn is_mixed(&self, cell: LatticeNode) -> bool {
        let known = corners(cell, self.step).map(|node| self.is_met(node));
        known.iter().any(|&met| met != known[0])
    }

    /// Halves the cells of change and their neighbours, into which a change may extend, and drops the others. Returns
    /// `false` on the finest grid.
    pub fn refine(&mut self) -> bool {
        if self.step == 1 {
            return false;
        }
        let (step, half) = (self.step, self.step / 2);
        let mut crossed: BTreeSet<LatticeNode> = BTreeSet::new();
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

    /// Edges across which the condition changes, linked to lines through the finest cells.
    pub fn lines(&self) -> Vec<Vec<Edge>> {
        let crosses = |edge: &Edge| self.is_met(edge.ends()[0]) != self.is_met(edge.ends()[1]);
        let links = self
            .cells
            .iter()
            .flat_map(|&cell| links(cell, crosses, self.is_met(cell)));
        let links: Vec<[Edge; 2]> = links.collect();
        join(&links)
    }
}

/// Pairs of edges of a cell between which a line passes. Where two opposite corners differ from the others, the lines
/// cut off the lower left and the upper right corner if `lower`, else the others.
fn links(cell: LatticeNode, crosses: impl Fn(&Edge) -> bool, lower: bool) -> Vec<[Edge; 2]> {
    let edges @ [bottom, right, top, left] = Edge::around(cell);
    let crossed: Vec<Edge> = edges.into_iter().filter(crosses).collect();
    match crossed[..] {
        [a, b] => vec![[a, b]],
        [_, _, _, _] if lower => vec![[bottom, left], [right, top]],
        [_, _, _, _] => vec![[bottom, right], [top, left]],
        _ => Vec::new(),
    }
}

/// Joins links to lines: first open lines from end to end, then closed lines, which repeat their first edge.
fn join<E: Copy + Ord>(links: &[[E; 2]]) -> Vec<Vec<E>> {
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

fn corners((i, j): LatticeNode, step: u32) -> [LatticeNode; 4] {
    [(i, j), (i + step, j), (i, j + step), (i + step, j + step)]
}

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
    let crosses = |edge: &Edge| (value(edge.ends()[0]) >= level) != (value(edge.ends()[1]) >= level);
    let cells = (0..nodes[1] as u32 - 1).flat_map(|j| (0..nodes[0] as u32 - 1).map(move |i| (i, j)));
    let known = cells.filter(|&cell| corners(cell, 1).into_iter().all(|node| !value(node).is_nan()));
    let links: Vec<[Edge; 2]> = known.flat_map(|cell| links(cell, crosses, false)).collect();
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
