//! The figures of a report.

use crate::Error;
use crate::plot::comparison::DrawnCandidate;
use crate::plot::{self, DrawnRun, Figure};
use crate::report::{DrawnPage, PagePart};
use std::path::Path;
use stickslip_compare::{Comparison, Mapping, Reference};

/// Width of a figure, mm.
const WIDTH: f64 = 170.0;

/// The figures of comparison `number` in the report, or the reason why there are none.
pub(super) fn figures(
    (reference, mapping): (&Reference, &Mapping),
    comparison: &Comparison,
    (report, number): (&Path, usize),
) -> Vec<PagePart> {
    let stem = report.file_stem().unwrap_or_default().to_string_lossy();
    let drawn = || -> Result<Vec<PagePart>, Error> {
        let run = DrawnRun::open(Path::new(&comparison.reference))?;
        let path = Path::new(&comparison.candidate);
        let beside = DrawnCandidate {
            reference,
            run: &run,
            path,
            mapping,
        };
        let place = match number {
            0 => String::new(),
            _ => format!("-{}", number + 1),
        };
        let part = |figure: &Figure| {
            Ok(PagePart::Figure(DrawnPage {
                file: format!("{stem}{place}-{}.svg", figure.name),
                title: figure.full_title(),
                svg: plot::draw(figure, WIDTH)?.svg(),
            }))
        };
        beside.figures(comparison)?.iter().map(part).collect()
    };
    drawn().unwrap_or_else(|error| vec![PagePart::Text(format!("no figure: {error}"))])
}
