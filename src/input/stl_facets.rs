//! The facets of a binary STL file, by all threads.
//!
//! Why any thread can begin anywhere: all facets take 50 bytes, so the one that begins at or
//! behind a byte is known without reading what lies before; and a weld takes corners by number.
//! A unit is a block of the input's digest: the thread that decodes it sums its bytes, too, as
//! they pass, so the file is read once (but for the facets that lie across the pieces in which
//! it is read). A facet belongs to the unit in which it begins.
//!
//! Between two units the reading may stop, and go on in another process.
//!
//! Memory: a buffer a thread. I/O: the input once.

use super::{FACET, HEAD, corners};
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{DataFile, Workspace};
use crate::error::{Error, Result};
use crate::folder::{BLOCK, InputDigest, digest_of_blocks};
use crate::input::CoordKind;
use crate::input::reader::ByteReader;
use crate::input::weld::{Bits, Soup, Units, Welding, few};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use xxhash_rust::xxh3::Xxh3Default;

/// Bytes of a thread's buffer when the budget is ample: they stay in its cache.
const BUFFER: u64 = 256 << 10;
/// Facets whose corners are handed on at a time.
const BATCH: usize = 64;

/// A regular file whose length agrees with its number of facets, and how far it is read.
#[derive(Debug)]
pub struct Facets {
    span: Span,
    /// Sums of the blocks that were read.
    sums: Vec<u64>,
    taken: Box<dyn Taken>,
}

/// How long the file is.
#[derive(Clone, Copy, Debug)]
struct Span {
    bytes: u64,
    facets: u64,
    /// Bytes that were read before the facets, to find out what they are.
    seen: u64,
}

impl Span {
    fn units(&self) -> u64 {
        self.bytes.div_ceil(BLOCK)
    }
}

/// [`Units`] whatever the widths.
trait Taken: std::fmt::Debug {
    /// Takes blocks until all are taken or `until` is past; true when all are.
    fn some(
        &mut self,
        ws: &Workspace,
        file: &DataFile,
        of: (Span, &Mutex<&mut Vec<u64>>),
        until: Option<Instant>,
    ) -> Result<bool>;
    fn end(self: Box<Self>) -> Result<Welding>;
    fn keep(&self, to: &mut Pen) -> Result<()>;
}

impl Facets {
    /// None is taken yet of the facets of the file that `reader` has begun to read.
    pub fn new(ws: &Workspace, reader: ByteReader, kind: CoordKind, facets: u64) -> Result<Facets> {
        let span = Span {
            bytes: HEAD + facets * FACET as u64,
            facets,
            seen: reader.read_so_far(),
        };
        drop(reader);
        let of = (facets, span.units());
        let taken: Box<dyn Taken> = match (kind, few(facets)) {
            (CoordKind::F4, true) => Box::new(Units::<u32, u32>::new(ws, of)?),
            (CoordKind::F4, false) => Box::new(Units::<u32, u64>::new(ws, of)?),
            (CoordKind::F8, true) => Box::new(Units::<u64, u32>::new(ws, of)?),
            (CoordKind::F8, false) => Box::new(Units::<u64, u64>::new(ws, of)?),
        };
        Ok(Facets {
            span,
            sums: vec![0; span.units() as usize],
            taken,
        })
    }

    /// Takes facets of the file at `path` until all are taken or `until` is past; true when all are.
    pub fn some(&mut self, ws: &Workspace, path: &Path, until: Option<Instant>) -> Result<bool> {
        let file = DataFile::open(path, &ws.io)?;
        let of = (self.span, &Mutex::new(&mut self.sums));
        self.taken.some(ws, &file, of, until)
    }

    /// All were taken: the digest of the file, and the weld.
    pub fn end(self) -> Result<(InputDigest, Welding)> {
        let digest = InputDigest {
            bytes: self.span.bytes,
            xxh3: format!("{:016x}", digest_of_blocks(&self.sums)),
        };
        Ok((digest, self.taken.end()?))
    }
}

