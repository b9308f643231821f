//! The program `stickslip`: arguments become validated options, options run, results are reported.

use std::process::ExitCode;

fn main() -> ExitCode {
    if let Some(end) = stickslip::results::probe_if_asked() {
        return end;
    }
    stickslip::name_build();
    stickslip::cli::complete_if_asked();
    stickslip::results::probe_by_this_program();
    let arguments = match stickslip::cli::Arguments::read() {
        Ok(arguments) => arguments,
        Err(refusal) => return refusal.report(),
    };
    let json = arguments.wants_json();
    match stickslip::cli::execute(arguments) {
        Ok(end) => end.report(json),
        Err(error) => error.report(json),
    }
}
