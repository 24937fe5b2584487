//! Where a decoder puts the mesh: indices to a scratch file, coordinates to `G.npy` (to a
//! scratch file too when vertices will be welded, since welding writes the `G.npy` then).
//!
//! Why nothing depends on what a file claims: a vertex or triangle is written when it has been
//! decoded, and a face of any number of corners is cut into its fan while it streams past
//! (first corner, previous, this one), so three ids are all that is ever held of it.
//!
//! Indices are stored as 4 bytes until one does not fit, or the corners outnumber the ids of 4
//! bytes; the scratch file is then widened in place, once, from its end to its start (a block
//! of 8-byte values never reaches the 4-byte values that lie before it).
//!
//! Memory: two buffers of 1 MiB (less when the budget is tight). I/O: V and G written once; a
//! mesh that outgrows 4 bytes reads and writes its V once more.

#[path = "sink_faces.rs"]
mod faces;
#[path = "sink_vertices.rs"]
mod vertices;

use self::faces::Fan;
use super::reader::lease_buffer;
use super::rounded::Rounded;
use super::{CoordArray, CoordKind, Endian, IndexArray, IndexKind, Mesh, Request, Source};
use crate::disk::{DataFile, Lease, ScratchFile, Workspace};
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::folder::{InputDigest, InputEntry};
use std::path::PathBuf;

/// The first id that 4 bytes do not hold: all ones is NONE.
const NARROW_IDS: u64 = u32::MAX as u64;
/// A multiple of every record written (12 and 24 bytes), and room for 16 of them.
const LEAST: usize = 384;

/// Takes vertices and faces in file order and makes a [`Mesh`] of them.
#[derive(Debug)]
pub struct MeshSink {
    path: PathBuf,
    v: ScratchFile,
    v_buf: Vec<u8>,
    v_len: usize,
    wide: bool,
    triangles: u64,
    /// Triangles that 4-byte corner ids allow.
    narrow_triangles: u64,
    /// No index so far is larger.
    largest: u64,
    g: Source,
    g_buf: Vec<u8>,
    g_len: usize,
    g_at: u64,
    kind: CoordKind,
    rounded: Rounded,
    vertices: u64,
    polygons_fanned: u64,
    fan: Fan,
    _leases: [Lease; 2],
}

impl MeshSink {
    /// A sink for the mesh in `path` (its name in messages), with coordinates of type `kind`
    /// unless the request says otherwise. Creates `G.npy`, which must not exist, unless the
    /// request asks to weld.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Budget`] for the buffers.
    pub fn new(
        ws: &Workspace,
        request: &Request,
        path: &std::path::Path,
        kind: CoordKind,
    ) -> Result<MeshSink> {
        let (v_bytes, v_lease) = lease_buffer(&ws.budget, "the buffer for indices", LEAST)?;
        let (g_bytes, g_lease) = lease_buffer(&ws.budget, "the buffer for coordinates", LEAST)?;
        let (g, g_at) = if request.weld == Some(true) {
            (Source::Scratch(ws.scratch.file("coordinates")?), 0)
        } else {
            let file = DataFile::create_new(&request.g_path, &ws.io)?;
            (Source::Named(file), DATA_START)
        };
        Ok(MeshSink {
            path: path.to_owned(),
            v: ws.scratch.file("indices")?,
            v_buf: vec![0; v_bytes / 24 * 24],
            v_len: 0,
            wide: request.wide,
            triangles: 0,
            narrow_triangles: (NARROW_IDS - 1) / 3,
            largest: 0,
            g,
            g_buf: vec![0; g_bytes / 24 * 24],
            g_len: 0,
            g_at,
            kind: request.coords.unwrap_or(kind),
            rounded: Rounded::default(),
            vertices: 0,
            polygons_fanned: 0,
            fan: Fan::default(),
            _leases: [v_lease, g_lease],
        })
    }

    /// Type that coordinates are stored as.
    pub fn kind(&self) -> CoordKind {
        self.kind
    }

    /// Vertices so far.
    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    /// Triangles so far.
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    fn flush_g(&mut self) -> Result<()> {
        let bytes = &self.g_buf[..self.g_len];
        match &self.g {
            Source::Named(file) => file.write_at(bytes, self.g_at)?,
            Source::Scratch(file) => file.write_at(bytes, self.g_at)?,
        }
        self.g_at += self.g_len as u64;
        self.g_len = 0;
        Ok(())
    }

    /// Adds a triangle.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::DiskLimit`].
    #[inline]
    pub fn triangle(&mut self, corners: [u64; 3]) -> Result<()> {
        if !self.wide {
            let fits = corners.iter().all(|&v| v < NARROW_IDS);
            if fits && self.triangles < self.narrow_triangles {
                let room = self.triangle_room()?;
                for (out, v) in room[..12].chunks_exact_mut(4).zip(corners) {
                    out.copy_from_slice(&(v as u32).to_le_bytes());
                }
                self.triangles_put(1, corners.into_iter().fold(0, u64::max));
                return Ok(());
            }
            self.widen()?;
        }
        if self.v_buf.len() - self.v_len < 24 {
            self.flush_v()?;
        }
        let out = &mut self.v_buf[self.v_len..self.v_len + 24];
        for (out, v) in out.chunks_exact_mut(8).zip(corners) {
            out.copy_from_slice(&v.to_le_bytes());
        }
        self.v_len += 24;
        self.triangles += 1;
        self.largest = corners.into_iter().fold(self.largest, u64::max);
        Ok(())
    }

