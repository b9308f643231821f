//! Where output goes. A product that was made from the same files is replaced, and any other file by force only.

#![cfg_attr(not(feature = "cli"), allow(dead_code, reason = "only commands need all of it"))]

use crate::Error;
use crate::plot::signature;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek};
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
    /// Contains the option that names the file.
    Case(&'static str),
    /// A table of a result.
    Table,
}

impl Product {
    const fn words(self) -> [&'static str; 4] {
        match self {
            Product::Figure(option) => ["figure", option, "figure.svg", "the file to be drawn"],
            Product::Page => ["page", "--html", "report.html", "the file to be drawn"],
            Product::Report => ["report", "--report", "report.html", "an input"],
            Product::Case(option) => ["case", option, "case.toml", "an input"],
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
            Product::Case(_) | Product::Table => false,
            Product::Report => [report_comment(), report_generator()].iter().any(|mark| contains(mark)),
            Product::Page => contains(signature::PAGE),
            Product::Figure(_) => contains(&figure_mark(&head)),
        })
    }

    /// The files from which the product at `path` was made; `None` if it is missing or does not name them.
    fn made_from(self, path: &Path) -> Option<String> {
        let head = head_of(path).ok()?;
        let marks = match self {
            Product::Case(_) | Product::Table => return None,
            Product::Report => vec![report_comment(), report_generator()],
            Product::Page => vec![signature::PAGE.to_owned()],
            Product::Figure(_) => vec![figure_mark(&head)],
        };
        let text = String::from_utf8_lossy(&head);
        let after = marks.iter().find_map(|mark| text.split_once(mark.as_str()))?.1;
        signature::names_in(after).map(str::to_owned)
    }

    pub(crate) fn failed(self, path: &Path, action: &'static str, error: io::Error) -> Error {
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
            Obstacle::NotOwn if matches!(self, Product::Case(_)) => format!("is there already; {replace}"),
            Obstacle::NotOwn if self == Product::Table => format!("there already, and not this table; {replace}"),
            Obstacle::NotOwn => format!("there already, and not a {name} that this program made; {replace}"),
            Obstacle::NotSeen(error) => return self.failed(path, "looking at the file", error),
        };
        Error::of_file(path, why)
    }
}

fn report_comment() -> String {
    format!("<!-- {}", signature::REPORT)
}

fn report_generator() -> String {
    format!("content=\"{}", signature::REPORT)
}

fn figure_mark(head: &[u8]) -> String {
    let (keyword, value) = signature::PNG;
    match head {
        [0x89, b'P', b'N', b'G', ..] => format!("{keyword}\0{value}"),
        [b'%', b'P', b'D', b'F', ..] => format!("/Producer ({}", signature::FIGURE),
        _ => format!("<desc>{}", signature::FIGURE),
    }
}

/// Whether an open file and the one at `path` have the same bytes.
fn is_same(mut file: &File, path: &Path) -> io::Result<bool> {
    let mut other = BufReader::new(File::open(path)?);
    if file.metadata()?.len() != other.get_ref().metadata()?.len() {
        return Ok(false);
    }
    file.rewind()?;
    let mut file = BufReader::new(file);
    loop {
        let (a, b) = (file.fill_buf()?, other.fill_buf()?);
        let length = a.len().min(b.len());
        if length == 0 || a[..length] != b[..length] {
            return Ok(a.len() == b.len() && length == 0);
        }
        file.consume(length);
        other.consume(length);
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
    /// Names of the files from which the product is made ([`signature::source`]); may be empty.
    source: String,
    force: bool,
}

impl Output {
    /// The place of a product made from `inputs`.
    ///
    /// # Errors
    /// `path` is an input or a folder, or is in a missing or read-only folder. Without `force` it may also not be a
    /// write-protected file, another product, or one that was made from other files.
    pub fn new(path: &Path, product: Product, inputs: &[PathBuf], force: bool) -> Result<Output, Error> {
        Output::made_from(path, product, (inputs, signature::source(inputs)), force)
    }

    /// Like [`Output::new`], with the names of the files from which the product is made.
    pub(crate) fn made_from(
        path: &Path,
        product: Product,
        (inputs, source): (&[PathBuf], String),
        force: bool,
    ) -> Result<Output, Error> {
        let output = Output::replacing(path, product, inputs, force, |path| product.is_own(path))?;
        let there = product.made_from(path).filter(|_| !force);
        match (there, signature::names_in(&source)) {
            (Some(there), Some(here)) if there != here => {
                let [name, option, ..] = product.words();
                Err(Error::of_file(
                    path,
                    format!(
                        "the {name} of {there}, which that of {here} would replace; choose another name with {option}, or replace it \
                         with --force"
                    ),
                ))
            }
            _ => Ok(Output { source, ..output }),
        }
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
        Ok(Output {
            path: path.to_owned(),
            product,
            source: String::new(),
            force,
        })
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the files from which the product is made, for its signature.
    pub(crate) fn source(&self) -> &str {
        &self.source
    }

    /// Writes `parts` under a temporary name, which becomes the path at the end, so that a product is complete or absent.
    ///
    /// # Errors
    /// The system fails, such as with a full disk.
    pub fn write(&self, parts: &[&[u8]]) -> Result<(), Error> {
        write_whole(&self.path, parts).map_err(|error| self.product.failed(&self.path, "writing", error))
    }

    /// Like [`Self::write`], with what `fill` writes. Without force, a table replaces only an identical one: its file
    /// does not say from which run it is.
    pub(crate) fn fill(&self, fill: impl FnOnce(&File) -> Result<(), Error>) -> Result<(), Error> {
        let failed = |error| self.product.failed(&self.path, "writing", error);
        let file = Temporary::create(&folder_of(&self.path)).map_err(failed)?;
        fill(file.file())?;
        let is_other = self.product == Product::Table && !self.force && self.path.exists();
        if is_other && !is_same(file.file(), &self.path).map_err(failed)? {
            return Err(self.product.refused(&self.path, Obstacle::NotOwn));
        }
        file.persist(&self.path).map_err(failed)
    }
}
