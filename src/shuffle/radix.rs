//! Sorts records in memory by their keys: most significant digits first, small groups by
//! comparison.
//!
//! Why it is quick here: keys of a bucket span few bits, so one pass that distributes by all
//! of them leaves groups of a few records. Groups lie on an explicit stack.
//!
//! Memory: a table of counters and the stack, sized by [`Tables::bytes`]; as much space as the
//! records again when the caller has it, else the records are permuted in place. I/O: none.

use super::{Record, Spread, compare};

/// Groups up to this many records are sorted by comparison.
const SMALL: usize = 96;
/// The most bits of a digit.
const BITS: u32 = 14;

/// Records `start..end`, equal in all levels below `level`.
#[derive(Clone, Copy)]
struct Group {
    start: u32,
    end: u32,
    level: u32,
}

/// The counters and the stack of a sort, reused.
pub(super) struct Tables {
    counts: Vec<u32>,
    stack: Vec<Group>,
}

impl Tables {
    /// Tables for sorting up to `records` within `memory` bytes of space.
    pub(super) fn new(records: usize, memory: u64) -> Tables {
        Tables {
            counts: vec![0; 2 << digit_bits(memory)],
            stack: Vec::with_capacity(records / SMALL + 1),
        }
    }

    /// Bytes of such tables.
    pub(super) fn bytes(records: u64, memory: u64) -> u64 {
        let stack = (records / SMALL as u64 + 1) * size_of::<Group>() as u64;
        (8 << digit_bits(memory)) + stack
    }
}

/// Digits so wide that the counters take a sixteenth of the memory at most.
fn digit_bits(memory: u64) -> u32 {
    (memory / 128).max(2).ilog2().min(BITS)
}

/// How a group is cut: by `(key - min) >> shift` of `level`, into `fan` groups.
struct Cut {
    level: usize,
    min: u64,
    shift: u32,
    fan: usize,
}

impl Cut {
    /// The widest sensible digit; `None` when all keys are equal.
    fn of<R: Record>(data: &[R], from: usize, table: usize) -> Option<Cut> {
        let mut spread = Spread::new(from);
        spread.feed(data);
        if spread.level == R::LEVELS {
            return None;
        }
        let bits = 64 - (spread.max - spread.min).leading_zeros();
        let digit = bits.min(table.ilog2()).min(data.len().ilog2());
        let shift = bits - digit;
        Some(Cut {
            level: spread.level,
            min: spread.min,
            shift,
            fan: ((spread.max - spread.min) >> shift) as usize + 1,
        })
    }

    #[inline]
    fn digit<R: Record>(&self, r: &R) -> usize {
        ((r.key(self.level) - self.min) >> self.shift) as usize
    }
}

/// Sorts `data` by its keys from level `from` on; `spare` is as long, or empty. Returns the
/// sorted records, which lie in either.
pub(super) fn sort<'a, R: Record>(
    data: &'a mut [R],
    spare: &'a mut [R],
    from: usize,
    tables: &mut Tables,
) -> &'a mut [R] {
    if data.len() <= SMALL {
        data.sort_unstable_by(|a, b| compare(a, b, from));
        return data;
    }
    let half = tables.counts.len() / 2;
    let Some(cut) = Cut::of(data, from, half) else {
        return data;
    };
    tables.stack.clear();
    let (data, spare) = if spare.is_empty() {
        permute(data, &cut, &mut tables.counts);
        (data, spare)
    } else {
        scatter(data, spare, &cut, &mut tables.counts);
        (spare, data)
    };
    settle(data, 0, &cut, tables);
    while let Some(group) = tables.stack.pop() {
        let range = group.start as usize..group.end as usize;
        let part = &mut data[range.clone()];
        let Some(cut) = Cut::of(part, group.level as usize, half) else {
            continue;
        };
        if spare.is_empty() {
            permute(part, &cut, &mut tables.counts);
        } else {
            scatter(part, &mut spare[range.clone()], &cut, &mut tables.counts);
            part.copy_from_slice(&spare[range]);
        }
        settle(part, group.start, &cut, tables);
    }
    data
}

/// Counts digits; afterwards `counts[d]` is where the group of digit d begins.
fn count<R: Record>(data: &[R], cut: &Cut, counts: &mut [u32]) {
    counts[..cut.fan].fill(0);
    for r in data {
        counts[cut.digit(r)] += 1;
    }
    let mut sum = 0;
    for c in &mut counts[..cut.fan] {
        sum += std::mem::replace(c, sum);
    }
}

/// Copies the records of `data` to `to` by digit; `counts[d]` becomes the end of group d.
fn scatter<R: Record>(data: &[R], to: &mut [R], cut: &Cut, counts: &mut [u32]) {
    count(data, cut, counts);
    for r in data {
        let next = &mut counts[cut.digit(r)];
        to[*next as usize] = *r;
        *next += 1;
    }
}

/// Permutes `data` by digit in place, along cycles; `counts[d]` becomes the end of group d.
fn permute<R: Record>(data: &mut [R], cut: &Cut, counts: &mut [u32]) {
    let (heads, ends) = counts.split_at_mut(counts.len() / 2);
    count(data, cut, heads);
    ends[..cut.fan - 1].copy_from_slice(&heads[1..cut.fan]);
    ends[cut.fan - 1] = data.len() as u32;
    for d in 0..cut.fan {
        while heads[d] < ends[d] {
            let mut r = data[heads[d] as usize];
            loop {
                let to = cut.digit(&r);
                let head = heads[to] as usize;
                heads[to] += 1;
                std::mem::swap(&mut r, &mut data[head]);
                if to == d {
                    break;
                }
            }
        }
    }
}

/// Sorts the small groups that a cut left, and stacks the others.
fn settle<R: Record>(data: &mut [R], at: u32, cut: &Cut, tables: &mut Tables) {
    let level = cut.level + usize::from(cut.shift == 0);
    if level == R::LEVELS {
        return;
    }
    let mut start = 0;
    for &end in &tables.counts[..cut.fan] {
        let len = (end - start) as usize;
        if len > SMALL {
            debug_assert!(tables.stack.len() < tables.stack.capacity());
            tables.stack.push(Group {
                start: at + start,
                end: at + end,
                level: level as u32,
            });
        } else if len > 1 {
            let group = &mut data[start as usize..end as usize];
            group.sort_unstable_by(|a, b| compare(a, b, level));
        }
        start = end;
    }
}
