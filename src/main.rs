//! The program `stickslip`: arguments become validated options, options run, results are reported.

use std::process::ExitCode;

fn main() -> ExitCode {
    if let Some(end) = stickslip::results::serve_if_asked() {
        return end;
    }
    stickslip::results::read_apart();
    let arguments = match stickslip::cli::Arguments::read() {
        Ok(arguments) => arguments,
        Err(refusal) => return refusal.report(),
    };
    let status = match stickslip::cli::execute(arguments) {
        Ok(end) => end.exit_code(),
        Err(error) => error.report(),
    };
    stickslip::results::end_reading();
    status
}
