//! From SVG to PNG, with the program's own font.

use super::error::PlotError;
use super::{font, signature};
use resvg::{tiny_skia, usvg};
use std::sync::{Arc, OnceLock};

/// Pixels of an inch in SVG.
const SVG_DPI: f64 = 96.0;

/// Largest picture, pixels: of 4 bytes each.
const LARGEST: f64 = 2e8;

/// The document as the renderer sees it; of use to measure what a figure shows.
///
/// # Errors
/// If `svg` is no SVG.
pub fn tree(svg: &str) -> Result<usvg::Tree, PlotError> {
    static FONTS: OnceLock<Arc<usvg::fontdb::Database>> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(font::DATA.to_vec());
        Arc::new(fonts)
    });
    let options = usvg::Options {
        fontdb: fonts.clone(),
        ..usvg::Options::default()
    };
    usvg::Tree::from_str(svg, &options).map_err(|error| PlotError::Drawing(error.to_string()))
}

/// The figure as a PNG file with `dpi` pixels in an inch.
///
/// # Errors
/// If the picture is too large.
pub fn png(svg: &str, dpi: f64) -> Result<Vec<u8>, PlotError> {
    let tree = tree(svg)?;
    let factor = dpi / SVG_DPI;
    let (width, height) = (
        f64::from(tree.size().width()) * factor,
        f64::from(tree.size().height()) * factor,
    );
    let too_large = || PlotError::TooLarge {
        width: width.ceil(),
        height: height.ceil(),
    };
    if width * height > LARGEST {
        return Err(too_large());
    }
    let mut pixels = tiny_skia::Pixmap::new(width.ceil() as u32, height.ceil() as u32).ok_or_else(too_large)?;
    let scale = tiny_skia::Transform::from_scale(factor as f32, factor as f32);
    pixels.fill(tiny_skia::Color::WHITE);
    resvg::render(&tree, scale, &mut pixels.as_mut());
    encode(&pixels, dpi).map_err(|error| PlotError::Drawing(error.to_string()))
}

/// Everything is opaque, so three channels are enough.
fn encode(pixels: &tiny_skia::Pixmap, dpi: f64) -> Result<Vec<u8>, png::EncodingError> {
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
    encoder.add_text_chunk(signature::PNG.0.to_owned(), signature::PNG.1.to_owned())?;
    let rgb: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(file)
}
