//! One export under way: what it takes, what is chosen, and the walks over the folder.
//!
//! Memory: [`least_memory`] and up to half of what the budget has left, leased before anything
//! is allocated. I/O: as the walks say.

use super::faces::{self, Faces};
use super::select::{self, Chosen};
use super::sink::{OUT_BYTES, Sink};
use super::source::Source;
use super::strip::{self, Strip};
use super::used::Used;
use super::{ExportCount, ExportRequest, Format, gather, npy, plain, ply, stl};
use crate::disk::{DataFile, Lease, Workspace};
use crate::error::{Error, Result, conserve};
use crate::folder::{Folder, npy::DATA_START};
use crate::table::array::Coords;
use std::path::PathBuf;

/// The least budget in bytes with which a request on this folder is not refused.
pub fn least_memory(folder: &Folder, request: &ExportRequest) -> u64 {
    let vertices = folder.manifest().counts.vertices;
    least(Some(folder), vertices, request, request.selects())
}

/// The least with which an export of listed triangles is not refused.
pub fn least_strip_memory(folder: &Folder, request: &ExportRequest) -> u64 {
    let vertices = folder.manifest().counts.vertices;
    least(Some(folder), vertices, request, true)
}

/// The same; `part` when not all triangles are written.
fn least(folder: Option<&Folder>, vertices: u64, request: &ExportRequest, part: bool) -> u64 {
    let [chosen, choosing] = folder.map_or([0; 2], |folder| {
        let choosing = select::bytes_while_choosing(folder, &request.selection);
        [select::bytes(folder, &request.selection), choosing]
    });
    chosen + choosing.max(used_bytes(vertices, request, part) + buffers(request, MIN_STEP))
}

/// Fewest triangles or vertices in a block.
pub(super) const MIN_STEP: u64 = 1 << 10;
/// Most of them: beyond that a block of a format other than STL gains nothing.
const MAX_STEP: u64 = 1 << 15;

/// Bytes of all buffers when blocks have `step` items.
fn buffers(request: &ExportRequest, step: u64) -> u64 {
    let of_stl = if request.format == Format::Stl {
        gather::BYTES_PER_TRIANGLE
    } else {
        0
    };
    OUT_BYTES + step * (faces::BYTES_PER_TRIANGLE + 24 + of_stl)
}

/// Memory for numbering vertices anew, when some are left out and have numbers at all.
fn used_bytes(vertices: u64, request: &ExportRequest, part: bool) -> u64 {
    if part && request.format != Format::Stl {
        Used::bytes(vertices)
    } else {
        0
    }
}

/// One export under way: what was chosen, and the readers of the folder.
pub(super) struct Job<'a> {
    ws: &'a Workspace,
    pub(super) request: &'a ExportRequest,
    faces: Faces<'a>,
    chosen: Option<Chosen>,
    /// Instead of the faces: triangles in an order of their own.
    strip: Option<&'a mut (dyn Strip + 'a)>,
    used: Option<Used>,
    /// G, and the type of its coordinates.
    pub(super) g: Option<(Coords, DataFile)>,
    /// Triangles to write.
    pub(super) triangles: u64,
    /// Vertices to write.
    pub(super) vertices: u64,
    /// Vertices of the folder.
    all_vertices: u64,
    /// Triangles, or vertices, in a block.
    pub(super) step: u64,
    _lease: Lease,
}

