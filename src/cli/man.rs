//! `stickslip man`: writes manual pages from the definitions of `--help`.

use super::arguments::{Arguments, Common, ManOptions};
use super::{CommandEnd, tell};
use crate::Error;
use crate::report::FilesReport;
use clap::CommandFactory;
use clap_mangen::Man;
use std::io;
use std::path::{Path, PathBuf};
use stickslip_files::disk::write_whole;

/// Writes a page for the program and one for each command. Earlier pages are replaced.
pub(super) fn man(options: &ManOptions, common: &Common) -> Result<CommandEnd, Error> {
    let folder = &options.folder;
    let written = pages(folder).map_err(|(path, error)| {
        Error::computation(format!(
            "{}: the manual pages could not be written: {error}; check the folder and its disk, or name another",
            path.display()
        ))
    })?;
    tell(
        common,
        &FilesReport {
            folder: None,
            files: &written,
        },
    )?;
    Ok(CommandEnd::Done)
}

fn pages(folder: &Path) -> Result<Vec<PathBuf>, (PathBuf, io::Error)> {
    std::fs::create_dir_all(folder).map_err(|error| (folder.to_owned(), error))?;
    let mut program = Arguments::command()
        .version(env!("CARGO_PKG_VERSION"))
        .disable_help_subcommand(true);
    program.build();
    let commands: Vec<clap::Command> = program.get_subcommands().cloned().collect();
    let source = format!("stickslip {}", env!("CARGO_PKG_VERSION"));
    std::iter::once(program)
        .chain(commands)
        .map(|command| {
            let page = Man::new(command).source(&source).manual("stickslip");
            let path = folder.join(page.get_filename());
            let mut text = Vec::new();
            let written = page.render(&mut text).and_then(|()| write_whole(&path, &[&text]));
            written.map(|()| path.clone()).map_err(|error| (path, error))
        })
        .collect()
}
