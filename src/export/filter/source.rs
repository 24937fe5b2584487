//! The folder that is filtered, read block by block of triangles.
//!
//! Every id is held to its bounds here, so that what follows may trust it.
//!
//! Memory: a block. I/O: what each walk asks for.

use super::{Job, Taken};
use crate::build::arrays::OutArray;
use crate::chunk::grid::Bounds;
use crate::disk::{DataFile, Workspace};
use crate::error::{Error, Result, conserve};
use crate::folder::{self, Folder, npy::DATA_START};
use crate::table::array::{self, Coords, Width};
use std::cell::RefCell;

/// A triangle of the source that is taken.
#[derive(Clone, Copy)]
pub(super) struct Row {
    /// Its id in the source.
    pub(super) t: u64,
    pub(super) v: [u64; 3],
    /// Opposites; NONE when they were not asked for.
    pub(super) o: [u64; 3],
    pub(super) component: u64,
    /// True when its orientation differs from the input's.
    pub(super) flipped: bool,
}

/// The arrays of the source.
pub(super) struct Source<'a> {
    ws: &'a Workspace,
    folder: &'a Folder,
    width: Width,
    v: DataFile,
    o: DataFile,
    labels: DataFile,
    flips: DataFile,
    pub(super) g: Option<(Coords, DataFile)>,
    step: u64,
    bytes: RefCell<Vec<u8>>,
}

