//! The events that a panel marks by lines.

use crate::record::EventKind;

/// Closest that lines of one family may stand, drawing units: where the closer half of their gaps is narrower, they
/// would hide the curve, and the ground alone tells where modes change.
const CLOSEST: f64 = 60.0;
/// Closest that a line may stand to one of another family.
const APART: f64 = 40.0;

/// Kinds that crowd together or not at all, the more important ones first.
const FAMILIES: [&[EventKind]; 5] = [
    &[EventKind::Stick, EventKind::Slip, EventKind::Reversal],
    &[EventKind::Separation, EventKind::Contact],
    &[EventKind::Corner],
    &[EventKind::Destabilised, EventKind::Restabilised],
    &[EventKind::Kick],
];

/// The events that are marked, by family; `place` gives the position of a time in drawing units.
pub(super) fn marks(events: &[(f64, EventKind)], place: impl Fn(f64) -> f64) -> Vec<(f64, EventKind)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two hundred changes of the mode at the end of a long run are no lines, what stands alone is one; among changes that
    /// have room, everything is marked that does not stand on another.
    #[test]
    fn analytic_crowded_events_are_left_to_the_ground() {
        let mut events = vec![
            (1.0, EventKind::Corner),
            (6.9, EventKind::Destabilised),
            (6.901, EventKind::Kick),
        ];
        let kinds = [EventKind::Stick, EventKind::Slip];
        events.extend((0..200).map(|k| (6.95 + 1e-4 * f64::from(k), kinds[k as usize % 2])));
        let whole = marks(&events, |t| 700.0 * t);
        assert_eq!(whole, [(1.0, EventKind::Corner), (6.9, EventKind::Destabilised)]);
        let close = marks(&events, |t| 1e6 * (t - 6.9));
        assert_eq!(close.len(), events.len());
    }
}
