//! Where a figure or a page goes: its earlier version is replaced, any other file only by force.

use super::signature;
use crate::results::disk::{Obstacle, folder_of, in_the_way, misplaced, try_folder, write_whole};
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
    const fn name(self) -> &'static str {
        match self {
            Product::Figure(_) => "figure",
            Product::Page => "page",
            Product::Report => "report",
            Product::Case => "case",
        }
    }

    /// The option that names it.
    pub const fn option(self) -> &'static str {
        match self {
            Product::Figure(option) => option,
            Product::Page => "--html",
            Product::Report => "--report",
            Product::Case => "--case",
        }
    }

    const fn example(self) -> &'static str {
        match self {
            Product::Figure(_) => "figure.svg",
            Product::Page | Product::Report => "report.html",
            Product::Case => "case.toml",
        }
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
            Product::Figure(_) if head.starts_with(b"\x89PNG") => contains(&format!("{keyword}\0{value}")),
            Product::Figure(_) if head.starts_with(b"%PDF") => contains(&format!("/Producer ({})", signature::PDF)),
            Product::Figure(_) if head.starts_with(b"%!PS") => contains(&format!("%%Creator: {}", signature::EPS)),
            Product::Figure(_) => contains(&format!("<desc>{}", signature::SVG)),
        }
    }

    /// What such a product is made from.
    const fn input(self) -> &'static str {
        match self {
            Product::Figure(_) | Product::Page => "the file to be drawn",
            Product::Report | Product::Case => "an input",
        }
    }

    /// Of a file that is there and is not replaced.
    fn not_own(self) -> String {
        match self {
            Product::Case => "is there already".to_owned(),
            _ => format!("there already, and not a {} that this program made", self.name()),
        }
    }
}

/// Why a figure or a page cannot go where it should.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum TargetError {
    #[error("{path}: this is {}; give the {} another name with {}",
        .product.input(), .product.name(), .product.option())]
    IsInput { path: PathBuf, product: Product },
    #[error(
        "{path}: a folder; name a file in it, for example {} {}",
        .product.option(), .path.join(.product.example()).display()
    )]
    IsFolder { path: PathBuf, product: Product },
    #[error(
        "{path}: not a usable file name; name the {} with {option}, for example {option} {}",
        .product.name(), .product.example(), option = .product.option()
    )]
    NoFileName { path: PathBuf, product: Product },
    #[error("{path}: the folder {folder} does not exist; create it, or choose another with {}", .product.option())]
    NoFolder {
        path: PathBuf,
        folder: PathBuf,
        product: Product,
    },
    #[error(
        "{path}: {}; choose another name with {}, or replace it with --force", .product.not_own(), .product.option()
    )]
    Foreign { path: PathBuf, product: Product },
    #[error("{path}: a pipe or a device, which no file replaces; choose another name with {}", .product.option())]
    PipeOrDevice { path: PathBuf, product: Product },
    #[error("{path}: write-protected; choose another name with {}, or replace it with --force", .product.option())]
    Protected { path: PathBuf, product: Product },
    #[error("{path}: {action} failed: {source}; check the folder and its disk, or choose another with {}", .product.option())]
    Io {
        path: PathBuf,
        action: &'static str,
        source: io::Error,
        product: Product,
    },
}

/// Whether a product made from `inputs` may be written to `path`; an input is never replaced.
///
/// # Errors
/// `path` is an input, a folder, in a folder that is missing, or a file that is no such product of this program, or
/// write-protected, and is not to be replaced by `force`; or its folder takes no file.
pub fn check(path: &Path, product: Product, inputs: &[PathBuf], force: bool) -> Result<(), TargetError> {
    let refused = |obstacle| Err(refusal(obstacle, path, product));
    if let Some(obstacle) = misplaced(path, inputs) {
        return refused(obstacle);
    }
    let is_own = |path: &Path| {
        let mut head = Vec::new();
        let read = fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
        read.map_err(|error| failed(path, product, "reading the file", error))?;
        Ok(product.is_own(&head))
    };
    if let Some(obstacle) = in_the_way(path, force, is_own)? {
        return refused(obstacle);
    }
    try_folder(&folder_of(path)).map_err(|error| failed(path, product, "creating the file", error))
}

fn refusal(obstacle: Obstacle, path: &Path, product: Product) -> TargetError {
    let owned = path.to_owned();
    match obstacle {
        Obstacle::Folder => TargetError::IsFolder { path: owned, product },
        Obstacle::NoFileName => TargetError::NoFileName { path: owned, product },
        Obstacle::NoFolder(folder) => TargetError::NoFolder {
            path: owned,
            folder,
            product,
        },
        Obstacle::Input => TargetError::IsInput { path: owned, product },
        Obstacle::PipeOrDevice => TargetError::PipeOrDevice { path: owned, product },
        Obstacle::Protected => TargetError::Protected { path: owned, product },
        Obstacle::NotOwn => TargetError::Foreign { path: owned, product },
        Obstacle::NotSeen(error) => failed(path, product, "looking at the file", error),
    }
}

/// Writes `parts` one after the other under a temporary name, which becomes `path` when all is written: a product is
/// there in whole or not at all.
///
/// # Errors
/// Of the operating system.
pub fn write(path: &Path, product: Product, parts: &[&[u8]]) -> Result<(), TargetError> {
    write_whole(path, parts).map_err(|error| failed(path, product, "writing", error))
}

fn failed(path: &Path, product: Product, action: &'static str, source: io::Error) -> TargetError {
    TargetError::Io {
        path: path.to_owned(),
        action,
        source,
        product,
    }
}
