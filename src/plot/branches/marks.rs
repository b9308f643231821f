//! Marks of special points: filled for eigenvalues or multipliers, open for changes of the event sequence.

use crate::plot::figure::Shape;
use crate::plot::style::{BLACK, VERMILLION};
use plotters::style::RGBColor;
use stickslip_analysis::continuation::Special;
use stickslip_analysis::cycle::Border;

/// Legend name, colour and shape for a kind of special point.
pub fn mark(special: Special) -> (&'static str, RGBColor, Shape) {
    let border = |words, shape| (words, VERMILLION, shape);
    match special {
        Special::Hopf => ("Hopf", BLACK, Shape::Disk),
        Special::Fold => ("fold", BLACK, Shape::Square),
        Special::Flip => ("flip", BLACK, Shape::Triangle),
        Special::Torus => ("torus", BLACK, Shape::Diamond),
        Special::BranchPoint => ("branch point", BLACK, Shape::Cross),
        Special::Border(Border::Touch | Border::Graze) => border("grazing of a slip", Shape::Circle),
        Special::Border(Border::Breakaway | Border::Release) => border("grazing of a stick", Shape::Box),
        Special::Border(Border::Landing) => border("stick without length", Shape::Tent),
        Special::Border(Border::Reversal) => border("reversal sticks", Shape::Funnel),
        Special::Border(Border::Opening) => border("loss of contact", Shape::Kite),
        Special::Border(Border::Closing) => border("contact closes within", Shape::Plus),
        Special::Border(Border::Slip) => border("slip without length", Shape::Pennant),
        Special::Border(Border::Separation) => border("separation without length", Shape::Hexagon),
    }
}
