//! States on both sides of events. Missing torques and forces follow from the equations.

use crate::Error;
use stickslip_compare::reference::states_at_events;
use stickslip_engine::simulation::Course;
use stickslip_files::ResultFile;
use stickslip_system::model::Mode;
use stickslip_system::record::{Channels, Event};

#[derive(Debug)]
pub(super) struct Sides {
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
}

impl Sides {
    pub(super) fn of_file(file: &ResultFile, channel: &str) -> Result<Sides, Error> {
        Ok(Sides {
            before: file.event_column(&format!("{channel}_before"))?,
            after: file.event_column(&format!("{channel}_after"))?,
        })
    }

    /// A force, a torque, an energy or the mode from the equations, if the state determines it. `first`: initial
    /// mode.
    pub(super) fn of(
        course: &Course,
        file: &ResultFile,
        events: &[Event],
        first: Option<Mode>,
        channel: &str,
    ) -> Result<Option<Sides>, Error> {
        let mut channels = Channels::CHANNELS.iter();
        let of_state = channels.position(|known| known.name == channel && !known.has_history);
        if of_state.is_none() && channel != "mode" {
            return Ok(None);
        }
        let states = states_at_events(file, course, events)?;
        let value = |t: f64, mode: Mode, y: &[f64]| match of_state {
            Some(place) => course.channels(mode, t, y).values()[place],
            None => f64::from(mode as u8),
        };
        let (mut before, mut after) = (Vec::with_capacity(events.len()), Vec::with_capacity(events.len()));
        let mut mode = first.unwrap_or(Mode::SlipForward);
        for (event, (y_before, y_after)) in events.iter().zip(&states) {
            before.push(value(event.time.next_down().max(0.0), mode, y_before));
            mode = event.mode_after;
            after.push(value(event.time, mode, y_after));
        }
        Ok(Some(Sides { before, after }))
    }
}