impl<'a> Source<'a> {
    pub(super) fn open(ws: &'a Workspace, folder: &'a Folder, step: u64) -> Result<Source<'a>> {
        let counts = &folder.manifest().counts;
        let (t, n, width) = (counts.triangles, counts.vertices, Width::of(folder)?);
        let ids = |name, shape: &[u64]| array::open(folder, name, width.descr(), shape);
        let g = Coords::of(folder)?.map(|kind| {
            let file = array::open(folder, folder::G, kind.descr(), &[n, 3])?;
            Ok((kind, file))
        });
        Ok(Source {
            ws,
            folder,
            width,
            v: ids(folder::V, &[t, 3])?,
            o: ids(folder::O, &[t, 3])?,
            labels: ids(folder::COMPONENT, &[t])?,
            flips: array::open(folder, folder::FLIPPED, "|u1", &[t.div_ceil(8)])?,
            g: g.transpose()?,
            step,
            bytes: RefCell::new(vec![0; step as usize * (7 * width.bytes() + 1)]),
        })
    }

    /// Marks the triangles and vertices of the chosen components, and what is turned; returns the
    /// number of triangles.
    pub(super) fn mark(&self, taken: &mut Taken) -> Result<u64> {
        let Taken {
            chosen,
            triangles,
            vertices,
            flips,
        } = taken;
        let wanted = |component| chosen.has(component);
        self.each_wanted("mark", false, wanted, |rows| {
            for row in rows {
                triangles.mark(row.t);
                flips[(row.t / 64) as usize] |= u64::from(row.flipped) << (row.t % 64);
                row.v.iter().for_each(|&v| vertices.mark(v));
            }
            Ok(())
        })?;
        Ok(triangles.seal())
    }

    /// Hands the triangles that are taken to `f`, block by block; with their opposites when these
    /// are asked for.
    pub(super) fn each(
        &self,
        pass: &'static str,
        opposites: bool,
        taken: &Taken,
        f: impl FnMut(&[Row]) -> Result<()>,
    ) -> Result<()> {
        self.each_wanted(pass, opposites, |c| taken.chosen.has(c), f)
    }

    fn each_wanted(
        &self,
        pass: &'static str,
        opposites: bool,
        wanted: impl Fn(u64) -> bool,
        mut f: impl FnMut(&[Row]) -> Result<()>,
    ) -> Result<()> {
        let counts = &self.folder.manifest().counts;
        let progress = &self.ws.progress;
        progress.begin(pass, "triangles", counts.triangles);
        let mut rows = Vec::with_capacity(self.step as usize);
        for from in (0..counts.triangles).step_by(self.step as usize) {
            let n = self.step.min(counts.triangles - from);
            rows.clear();
            self.read(from, n as usize, opposites, &wanted, &mut rows)?;
            f(&rows)?;
            progress.advance(n);
        }
        progress.end();
        Ok(())
    }

    fn read(
        &self,
        from: u64,
        n: usize,
        opposites: bool,
        wanted: &impl Fn(u64) -> bool,
        rows: &mut Vec<Row>,
    ) -> Result<()> {
        let counts = &self.folder.manifest().counts;
        let (w, width) = (self.width.bytes(), self.width);
        let mut bytes = self.bytes.borrow_mut();
        let (labels, rest) = bytes.split_at_mut(n * w);
        let (v, rest) = rest.split_at_mut(3 * n * w);
        let (o, rest) = rest.split_at_mut(3 * n * w);
        // A block begins with a byte of flips, one triangle with a bit of one.
        let lead = (from % 8) as usize;
        let flips = &mut rest[..(lead + n).div_ceil(8)];
        let at = |columns: u64| DATA_START + from * columns * w as u64;
        self.labels.read_at(labels, at(1))?;
        self.v.read_at(v, at(3))?;
        self.flips.read_at(flips, DATA_START + from / 8)?;
        if opposites {
            self.o.read_at(o, at(3))?;
        }
        for i in 0..n {
            let component = width.get(labels, i);
            if component != u64::MAX {
                self.bound(
                    folder::COMPONENT,
                    from + i as u64,
                    component,
                    counts.components,
                )?;
            }
            if component == u64::MAX || !wanted(component) {
                continue;
            }
            let t = from + i as u64;
            let row = [0, 1, 2].map(|k| width.get(v, 3 * i + k));
            for v in row {
                self.bound(folder::V, t, v, counts.vertices)?;
            }
            let mut o3 = [u64::MAX; 3];
            if opposites {
                o3 = [0, 1, 2].map(|k| width.get(o, 3 * i + k));
                for o in o3.into_iter().filter(|&o| o != u64::MAX) {
                    self.bound(folder::O, t, o, 3 * counts.triangles)?;
                }
            }
            rows.push(Row {
                t,
                v: row,
                o: o3,
                component,
                flipped: flips[(lead + i) / 8] >> ((lead + i) % 8) & 1 == 1,
            });
        }
        Ok(())
    }

    /// Holds an id, of a row of an array, to its bound.
    pub(super) fn bound(&self, name: &str, row: u64, found: u64, end: u64) -> Result<()> {
        if found < end {
            return Ok(());
        }
        Err(self.damaged(
            name,
            format!("row {row}"),
            format!("an id below {end}"),
            found.to_string(),
        ))
    }

    pub(super) fn damaged(&self, name: &str, at: String, expected: String, found: String) -> Error {
        let help = "the folder is damaged; `cornermill verify` says how; build it again";
        Error::input(&self.folder.path().join(name), at, expected, found, help)
    }

    /// The table of components and the labels disagree.
    pub(super) fn miscounted(&self, expected: u64, found: u64) -> Error {
        let expected =
            format!("{expected} triangles with the chosen labels, as components.npy says");
        self.damaged(
            folder::COMPONENT,
            String::new(),
            expected,
            found.to_string(),
        )
    }

    /// One triangle that is taken, without its opposites.
    pub(super) fn one(&self, t: u64) -> Result<Row> {
        let mut rows = Vec::with_capacity(1);
        self.read(t, 1, false, &|_| true, &mut rows)?;
        rows.pop().ok_or_else(|| {
            let expected = "a component".to_owned();
            self.damaged(
                folder::COMPONENT,
                format!("triangle {t}"),
                expected,
                "none".into(),
            )
        })
    }

    /// Hands ids from one of the lists to `each`, in order.
    pub(super) fn list(
        &self,
        name: &str,
        len: u64,
        mut each: impl FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let file = array::open(self.folder, name, self.width.descr(), &[len])?;
        let w = self.width.bytes();
        let mut bytes = vec![0; 4096 * w];
        for from in (0..len).step_by(4096) {
            let n = (len - from).min(4096) as usize;
            file.read_at(&mut bytes[..n * w], DATA_START + from * w as u64)?;
            (0..n).try_for_each(|i| each(self.width.get(&bytes, i)))?;
        }
        Ok(())
    }

    /// Copies the rows of G that are taken, and finds their box.
    pub(super) fn write_g(&self, job: &Job, bounds: &mut Bounds) -> Result<Option<OutArray>> {
        let Some((kind, file)) = &self.g else {
            return Ok(None);
        };
        let row = kind.row_bytes();
        let array = job.array(folder::G, kind.descr(), &[job.vertices, 3], row as u64)?;
        let n = self.folder.manifest().counts.vertices;
        self.ws.progress.begin("coordinates", "vertices", n);
        let mut bytes = vec![0; self.step as usize * row];
        let mut out = Vec::with_capacity(bytes.len());
        let mut written = 0;
        for from in (0..n).step_by(self.step as usize) {
            let count = self.step.min(n - from) as usize;
            file.read_at(&mut bytes[..count * row], DATA_START + from * row as u64)?;
            out.clear();
            for i in (0..count).filter(|&i| job.taken.vertices.has(from + i as u64)) {
                bounds.add(kind.row(&bytes, i));
                out.extend_from_slice(&bytes[i * row..][..row]);
            }
            array.write(written * row as u64, &out)?;
            written += (out.len() / row) as u64;
            self.ws.progress.advance(count as u64);
        }
        self.ws.progress.end();
        conserve("filter: coordinates", "vertices", job.vertices, written)?;
        Ok(Some(array))
    }
}
