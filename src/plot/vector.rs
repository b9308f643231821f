//! From SVG to PDF and EPS: lines and surfaces, with the letters as outlines, so that neither needs a font.
//!
//! Both have the same page, as operators of PDF; EPS begins with what they are in PostScript. PostScript knows no
//! transparency, and some printers want none: what lets the ground through has the colour that it has on white.

use super::error::PlotError;
use super::{raster, signature};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::{Filter, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::{PathSegment, Point, Transform};
use resvg::usvg::{FillRule, Group, LineCap, LineJoin, Node, Paint, Path, Tree};
use std::fmt::Write as _;
use std::io::Write as _;

/// Points in an inch, and pixels of SVG in one.
const POINTS_PER_PIXEL: f64 = 72.0 / 96.0;

/// The figure as a PDF file of one page.
///
/// # Errors
/// If `svg` is no SVG.
pub fn pdf(svg: &str, title: &str) -> Result<Vec<u8>, PlotError> {
    let Page { width, height, content } = page(svg)?;
    let failed = |error: std::io::Error| PlotError::Drawing(error.to_string());
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(content.as_bytes()).map_err(failed)?;
    let content = encoder.finish().map_err(failed)?;
    let [information, catalogue, pages, sheet, stream] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut pdf = Pdf::new();
    pdf.set_version(1, 4);
    // First, so that the program finds its signature at the head of the file.
    let mut about = pdf.document_info(information);
    about.producer(TextStr(signature::FIGURE));
    about.title(TextStr(title));
    drop(about);
    pdf.catalog(catalogue).pages(pages);
    pdf.pages(pages).kids([sheet]).count(1);
    let mut page = pdf.page(sheet);
    page.media_box(Rect::new(0.0, 0.0, width as f32, height as f32));
    page.parent(pages);
    page.contents(stream);
    page.resources();
    drop(page);
    pdf.stream(stream, &content).filter(Filter::FlateDecode);
    Ok(pdf.finish())
}

/// What the operators of a page are in PostScript.
const PROLOGUE: &str = "\
/m {moveto} bind def
/l {lineto} bind def
/c {curveto} bind def
/h {closepath} bind def
/f {fill} bind def
/f* {eofill} bind def
/S {stroke} bind def
/rg {setrgbcolor} bind def
/RG {setrgbcolor} bind def
/w {setlinewidth} bind def
/J {setlinecap} bind def
/j {setlinejoin} bind def
/d {setdash} bind def
";

/// The figure as an Encapsulated PostScript file.
///
/// # Errors
/// If `svg` is no SVG.
pub fn eps(svg: &str, title: &str) -> Result<Vec<u8>, PlotError> {
    let Page { width, height, content } = page(svg)?;
    // A comment of the document is one line of ASCII, of 255 letters at most.
    let plain = |c: &char| c.is_ascii() && !c.is_ascii_control() && !matches!(c, '(' | ')' | '\\');
    let title: String = title.chars().filter(plain).take(200).collect();
    let (right, top) = (width.ceil(), height.ceil());
    Ok(format!(
        "%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 {right} {top}\n%%HiResBoundingBox: 0 0 {} {}\n%%Creator: {}\n%%Title: ({title})\n\
         %%LanguageLevel: 2\n%%Pages: 1\n%%EndComments\n%%BeginProlog\n20 dict begin\n{PROLOGUE}%%EndProlog\n%%Page: 1 1\ngsave\n\
         {content}grestore\nshowpage\n%%Trailer\nend\n%%EOF\n",
        number(width),
        number(height),
        signature::FIGURE,
    )
    .into_bytes())
}

/// What is on a page, and how large it is, in points.
struct Page {
    width: f64,
    height: f64,
    content: String,
}

fn page(svg: &str) -> Result<Page, PlotError> {
    let tree: Tree = raster::tree(svg)?;
    let size = |pixels: f32| f64::from(pixels) * POINTS_PER_PIXEL;
    let (width, height) = (size(tree.size().width()), size(tree.size().height()));
    let mut drawing = Drawing {
        height,
        content: String::new(),
    };
    drawing.group(tree.root(), 1.0);
    Ok(Page {
        width,
        height,
        content: drawing.content,
    })
}

struct Drawing {
    /// Of the page, points: it has its origin below.
    height: f64,
    content: String,
}

impl Drawing {
    fn group(&mut self, group: &Group, opacity: f32) {
        let opacity = opacity * group.opacity().get();
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, opacity),
                Node::Path(path) => self.path(path, opacity),
                Node::Text(text) => self.group(text.flattened(), opacity),
                // Figures have none.
                Node::Image(_) => {}
            }
        }
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        if !path.is_visible() {
            return;
        }
        let transform = path.abs_transform();
        if let Some(fill) = path.fill()
            && let Some(color) = on_white(fill.paint(), opacity * fill.opacity().get())
        {
            self.line(format_args!("{color} rg"));
            self.outline(path, transform);
            let star = if fill.rule() == FillRule::EvenOdd { "*" } else { "" };
            self.line(format_args!("f{star}"));
        }
        if let Some(stroke) = path.stroke()
            && let Some(color) = on_white(stroke.paint(), opacity * stroke.opacity().get())
        {
            let scale = f64::from(transform.get_scale().0) * POINTS_PER_PIXEL;
            let lengths = stroke.dasharray().unwrap_or_default().iter();
            let lengths: Vec<String> = lengths.map(|length| number(f64::from(*length) * scale)).collect();
            let cap = match stroke.linecap() {
                LineCap::Butt => 0,
                LineCap::Round => 1,
                LineCap::Square => 2,
            };
            let join = match stroke.linejoin() {
                LineJoin::Miter | LineJoin::MiterClip => 0,
                LineJoin::Round => 1,
                LineJoin::Bevel => 2,
            };
            let width = number(f64::from(stroke.width().get()) * scale);
            self.line(format_args!(
                "{color} RG {width} w {cap} J {join} j [{}] 0 d",
                lengths.join(" ")
            ));
            self.outline(path, transform);
            self.line(format_args!("S"));
        }
    }

    fn outline(&mut self, path: &Path, transform: Transform) {
        let height = self.height;
        let place = |point: Point| {
            let mut point = point;
            transform.map_point(&mut point);
            let scaled = |pixels: f32| f64::from(pixels) * POINTS_PER_PIXEL;
            (scaled(point.x), height - scaled(point.y))
        };
        let mut last = (0.0, 0.0);
        for segment in path.data().segments() {
            let (points, operator) = match segment {
                PathSegment::MoveTo(point) => (vec![place(point)], "m"),
                PathSegment::LineTo(point) => (vec![place(point)], "l"),
                PathSegment::QuadTo(middle, point) => {
                    // The same parabola as a cubic.
                    let (middle, end) = (place(middle), place(point));
                    let third = |from: f64, to: f64| from + 2.0 / 3.0 * (to - from);
                    let third = |from: (f64, f64)| (third(from.0, middle.0), third(from.1, middle.1));
                    (vec![third(last), third(end), end], "c")
                }
                PathSegment::CubicTo(first, second, point) => (vec![place(first), place(second), place(point)], "c"),
                PathSegment::Close => (Vec::new(), "h"),
            };
            last = points.last().copied().unwrap_or(last);
            for (x, y) in points {
                self.content += &format!("{} {} ", number(x), number(y));
            }
            self.line(format_args!("{operator}"));
        }
    }

    fn line(&mut self, line: std::fmt::Arguments) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.content, "{line}");
    }
}

