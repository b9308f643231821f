//! Where a report is written.

use super::super::CommandError;
use super::super::arguments::CompareOptions;
use super::super::plot::bad;
use super::pages::{Page, Part};
use super::render;
use crate::plot::target::{self, Product, TargetError};
use std::path::{Path, PathBuf};

/// A file that a report may be written to.
pub(super) struct Target {
    path: PathBuf,
    html: bool,
    force: bool,
}

impl Target {
    /// Refuses another format, an input, and a file that is no report, before anything is computed.
    pub fn check(path: &Path, options: &CompareOptions) -> Result<Target, CommandError> {
        let refuse = |what: &str| Err(CommandError::Input(format!("{}: {what}", path.display())));
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let html = match extension.as_deref() {
            Some("html" | "htm") => true,
            Some("md") => false,
            _ => return refuse("a report is written as HTML or Markdown; give it the extension .html or .md"),
        };
        if path.is_dir() {
            return refuse("this is a folder; name a file in it with --report");
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return refuse("the folder does not exist; create it, or choose another with --report");
        }
        let inputs = options
            .candidates
            .iter()
            .chain([&options.reference])
            .chain(&options.map)
            .chain(&options.events);
        let same = |input: &PathBuf| matches!((input.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b);
        if inputs.into_iter().any(same) {
            return refuse("this is an input of the comparison; give the report another name");
        }
        if path.exists() && !options.force && !is_report(path) {
            return refuse(
                "exists and is no report of this program, so it is not replaced; choose another name, or replace it with --force",
            );
        }
        Ok(Target {
            path: path.to_owned(),
            html,
            force: options.force,
        })
    }

    /// Where the report goes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the report; the figures of one in Markdown are files beside it, which replace no other than figures of this
    /// program.
    pub fn write(&self, pages: &[Page], shortfalls: &[String]) -> Result<(), CommandError> {
        let text = if self.html {
            render::html(pages, shortfalls)
        } else {
            self.write_figures(pages)?;
            render::markdown(pages, shortfalls)
        };
        crate::results::disk::write_whole(&self.path, &[text.as_bytes()]).map_err(|error| {
            let path = self.path.display();
            CommandError::Computation(format!(
                "{path}: writing failed: {error}; check the disk and the folder"
            ))
        })
    }
}

impl Target {
    fn write_figures(&self, pages: &[Page]) -> Result<(), CommandError> {
        let figures = pages.iter().flat_map(|page| &page.parts);
        for part in figures {
            let Part::Figure(figure) = part else { continue };
            let path = self.path.with_file_name(&figure.file);
            let failed = |error: TargetError| bad(error.into());
            target::check(&path, Product::Figure, &[], self.force).map_err(failed)?;
            target::write(&path, Product::Figure, &[figure.svg.as_bytes()]).map_err(failed)?;
        }
        Ok(())
    }
}

fn is_report(path: &Path) -> bool {
    use std::io::Read;
    let mut start = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(512).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains(render::MARK)
}
