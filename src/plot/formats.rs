//! A drawing as SVG, PDF and PNG.
//!
//! In PDF letters are outlines, so that no font is needed. Some printers reject transparency: translucent colours are mixed with
//! white there.

use super::drawing::{Drawing, DrawingElement, DrawnPoint, ElementForm};
use super::html::escaped;
use super::{signature, text};
use crate::Error;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Pdf, Rect, Ref, TextStr};
use std::io::Write as _;
use tiny_skia::{Color, FillRule, LineJoin, Paint, Path, PathSegment, Pixmap, Point, Stroke, StrokeDash, Transform};

impl Drawing {
    /// The SVG document, with its physical size, and a description for blind readers.
    pub fn svg(&self) -> String {
        let (width, height) = self.size;
        let mm = |units: u32| (f64::from(units) / self.units_per_mm * 1e3).round() / 1e3;
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{}mm\" viewBox=\"0 0 {width} {height}\" \
             role=\"img\" stroke-linejoin=\"round\">\n<title>{}</title>\n<desc>{} {}{}</desc>\n",
            mm(width),
            mm(height),
            escaped(&self.title),
            signature::FIGURE,
            escaped(&self.name),
            self.source,
        );
        for element in &self.elements {
            text += &written(element);
        }
        text + "</svg>\n"
    }
}

fn written(element: &DrawingElement) -> String {
    let [red, green, blue] = element.color;
    let color = format!("#{red:02X}{green:02X}{blue:02X}");
    let opacity = element.opacity;
    let (fill, stroke) = match element.stroke {
        Some(_) => ("none", &*color),
        None => (&*color, "none"),
    };
    let width = element.stroke.unwrap_or(1);
    let dash = element
        .dash
        .map_or_else(String::new, |[dash, gap]| format!(" stroke-dasharray=\"{dash} {gap}\""));
    match &element.form {
        ElementForm::Line([(x1, y1), (x2, y2)]) => format!(
            "<line opacity=\"{opacity}\" stroke=\"{stroke}\" stroke-width=\"{width}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>\n"
        ),
        ElementForm::Polyline(points) => format!(
            "<polyline fill=\"{fill}\" opacity=\"{opacity}\" stroke=\"{stroke}\" stroke-width=\"{width}\"{dash} points=\"{}\"/>\n",
            listed(points)
        ),
        ElementForm::Polygon(corners) => format!(
            "<polygon opacity=\"{opacity}\" fill=\"{fill}\" points=\"{}\"/>\n",
            listed(corners)
        ),
        ElementForm::Rectangle([(left, top), (right, bottom)]) => format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" opacity=\"{opacity}\" fill=\"{fill}\" stroke=\"{stroke}\"/>\n",
            right - left,
            bottom - top
        ),
        ElementForm::Circle((x, y), radius) => format!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" opacity=\"{opacity}\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"{width}\"/>\n"
        ),
        ElementForm::Text(text) => {
            let (x, y) = text.at;
            let turned = match text.turn {
                0 => String::new(),
                degrees => format!(" transform=\"rotate({degrees}, {x}, {y})\""),
            };
            format!(
                "<text x=\"{x}\" y=\"{y}\" dy=\"{}\" text-anchor=\"{}\" font-family=\"{}\" font-size=\"{}\" opacity=\"{opacity}\" \
                 fill=\"{fill}\"{turned}>\n{}\n</text>\n",
                text.drop.0,
                text.anchor.0,
                text::FAMILIES,
                text.size,
                text::spans(&text.words, text.size)
            )
        }
    }
}

fn listed(points: &[DrawnPoint]) -> String {
    points.iter().map(|(x, y)| format!("{x},{y} ")).collect()
}

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
                if let Some(dash) = element.dash {
                    page.set_dash_pattern(dash.map(|length| self.points(length as f32)), 0.0);
                }
                self.trace(&mut page, &outline);
                page.stroke();
                if element.dash.is_some() {
                    page.set_dash_pattern([], 0.0);
                }
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

/// Pixels.
const LARGEST: f64 = 2e8;

impl Drawing {
    /// The PNG file, with `dpi` pixels per inch.
    ///
    /// # Errors
    /// The picture is too large.
    pub fn png(&self, dpi: f64) -> Result<Vec<u8>, Error> {
        let scale = dpi / 25.4 / self.units_per_mm;
        let [width, height] = [self.size.0, self.size.1].map(|units| (f64::from(units) * scale).ceil());
        let too_large = || {
            Error::input(format!(
                "a picture of {width} x {height} pixels is too large; use a smaller --width or --dpi"
            ))
        };
        if width * height > LARGEST {
            return Err(too_large());
        }
        let mut pixels = Pixmap::new(width as u32, height as u32).ok_or_else(too_large)?;
        pixels.fill(Color::WHITE);
        let scaled = Transform::from_scale(scale as f32, scale as f32);
        for element in &self.elements {
            let Some(outline) = element.outline() else { continue };
            let [red, green, blue] = element.color;
            let mut paint = Paint::default();
            paint.set_color_rgba8(red, green, blue, (255.0 * element.opacity).round() as u8);
            match element.stroke {
                None => {
                    // Cells of a map meet without a seam.
                    paint.anti_alias = !matches!(element.form, ElementForm::Rectangle(_));
                    pixels.fill_path(&outline, &paint, FillRule::Winding, scaled, None);
                }
                Some(width) => {
                    let stroke = Stroke {
                        width: width as f32,
                        line_join: LineJoin::Round,
                        dash: element
                            .dash
                            .and_then(|lengths| StrokeDash::new(lengths.map(|length| length as f32).to_vec(), 0.0)),
                        ..Stroke::default()
                    };
                    pixels.stroke_path(&outline, &paint, &stroke, scaled, None);
                }
            }
        }
        encode(&pixels, dpi, &self.source).map_err(Error::drawing)
    }
}

/// Everything is opaque, so that three channels suffice.
fn encode(pixels: &Pixmap, dpi: f64, source: &str) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (dpi / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: per_metre,
        yppu: per_metre,
        unit: png::Unit::Meter,
    }));
    encoder.add_text_chunk(signature::PNG.0.to_owned(), format!("{}{source}", signature::PNG.1))?;
    let rgb: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(file)
}
