//! Figures: from result files to SVG, PNG and PDF.
//!
//! The [`catalogue`] and [`own`] turn a result file, opened as a [`DrawnRun`], into [`Figure`]s (data). [`draw`](fn@draw)
//! turns a figure into a [`Drawing`] with an embedded font, which is written as SVG, PNG or PDF. [`page`] writes HTML
//! pages.
//!
//! | module | contents |
//! |---|---|
//! | `figure`, `style`, `scale`, `labels` | a figure as data, and its parts |
//! | `text` | texts: font, width, subscripts and superscripts |
//! | `run`, `thinning` | data from a result file for figures |
//! | `catalogue`, `entry`, `portraits`, `law`, `own` | figures of a run; figures of any channel |
//! | `certified`, `comparison`, `critical`, `accuracy` | figures of other results |
//! | `studies` | figures and page for many runs |
//! | `branches` | figures and page for a continuation |
//! | `draw`, `drawing` | layout, lines and marks, and the drawing that results |
//! | `formats` | a drawing as SVG, PNG and PDF |
//! | `html`, `page` | interactive pages: their form, that of a study or a continuation, that of a run |
//! | `target`, `signature`, `error` | destinations, signatures and errors |

pub mod accuracy;
pub mod branches;
pub mod catalogue;
pub mod certified;
pub mod comparison;
pub mod critical;
mod draw;
mod drawing;
pub mod entry;
pub mod figure;
mod formats;
pub(crate) mod html;
pub mod labels;
pub mod law;
pub mod own;
pub mod page;
pub mod portraits;
pub mod run;
pub mod scale;
pub mod signature;
pub mod studies;
pub mod style;
pub mod text;
pub mod thinning;

use crate::Error;

pub use draw::draw;
pub use drawing::{Drawing, DrawingElement, ElementForm, Text};
pub use figure::{Axis, Curve, CurveStyle, Figure, MarkShape, Panel};
pub use html::PointsPage;
pub use run::DrawnRun;
pub use style::Layout;
