//! Where a decoder puts vertices: as they are, widened, or rounded.

use super::MeshSink;
use crate::error::{Error, Result};
use crate::input::CoordKind;

impl MeshSink {
    /// Adds a vertex of the mesh whose coordinates are f4; stored bit by bit when G is f4.
    ///
    /// # Errors
    /// [`Error::Io`].
    #[inline]
    pub fn vertex4(&mut self, [x, y, z]: [f32; 3]) -> Result<()> {
        match self.kind {
            CoordKind::F4 => self.put4([x, y, z]),
            CoordKind::F8 => self.put8([x.into(), y.into(), z.into()]),
        }
    }

    /// Adds a vertex of the mesh whose coordinates are f8, rounded when G is f4.
    ///
    /// # Errors
    /// [`Error::Input`] when a finite coordinate is beyond what f4 holds, [`Error::Io`].
    #[inline]
    pub fn vertex8(&mut self, at: [f64; 3]) -> Result<()> {
        match self.kind {
            CoordKind::F8 => self.put8(at),
            CoordKind::F4 => {
                let near = at.map(|c| c as f32);
                for (c, near) in at.into_iter().zip(near) {
                    if c.is_finite() && near.is_infinite() {
                        return Err(self.beyond_f4(c));
                    }
                }
                self.rounded4(near)
            }
        }
    }

    /// Adds a vertex that was rounded to f4, where G is f4.
    ///
    /// # Errors
    /// [`Error::Io`].
    #[inline]
    pub fn rounded4(&mut self, at: [f32; 3]) -> Result<()> {
        self.rounded.see(at);
        self.put4(at)
    }

    #[cold]
    fn beyond_f4(&self, c: f64) -> Error {
        Error::input(
            &self.path,
            format!("vertex {}", self.vertices),
            "a coordinate that 4 bytes hold",
            format!("{c:e}"),
            "store coordinates as 8 bytes: --coords f8",
        )
    }

    fn put4(&mut self, at: [f32; 3]) -> Result<()> {
        if self.g_buf.len() - self.g_len < 12 {
            self.flush_g()?;
        }
        let out = &mut self.g_buf[self.g_len..self.g_len + 12];
        for (out, c) in out.chunks_exact_mut(4).zip(at) {
            out.copy_from_slice(&c.to_bits().to_le_bytes());
        }
        self.g_len += 12;
        self.vertices += 1;
        Ok(())
    }

    fn put8(&mut self, at: [f64; 3]) -> Result<()> {
        if self.g_buf.len() - self.g_len < 24 {
            self.flush_g()?;
        }
        let out = &mut self.g_buf[self.g_len..self.g_len + 24];
        for (out, c) in out.chunks_exact_mut(8).zip(at) {
            out.copy_from_slice(&c.to_bits().to_le_bytes());
        }
        self.g_len += 24;
        self.vertices += 1;
        Ok(())
    }

    /// Room for whole vertices as they are stored (little-endian, of type
    /// [`kind`](MeshSink::kind)), never empty; tell [`vertices_put`](MeshSink::vertices_put)
    /// how many were written.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn vertex_room(&mut self) -> Result<&mut [u8]> {
        if self.g_len == self.g_buf.len() {
            self.flush_g()?;
        }
        Ok(&mut self.g_buf[self.g_len..])
    }

    /// `n` vertices were written to the start of [`vertex_room`](MeshSink::vertex_room).
    pub fn vertices_put(&mut self, n: usize) {
        let bytes = match self.kind {
            CoordKind::F4 => 12,
            CoordKind::F8 => 24,
        };
        self.g_len += n * bytes;
        debug_assert!(self.g_len <= self.g_buf.len());
        self.vertices += n as u64;
    }
}
