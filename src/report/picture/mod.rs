//! A picture of a mesh folder: a z-buffer that triangles are streamed through.
//!
//! ```text
//!   components ──bounding box──> where positions fall in the image
//!   V (O, labels), G ──pass──> samples: nearest triangle and paint ──mean──> pixels ──> PNG
//! ```
//!
//! Why it is right: each triangle is looked at once and each sample keeps the nearest
//! (`canvas.rs`); a sample inside the surface is covered by some triangle however small they are
//! (`facet.rs`), so triangles that cover none are dropped at once and nothing is missed. Of
//! triangles at the same depth the one with the smallest number shows. So the picture is the
//! same, byte for byte, for every budget and number of threads.
//!
//! Triangles with a vertex that is not finite are left out and counted; degenerate ones have no
//! inside to draw.
//!
//! Memory: the image, not the mesh: 12 bytes a sample, 16 samples a pixel up to 512 pixels
//! wide and high, 4 up to 4096, else 1; and the buffers of the pass. Colours by swirl order take
//! O and more in memory (`swirl.rs`). All of it is drawn from the budget, and
//! [`least_memory`] says how much that is. I/O: `components.npy` once; G once more for a view
//! that is not along an axis; then as `pass.rs` says; the PNG.

mod asked;
mod canvas;
mod colour;
mod cuts;
mod develop;
mod facet;
mod pass;
mod source;
mod swirl;
mod view;

pub use colour::{Background, ColorBy};
pub use view::{View, direction};

use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::{self, Folder, Outputs, Rows};
use crate::table::array;
use canvas::Canvas;
use colour::Palette;
use cuts::Cuts;
use pass::{Pass, ToneSource};
use source::Source;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Mutex;
use view::{Bounds, Frame, Projection, Turn};

/// Most pixels along a side.
pub const MOST_PIXELS: u32 = 8192;
/// Half the width of a mark, in pixels.
const MARK_RADIUS: f64 = 0.8;
/// Vertices that are read at a time to find what the view shows.
const FIT_STEP: u64 = 4 << 10;

/// What to draw, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureRequest {
    /// Pixels across and down, each from 1 to [`MOST_PIXELS`].
    pub size: [u32; 2],
    /// Where the viewer stands.
    pub view: View,
    /// The direction that is up in the mesh.
    pub up: [f64; 3],
    /// What colours tell apart.
    pub color: ColorBy,
    /// Whether border and non-manifold edges are drawn as lines.
    pub marks: bool,
    /// What lies behind the mesh.
    pub background: Background,
    /// Samples along each side of a pixel, 1 to 4; `None` chooses by size.
    pub samples: Option<u32>,
}

impl Default for PictureRequest {
    fn default() -> PictureRequest {
        PictureRequest {
            size: [1024; 2],
            view: View::Iso,
            up: [0.0, 1.0, 0.0],
            color: ColorBy::Component,
            marks: true,
            background: Background::Transparent,
            samples: None,
        }
    }
}

impl PictureRequest {
    /// Samples along each side of a pixel: by size alone, so that the picture is the same for
    /// every budget.
    fn samples(&self) -> u32 {
        let by_size = match self.size[0].max(self.size[1]) {
            ..=512 => 4,
            513..=4096 => 2,
            _ => 1,
        };
        self.samples.unwrap_or(by_size)
    }

    fn sampled(&self) -> [u32; 2] {
        self.size.map(|n| n * self.samples())
    }

    /// What makes no sense is refused before anything is read.
    fn check(&self) -> Result<()> {
        if self.size.iter().any(|n| !(1..=MOST_PIXELS).contains(n)) {
            let [w, h] = self.size;
            return Err(Error::Usage(format!(
                "a picture of {w} by {h} pixels: give from 1 to {MOST_PIXELS} each way"
            )));
        }
        let samples = self.samples();
        if !(1..=4).contains(&samples) || self.sampled().iter().any(|&n| n > 2 * MOST_PIXELS) {
            return Err(Error::Usage(format!(
                "{samples} samples a pixel each way: give 1 to 4, and no more than {} in all",
                2 * MOST_PIXELS
            )));
        }
        Ok(())
    }
}

/// What a picture shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureCount {
    /// Triangles that were drawn; most of a large mesh cover no sample.
    pub triangles: u64,
    /// Triangles left out since a vertex of theirs is not finite.
    pub nonfinite: u64,
    /// Degenerate triangles, which have nothing to draw.
    pub degenerate: u64,
    /// Bytes of the PNG.
    pub bytes: u64,
}

