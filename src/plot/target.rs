//! Destination of figures and pages. An earlier version is replaced, and other files by force only.

use super::signature;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use stickslip_files::disk::{Obstacle, folder_of, in_the_way, misplaced, try_folder, write_whole};

/// Number of bytes at the start of a file in which the signature is searched.
const HEAD: u64 = 4096;

/// A product of this program.
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
}

impl Product {
    const fn words(self) -> [&'static str; 4] {
        match self {
            Product::Figure(option) => ["figure", option, "figure.svg", "the file to be drawn"],
            Product::Page => ["page", "--html", "report.html", "the file to be drawn"],
            Product::Report => ["report", "--report", "report.html", "an input"],
            Product::Case => ["case", "--case", "case.toml", "an input"],
        }
    }

    /// The option that names the file.
    pub const fn option(self) -> &'static str {
        self.words()[1]
    }

    fn is_own(self, head: &[u8]) -> bool {
        let contains = |text: &str| head.windows(text.len()).any(|window| window == text.as_bytes());
        match self {
            Product::Page => contains(signature::PAGE),
            Product::Report => {
                let generator = format!("content=\"{}\"", signature::REPORT);
                contains(&format!("<!-- {} -->", signature::REPORT)) || contains(&generator)
            }
            Product::Case => false,
            Product::Figure(_) => contains(&figure_mark(head)),
        }
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
    fs::File::open(path)?.take(HEAD).read_to_end(&mut head)?;
    Ok(head)
}

/// The files from which the figure at `path` was drawn; `None` if there is no figure, or if it does not name them.
pub fn drawn_from(path: &Path) -> Option<String> {
    let head = head_of(path).ok()?;
    let text = String::from_utf8_lossy(&head);
    let (_, after) = text.split_once(&figure_mark(&head))?;
    signature::names_in(after).map(str::to_owned)
}

/// Reason why a product cannot be written to a path.
#[derive(Debug)]
pub struct TargetError {
    path: PathBuf,
    product: Product,
    obstacle: Obstacle,
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
    pub(crate) fn failed(path: &Path, product: Product, action: &'static str, error: io::Error) -> TargetError {
        TargetError {
            path: path.to_owned(),
            product,
            obstacle: Obstacle::NotSeen(error),
            action,
        }
    }

    /// Whether the operating system failed, so that the path may be right.
    pub fn is_failure(&self) -> bool {
        matches!(self.obstacle, Obstacle::NotSeen(_))
    }
}

/// Checks whether a product made from `inputs` may be written to `path`.
///
/// # Errors
/// `path` is an input or a folder, or is in a missing or read-only folder. Without `force` it may also not be a
/// write-protected file or another product.
pub fn check(path: &Path, product: Product, inputs: &[PathBuf], force: bool) -> Result<(), TargetError> {
    let failed = |action| move |error| TargetError::failed(path, product, action, error);
    let is_own = |path: &Path| {
        let head = head_of(path).map_err(failed("reading the file"))?;
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

/// Writes `parts` under a temporary name, which becomes `path` at the end, so that a product is complete or absent.
pub fn write(path: &Path, product: Product, parts: &[&[u8]]) -> Result<(), TargetError> {
    write_whole(path, parts).map_err(|error| TargetError::failed(path, product, "writing", error))
}
