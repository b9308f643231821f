//! `stickslip modes`: reports frequencies, damping and the loss of stability.

use super::arguments::{Common, ModesOptions};
use super::plot::{draw, figure_output};
use super::{CommandEnd, complain, tell};
use crate::Error;
use crate::report::ModesReport;
use stickslip_analysis::analysis::Modes;
use stickslip_analysis::{GivenCase, overrides};
use stickslip_case::Case;
use stickslip_system::model::margin;

pub(super) fn modes(options: &ModesOptions, common: &Common) -> Result<CommandEnd, Error> {
    let given = GivenCase::read(&options.case)?;
    let changes = overrides(&options.keys.over(&options.set))?;
    let case = Case::read(&given.source, &changes)?;
    let (system, title) = (&case.system, &case.title);
    if let (Some(_), Err(reason)) = (&options.figure, margin::resistance(system)) {
        return Err(Error::input(format!(
            "--figure draws the effective damping of sliding that slows down by itself over its speed, and this case has no such \
             sliding: {reason}; leave it out"
        )));
    }
    let changed = given.changed(&changes);
    let target = figure_output(options.figure.as_deref(), options.force, &given, &changed)?;
    let modes = Modes::of_case(system, &case.solver, case.output.end_time);
    let report = ModesReport::new(&given, &changes, &case, &modes);
    tell(common, &report)?;
    let Some(slowing) = &modes.slowing else {
        return Ok(CommandEnd::Done);
    };
    if let Some(target) = &target {
        draw(&crate::plot::law::modes_figure(title, case.motion(), slowing), target)?;
    }
    if let (Some(failure), false) = (&slowing.run_failure, common.quiet) {
        complain(&format!(
            "warning: the run that looks for the loss of stability failed before its first stick, so only what came \
             before is known: {failure}"
        ));
    }
    Ok(CommandEnd::Done)
}
