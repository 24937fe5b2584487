//! Dense local vertex ids for one chunk.
//!
//! Why it works: the triangles of a coherent chunk name a narrow range of ids, so `id - min`
//! is dense enough to index tables with. A chunk whose ids lie far apart gets local ids in
//! order of first use from an open-addressing table instead. Either way equal ids get equal
//! local ids, which is all that pairing needs; no result depends on which way was taken.
//!
//! Memory: 12 bytes a triangle for the local ids; a scattered chunk adds [`TABLE_BYTES`]
//! bytes a triangle.

use crate::corner::Index;

/// Bytes a triangle that a scattered chunk's table and id list take at most.
pub const TABLE_BYTES: u64 = 8 * 8 + 3 * 8;

/// A chunk is narrow when its ids span at most this many times its triangles.
pub const NARROW_SPAN: u64 = 2;

/// Local ids of a chunk, and the way back. Reused from chunk to chunk.
#[derive(Debug, Default)]
pub struct LocalIds {
    local: Vec<u32>,
    /// Scattered chunks: global id of each local id. Narrow chunks: empty.
    global: Vec<u64>,
    /// Slots of the table: local id + 1, or 0 when free.
    slots: Vec<u32>,
    first: u64,
    span: usize,
}

impl LocalIds {
    /// Gives local ids to the corners' vertices `v`.
    pub fn assign<I: Index>(&mut self, v: &[I]) {
        self.local.clear();
        self.global.clear();
        let Some(&start) = v.first() else {
            self.first = 0;
            self.span = 0;
            return;
        };
        let (lo, hi) = v
            .iter()
            .fold((start, start), |(lo, hi), &x| (lo.min(x), hi.max(x)));
        let (lo, hi) = (lo.wide(), hi.wide());
        if hi - lo < NARROW_SPAN * (v.len() as u64 / 3) + 64 {
            self.first = lo;
            self.span = (hi - lo) as usize + 1;
            self.local.extend(v.iter().map(|x| (x.wide() - lo) as u32));
        } else {
            self.assign_scattered(v);
        }
    }

    fn assign_scattered<I: Index>(&mut self, v: &[I]) {
        // At most 3C distinct ids in at least 4C slots: load below 3/4.
        let bits = (v.len() * 4 / 3)
            .next_power_of_two()
            .max(16)
            .trailing_zeros();
        let mask = (1usize << bits) - 1;
        self.slots.clear();
        self.slots.resize(mask + 1, 0);
        for &x in v {
            let id = x.wide();
            let mut slot = place(id, bits);
            let local = loop {
                match self.slots[slot] {
                    0 => {
                        self.global.push(id);
                        self.slots[slot] = self.global.len() as u32;
                        break self.global.len() as u32 - 1;
                    }
                    used if self.global[used as usize - 1] == id => break used - 1,
                    _ => slot = (slot + 1) & mask,
                }
            };
            self.local.push(local);
        }
        self.span = self.global.len();
    }

    /// The local id of a global one, if a corner may have it. (A narrow chunk may leave some of
    /// its local ids unused.)
    #[inline]
    pub fn find(&self, id: u64) -> Option<u32> {
        if self.global.is_empty() {
            let local = id.wrapping_sub(self.first);
            return (local < self.span as u64).then_some(local as u32);
        }
        let mask = self.slots.len() - 1;
        let mut slot = place(id, self.slots.len().trailing_zeros());
        loop {
            match self.slots[slot] {
                0 => return None,
                used if self.global[used as usize - 1] == id => return Some(used - 1),
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    /// Local id of each corner's vertex.
    pub fn local(&self) -> &[u32] {
        &self.local
    }

    /// Local ids lie below this; a narrow chunk may leave some unused.
    pub fn span(&self) -> usize {
        self.span
    }

    /// The first global id, when the chunk is narrow: local ids are global minus this.
    pub fn window(&self) -> Option<u64> {
        self.global.is_empty().then_some(self.first)
    }

    /// The largest global id, if there is any.
    pub fn most(&self) -> Option<u64> {
        match self.window() {
            Some(first) => (self.span as u64).checked_sub(1).map(|last| first + last),
            None => self.global.iter().max().copied(),
        }
    }

    /// Global ids by local id, when the chunk is scattered.
    pub fn table(&self) -> &[u64] {
        &self.global
    }

    /// The global id of a local one.
    #[inline]
    pub fn global(&self, local: u32) -> u64 {
        if self.global.is_empty() {
            self.first + u64::from(local)
        } else {
            self.global[local as usize]
        }
    }
}

/// Where an id's search begins in a table of 2^bits slots.
#[inline]
fn place(id: u64, bits: u32) -> usize {
    (id.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - bits)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_and_scattered_map_back() {
        let mut ids = LocalIds::default();
        for v in [
            vec![7u32, 8, 9, 9, 8, 10],
            vec![0, u32::MAX - 1, 5, 5, 0, 1 << 20],
            vec![],
        ] {
            ids.assign(&v);
            let back: Vec<u32> = ids.local().iter().map(|&l| ids.global(l) as u32).collect();
            assert_eq!(back, v);
            assert!(ids.local().iter().all(|&l| (l as usize) < ids.span()));
            for (&id, &local) in v.iter().zip(ids.local()) {
                assert_eq!(ids.find(u64::from(id)), Some(local));
            }
            assert_eq!(ids.find(u64::from(u32::MAX)), None);
            assert_eq!(ids.most(), v.iter().max().map(|&id| id.into()));
        }
        ids.assign(&[1u64 << 40, 3, 1 << 40]);
        assert_eq!((ids.local(), ids.window()), (&[0, 1, 0][..], None));
    }
}
