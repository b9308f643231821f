//! Where a figure or a page goes: its earlier version is replaced, any other file only by force.

use super::signature;
use crate::results::disk::{Obstacle, folder_of, in_the_way, misplaced, try_folder, write_whole};
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Bytes at the start of a file in which a signature stands.
const HEAD: u64 = 4096;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Product {
    /// SVG, PNG, PDF or EPS; with the option that names it.
    Figure(&'static str),
    /// An HTML page.
    Page,
    /// Of a comparison, HTML or Markdown.
    Report,
    /// A case file. It is an input as well: one that is there is replaced by force alone.
    Case,
}

impl Product {
    /// Its name, the option that names it, an example, and what it is made from.
    const fn words(self) -> [&'static str; 4] {
        match self {
            Product::Figure(option) => ["figure", option, "figure.svg", "the file to be drawn"],
            Product::Page => ["page", "--html", "report.html", "the file to be drawn"],
            Product::Report => ["report", "--report", "report.html", "an input"],
            Product::Case => ["case", "--case", "case.toml", "an input"],
        }
    }

    /// The option that names it.
    pub const fn option(self) -> &'static str {
        self.words()[1]
    }

    /// Whether a file that begins with `head` is such a product of this program.
    fn is_own(self, head: &[u8]) -> bool {
        let contains = |text: &str| head.windows(text.len()).any(|window| window == text.as_bytes());
        let (keyword, value) = signature::PNG;
        match self {
            Product::Page => contains(signature::PAGE),
            Product::Report => {
                let generator = format!("content=\"{}\"", signature::REPORT);
                contains(&format!("<!-- {} -->", signature::REPORT)) || contains(&generator)
            }
            Product::Case => false,
            Product::Figure(_) => contains(&match head {
                [0x89, b'P', b'N', b'G', ..] => format!("{keyword}\0{value}"),
                [b'%', b'P', b'D', b'F', ..] => format!("/Producer ({})", signature::FIGURE),
                [b'%', b'!', b'P', b'S', ..] => format!("%%Creator: {}", signature::FIGURE),
                _ => format!("<desc>{}", signature::FIGURE),
            }),
        }
    }
}

/// Why a figure or a page cannot go where it should.
#[derive(Debug)]
pub struct TargetError {
    path: PathBuf,
    product: Product,
    obstacle: Obstacle,
    /// What the system was asked for, where that failed.
    action: &'static str,
}

impl Display for TargetError {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let [name, option, example, input] = self.product.words();
        write!(f, "{}: ", self.path.display())?;
        match &self.obstacle {
            Obstacle::Input => write!(f, "this is {input}; give the {name} another name with {option}"),
            Obstacle::Folder => {
                let example = self.path.join(example);
                write!(
                    f,
                    "a folder; name a file in it, for example {option} {}",
                    example.display()
                )
            }
            Obstacle::NoFileName => {
                let words = "not a usable file name; name the";
                write!(f, "{words} {name} with {option}, for example {option} {example}")
            }
            Obstacle::NoFolder(folder) => {
                let (folder, words) = (folder.display(), "does not exist; create it, or choose another with");
                write!(f, "the folder {folder} {words} {option}")
            }
            Obstacle::PipeOrDevice => {
                let words = "a pipe or a device, which no file replaces; choose another name with";
                write!(f, "{words} {option}")
            }
            Obstacle::Protected | Obstacle::NotOwn => {
                let foreign = format!("there already, and not a {name} that this program made");
                let why = match (&self.obstacle, self.product) {
                    (Obstacle::Protected, _) => "write-protected",
                    (_, Product::Case) => "is there already",
                    _ => &foreign,
                };
                write!(
                    f,
                    "{why}; choose another name with {option}, or replace it with --force"
                )
            }
            Obstacle::NotSeen(error) => {
                let words = "check the folder and its disk, or choose another with";
                write!(f, "{} failed: {error}; {words} {option}", self.action)
            }
        }
    }
}

impl std::error::Error for TargetError {}

impl TargetError {
    /// Of an action of the operating system that failed.
    pub(crate) fn failed(path: &Path, product: Product, action: &'static str, error: io::Error) -> TargetError {
        TargetError {
            path: path.to_owned(),
            product,
            obstacle: Obstacle::NotSeen(error),
            action,
        }
    }

    /// Whether the operating system failed, and the path is not to blame.
    pub fn is_failure(&self) -> bool {
        matches!(self.obstacle, Obstacle::NotSeen(_))
    }
}

/// Whether a product made from `inputs` may be written to `path`; an input is never replaced.
///
/// # Errors
/// `path` is an input, a folder, in a folder that is missing, or a file that is no such product of this program, or
/// write-protected, and is not to be replaced by `force`; or its folder takes no file.
pub fn check(path: &Path, product: Product, inputs: &[PathBuf], force: bool) -> Result<(), TargetError> {
    let failed = |action| move |error| TargetError::failed(path, product, action, error);
    let is_own = |path: &Path| {
        let mut head = Vec::new();
        let read = fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
        read.map_err(failed("reading the file"))?;
        Ok(product.is_own(&head))
    };
    let obstacle = match misplaced(path, inputs) {
        None => in_the_way(path, force, is_own)?,
        misplaced => misplaced,
    };
    match obstacle {
        Some(obstacle) => Err(TargetError {
            path: path.to_owned(),
            product,
            obstacle,
            action: "looking at the file",
        }),
        None => try_folder(&folder_of(path)).map_err(failed("creating the file")),
    }
}

/// Writes `parts` one after the other under a temporary name, which becomes `path` when all is written: a product is
/// there in whole or not at all.
///
/// # Errors
/// Of the operating system.
pub fn write(path: &Path, product: Product, parts: &[&[u8]]) -> Result<(), TargetError> {
    write_whole(path, parts).map_err(|error| TargetError::failed(path, product, "writing", error))
}
