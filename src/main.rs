//! The program `stickslip`: arguments become validated options, options run, results are reported.

use std::process::ExitCode;

fn main() -> ExitCode {
    if let Some(end) = stickslip::results::serve_if_asked() {
        return end;
    }
    stickslip::cli::complete_if_asked();
    stickslip::results::read_apart();
    let arguments = match stickslip::cli::Arguments::read() {
        Ok(arguments) => arguments,
        Err(refusal) => return refusal.report(),
    };
    let json = arguments.wants_json();
    let status = match stickslip::cli::execute(arguments) {
        Ok(end) => end.report(json),
        Err(error) => error.report(json),
    };
    stickslip::results::end_reading();
    status
}
