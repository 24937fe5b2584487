//! From the blocks' distinct positions to ids: the sorts that make blocks one mesh.
//!
//! What each step does and why is in [`super`]. Every step reads what the one before it sent,
//! in the order that it needs, so none holds more than a sorter and a few buffers; the step
//! that maps corners holds the ids of one block's keys.

use super::bits::{Bits, Pair, Place, Ranked, same};
use super::front::Fronted;
use super::sorter;
use super::stream::{SeqReader, SeqWriter};
use crate::disk::{DataFile, Lease, ScratchFile, Workspace};
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::input::reader::lease_buffer;
use crate::input::{CoordArray, Endian, IndexArray, IndexKind, Request, Source};
use crate::shuffle::{Buckets, Plan, Shuffle};
use std::path::PathBuf;

/// Joins the blocks. `placed`: the mesh's former G lies at `request.g_path`.
///
/// # Errors
/// As [`super::weld`].
pub fn join<B: Bits>(
    ws: &Workspace,
    request: &Request,
    placed: bool,
    (locals, blocks, done): (ScratchFile, ScratchFile, Fronted),
    places: Buckets<Place<B>>,
) -> Result<(IndexArray, CoordArray)> {
    let (firsts, others) = group(ws, places, done.ranks)?;
    let (g, ranks) = place(ws, request, placed, firsts, others.records() > 0)?;
    let others = resolve(ws, others, &ranks, g.vertices, done.ranks)?;
    drop(ranks);
    let wide = request.wide || done.corners >= u64::from(u32::MAX);
    let v = corners(ws, locals, blocks, done, others, wide)?;
    Ok((v, g))
}

/// Finds the groups of equal positions: their first uses, and the ranks of all others, each
/// sent to the first use of its group.
fn group<B: Bits>(
    ws: &Workspace,
    places: Buckets<Place<B>>,
    ranks: u64,
) -> Result<(Buckets<Ranked<B>>, Buckets<Pair>)> {
    let free = ws.budget.free();
    let mut sorter = sorter(ws, &places)?;
    let plan = Plan::within(free / 8, 1, size_of::<Ranked<B>>(), ranks, free / 2);
    let firsts = Shuffle::new(ws, "first uses of a weld", 0..ranks, plan)?;
    let plan = Plan::within(free / 8, 1, size_of::<Pair>(), ranks, free / 2);
    let others = Shuffle::new(ws, "joined positions of a weld", 0..ranks, plan)?;
    let (mut to_firsts, mut to_others) = (firsts.writer()?, others.writer()?);
    let mut first: Option<Place<B>> = None;
    ws.progress.begin("weld: group", "positions", ranks);
    places.sorted_all(&mut sorter, &mut |slice| {
        for place in slice {
            match first {
                Some(first) if same(first.at, place.at) => to_others.push(Pair {
                    key: first.rank,
                    value: place.rank,
                })?,
                _ => {
                    let (at, rank) = (place.at, place.rank);
                    to_firsts.push(Ranked { at, rank })?;
                    first = Some(*place);
                }
            }
        }
        ws.progress.advance(slice.len() as u64);
        ws.progress.usage(ws.budget.used(), ws.scratch.used());
        Ok(())
    })?;
    ws.progress.end();
    to_firsts.finish()?;
    to_others.finish()?;
    Ok((firsts.finish()?, others.finish()?))
}

/// Writes G in order of first use, and the rank of each vertex when `keep` says so.
fn place<B: Bits>(
    ws: &Workspace,
    request: &Request,
    placed: bool,
    firsts: Buckets<Ranked<B>>,
    keep: bool,
) -> Result<(CoordArray, ScratchFile)> {
    let vertices = firsts.records();
    let path = if placed {
        let mut name = request.g_path.clone().into_os_string();
        name.push(".weld");
        PathBuf::from(name)
    } else {
        request.g_path.clone()
    };
    let mut sorter = sorter(ws, &firsts)?;
    let file = DataFile::create_new(&path, &ws.io)?;
    let mut g = SeqWriter::new(&ws.budget, file, DATA_START)?;
    let mut ranks = SeqWriter::new(&ws.budget, ws.scratch.file("ranks of a weld")?, 0)?;
    ws.progress.begin("weld: place", "vertices", vertices);
    firsts.sorted_all(&mut sorter, &mut |slice| {
        for place in slice {
            g.push(bytemuck::bytes_of(&{ place.at }))?;
            if keep {
                ranks.push(bytemuck::bytes_of(&{ place.rank }))?;
            }
        }
        ws.progress.advance(slice.len() as u64);
        Ok(())
    })?;
    ws.progress.end();
    let (file, end) = g.finish()?;
    // Without a vertex nothing was written behind the hole for the header.
    file.set_len(end)?;
    drop(file);
    if placed {
        std::fs::rename(&path, &request.g_path).map_err(|e| {
            Error::io(
                &path,
                format!("rename it to {}", request.g_path.display()),
                e,
            )
        })?;
    }
    let g = CoordArray {
        source: Source::Named(DataFile::open_rw(&request.g_path, &ws.io)?),
        at: DATA_START,
        kind: B::KIND,
        endian: Endian::Little,
        vertices,
        placed: true,
    };
    Ok((g, ranks.finish()?.0))
}

