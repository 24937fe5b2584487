//! V and G as a decoder writes them: rows of three at their places.
//!
//! Memory: none of its own. I/O: what is written.

use super::file::Head;
use crate::corner::Index;
use crate::disk::{DataFile, Workspace};
use crate::error::Result;
use crate::folder::{fits_u4, npy};
use std::path::Path;

/// Two new `.npy` arrays, V and, when the file has coordinates, G.
pub(super) struct Rows {
    v: DataFile,
    g: Option<DataFile>,
    /// Ids of 4 bytes.
    pub(super) narrow: bool,
    /// Bytes of a coordinate.
    coords: u8,
}

impl Rows {
    /// The arrays of a mesh with no more than so many triangles and vertices.
    pub(super) fn create(
        ws: &Workspace,
        head: &Head,
        [v, g]: [&Path; 2],
        [triangles, vertices]: [u64; 2],
    ) -> Result<Rows> {
        let create = |path| DataFile::create_new(path, &ws.io);
        Ok(Rows {
            v: create(v)?,
            g: (head.coords > 0).then(|| create(g)).transpose()?,
            narrow: fits_u4(triangles, vertices),
            coords: head.coords,
        })
    }

    fn v_row(&self) -> u64 {
        if self.narrow { 12 } else { 24 }
    }

    fn g_row(&self) -> u64 {
        3 * u64::from(self.coords)
    }

    /// How many rows there are: headers and lengths.
    pub(super) fn shape(&self, [triangles, vertices]: [u64; 2]) -> Result<()> {
        let descr = if self.narrow { u32::DESCR } else { u64::DESCR };
        let set = |file: &DataFile, descr, rows, row| {
            file.write_at(&npy::header_bytes(descr, &[rows, 3]), 0)?;
            file.set_len(npy::DATA_START + rows * row)
        };
        set(&self.v, descr, triangles, self.v_row())?;
        match &self.g {
            None => Ok(()),
            Some(g) => {
                let descr = if self.coords == 8 { "<f8" } else { "<f4" };
                set(g, descr, vertices, self.g_row())
            }
        }
    }

    /// Writes triangles from number `first` on, three ids each.
    pub(super) fn triangles(&self, first: u64, ids: impl Iterator<Item = u64>) -> Result<()> {
        let at = npy::DATA_START + first * self.v_row();
        if self.narrow {
            let v: Vec<u32> = ids.map(|v| (v as u32).to_le()).collect();
            self.v.write_at(bytemuck::cast_slice(&v), at)
        } else {
            let v: Vec<u64> = ids.map(u64::to_le).collect();
            self.v.write_at(bytemuck::cast_slice(&v), at)
        }
    }

    /// Writes coordinates from vertex `first` on, as bytes of rows.
    pub(super) fn points(&self, first: u64, rows: &[u8]) -> Result<()> {
        match &self.g {
            None => Ok(()),
            Some(g) => g.write_at(rows, npy::DATA_START + first * self.g_row()),
        }
    }
}
