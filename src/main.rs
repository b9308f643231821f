//! The program `stickslip`: arguments become validated options, options run, results are reported.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match stickslip::cli::Arguments::read() {
        Ok(arguments) => arguments,
        Err(refusal) => return refusal.report(),
    };
    match stickslip::cli::execute(arguments) {
        Ok(end) => end.exit_code(),
        Err(error) => error.report(),
    }
}
