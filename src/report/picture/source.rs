//! The arrays of the folder, as the pass over them needs them: triangles in blocks, with the
//! marks of their edges, and vertices in windows of consecutive ids, with their spots.
//!
//! Every vertex id is held to its bounds here, so that what follows may trust it.
//!
//! Memory: [`Block::bytes`] and [`Rows::bytes`]; leased when they are made. I/O: V, and O when
//! edges are marked, once; of G what the windows cover.

use super::colour::Mark;
use super::cuts::Cuts;
use super::view::{Projection, Spot};
use crate::disk::{DataFile, Lease, Window, Workspace};
use crate::error::{Error, Result};
use crate::folder::{self, Folder, npy::DATA_START};
use crate::table::array::{self, Coords, Width};

/// A larger G is not mapped even where it fits: where triangles lie anyhow in it, each corner
/// then waits for memory, and two shuffles are faster (twice, at 192 MiB on two cores).
const MAPPED: u64 = 32 << 20;

/// The open arrays.
pub(super) struct Source<'a> {
    folder: &'a Folder,
    pub(super) width: Width,
    v: DataFile,
    /// O, when edges are marked.
    o: Option<DataFile>,
    /// The corners on non-manifold edges, when there are any and edges are marked.
    cuts: Option<Cuts>,
    g: DataFile,
    kind: Coords,
    pub(super) triangles: u64,
    pub(super) vertices: u64,
}

impl<'a> Source<'a> {
    /// Opens what is needed; `cuts` when edges are marked.
    ///
    /// # Errors
    /// [`Error::Usage`] when the folder has no coordinates; [`Error::Input`], [`Error::Io`].
    pub(super) fn open(folder: &'a Folder) -> Result<Source<'a>> {
        let counts = &folder.manifest().counts;
        let (t, n, width) = (counts.triangles, counts.vertices, Width::of(folder)?);
        let Some(kind) = Coords::of(folder)? else {
            return Err(Error::Usage(format!(
                "{}: the folder has no coordinates (it was built from V alone), so there is \
                 nothing to draw; build it with --positions",
                folder.path().display()
            )));
        };
        Ok(Source {
            folder,
            width,
            v: array::open(folder, folder::V, width.descr(), &[t, 3])?,
            o: None,
            cuts: None,
            g: array::open(folder, folder::G, kind.descr(), &[n, 3])?,
            kind,
            triangles: t,
            vertices: n,
        })
    }

    /// Marks borders and non-manifold edges from now on.
    ///
    /// # Errors
    /// [`Error::Input`], [`Error::Io`].
    pub(super) fn mark(&mut self, cuts: Option<Cuts>) -> Result<()> {
        let (width, shape) = (self.width.descr(), [self.triangles, 3]);
        self.o = Some(array::open(self.folder, folder::O, width, &shape)?);
        self.cuts = cuts;
        Ok(())
    }

    /// Room for blocks of up to `step` triangles.
    ///
    /// # Errors
    /// [`Error::Budget`].
    pub(super) fn block(&self, ws: &Workspace, step: u64) -> Result<Block> {
        let lease = ws
            .budget
            .lease("a block of triangles", Block::bytes(step))?;
        Ok(Block {
            bytes: vec![0; 3 * step as usize * self.width.bytes()],
            triangles: Vec::with_capacity(step as usize),
            cuts: Vec::new(),
            _lease: lease,
        })
    }

    /// Room for up to `most` consecutive vertices.
    ///
    /// # Errors
    /// [`Error::Budget`].
    pub(super) fn rows(&self, ws: &Workspace, most: u64) -> Result<Rows<'_>> {
        let lease = ws.budget.lease("a window of G", Rows::bytes(most))?;
        Ok(Rows {
            source: self,
            bytes: vec![0; most as usize * self.kind.row_bytes()],
            spots: Vec::with_capacity(most as usize),
            first: 0,
            most,
            _lease: lease,
        })
    }

    /// G mapped whole, leased; `None` when it is larger than [`MAPPED`], or than half of what is
    /// free.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Input`] when it is shorter than it should be.
    pub(super) fn mapped(&self, ws: &Workspace) -> Result<Option<Mapped>> {
        let bytes = self.vertices * self.kind.row_bytes() as u64;
        if bytes > MAPPED.min(ws.budget.free() / 2) {
            return Ok(None);
        }
        let lease = ws.budget.lease("all of G", bytes)?;
        let window = Window::uncounted(&self.g, DATA_START, bytes as usize)?;
        Ok(Some(Mapped {
            window,
            kind: self.kind,
            _lease: lease,
        }))
    }

    /// Calls `f` with each coordinate triple of `rows` vertices from `first`.
    pub(super) fn each_position(
        &self,
        first: u64,
        bytes: &mut [u8],
        mut f: impl FnMut([f64; 3]),
    ) -> Result<()> {
        let row = self.kind.row_bytes();
        self.g.read_at(bytes, DATA_START + first * row as u64)?;
        (0..bytes.len() / row).for_each(|i| f(self.kind.row(bytes, i)));
        Ok(())
    }

