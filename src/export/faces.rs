//! The triangles of a folder, block by block: chosen ones only, flips undone when asked.
//!
//! Every id is held to its bounds here, so that what follows may trust it.
//!
//! Memory: [`BYTES_PER_TRIANGLE`] for each triangle of a block; the caller leases it. I/O: V,
//! and the labels and flip bits when they are needed, once each time the triangles are walked.

use super::ExportRequest;
use super::select::Chosen;
use super::source::Source;
use crate::disk::DataFile;
use crate::error::{Error, Result};
use crate::folder::{self, Folder, npy};
use crate::table::array::{self, Coords, Width};
use std::path::PathBuf;

/// V as read (24), the label (8), a byte for the flip bit, and the decoded ids (24).
pub(super) const BYTES_PER_TRIANGLE: u64 = 57;

pub(super) struct Faces<'a> {
    folder: Option<&'a Folder>,
    width: Width,
    v: DataFile,
    labels: Option<DataFile>,
    flips: Option<DataFile>,
    triangles: u64,
    vertices: u64,
    components: u64,
    step: u64,
    v_bytes: Vec<u8>,
    label_bytes: Vec<u8>,
    flip_bytes: Vec<u8>,
    kept: Vec<[u64; 3]>,
}

impl<'a> Faces<'a> {
    /// The triangles of a source, whose coordinates are handed back.
    pub(super) fn open(
        source: Source<'a>,
        request: &ExportRequest,
        step: u64,
    ) -> Result<(Faces<'a>, Option<(Coords, DataFile)>)> {
        let (t, width) = (source.triangles, source.width);
        let when = |on: bool, name, descr, shape: u64| match source.folder {
            Some(folder) if on => array::open(folder, name, descr, &[shape]).map(Some),
            _ => Ok(None),
        };
        let flip_bytes = t.div_ceil(8);
        let faces = Faces {
            folder: source.folder,
            width,
            labels: when(request.selects(), folder::COMPONENT, width.descr(), t)?,
            flips: when(
                request.input_orientation,
                folder::FLIPPED,
                "|u1",
                flip_bytes,
            )?,
            v: source.v,
            triangles: t,
            vertices: source.vertices,
            components: source.folder.map_or(0, |f| f.manifest().counts.components),
            step,
            v_bytes: vec![0; step as usize * 3 * width.bytes()],
            label_bytes: vec![0; step as usize * width.bytes()],
            flip_bytes: vec![0; step as usize / 8],
            kept: Vec::with_capacity(step as usize),
        };
        Ok((faces, source.g))
    }

    /// Triangles of the folder.
    pub(super) fn triangles(&self) -> u64 {
        self.triangles
    }

    /// The block of triangles that begins at `from`, a multiple of the step (and so of 8).
    pub(super) fn read(&mut self, from: u64, chosen: Option<&Chosen>) -> Result<&[[u64; 3]]> {
        let n = self.step.min(self.triangles - from) as usize;
        let width = self.width.bytes();
        let at = |bytes: u64| npy::DATA_START + bytes;
        let row = 3 * width as u64;
        self.v
            .read_at(&mut self.v_bytes[..3 * n * width], at(from * row))?;
        if let Some(labels) = &self.labels {
            labels.read_at(&mut self.label_bytes[..n * width], at(from * width as u64))?;
        }
        if let Some(flips) = &self.flips {
            flips.read_at(&mut self.flip_bytes[..n.div_ceil(8)], at(from / 8))?;
        }
        self.kept.clear();
        for i in 0..n {
            if self.wanted(from, i, chosen)? {
                let mut triangle = self.decode(from, i)?;
                if self.flips.is_some() && self.flip_bytes[i / 8] >> (i % 8) & 1 == 1 {
                    triangle.swap(1, 2);
                }
                self.kept.push(triangle);
            }
        }
        Ok(&self.kept)
    }

    fn wanted(&self, from: u64, i: usize, chosen: Option<&Chosen>) -> Result<bool> {
        let Some(chosen) = chosen else {
            return Ok(true);
        };
        let label = self.width.get(&self.label_bytes, i);
        if label == u64::MAX {
            return Ok(false);
        }
        if label >= self.components {
            let expected = format!("a component below {}", self.components);
            return Err(self.damaged(folder::COMPONENT, from + i as u64, expected, label));
        }
        Ok(chosen.has(label))
    }

    fn decode(&self, from: u64, i: usize) -> Result<[u64; 3]> {
        let triangle = [0, 1, 2].map(|k| self.width.get(&self.v_bytes, 3 * i + k));
        match triangle.iter().find(|&&v| v >= self.vertices) {
            None => Ok(triangle),
            Some(&v) => {
                let expected = format!("a vertex below {}", self.vertices);
                Err(self.damaged(folder::V, from + i as u64, expected, v))
            }
        }
    }

    /// The path of an array.
    fn path(&self, name: &str) -> PathBuf {
        let folder = self.folder.map(|folder| folder.path().join(name));
        folder.unwrap_or_else(|| self.v.path().to_owned())
    }

    fn damaged(&self, name: &str, triangle: u64, expected: String, found: u64) -> Error {
        Error::input(
            &self.path(name),
            format!("triangle {triangle}"),
            expected,
            found.to_string(),
            "the folder is damaged; `cornermill verify` says how; build it again",
        )
    }

    /// The table of components and the labels disagree.
    pub(super) fn miscounted(&self, expected: u64, found: u64) -> Error {
        Error::input(
            &self.path(folder::COMPONENT),
            "",
            format!("{expected} triangles with the chosen labels, as components.npy says"),
            found.to_string(),
            "the folder is damaged; `cornermill verify` says how; build it again",
        )
    }
}