impl<'a> Job<'a> {
    /// Chooses, draws the memory, and marks the vertices in use.
    pub(super) fn start(
        ws: &'a Workspace,
        source: Source<'a>,
        request: &'a ExportRequest,
        strip: Option<&'a mut (dyn Strip + 'a)>,
    ) -> Result<Job<'a>> {
        let part = request.selects() || strip.is_some();
        let n = source.vertices;
        let least = least(source.folder, n, request, part);
        if least > ws.budget.free() {
            return Err(Error::Budget {
                what: "this export".into(),
                need: ws.budget.used() + least,
                have: ws.budget.limit(),
            });
        }
        let chosen = match source.folder {
            Some(folder) => select::choose(ws, folder, &request.selection)?,
            None => None,
        };
        let marks = used_bytes(n, request, part);
        let mut step = MIN_STEP;
        let most = if request.format == Format::Stl {
            gather::MAX_STEP
        } else {
            MAX_STEP
        };
        // Larger blocks from what is left, but never more than half of it.
        let half = (ws.budget.free() - marks) / 2;
        let items = source.triangles.max(n);
        while step < most.min(items) && buffers(request, 2 * step) <= half {
            step *= 2;
        }
        let lease = ws
            .budget
            .lease("an export", marks + buffers(request, step))?;
        let all = source.triangles;
        let (faces, g) = Faces::open(source, request, step)?;
        let mut job = Job {
            ws,
            request,
            faces,
            triangles: match (&strip, &chosen) {
                (Some(strip), _) => strip.count(),
                (None, Some(chosen)) => chosen.triangles,
                (None, None) => all,
            },
            chosen,
            strip,
            used: None,
            g,
            vertices: n,
            all_vertices: n,
            step,
            _lease: lease,
        };
        if marks > 0 {
            job.mark()?;
        }
        Ok(job)
    }

    /// Marks the vertices that the chosen triangles name.
    fn mark(&mut self) -> Result<()> {
        let mut used = Used::new(self.all_vertices);
        self.each_block("mark vertices", |block| {
            block.as_flattened().iter().for_each(|&v| used.mark(v));
            Ok(())
        })?;
        self.vertices = used.seal();
        self.used = Some(used);
        Ok(())
    }

    pub(super) fn write(&mut self, sink: &mut Sink<'_>) -> Result<()> {
        match self.request.format {
            Format::Ply => ply::write(self, sink),
            Format::Stl => stl::write(self, sink),
            Format::Obj => plain::write_obj(self, sink),
            Format::Off => plain::write_off(self, sink),
            Format::Npy => npy::write_v(self, sink),
        }
    }

    /// Calls `f` with the triangles to write, block by block, ids as the folder has them.
    pub(super) fn each_block(
        &mut self,
        pass: &'static str,
        mut f: impl FnMut(&[[u64; 3]]) -> Result<()>,
    ) -> Result<()> {
        if let Some(strip) = &mut self.strip {
            let listed = strip::each_block(*strip, self.step, &mut f)?;
            return conserve(pass, "triangles", self.triangles, listed);
        }
        let progress = &self.ws.progress;
        progress.begin(pass, "triangles", self.faces.triangles());
        let mut kept = 0;
        let mut from = 0;
        while from < self.faces.triangles() {
            let block = self.faces.read(from, self.chosen.as_ref())?;
            kept += block.len() as u64;
            f(block)?;
            let done = self.step.min(self.faces.triangles() - from);
            progress.advance(done);
            from += done;
        }
        progress.end();
        if kept != self.triangles {
            return Err(self.faces.miscounted(self.triangles, kept));
        }
        Ok(())
    }

    /// Calls `f` with the vertices of each triangle to write, numbered as they are written.
    pub(super) fn each_face(&mut self, mut f: impl FnMut([u64; 3]) -> Result<()>) -> Result<()> {
        let used = self.used.take();
        let done = self.each_block("write triangles", |block| {
            block.iter().try_for_each(|&triangle| match &used {
                Some(used) => f(triangle.map(|v| used.rank(v))),
                None => f(triangle),
            })
        });
        self.used = used;
        done
    }

    /// Calls `f` with the row of G, as the folder has it, of each vertex to write.
    pub(super) fn each_point(
        &mut self,
        mut f: impl FnMut(Coords, &[u8]) -> Result<()>,
    ) -> Result<()> {
        let Some((kind, file)) = &self.g else {
            return Ok(());
        };
        let row = kind.row_bytes();
        let mut buf = vec![0; self.step as usize * row];
        let progress = &self.ws.progress;
        progress.begin("write vertices", "vertices", self.all_vertices);
        let (mut from, mut written) = (0, 0);
        while from < self.all_vertices {
            let n = self.step.min(self.all_vertices - from);
            // What has no vertex to write is not read.
            if self.used.as_ref().is_some_and(|u| !u.any(from, from + n)) {
                progress.advance(n);
                from += n;
                continue;
            }
            let bytes = &mut buf[..n as usize * row];
            file.read_at(bytes, DATA_START + from * row as u64)?;
            for (i, point) in bytes.chunks_exact(row).enumerate() {
                let wanted = self.used.as_ref();
                if wanted.is_none_or(|used| used.has(from + i as u64)) {
                    written += 1;
                    f(*kind, point)?;
                }
            }
            progress.advance(n);
            from += n;
        }
        progress.end();
        conserve("write vertices", "vertices", self.vertices, written)
    }

    pub(super) fn count(&self, bytes: u64, files: Vec<PathBuf>) -> ExportCount {
        ExportCount {
            triangles: self.triangles,
            vertices: match (self.request.format, &self.g) {
                (_, None) => 0,
                (Format::Stl, _) => 3 * self.triangles,
                _ => self.vertices,
            },
            components: self.chosen.as_ref().map(|c| c.count),
            bytes,
            files,
        }
    }
}
