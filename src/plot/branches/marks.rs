//! Marks of special points: filled for eigenvalues or multipliers, open for changes of the event sequence.

use crate::plot::figure::MarkShape;
use crate::plot::style::{BLACK, VERMILLION};
use plotters::style::RGBColor;
use stickslip_analysis::continuation::Special;
use stickslip_analysis::cycle::Border;

/// Legend name, colour and shape for a kind of special point.
pub fn mark(special: Special) -> (&'static str, RGBColor, MarkShape) {
    let border = |words, shape| (words, VERMILLION, shape);
    match special {
        Special::Hopf => ("Hopf", BLACK, MarkShape::Disk),
        Special::Fold => ("fold", BLACK, MarkShape::Square),
        Special::Flip => ("flip", BLACK, MarkShape::Triangle),
        Special::Torus => ("torus", BLACK, MarkShape::Diamond),
        Special::BranchPoint => ("branch point", BLACK, MarkShape::Cross),
        Special::Border(Border::Touch | Border::Graze) => border("grazing of a slip", MarkShape::Circle),
        Special::Border(Border::Breakaway | Border::Release) => border("grazing of a stick", MarkShape::Box),
        Special::Border(Border::Landing) => border("stick without length", MarkShape::Tent),
        Special::Border(Border::Reversal) => border("reversal sticks", MarkShape::Funnel),
        Special::Border(Border::Opening) => border("loss of contact", MarkShape::Kite),
        Special::Border(Border::Closing) => border("contact closes within", MarkShape::Plus),
        Special::Border(Border::Slip) => border("slip without length", MarkShape::Pennant),
        Special::Border(Border::Separation) => border("separation without length", MarkShape::Hexagon),
    }
}