/// Gives every rank that is no first use the id of its group, sent to the rank.
fn resolve(
    ws: &Workspace,
    others: Buckets<Pair>,
    ranks_of_ids: &ScratchFile,
    vertices: u64,
    ranks: u64,
) -> Result<Buckets<Pair>> {
    let free = ws.budget.free();
    let plan = Plan::within(free / 8, 1, size_of::<Pair>(), others.records(), free / 2);
    let ids = Shuffle::new(ws, "ids of a weld", 0..ranks, plan)?;
    let mut to_ids = ids.writer()?;
    if others.records() > 0 {
        let mut sorter = sorter(ws, &others)?;
        let mut firsts = SeqReader::new(&ws.budget, ranks_of_ids.data(), 0, 8, vertices)?;
        let (mut rank, mut next_id) = (None, 0u64);
        ws.progress
            .begin("weld: resolve", "positions", others.records());
        others.sorted_all(&mut sorter, &mut |slice| {
            for pair in slice {
                while rank != Some(pair.key) {
                    let Some(bytes) = firsts.next()? else {
                        return Err(Error::Internal(format!(
                            "a weld lost the first use with rank {}",
                            pair.key
                        )));
                    };
                    rank = Some(super::bits::unsigned(bytes, Endian::Little));
                    next_id += 1;
                }
                to_ids.push(Pair {
                    key: pair.value,
                    value: next_id - 1,
                })?;
            }
            ws.progress.advance(slice.len() as u64);
            Ok(())
        })?;
        ws.progress.end();
    }
    to_ids.finish()?;
    ids.finish()
}

/// Writes V: ranks in order, either the next first use or one that was resolved.
fn corners(
    ws: &Workspace,
    locals: ScratchFile,
    blocks: ScratchFile,
    done: Fronted,
    others: Buckets<Pair>,
    wide: bool,
) -> Result<IndexArray> {
    let lease = ws
        .budget
        .lease("ids of a block of a weld", 8 * done.widest)?;
    let mut sorter = sorter(ws, &others)?;
    let wide_v = wide
        .then(|| SeqWriter::new(&ws.budget, ws.scratch.file("wide indices")?, 0))
        .transpose()?;
    let (room, chunk_lease) = lease_buffer(&ws.budget, "corners of a weld", 4096)?;
    ws.progress.begin("weld: corners", "corners", done.corners);
    let mut out = Corners {
        ws,
        locals,
        blocks: SeqReader::new(&ws.budget, blocks.data(), 0, 16, done.blocks)?,
        block: (0, 0),
        ids: Vec::with_capacity(done.widest as usize),
        next_rank: 0,
        next_id: 0,
        at: 0,
        chunk: vec![0; room / 4],
        wide: wide_v,
        _leases: [lease, chunk_lease],
    };
    others.sorted_all(&mut sorter, &mut |slice| {
        for pair in slice {
            out.first_uses(pair.key)?;
            out.rank(pair.value)?;
        }
        Ok(())
    })?;
    out.first_uses(done.ranks)?;
    ws.progress.end();
    let (source, kind) = match out.wide {
        Some(wide) => (wide.finish()?.0, IndexKind::U8),
        None => (out.locals, IndexKind::U4),
    };
    Ok(IndexArray {
        source: Source::Scratch(source),
        at: 0,
        kind,
        endian: Endian::Little,
        triangles: done.corners / 3,
    })
}

/// Turns numbers in blocks into ids, block by block. Narrow ids take the numbers' place.
struct Corners<'a> {
    ws: &'a Workspace,
    locals: ScratchFile,
    blocks: SeqReader<'a>,
    /// Distinct keys and corners of this block.
    block: (u64, u64),
    /// Ids of this block's keys so far.
    ids: Vec<u64>,
    next_rank: u64,
    next_id: u64,
    /// Corner where this block begins.
    at: u64,
    chunk: Vec<u32>,
    wide: Option<SeqWriter<ScratchFile>>,
    _leases: [Lease; 2],
}

impl Corners<'_> {
    /// All ranks below `end` that are still to come are first uses.
    fn first_uses(&mut self, end: u64) -> Result<()> {
        while self.next_rank < end {
            self.next_id += 1;
            self.rank(self.next_id - 1)?;
        }
        Ok(())
    }

    /// The next rank has this id.
    #[inline]
    fn rank(&mut self, id: u64) -> Result<()> {
        if self.ids.is_empty() {
            let Some(block) = self.blocks.next()? else {
                return Err(Error::Internal("a weld lost a block".into()));
            };
            let part = |bytes| super::bits::unsigned(bytes, Endian::Little);
            self.block = (part(&block[..8]), part(&block[8..]));
        }
        self.ids.push(id);
        self.next_rank += 1;
        if self.ids.len() as u64 == self.block.0 {
            self.map_block()?;
            self.ids.clear();
        }
        Ok(())
    }

    fn map_block(&mut self) -> Result<()> {
        let end = self.at + self.block.1;
        while self.at < end {
            let n = (end - self.at).min(self.chunk.len() as u64) as usize;
            let chunk = &mut self.chunk[..n];
            self.locals
                .read_at(bytemuck::cast_slice_mut(chunk), 4 * self.at)?;
            if let Some(wide) = &mut self.wide {
                for &number in &*chunk {
                    wide.push(&self.ids[number as usize].to_le_bytes())?;
                }
            } else {
                for number in chunk.iter_mut() {
                    *number = self.ids[*number as usize] as u32;
                }
                self.locals
                    .write_at(bytemuck::cast_slice(chunk), 4 * self.at)?;
            }
            self.at += n as u64;
        }
        self.ws.progress.advance(self.block.1);
        self.ws
            .progress
            .usage(self.ws.budget.used(), self.ws.scratch.used());
        Ok(())
    }
}
