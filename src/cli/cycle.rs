//! `stickslip cycle`: finds a periodic motion.

use super::arguments::{Common, CycleOptions, SearchFrom};
use super::interrupt::interrupt_flag;
use super::{CommandEnd, interrupted, tell};
use crate::Error;
use crate::report::CycleReport;
use stickslip_analysis::cycle::{CycleSearch, From, SavedCycle};
use stickslip_files::Overwrite;

pub(super) fn cycle(options: &CycleOptions, common: &Common) -> Result<CommandEnd, Error> {
    let search = CycleSearch {
        from: match options.from {
            SearchFrom::End => From::End,
            SearchFrom::Initial => From::Initial,
        },
        periods: options.periods,
        period: options.period,
    };
    let place = options.branch.zip(options.point);
    let saving = SavedCycle::of(&options.case, place, options.keys.over(&options.set), search)?;
    let overwrite = Overwrite::by_force(options.force);
    let stop = interrupt_flag()?;
    match saving.start(options.output.as_deref(), overwrite, &*stop) {
        Err(error) if error.is_interrupted() => interrupted(common, &format!(" {error}")),
        found => tell(common, &CycleReport::new(&found?)),
    }
}