    /// Room for whole triangles of 4-byte little-endian ids below 2^32 - 1: empty once ids are
    /// stored as 8 bytes (use [`triangle`](MeshSink::triangle) then). Tell
    /// [`triangles_put`](MeshSink::triangles_put) how many were written.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::DiskLimit`].
    #[inline]
    pub fn triangle_room(&mut self) -> Result<&mut [u8]> {
        if self.wide {
            return Ok(&mut []);
        }
        if self.v_buf.len() - self.v_len < 12 {
            self.flush_v()?;
        }
        let left = self.narrow_triangles - self.triangles;
        let room = ((self.v_buf.len() - self.v_len) / 12).min(usize::try_from(left).unwrap_or(0));
        Ok(&mut self.v_buf[self.v_len..self.v_len + room * 12])
    }

    /// `n` triangles were written to the start of [`triangle_room`](MeshSink::triangle_room),
    /// no index of them above `largest`.
    #[inline]
    pub fn triangles_put(&mut self, n: usize, largest: u64) {
        self.v_len += n * 12;
        debug_assert!(self.v_len <= self.v_buf.len());
        self.triangles += n as u64;
        self.largest = self.largest.max(largest);
    }

    fn flush_v(&mut self) -> Result<()> {
        self.v.append(&self.v_buf[..self.v_len])?;
        self.v_len = 0;
        Ok(())
    }

    /// Rewrites the 4-byte ids so far as 8-byte ids, block by block from the end.
    fn widen(&mut self) -> Result<()> {
        self.flush_v()?;
        self.wide = true;
        let step = self.v_buf.len() / 12;
        let (narrow, wide) = self.v_buf.split_at_mut(step * 4);
        let mut end = self.triangles * 3;
        while end > 0 {
            let n = end.min(step as u64) as usize;
            let begin = end - n as u64;
            self.v.read_at(&mut narrow[..n * 4], begin * 4)?;
            for (out, v) in wide
                .chunks_exact_mut(8)
                .zip(narrow[..n * 4].chunks_exact(4))
            {
                out[..4].copy_from_slice(v);
                out[4..].fill(0);
            }
            self.v.write_at(&wide[..n * 8], begin * 8)?;
            end = begin;
        }
        Ok(())
    }

    /// The error of the first index that names no vertex.
    ///
    /// The scan would find it too, but knows only the scratch file by name.
    #[cold]
    fn beyond(&mut self) -> Result<Error> {
        let width = if self.wide { 8 } else { 4 };
        let mut corner = 0;
        let mut found = self.largest;
        'search: while corner < self.triangles * 3 {
            let rows = (self.v_buf.len() / width) as u64;
            let n = rows.min(self.triangles * 3 - corner) as usize;
            let part = &mut self.v_buf[..n * width];
            self.v.read_at(part, corner * width as u64)?;
            for id in part.chunks_exact(width) {
                let id = id.iter().rev().fold(0, |id, &b| id << 8 | u64::from(b));
                if id >= self.vertices {
                    found = id;
                    break 'search;
                }
                corner += 1;
            }
        }
        Ok(Error::input(
            &self.path,
            format!("triangle {}, corner {}", corner / 3, corner % 3),
            format!("the index of one of the {} vertices, from 0", self.vertices),
            found.to_string(),
            "the file is damaged, cut short, or made by a faulty program",
        ))
    }

    /// Writes what is buffered and hands over the mesh; tells when rounding may show.
    ///
    /// # Errors
    /// [`Error::Input`] when an index names no vertex; [`Error::Io`], [`Error::DiskLimit`].
    pub fn finish(mut self, ws: &Workspace, format: &str, digest: InputDigest) -> Result<Mesh> {
        self.flush_v()?;
        self.flush_g()?;
        if self.triangles > 0 && self.largest >= self.vertices {
            return Err(self.beyond()?);
        }
        if let Some(told) = self.rounded.told() {
            let path = self.path.display();
            ws.progress.note(&format!("{path}: {told}"));
        }
        self.into_mesh(format, digest)
    }

    fn into_mesh(self, format: &str, digest: InputDigest) -> Result<Mesh> {
        let placed = matches!(self.g, Source::Named(_));
        if placed {
            // Without a vertex nothing was written behind the hole for the header.
            self.g.data().set_len(self.g_at)?;
        }
        Ok(Mesh {
            v: IndexArray {
                source: Source::Scratch(self.v),
                at: 0,
                kind: if self.wide {
                    IndexKind::U8
                } else {
                    IndexKind::U4
                },
                endian: Endian::Little,
                triangles: self.triangles,
            },
            g: Some(CoordArray {
                source: self.g,
                at: if placed { DATA_START } else { 0 },
                kind: self.kind,
                endian: Endian::Little,
                vertices: self.vertices,
                placed,
            }),
            vertices: None,
            polygons_fanned: self.polygons_fanned,
            welded: false,
            entry: InputEntry {
                format: format.into(),
                files: vec![digest],
            },
            sums: Vec::new(),
        })
    }
}

#[cfg(test)]
#[path = "sink_tests.rs"]
mod tests;
