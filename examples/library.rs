//! The library without the program: the paper's brake with more damping, kept in memory, and what its stick-slip
//! comes to.
//!
//!     cargo run --release --example library

use std::error::Error;

use stickslip::Run;
use stickslip::analysis::CycleStatistics;
use stickslip::case::{Case, CaseSource, Override};
use stickslip::record::{EventKind, MemoryRecorder};

fn main() -> Result<(), Box<dyn Error>> {
    let source = CaseSource::built_in("paper")?;
    let case = Case::read(&source, &[Override::parse("torsion.damping=210 lbf in s/rad")?])?;

    // A `results::ResultWriter` here would write the HDF5 file; any type that implements `Recorder` can listen. A closure
    // given to `control` is asked now and then, and can end the run.
    let mut recorder = MemoryRecorder::default();
    Run::new(&case).record(&mut recorder).start()?;

    let events = recorder.events.iter().map(|event| (event.time, event.kind));
    let (stick_slip, _) = CycleStatistics::of_events(events);
    println!("{} samples, {} events", recorder.samples.len(), recorder.events.len());
    println!("{} sticks, {} slips", stick_slip.stick_count, stick_slip.slip_count);
    for event in recorder
        .events
        .iter()
        .filter(|event| event.kind == EventKind::Stick)
        .take(3)
    {
        println!(
            "stick at {:.12} s, rotor at {:.6} rad/s",
            event.time, event.before.theta_dot
        );
    }
    Ok(())
}