    /// Bytes of a row of G.
    pub(super) fn row_bytes(&self) -> usize {
        self.kind.row_bytes()
    }

    fn damaged(&self, t: u64, found: u64) -> Error {
        Error::input(
            &self.folder.path().join(folder::V),
            format!("triangle {t}"),
            format!("a vertex below {}", self.vertices),
            found.to_string(),
            "the folder is damaged; `cornermill verify` says how; build it again",
        )
    }
}

/// A triangle, and how its edges are marked: `marks[k]` for the edge that its corner k faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) id: u64,
    pub(super) vertices: [u64; 3],
    pub(super) marks: [Mark; 3],
}

/// A run of consecutive triangles. Degenerate ones are left out: they have no inside, and their
/// corners face no edge.
pub(super) struct Block {
    bytes: Vec<u8>,
    pub(super) triangles: Vec<Triangle>,
    cuts: Vec<u64>,
    _lease: Lease,
}

impl Block {
    /// Bytes for so many triangles: ids as read, triangles, corners on non-manifold edges.
    pub(super) fn bytes(step: u64) -> u64 {
        step * (24 + size_of::<Triangle>() as u64 + 24)
    }

    /// Reads the triangles from `first`, `count` of them.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] for a vertex that the folder does not have.
    pub(super) fn read(&mut self, source: &Source, first: u64, count: u64) -> Result<()> {
        let width = source.width;
        let at = DATA_START + first * 3 * width.bytes() as u64;
        let bytes = &mut self.bytes[..3 * count as usize * width.bytes()];
        source.v.read_at(bytes, at)?;
        self.triangles.clear();
        for (i, id) in (first..first + count).enumerate() {
            let vertices = [0, 1, 2].map(|k| width.get(bytes, 3 * i + k));
            if let Some(&v) = vertices.iter().find(|&&v| v >= source.vertices) {
                return Err(source.damaged(id, v));
            }
            let [a, b, c] = vertices;
            if a != b && b != c && c != a {
                self.triangles.push(Triangle {
                    id,
                    vertices,
                    marks: [Mark::None; 3],
                });
            }
        }
        let Some(o) = &source.o else {
            return Ok(());
        };
        o.read_at(bytes, at)?;
        self.cuts.clear();
        if let Some(cuts) = &source.cuts {
            cuts.range(3 * first, 3 * (first + count), &mut self.cuts)?;
        }
        let mut cuts = self.cuts.iter().copied().peekable();
        for triangle in &mut self.triangles {
            for k in 0..3 {
                let corner = 3 * triangle.id + k as u64;
                if width.get(bytes, (corner - 3 * first) as usize) == u64::MAX {
                    while cuts.next_if(|&cut| cut < corner).is_some() {}
                    let cut = cuts.peek() == Some(&corner);
                    triangle.marks[k] = if cut { Mark::NonManifold } else { Mark::Border };
                }
            }
        }
        Ok(())
    }
}

/// The spots of consecutive vertices.
pub(super) struct Rows<'a> {
    source: &'a Source<'a>,
    bytes: Vec<u8>,
    spots: Vec<Spot>,
    first: u64,
    pub(super) most: u64,
    _lease: Lease,
}

impl Rows<'_> {
    /// Bytes for so many vertices: coordinates as read, and spots.
    pub(super) fn bytes(most: u64) -> u64 {
        most * (24 + size_of::<Spot>() as u64)
    }

    /// Reads as many as there is room for, from `first`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn read(&mut self, first: u64, way: &Projection) -> Result<()> {
        self.read_to(first, (first + self.most).min(self.source.vertices), way)
    }

    /// Reads those from `first` to before `end`, for which there must be room.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn read_to(&mut self, first: u64, end: u64, way: &Projection) -> Result<()> {
        let bytes = &mut self.bytes[..(end - first) as usize * self.source.kind.row_bytes()];
        self.first = first;
        self.spots.clear();
        let spots = &mut self.spots;
        self.source
            .each_position(first, bytes, |p| spots.push(way.spot(p)))
    }

    /// True when the vertex is among them.
    #[inline]
    pub(super) fn has(&self, vertex: u64) -> bool {
        vertex >= self.first && vertex - self.first < self.spots.len() as u64
    }

    /// The spot of a vertex that is among them.
    #[inline]
    pub(super) fn spot(&self, vertex: u64) -> Spot {
        self.spots[(vertex - self.first) as usize]
    }
}

/// All of G, mapped.
pub(super) struct Mapped {
    window: Window,
    kind: Coords,
    _lease: Lease,
}

impl Mapped {
    #[inline]
    pub(super) fn spot(&self, vertex: u64, way: &Projection) -> Spot {
        way.spot(self.kind.row(self.window.bytes(), vertex as usize))
    }
}