/// The least budget in bytes with which a request on this folder is not refused, on so many
/// threads.
pub fn least_memory(folder: &Folder, request: &PictureRequest, threads: usize) -> u64 {
    let samples = request.sampled();
    let canvas = Canvas::bytes(samples) + develop::bytes(samples[0]);
    let pass = pass::least(threads as u64).max(cuts::least());
    let swirls = request.color == ColorBy::Swirl;
    let [walk, kept] =
        [swirl::bytes(folder), swirl::kept(folder)].map(|b| if swirls { b } else { 0 });
    (canvas + kept + pass).max(walk)
}

/// Draws a folder to a PNG file.
///
/// The target must not exist unless `force` is set, nor lie in a mesh folder. It appears
/// under its name when it is complete; on an error it does not.
///
/// # Errors
/// As [`draw_to`]; [`Error::Usage`] when the target exists.
///
/// # Example
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # let target = dir.path().join("tetrahedron.png");
/// # by_hand::tetrahedron().write(&folder);
/// # let ws = by_hand::workspace(dir.path(), 64 << 20);
/// use cornermill::folder::Folder;
/// use cornermill::report::picture::{PictureRequest, draw};
///
/// // ws: a Workspace of 64 MiB; folder: the mesh folder of a tetrahedron
/// let folder = Folder::open(&folder, &ws.io)?;
/// let request = PictureRequest { size: [64, 64], ..PictureRequest::default() };
/// let count = draw(&ws, &folder, &request, &target, false)?;
/// assert_eq!((count.triangles, count.nonfinite), (4, 0));
/// assert!(std::fs::read(&target).unwrap().starts_with(b"\x89PNG"));
/// # Ok::<(), cornermill::Error>(())
/// ```
pub fn draw(
    ws: &Workspace,
    folder: &Folder,
    request: &PictureRequest,
    target: &Path,
    force: bool,
) -> Result<PictureCount> {
    let mut target = Outputs::new(&[folder.path()], force).create(target)?;
    let path = target.path().to_owned();
    let count = draw_to(ws, folder, request, target.file(), &path)?;
    target.keep()?;
    ws.io.add_written(count.bytes);
    Ok(count)
}

/// Draws a folder as a PNG to a stream; the path is for messages.
///
/// # Errors
/// [`Error::Usage`] for a request that makes no sense, or a mesh that has nothing to draw;
/// [`Error::Budget`] naming the least that would do; [`Error::Input`] when the folder is damaged;
/// [`Error::Io`], [`Error::DiskLimit`].
pub fn draw_to(
    ws: &Workspace,
    folder: &Folder,
    request: &PictureRequest,
    out: &mut dyn Write,
    path: &Path,
) -> Result<PictureCount> {
    request.check()?;
    let least = least_memory(folder, request, ws.workers.count());
    if least > ws.budget.free() {
        return Err(Error::Budget {
            what: "this picture".into(),
            need: ws.budget.used().saturating_add(least),
            have: ws.budget.limit(),
        });
    }
    let mut source = Source::open(folder)?;
    let frame = Frame::new(request.view, request.up)?;
    let bounds = bounds(folder)?;
    let tones = tones(ws, folder, &source, request.color)?;
    let way = fit(
        ws,
        &source,
        Turn::new(frame, &bounds),
        &bounds,
        request.sampled(),
    )?;
    let samples = request.sampled();
    let canvas = Canvas::new(&ws.budget, samples, source.triangles)?;
    let developing = ws
        .budget
        .lease("rows of pixels", develop::bytes(samples[0]))?;
    mark(ws, folder, &mut source, request)?;
    let pass = Pass {
        ws,
        source: &source,
        way,
        canvas,
        tones,
        mark_radius: MARK_RADIUS * f64::from(request.samples()),
        total: Mutex::default(),
    };
    let drawn = if asked::fits_narrow(source.triangles, source.vertices) {
        pass.run::<asked::Narrow>()
    } else {
        pass.run::<asked::Wide>()
    };
    folder.intact(drawn)?;
    let Pass {
        mut canvas, total, ..
    } = pass;
    let total = total
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut out = Counted {
        out: BufWriter::new(out),
        bytes: 0,
    };
    let palette = Palette::new(request.color);
    let background = request.background;
    develop::write(
        &mut canvas,
        request.samples(),
        &palette,
        background,
        &mut out,
        path,
    )?;
    out.flush()
        .map_err(|e| Error::io(path, "write the picture", e))?;
    drop(developing);
    Ok(PictureCount {
        triangles: total.triangles - total.skipped,
        nonfinite: total.skipped,
        degenerate: folder.manifest().counts.degenerate,
        bytes: out.bytes,
    })
}

