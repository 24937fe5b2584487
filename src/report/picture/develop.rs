//! From samples to pixels, and to a PNG.
//!
//! A pixel is the mean of its samples, as linear light; what nothing covers is background, or
//! makes the pixel that much transparent. The file is written row by row.
//!
//! Memory: a row of pixels, its rows of samples, and the buffers of the compressor, in all
//! [`bytes`]. I/O: the file, written once.

use super::canvas::Canvas;
use super::colour::{Background, Paint, Palette, linear, srgb};
use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Entries of the table from linear light to bytes: fine enough for the steepest part.
const STEPS: usize = 16 << 10;
/// What a compressor holds.
const COMPRESSOR: u64 = 1 << 20;

/// Memory to develop rows of so many samples.
pub(super) fn bytes(samples: u32) -> u64 {
    let row = u64::from(samples) * (size_of::<Option<Paint>>() + 4 * size_of::<f32>()) as u64;
    row + 4 * u64::from(samples) + Palette::BYTES + STEPS as u64 + COMPRESSOR
}

/// Writes the picture, `samples` by `samples` for each pixel.
///
/// # Errors
/// [`Error::Io`] naming the path.
pub(super) fn write(
    canvas: &mut Canvas,
    samples: u32,
    palette: &Palette,
    background: Background,
    out: &mut dyn Write,
    path: &Path,
) -> Result<()> {
    let failed = |e: png::EncodingError| {
        let source = match e {
            png::EncodingError::IoError(e) => e,
            other => std::io::Error::other(other),
        };
        Error::io(path, "write the picture", source)
    };
    let (width, height) = (
        canvas.width as u32 / samples,
        canvas.height as u32 / samples,
    );
    let clear = background == Background::Transparent;
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(if clear {
        png::ColorType::Rgba
    } else {
        png::ColorType::Rgb
    });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut header = encoder.write_header().map_err(failed)?;
    let mut stream = header.stream_writer().map_err(failed)?;
    let mut rows = Rows::new(canvas, samples, palette, background);
    let mut pixels = Vec::with_capacity(4 * width as usize);
    for y in 0..height {
        rows.read(y, &mut pixels);
        stream
            .write_all(&pixels)
            .map_err(|e| Error::io(path, "write the picture", e))?;
    }
    stream.finish().map_err(failed)
}

struct Rows<'a> {
    canvas: &'a mut Canvas,
    samples: u32,
    palette: &'a Palette,
    /// The colour behind, as light; `None` when there is none.
    behind: Option<[f32; 3]>,
    bytes: Vec<u8>,
    row: Vec<Option<Paint>>,
    sums: Vec<[f32; 4]>,
}

impl<'a> Rows<'a> {
    fn new(
        canvas: &'a mut Canvas,
        samples: u32,
        palette: &'a Palette,
        background: Background,
    ) -> Rows<'a> {
        let width = canvas.width as usize;
        Rows {
            canvas,
            samples,
            palette,
            behind: match background {
                Background::Color(color) => Some(color.map(linear)),
                Background::Transparent => None,
            },
            bytes: (0..STEPS)
                .map(|i| srgb(i as f32 / (STEPS - 1) as f32))
                .collect(),
            row: vec![None; width],
            sums: vec![[0.0; 4]; width / samples as usize],
        }
    }

    /// The bytes of row y of pixels.
    fn read(&mut self, y: u32, pixels: &mut Vec<u8>) {
        self.sums.fill([0.0; 4]);
        for i in 0..self.samples {
            self.canvas.row(y * self.samples + i, &mut self.row);
            let cells = self.row.chunks_exact(self.samples as usize);
            for (sum, cell) in self.sums.iter_mut().zip(cells) {
                for paint in cell.iter().flatten() {
                    let [r, g, b] = self.palette.light(*paint);
                    *sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + 1.0];
                }
            }
        }
        let byte =
            |light: f32| self.bytes[(light.clamp(0.0, 1.0) * (STEPS - 1) as f32 + 0.5) as usize];
        let all = (self.samples * self.samples) as f32;
        pixels.clear();
        for &[r, g, b, covered] in &self.sums {
            match self.behind {
                Some(behind) => {
                    let [x, y, z] = behind.map(|x| x * (all - covered));
                    pixels.extend([r + x, g + y, b + z].map(|x| byte(x / all)));
                }
                None => {
                    let share = covered.max(1.0);
                    pixels.extend([r, g, b].map(|x| byte(x / share)));
                    pixels.push((255.0 * covered / all + 0.5) as u8);
                }
            }
        }
    }
}
