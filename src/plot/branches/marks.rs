//! How special points are marked: filled where eigenvalues or multipliers decide, open where the sequence of events changes.

use crate::continuation::Special;
use crate::cycle::Border;
use crate::plot::figure::Shape;
use crate::plot::style::{BLACK, VERMILLION};
use plotters::style::RGBColor;

/// Name in the legend, colour and shape of a kind of special point.
pub(super) fn mark(special: Special) -> (&'static str, RGBColor, Shape) {
    let border = |words, shape| (words, VERMILLION, shape);
    match special {
        Special::Hopf => ("Hopf", BLACK, Shape::Disk),
        Special::Fold => ("fold", BLACK, Shape::Square),
        Special::Flip => ("flip", BLACK, Shape::Triangle),
        Special::Torus => ("torus", BLACK, Shape::Diamond),
        Special::BranchPoint => ("branch point", BLACK, Shape::Cross),
        Special::Border(Border::Touch) => border("grazing of a slip", Shape::Circle),
        Special::Border(Border::Breakaway) => border("grazing of a stick", Shape::Box),
        Special::Border(Border::Landing) => border("stick without length", Shape::Tent),
        Special::Border(Border::Reversal) => border("reversal sticks", Shape::Funnel),
        Special::Border(Border::Opening) => border("loss of contact", Shape::Kite),
        Special::Border(Border::Closing) => border("contact closes within", Shape::Plus),
        Special::Border(Border::Slip) => border("slip without length", Shape::Pennant),
        Special::Border(Border::Separation) => border("separation without length", Shape::Hexagon),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_marks_differ_in_shape_and_name() {
        let marks: Vec<_> = Special::ALL.into_iter().map(mark).collect();
        for (k, a) in marks.iter().enumerate() {
            for b in &marks[..k] {
                assert!(a.0 != b.0 && a.2 != b.2, "{a:?} {b:?}");
            }
        }
    }
}