/// A colour as it appears on white; `None` of what is no single colour, which figures do not have.
fn on_white(paint: &Paint, opacity: f32) -> Option<String> {
    let Paint::Color(color) = paint else { return None };
    let share = |part: u8| number(1.0 - f64::from(opacity) * (1.0 - f64::from(part) / 255.0));
    Some([color.red, color.green, color.blue].map(share).join(" "))
}

/// With three decimals, a third of a micrometre in points.
fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page of 254 x 127 mm is one of 720 x 360 points; its origin is below, and a colour of half the opacity is half as far
    /// from white.
    #[test]
    fn analytic_a_line_and_a_surface_have_their_places() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"254mm\" height=\"127mm\" viewBox=\"0 0 2540 1270\">\
                   <rect x=\"0\" y=\"0\" width=\"254\" height=\"127\" fill=\"#ff0000\" opacity=\"0.5\"/>\
                   <path d=\"M 0 0 L 2540 1270\" stroke=\"#0000ff\" stroke-width=\"10\" stroke-dasharray=\"20 10\"/></svg>";
        let Page { width, height, content } = page(svg).unwrap();
        assert!(
            (width - 720.0).abs() < 1e-3 && (height - 360.0).abs() < 1e-3,
            "{width} {height}"
        );
        assert!(
            content.starts_with("1 0.5 0.5 rg\n0 360 m\n72 360 l\n72 324 l\n0 324 l\nh\nf\n"),
            "{content}"
        );
        assert!(
            content.contains("0 0 1 RG 2.835 w 0 J 0 j [5.669 2.835] 0 d\n0 360 m\n720 0 l\nS\n"),
            "{content}"
        );
    }
}
