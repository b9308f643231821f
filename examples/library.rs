//! The library without the program: the paper's brake with more damping, kept in memory, and what its stick-slip
//! comes to.
//!
//!     cargo run --release --example library

use std::error::Error;
use std::ops::ControlFlow;

use stickslip::analysis::StickSlip;
use stickslip::case::{Case, CaseSource, Override};
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::simulation::simulate;

fn main() -> Result<(), Box<dyn Error>> {
    let source = CaseSource::built_in("paper")?;
    let case = Case::parse(&source, &[Override::parse("torsion.damping=210 lbf in s/rad")?])?;

    // A `results::ResultWriter` here would write the HDF5 file; any type that implements `Recorder` can listen.
    let mut recorder = MemoryRecorder::default();
    simulate(
        &case.parameters,
        &case.solver,
        &case.output,
        &mut recorder,
        // Asked now and then; Break ends the run in good order.
        &mut |_progress| ControlFlow::Continue(()),
    )?;

    let stick_slip = StickSlip::from_events(&recorder.events);
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
