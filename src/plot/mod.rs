//! Figures: from result files to SVG and PNG.
//!
//! A result file is opened as a [`Run`]; the [`catalogue`] or [`own`] makes [`Figure`]s of it, which are data; [`svg`]
//! draws them; [`raster`] turns that into pixels and [`vector`] into PDF and EPS, with a font of its own. [`page`] is a page for the browser.
//!
//! | module | what it is |
//! |---|---|
//! | `figure`, `style`, `colors`, `scale`, `labels`, `marks` | a figure as data, and its parts |
//! | `font`, `typeset` | texts: font, width, sub- and superscripts |
//! | `run`, `decimate`, `sides`, `spiral` | a result file as figures need it |
//! | `catalogue`, `entry`, `portraits`, `law`, `own` | the figures of a run; figures of any channel |
//! | `certified`, `comparison`, `critical`, `modes`, `onset`, `work_precision` | figures of other results |
//! | `studies` | figures and page of many runs |
//! | `branches` | figures and page of a continuation |
//! | `svg`, `ink`, `raster`, `vector` | a figure as SVG, and its lines and marks; from that PNG, PDF and EPS |
//! | `page`, `html` | the interactive page of a run |
//! | `target`, `signature`, `error` | where figures and pages go; how they are recognised; why there is none |

pub mod branches;
pub mod catalogue;
pub mod certified;
pub mod colors;
pub mod comparison;
pub mod critical;
pub mod decimate;
pub mod entry;
pub mod error;
pub mod figure;
pub mod font;
mod html;
mod ink;
pub mod labels;
mod law;
mod marks;
pub mod modes;
pub mod onset;
pub mod own;
pub mod page;
pub mod portraits;
pub mod raster;
pub mod run;
pub mod scale;
mod sides;
pub mod signature;
pub mod spiral;
pub mod studies;
pub mod style;
pub mod svg;
pub mod target;
mod typeset;
pub mod vector;
pub mod work_precision;

pub use error::PlotError;
pub use figure::{Axis, Curve, CurveStyle, Figure, Panel, Shape};
pub use run::Run;
pub use style::Layout;