impl<B: Bits, R: Index> Taken for Units<B, R> {
    fn some(
        &mut self,
        ws: &Workspace,
        file: &DataFile,
        (span, sums): (Span, &Mutex<&mut Vec<u64>>),
        until: Option<Instant>,
    ) -> Result<bool> {
        let Span {
            bytes,
            facets,
            seen,
        } = span;
        self.take(
            ws,
            until,
            || {
                let share = ws.budget.limit() / 32 / ws.workers.count() as u64;
                let room = share.clamp(4096, BUFFER);
                let lease = ws.budget.lease("the buffer for reading the mesh", room)?;
                Ok((vec![0; room as usize], lease))
            },
            |(buf, _), soup, unit| {
                let (from, to) = (unit * BLOCK, bytes.min((unit + 1) * BLOCK));
                let mut part = Part {
                    file,
                    bytes,
                    facets,
                    hasher: Xxh3Default::new(),
                };
                soup.begin(part.facet_at(from));
                part.read(from, to, buf, soup)?;
                ws.progress
                    .advance((to - from).saturating_sub(seen.saturating_sub(from)));
                sums.lock().unwrap_or_else(PoisonError::into_inner)[unit as usize] =
                    part.hasher.digest();
                Ok(())
            },
        )
    }

    fn end(self: Box<Self>) -> Result<Welding> {
        Units::end(*self)
    }

    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.list(&[B::KIND.bytes(), R::BYTES as u64])?;
        Keep::keep(self, to)
    }
}

impl Keep for Facets {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let Span {
            bytes,
            facets,
            seen,
        } = self.span;
        to.list(&[bytes, facets, seen])?;
        to.list(&self.sums)?;
        self.taken.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Facets> {
        let other = || Error::Internal("a journal of other facets".into());
        let [bytes, facets, seen] = from.list::<u64>()?[..] else {
            return Err(other());
        };
        Ok(Facets {
            span: Span {
                bytes,
                facets,
                seen,
            },
            sums: from.list()?,
            taken: match from.list::<u64>()?[..] {
                [4, 4] => Box::new(Units::<u32, u32>::restore(from)?),
                [4, 8] => Box::new(Units::<u32, u64>::restore(from)?),
                [8, 4] => Box::new(Units::<u64, u32>::restore(from)?),
                [8, 8] => Box::new(Units::<u64, u64>::restore(from)?),
                _ => return Err(other()),
            },
        })
    }
}

/// A part of the file on its way.
struct Part<'a> {
    file: &'a DataFile,
    bytes: u64,
    facets: u64,
    hasher: Xxh3Default,
}

impl Part<'_> {
    /// The first facet that begins at byte `at` or behind it.
    fn facet_at(&self, at: u64) -> u64 {
        at.saturating_sub(HEAD)
            .div_ceil(FACET as u64)
            .min(self.facets)
    }

    /// Sums bytes `from..to`, and hands on the facets that begin there.
    fn read<B: Bits>(
        &mut self,
        from: u64,
        to: u64,
        buf: &mut [u8],
        soup: &mut dyn Soup<B>,
    ) -> Result<()> {
        let step = (buf.len() - FACET) as u64;
        let mut at = from;
        while at < to {
            let end = to.min(at + step);
            // The last facet may reach beyond.
            let held = &mut buf[..(self.bytes.min(end + FACET as u64) - at) as usize];
            self.file.read_at(held, at)?;
            self.hasher.update(&held[..(end - at) as usize]);
            let [first, last] = [self.facet_at(at), self.facet_at(end)];
            if first < last {
                let start = (HEAD + first * FACET as u64 - at) as usize;
                let whole = &held[start..start + (last - first) as usize * FACET];
                hand_on(whole, soup)?;
            }
            at = end;
        }
        Ok(())
    }
}

fn hand_on<B: Bits>(facets: &[u8], soup: &mut dyn Soup<B>) -> Result<()> {
    let mut at = [[[B::from_f4(0); 3]; 3]; BATCH];
    for batch in facets.chunks(BATCH * FACET) {
        let mut taken = 0;
        for (to, facet) in at.iter_mut().zip(batch.chunks_exact(FACET)) {
            *to = corners(facet);
            taken += 1;
        }
        soup.corners(at[..taken].as_flattened())?;
    }
    Ok(())
}
