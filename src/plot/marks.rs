//! The events that a panel marks with lines.

use stickslip_system::record::EventKind;

/// Least distance between lines of one family, drawing units. If the closer half of the gaps is narrower, the lines
/// would hide the curve, and only the background shows the modes.
const CLOSEST: f64 = 60.0;
/// Least distance between lines of different families, drawing units.
const APART: f64 = 40.0;

/// Kinds that are shown or hidden together, the most important first.
const FAMILIES: [&[EventKind]; 5] = [
    &[EventKind::Stick, EventKind::Slip, EventKind::Reversal],
    &[EventKind::Separation, EventKind::Contact],
    &[EventKind::Corner],
    &[EventKind::Destabilised, EventKind::Restabilised],
    &[EventKind::Kick],
];

/// The marked events, by family. `place` gives the position of a time in drawing units.
pub fn marks(events: &[(f64, EventKind)], place: impl Fn(f64) -> f64) -> Vec<(f64, EventKind)> {
    let mut shown: Vec<(f64, EventKind)> = Vec::new();
    for family in FAMILIES {
        let of_family: Vec<_> = events.iter().filter(|e| family.contains(&e.1)).copied().collect();
        let gap = |pair: &[(f64, EventKind)]| place(pair[1].0) - place(pair[0].0);
        let mut gaps: Vec<f64> = of_family.windows(2).map(gap).collect();
        gaps.sort_by(f64::total_cmp);
        if gaps
            .get(gaps.len().saturating_sub(1) / 2)
            .is_some_and(|&gap| gap < CLOSEST)
        {
            continue;
        }
        let free = |e: &(f64, EventKind)| shown.iter().all(|other| (place(e.0) - place(other.0)).abs() >= APART);
        let free: Vec<_> = of_family.into_iter().filter(free).collect();
        shown.extend(free);
    }
    shown
}
