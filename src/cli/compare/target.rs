//! Destination of a report.

use super::super::arguments::CompareOptions;
use crate::Error;
use crate::output::{Output, Product};
use crate::plot::signature::REPORT as MARK;
use crate::report::{Page, PagePart, html, markdown};
use std::path::{Path, PathBuf};

pub(super) struct ReportTarget {
    pub output: Output,
    html: bool,
    force: bool,
}

impl ReportTarget {
    /// Refuses unknown formats, inputs, and existing files that are not reports, before anything is computed.
    pub fn new(path: &Path, options: &CompareOptions) -> Result<ReportTarget, Error> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let html = match extension.as_deref() {
            Some("html" | "htm") => true,
            Some("md") => false,
            _ => {
                let why = "a report is written as HTML or Markdown; give it the extension .html or .md";
                return Err(Error::of_file(path, why));
            }
        };
        let files = options.candidates.iter().chain([&options.reference]);
        let inputs: Vec<PathBuf> = files.chain(&options.map).chain(&options.events).cloned().collect();
        let (output, force) = (
            Output::new(path, Product::Report, &inputs, options.force)?,
            options.force,
        );
        Ok(ReportTarget { output, html, force })
    }

    /// Writes the report. Figures of a Markdown report are files next to it, which replace only figures of this
    /// program.
    pub fn write(&self, pages: &[Page]) -> Result<(), Error> {
        if self.html {
            return self.output.write(&[html(pages, MARK).as_bytes()]);
        }
        for part in pages.iter().flat_map(|page| &page.parts) {
            let PagePart::Figure(figure) = part else { continue };
            let path = self.output.path().with_file_name(&figure.file);
            let product = Product::Figure(Product::Report.option());
            Output::new(&path, product, &[], self.force)?.write(&[figure.svg.as_bytes()])?;
        }
        self.output.write(&[markdown(pages, MARK).as_bytes()])
    }
}
