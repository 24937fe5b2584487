//! Buckets beyond the sorter's memory: split on disk until the parts fit.
//!
//! A part is cut by the highest bits in which its keys differ at the first level where they
//! differ at all, so no pass is spent on bits or levels that all records share, and each cut
//! leaves at least two parts. A part whose records agree in all levels is streamed.
//!
//! Parts live as chains of blocks in one temporary file (see [`pool`](super::pool)), whose space is free
//! again as parts are read, however often they are split.
//!
//! Memory: the sorter's record space as buffers, one block for each part and one for input; a
//! stack of parts whose bound [`least_parts`] explains. I/O: each split reads and writes its
//! part once; an oversized bucket is read once more to learn the bounds of its keys.

use super::buckets::Bucket;
use super::pool::{NONE, Pool, footer};
use super::sorter::Sorter;
use super::{Record, Spread};
use crate::error::Result;

/// Parts of one split at most.
const FAN: u64 = 128;

/// Records of one key interval that wait on disk.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// The block written last, which all but fills the chain: only it may be part full. None
    /// when the part is the bucket itself.
    head: u64,
    records: u64,
    /// All records agree in the levels below.
    level: u32,
    /// Bounds of the keys at `level`; not known when `min > max`.
    min: u64,
    max: u64,
}

/// Stack room with which any bucket can be split in two again and again.
///
/// A part has `potential` = the bits of its interval + 64 for each level after. A split into
/// 2^f parts leaves 2^f - 1 on the stack beneath a part with f bits less. So with f = 1 the
/// stack's length + potential never grows; larger f are taken as long as the sum fits.
pub(super) const fn least_parts<R: Record>() -> usize {
    64 * R::LEVELS + 1
}

/// Splits and sorts a bucket of more than `sorter.capacity()` records.
pub(super) fn sort<R: Record>(
    sorter: &mut Sorter<R>,
    bucket: &Bucket<'_, R>,
    records: u64,
    sink: &mut dyn FnMut(&[R]) -> Result<()>,
) -> Result<()> {
    let mut store = Store {
        bucket,
        block: sorter.block,
        pool: Pool::new(
            &sorter.scratch,
            "a split bucket",
            (sorter.block * size_of::<R>()) as u64,
        ),
    };
    sorter.parts.clear();
    sorter.parts.push(Part {
        head: NONE,
        records,
        level: 0,
        min: u64::MAX,
        max: 0,
    });
    while let Some(part) = sorter.parts.pop() {
        if part.records <= sorter.capacity() {
            let n = part.records as usize;
            sorter.grow(n + footer::<R>());
            store.load(&part, &mut sorter.space[..n + footer::<R>()])?;
            sorter.sort_loaded(n, part.level as usize, sink)?;
            continue;
        }
        sorter.grow(sorter.block);
        let block = &mut sorter.space[..sorter.block];
        match store.bounds(part, block)? {
            Some(part) => divide(sorter, &mut store, &part)?,
            None => store.stream(&part, true, block, sink)?,
        }
    }
    Ok(())
}

/// Replaces a part whose bounds differ by its parts, the least on top of the stack.
fn divide<R: Record>(sorter: &mut Sorter<R>, store: &mut Store<'_, R>, part: &Part) -> Result<()> {
    let bits = 64 - (part.max - part.min).leading_zeros();
    let fan_bits = fan_bits(sorter, part, bits);
    let shift = bits - fan_bits;
    let fan = 1usize << fan_bits;
    let base = sorter.parts.len();
    debug_assert!(base + fan <= sorter.parts.capacity());
    let empty = Part {
        head: NONE,
        records: 0,
        level: part.level,
        min: u64::MAX,
        max: 0,
    };
    sorter.parts.resize(base + fan, empty);
    let block = sorter.block;
    sorter.grow((fan + 1) * block);
    let (input, buffers) = sorter.space.split_at_mut(block);
    // Descending, so that popping ascends.
    let parts = &mut sorter.parts[base..];
    let per = block - footer::<R>();
    store.each_block(part, true, input, &mut |pool, records| {
        for r in records {
            let key = r.key(part.level as usize);
            let d = fan - 1 - ((key - part.min) >> shift) as usize;
            let p = &mut parts[d];
            let fill = (p.records % per as u64) as usize;
            buffers[d * block + fill] = *r;
            p.records += 1;
            p.min = p.min.min(key);
            p.max = p.max.max(key);
            if fill + 1 == per {
                p.head = pool.write(&mut buffers[d * block..][..block], p.head)?;
            }
        }
        Ok(())
    })?;
    for (d, p) in parts.iter_mut().enumerate() {
        let fill = (p.records % per as u64) as usize;
        if fill > 0 {
            let used = &mut buffers[d * block..][..fill + footer::<R>()];
            p.head = store.pool.write(used, p.head)?;
        }
    }
    let mut kept = base;
    for i in base..base + fan {
        if sorter.parts[i].records > 0 {
            sorter.parts[kept] = sorter.parts[i];
            kept += 1;
        }
    }
    sorter.parts.truncate(kept);
    sorter.splits += 1;
    Ok(())
}

