//! PNG output.

use super::drawing::{Drawing, ElementForm};
use super::signature;
use crate::Error;
use tiny_skia::{Color, FillRule, LineJoin, Paint, Pixmap, Stroke, Transform};

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
