//! PDF output. Letters are outlines, so that no font is needed.
//!
//! Some printers reject transparency. Translucent colours are therefore mixed with white.

use super::drawing::{Drawing, DrawingElement};
use super::signature;
use crate::Error;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Pdf, Rect, Ref, TextStr};
use std::io::Write as _;
use tiny_skia::{Path, PathSegment, Point};

impl Drawing {
    /// The PDF file, with one page.
    pub fn pdf(&self) -> Result<Vec<u8>, Error> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&self.page()).map_err(Error::drawing)?;
        let content = encoder.finish().map_err(Error::drawing)?;
        let [information, catalogue, pages, sheet, stream] = [1, 2, 3, 4, 5].map(Ref::new);
        let mut pdf = Pdf::new();
        pdf.set_version(1, 4);
        // Written first, so that the signature is at the beginning of the file.
        let mut about = pdf.document_info(information);
        about.producer(TextStr(&format!("{}{}", signature::FIGURE, self.source)));
        about.title(TextStr(&self.title));
        drop(about);
        pdf.catalog(catalogue).pages(pages);
        pdf.pages(pages).kids([sheet]).count(1);
        let mut page = pdf.page(sheet);
        let [width, height] = [self.size.0, self.size.1].map(|units| self.points(units as f32));
        page.media_box(Rect::new(0.0, 0.0, width, height));
        page.parent(pages);
        page.contents(stream);
        page.resources();
        drop(page);
        pdf.stream(stream, &content).filter(Filter::FlateDecode);
        Ok(pdf.finish())
    }

    /// The drawing operators of the page, in points from its lower left corner.
    pub fn page(&self) -> Vec<u8> {
        let mut page = Content::new();
        page.set_line_join(LineJoinStyle::RoundJoin);
        for element in &self.elements {
            let Some(outline) = element.outline() else { continue };
            let [red, green, blue] = on_white(element);
            if let Some(width) = element.stroke {
                page.set_stroke_rgb(red, green, blue);
                page.set_line_width(self.points(width as f32));
                self.trace(&mut page, &outline);
                page.stroke();
            } else {
                page.set_fill_rgb(red, green, blue);
                self.trace(&mut page, &outline);
                page.fill_nonzero();
            }
        }
        page.finish().into_vec()
    }

    fn trace(&self, page: &mut Content, outline: &Path) {
        // The origin of a page is at the bottom.
        let place = |point: Point| (self.points(point.x), self.points(self.size.1 as f32 - point.y));
        let mut last = (0.0, 0.0);
        for segment in outline.segments() {
            match segment {
                PathSegment::MoveTo(end) => {
                    last = place(end);
                    page.move_to(last.0, last.1)
                }
                PathSegment::LineTo(end) => {
                    last = place(end);
                    page.line_to(last.0, last.1)
                }
                PathSegment::QuadTo(middle, end) => {
                    // The quadratic curve as a cubic one.
                    let (start, middle) = (last, place(middle));
                    last = place(end);
                    let third = |from: f32, to: f32| rounded(from + 2.0 / 3.0 * (to - from));
                    let [first, second] = [start, last].map(|from| (third(from.0, middle.0), third(from.1, middle.1)));
                    page.cubic_to(first.0, first.1, second.0, second.1, last.0, last.1)
                }
                PathSegment::CubicTo(first, second, end) => {
                    let (first, second) = (place(first), place(second));
                    last = place(end);
                    page.cubic_to(first.0, first.1, second.0, second.1, last.0, last.1)
                }
                PathSegment::Close => page.close_path(),
            };
        }
    }

    fn points(&self, units: f32) -> f32 {
        rounded((f64::from(units) / self.units_per_mm / 25.4 * 72.0) as f32)
    }
}

/// Three decimals of a point are a third of a micrometre.
fn rounded(value: f32) -> f32 {
    (1e3 * value).round() / 1e3
}

fn on_white(element: &DrawingElement) -> [f32; 3] {
    let opacity = element.opacity as f32;
    element
        .color
        .map(|part| rounded(1.0 - opacity * (1.0 - f32::from(part) / 255.0)))
}
