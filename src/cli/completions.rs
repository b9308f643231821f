//! `stickslip completions`: shell completion. The shell asks the program itself through an environment variable, so
//! that names and keys are those of the installed version.

use super::arguments::{Arguments, Common, CompletionsOptions, Shell};
use super::{CommandEnd, print, print_json};
use crate::Error;
use clap::CommandFactory;
use clap_complete::CompleteEnv;
use clap_complete::env::{Bash, EnvCompleter, Fish, Shells, Zsh};
use serde::Serialize;

const ASKED: &str = "STICKSLIP_COMPLETE";
const NAME: &str = "stickslip";

/// zsh calls a script in `fpath` already for the first word.
const FIRST_WORD_IN_ZSH: &str = "
if [ \"$funcstack[1]\" = \"_stickslip\" ]; then
    _clap_dynamic_completer_stickslip \"$@\"
fi
";

/// Answers the completion request of a shell, and ends the process. Without a request it does nothing.
pub fn complete_if_asked() {
    CompleteEnv::with_factory(Arguments::command)
        .var(ASKED)
        .shells(Shells(&[&Bash, &Fish, &Zsh]))
        .complete();
}

#[derive(Serialize)]
struct Completion<'a> {
    script: &'a str,
    shell: &'static str,
}

pub(super) fn completions(options: &CompletionsOptions, common: &Common) -> Result<CommandEnd, Error> {
    let (shell, last): (&dyn EnvCompleter, &str) = match options.shell {
        Shell::Bash => (&Bash, ""),
        Shell::Fish => (&Fish, ""),
        Shell::Zsh => (&Zsh, FIRST_WORD_IN_ZSH),
    };
    let mut script = Vec::new();
    shell
        .write_registration(ASKED, NAME, NAME, NAME, &mut script)
        .map_err(|error| Error::computation(format!("writing the script failed: {error}")))?;
    let script = String::from_utf8_lossy(&script).trim_start().to_owned() + last;
    if common.json {
        let shell = shell.name();
        print_json(&Completion { script: &script, shell })?;
    } else {
        print(&script)?;
    }
    Ok(CommandEnd::Done)
}
