//! SVG output.

use super::drawing::{Drawing, DrawingElement, ElementForm};
use super::html::escaped;
use super::{font, signature, typeset};
use plotters_backend::BackendCoord;

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
    match &element.form {
        ElementForm::Line([(x1, y1), (x2, y2)]) => format!(
            "<line opacity=\"{opacity}\" stroke=\"{stroke}\" stroke-width=\"{width}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>\n"
        ),
        ElementForm::Polyline(points) => format!(
            "<polyline fill=\"{fill}\" opacity=\"{opacity}\" stroke=\"{stroke}\" stroke-width=\"{width}\" points=\"{}\"/>\n",
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
                font::FAMILIES,
                text.size,
                typeset::spans(&text.words, text.size)
            )
        }
    }
}

fn listed(points: &[BackendCoord]) -> String {
    points.iter().map(|(x, y)| format!("{x},{y} ")).collect()
}
