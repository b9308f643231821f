//! Figures: from result files to SVG, PNG and PDF.
//!
//! The [`catalogue`] and [`own`] turn a result file, opened as a [`DrawnRun`], into [`Figure`]s (data). [`draw`](fn@draw)
//! turns a figure into a [`Drawing`] with an embedded font, which is written as SVG, PNG or PDF. [`page`] writes HTML
//! pages.
//!
//! | module | contents |
//! |---|---|
//! | `figure`, `style`, `colors`, `scale`, `labels`, `marks` | a figure as data, and its parts |
//! | `font`, `typeset` | texts: font, width, subscripts and superscripts |
//! | `run`, `decimate`, `sides`, `spiral` | data from a result file for figures |
//! | `catalogue`, `entry`, `portraits`, `law`, `own` | figures of a run; figures of any channel |
//! | `certified`, `comparison`, `critical`, `modes`, `onset`, `work_precision` | figures of other results |
//! | `studies` | figures and page for many runs |
//! | `branches` | figures and page for a continuation |
//! | `draw`, `ink`, `drawing` | layout, lines and marks, and the drawing that results |
//! | `svg`, `raster`, `pdf` | a drawing as SVG, PNG and PDF |
//! | `html`, `page`, `points` | interactive pages: their form, that of a run, that of a study or a continuation |
//! | `target`, `signature`, `error` | destinations, signatures and errors |

pub mod branches;
pub mod catalogue;
pub mod certified;
pub mod colors;
pub mod comparison;
pub mod critical;
pub mod decimate;
mod draw;
mod drawing;
pub mod entry;
pub mod figure;
pub mod font;
pub(crate) mod html;
mod ink;
pub mod labels;
mod law;
pub mod marks;
pub mod modes;
pub mod onset;
pub mod own;
pub mod page;
mod pdf;
mod points;
pub mod portraits;
mod raster;
pub mod run;
pub mod scale;
mod sides;
pub mod signature;
pub mod spiral;
pub mod studies;
pub mod style;
mod svg;
pub mod typeset;
pub mod work_precision;

use crate::Error;

pub use draw::draw;
pub use drawing::{Drawing, DrawingElement, ElementForm, Text};
pub use figure::{Axis, Curve, CurveStyle, Figure, MarkShape, Panel};
pub use points::PointsPage;
pub use run::DrawnRun;
pub use style::Layout;