/// Enough parts that each should fit twice, as far as buffers and the stack allow.
fn fan_bits<R: Record>(sorter: &Sorter<R>, part: &Part, bits: u32) -> u32 {
    let buffers = (sorter.room / sorter.block - 1) as u64;
    let want = part.records.div_ceil(sorter.capacity()).saturating_mul(4);
    let mut fan_bits = want.min(buffers).clamp(2, FAN).ilog2().min(bits);
    let later = 64 * (R::LEVELS - 1 - part.level as usize);
    let room = sorter.parts.capacity() - sorter.parts.len();
    while fan_bits > 1 && (1 << fan_bits) + (bits - fan_bits) as usize + later > room {
        fan_bits -= 1;
    }
    fan_bits
}

/// Where parts are read from: the bucket, or the chains of its parts.
struct Store<'a, R> {
    bucket: &'a Bucket<'a, R>,
    block: usize,
    pool: Pool,
}

impl<R: Record> Store<'_, R> {
    /// The part at the first level where its keys differ, with their bounds there; `None`
    /// when all keys of all levels are equal.
    fn bounds(&mut self, mut part: Part, block: &mut [R]) -> Result<Option<Part>> {
        if part.min < part.max {
            return Ok(Some(part));
        }
        let known = usize::from(part.min == part.max);
        let mut spread = Spread::new(part.level as usize + known);
        self.stream(&part, false, block, &mut |records| {
            spread.feed(records);
            Ok(())
        })?;
        (part.level, part.min, part.max) = (spread.level as u32, spread.min, spread.max);
        Ok((spread.level < R::LEVELS).then_some(part))
    }

    fn stream(
        &mut self,
        part: &Part,
        consume: bool,
        block: &mut [R],
        sink: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        self.each_block(part, consume, block, &mut |_, records| sink(records))
    }

    /// Hands the records of a part to `each`, a block at a time; `consume` frees its blocks.
    fn each_block(
        &mut self,
        part: &Part,
        consume: bool,
        block: &mut [R],
        each: &mut dyn FnMut(&mut Pool, &[R]) -> Result<()>,
    ) -> Result<()> {
        let pool = &mut self.pool;
        if part.head == NONE {
            return self
                .bucket
                .stream(consume, block, &mut |records| each(pool, records));
        }
        let per = (self.block - footer::<R>()) as u64;
        let (mut head, mut left) = (part.head, part.records);
        while left > 0 {
            let n = Self::in_block(left, per);
            let next = pool.read(&mut block[..n + footer::<R>()], head)?;
            if consume {
                pool.give::<R>(head, n + footer::<R>())?;
            }
            each(pool, &block[..n])?;
            left -= n as u64;
            head = next;
        }
        Ok(())
    }

    /// Loads a part to the front of `into`, which has room for one footer more.
    fn load(&mut self, part: &Part, into: &mut [R]) -> Result<()> {
        let n = part.records as usize;
        if part.head == NONE {
            return self.bucket.load(&mut into[..n]);
        }
        let per = self.block - footer::<R>();
        let (mut head, mut done) = (part.head, 0);
        while done < n {
            let len = Self::in_block((n - done) as u64, per as u64);
            // The next block overwrites this one's footer.
            let next = self
                .pool
                .read(&mut into[done..done + len + footer::<R>()], head)?;
            self.pool.give::<R>(head, len + footer::<R>())?;
            done += len;
            head = next;
        }
        Ok(())
    }

    /// Records in the head block of a chain of `left`: what full blocks leave over.
    fn in_block(left: u64, per: u64) -> usize {
        ((left - 1) % per + 1) as usize
    }
}
