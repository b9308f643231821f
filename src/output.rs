//! Where output goes. An earlier version of a file is replaced, and any other file by force only.

#![cfg_attr(not(feature = "cli"), allow(dead_code, reason = "only commands need all of it"))]

use crate::Error;
use crate::plot::signature;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use stickslip_files::disk::{Obstacle, Temporary, folder_of, in_the_way, misplaced, try_folder, write_whole};

/// Number of bytes at the start of a file in which the signature is searched.
const HEAD: u64 = 4096;

/// A product of this program besides results in HDF5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Product {
    /// SVG, PNG or PDF. Contains the option that names the file.
    Figure(&'static str),
    /// An HTML page.
    Page,
    /// A report of a comparison, HTML or Markdown.
    Report,
    /// A case file. Cases are also inputs, so that an existing one is replaced by force only.
    Case,
    /// A table of a result.
    Table,
}

impl Product {
    const fn words(self) -> [&'static str; 4] {
        match self {
            Product::Figure(option) => ["figure", option, "figure.svg", "the file to be drawn"],
            Product::Page => ["page", "--html", "report.html", "the file to be drawn"],
            Product::Report => ["report", "--report", "report.html", "an input"],
            Product::Case => ["case", "--case", "case.toml", "an input"],
            Product::Table => ["table", "-o", "table.csv", "the file to be exported"],
        }
    }

    /// The option that names the file.
    pub const fn option(self) -> &'static str {
        self.words()[1]
    }

    fn is_own(self, path: &Path) -> io::Result<bool> {
        let head = head_of(path)?;
        let contains = |text: &str| head.windows(text.len()).any(|window| window == text.as_bytes());
        Ok(match self {
            Product::Page => contains(signature::PAGE),
            Product::Report => {
                let generator = format!("content=\"{}\"", signature::REPORT);
                contains(&format!("<!-- {} -->", signature::REPORT)) || contains(&generator)
            }
            Product::Case | Product::Table => false,
            Product::Figure(_) => contains(&figure_mark(&head)),
        })
    }

    pub(crate) fn failed(self, path: &Path, action: &str, error: io::Error) -> Error {
        Error::io(path, action, error, self.option())
    }

    fn refused(self, path: &Path, obstacle: Obstacle) -> Error {
        let [name, option, example, input] = self.words();
        let replace = format!("choose another name with {option}, or replace it with --force");
        let why = match obstacle {
            Obstacle::Input => format!("this is {input}; give the {name} another name with {option}"),
            Obstacle::Folder => {
                let example = path.join(example);
                let example = example.display();
                format!("a folder; name a file in it, for example {option} {example}")
            }
            Obstacle::NoFileName => {
                format!("not a usable file name; name the {name} with {option}, for example {option} {example}")
            }
            Obstacle::NoFolder(folder) => {
                let folder = folder.display();
                format!("the folder {folder} does not exist; create it, or choose another with {option}")
            }
            Obstacle::PipeOrDevice => {
                let or = if self == Product::Table {
                    ", or - for standard output"
                } else {
                    ""
                };
                format!("a pipe or a device, which no file replaces; choose another name with {option}{or}")
            }
            Obstacle::Protected => format!("write-protected; {replace}"),
            Obstacle::NotOwn if self == Product::Case => format!("is there already; {replace}"),
            Obstacle::NotOwn if self == Product::Table => {
                format!("there already, and not an earlier export of this table; {replace}")
            }
            Obstacle::NotOwn => format!("there already, and not a {name} that this program made; {replace}"),
            Obstacle::NotSeen(error) => return self.failed(path, "looking at the file", error),
        };
        Error::of_file(path, why)
    }
}

fn figure_mark(head: &[u8]) -> String {
    let (keyword, value) = signature::PNG;
    match head {
        [0x89, b'P', b'N', b'G', ..] => format!("{keyword}\0{value}"),
        [b'%', b'P', b'D', b'F', ..] => format!("/Producer ({}", signature::FIGURE),
        _ => format!("<desc>{}", signature::FIGURE),
    }
}

fn head_of(path: &Path) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(HEAD).read_to_end(&mut head)?;
    Ok(head)
}

/// A path that a product may take.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    product: Product,
}

impl Output {
    /// The place of a product made from `inputs`.
    ///
    /// # Errors
    /// `path` is an input or a folder, or is in a missing or read-only folder. Without `force` it may also not be a
    /// write-protected file or another product.
    pub fn new(path: &Path, product: Product, inputs: &[PathBuf], force: bool) -> Result<Output, Error> {
        Output::replacing(path, product, inputs, force, |path| product.is_own(path))
    }

    /// Like [`Output::new`]; replaces files for which `is_own` holds.
    pub(crate) fn replacing(
        path: &Path,
        product: Product,
        inputs: &[PathBuf],
        force: bool,
        is_own: impl FnOnce(&Path) -> io::Result<bool>,
    ) -> Result<Output, Error> {
        let failed = |action| move |error| product.failed(path, action, error);
        let obstacle = match misplaced(path, inputs) {
            None => in_the_way(path, force, is_own).map_err(failed("reading the file"))?,
            misplaced => misplaced,
        };
        if let Some(obstacle) = obstacle {
            return Err(product.refused(path, obstacle));
        }
        try_folder(&folder_of(path)).map_err(failed("creating the file"))?;
        let path = path.to_owned();
        Ok(Output { path, product })
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes `parts` under a temporary name, which becomes the path at the end, so that a product is complete or absent.
    ///
    /// # Errors
    /// The system fails, such as with a full disk.
    pub fn write(&self, parts: &[&[u8]]) -> Result<(), Error> {
        write_whole(&self.path, parts).map_err(|error| self.product.failed(&self.path, "writing", error))
    }

    /// Like [`Self::write`], with what `fill` writes.
    pub(crate) fn fill(&self, fill: impl FnOnce(&File) -> Result<(), Error>) -> Result<(), Error> {
        let failed = |error| self.product.failed(&self.path, "writing", error);
        let file = Temporary::create(&folder_of(&self.path)).map_err(failed)?;
        fill(file.file())?;
        file.persist(&self.path).map_err(failed)
    }

    /// Refuses to replace a figure of other files than `source`, if this program chose its name.
    pub(crate) fn spare(&self, source: &str) -> Result<(), Error> {
        let here = signature::names_in(source).unwrap_or_default();
        match drawn_from(&self.path) {
            Some(there) if there != here => Err(Error::of_file(
                &self.path,
                format!(
                    "the figure of {there}, which that of {here} would replace; choose another folder with {}, or replace it with \
                     --force",
                    self.product.option()
                ),
            )),
            _ => Ok(()),
        }
    }
}

/// The files from which the figure at `path` was drawn; `None` if there is no figure, or if it does not name them.
fn drawn_from(path: &Path) -> Option<String> {
    let head = head_of(path).ok()?;
    let text = String::from_utf8_lossy(&head);
    let (_, after) = text.split_once(&figure_mark(&head))?;
    signature::names_in(after).map(str::to_owned)
}