/// A stream that counts its bytes.
struct Counted<W> {
    out: W,
    bytes: u64,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, buf: &[u8]) -> std::io::Result<usize> {
        let n = self.out.write(buf)?;
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// True when a folder has something to draw: coordinates, and a triangle with finite ones.
pub(super) fn drawable(folder: &Folder) -> Result<bool> {
    Ok(folder.has(folder::G) && union(folder)?.is_finite())
}

/// The union of the components' boxes.
fn union(folder: &Folder) -> Result<Bounds> {
    let mut bounds = Bounds::NOTHING;
    Rows::open(folder)?.each(|_, row| {
        bounds.add(row.base.bbox_min);
        bounds.add(row.base.bbox_max);
        Ok(())
    })?;
    Ok(bounds)
}

/// The bounding box of all that may be drawn.
fn bounds(folder: &Folder) -> Result<Bounds> {
    let bounds = union(folder)?;
    if bounds.is_finite() {
        return Ok(bounds);
    }
    let counts = &folder.manifest().counts;
    Err(Error::Usage(format!(
        "{}: there is nothing to draw: of {} triangles {} are degenerate, and no other has \
         finite coordinates",
        folder.path().display(),
        counts.triangles,
        counts.degenerate
    )))
}

/// Fits what is seen into the image. Along an axis the box says where that ends; else all
/// vertices within the box are looked at, since the corners of the box may lie far from any.
fn fit(
    ws: &Workspace,
    source: &Source,
    turn: Turn,
    bounds: &Bounds,
    samples: [u32; 2],
) -> Result<Projection> {
    let mut turned = Bounds::NOTHING;
    if turn.along_axes() {
        turned.add(turn.apply(bounds.min));
        turned.add(turn.apply(bounds.max));
        return Ok(Projection::fit(turn, &turned, samples));
    }
    let all = Mutex::new(turned);
    let row = source.row_bytes();
    ws.progress
        .begin("fit the view", "vertices", source.vertices);
    ws.workers.run(
        source.vertices.div_ceil(FIT_STEP),
        || {
            let room = FIT_STEP as usize * row;
            let lease = ws.budget.lease("vertices", room as u64)?;
            Ok((vec![0; room], Bounds::NOTHING, lease))
        },
        |(bytes, seen, _), unit| {
            let first = unit * FIT_STEP;
            let count = FIT_STEP.min(source.vertices - first);
            let bytes = &mut bytes[..count as usize * row];
            source.each_position(first, bytes, |p| {
                if bounds.hold(p) {
                    seen.add(turn.apply(p));
                }
            })?;
            ws.progress.advance(count);
            Ok(())
        },
        |(_, seen, _)| {
            let mut all = all
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            all.join(&seen);
            Ok(())
        },
    )?;
    ws.progress.end();
    turned = all
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    Ok(Projection::fit(turn, &turned, samples))
}

fn tones(ws: &Workspace, folder: &Folder, source: &Source, by: ColorBy) -> Result<ToneSource> {
    match by {
        ColorBy::Component => {
            let (t, width) = (source.triangles, source.width);
            let file = array::open(folder, folder::COMPONENT, width.descr(), &[t])?;
            Ok(ToneSource::Labels(file, width))
        }
        ColorBy::Swirl => {
            let (tones, _lease) = swirl::tones(ws, folder, |f| {
                Rows::open(folder)?.each(|_, row| f(row.base.first_triangle, row.base.triangles))
            })?;
            Ok(ToneSource::Each { tones, _lease })
        }
        ColorBy::Orientation | ColorBy::Plain => Ok(ToneSource::One),
    }
}

/// Marks edges when asked, and when there are any to mark.
fn mark(
    ws: &Workspace,
    folder: &Folder,
    source: &mut Source,
    request: &PictureRequest,
) -> Result<()> {
    let counts = &folder.manifest().counts;
    if !request.marks || counts.border_edges + counts.nonmanifold_edges == 0 {
        return Ok(());
    }
    let cuts = if counts.nonmanifold_corners > 0 {
        let memory = (ws.budget.free() / 2).max(cuts::least());
        Some(Cuts::sort(ws, folder, memory)?)
    } else {
        None
    };
    source.mark(cuts)
}
