//! Destination of a report.

use super::super::CommandError;
use super::super::arguments::CompareOptions;
use crate::plot::signature::REPORT as MARK;
use crate::plot::target::{self, Product};
use crate::report::{Page, PagePart, html, markdown};
use std::path::{Path, PathBuf};

pub(super) struct ReportTarget {
    path: PathBuf,
    html: bool,
    force: bool,
}

impl ReportTarget {
    /// Refuses unknown formats, inputs, and existing files that are not reports, before anything is computed.
    pub fn check(path: &Path, options: &CompareOptions) -> Result<ReportTarget, CommandError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let html = match extension.as_deref() {
            Some("html" | "htm") => true,
            Some("md") => false,
            _ => {
                return Err(CommandError::input(format!(
                    "{}: a report is written as HTML or Markdown; give it the extension .html or .md",
                    path.display()
                )));
            }
        };
        let inputs = options
            .candidates
            .iter()
            .chain([&options.reference])
            .chain(&options.map)
            .chain(&options.events);
        let inputs: Vec<PathBuf> = inputs.cloned().collect();
        target::check(path, Product::Report, &inputs, options.force)?;
        Ok(ReportTarget {
            path: path.to_owned(),
            html,
            force: options.force,
        })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the report. Figures of a Markdown report are files next to it, which replace only figures of this
    /// program.
    pub fn write(&self, pages: &[Page]) -> Result<(), CommandError> {
        let text = if self.html {
            html(pages, MARK)
        } else {
            self.write_figures(pages)?;
            markdown(pages, MARK)
        };
        Ok(target::write(&self.path, Product::Report, &[text.as_bytes()])?)
    }

    fn write_figures(&self, pages: &[Page]) -> Result<(), CommandError> {
        let figures = pages.iter().flat_map(|page| &page.parts);
        for part in figures {
            let PagePart::Figure(figure) = part else { continue };
            let path = self.path.with_file_name(&figure.file);
            let figures = Product::Figure(Product::Report.option());
            target::check(&path, figures, &[], self.force)?;
            target::write(&path, figures, &[figure.svg.as_bytes()])?;
        }
        Ok(())
    }
}
