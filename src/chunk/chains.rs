//! Chains: corners without opposite, joined.
//!
//! Why it works: every corner without opposite lies at the ends of two fans, and each fan joins the
//! two corners at its ends. So the corners form paths and rings; a join inside one chain closes a
//! ring, and a chain is named by its smallest corner, whatever the order of the joins.
//!
//! Memory: a bit for each corner, half a bit for its rank, at most 12 bytes for each corner without
//! opposite (their list grows by doubling).

/// The corners without opposite, joined.
#[derive(Debug, Default)]
pub struct Chains {
    /// A bit a corner, and the number of bits before each word.
    bits: Vec<u64>,
    ranks: Vec<u32>,
    corners: Vec<u32>,
    parent: Vec<u32>,
}

impl Chains {
    /// Forgets all corners; new ones come from so many.
    pub fn clear(&mut self, corners: usize) {
        self.bits.clear();
        self.bits.resize(corners.div_ceil(64), 0);
        self.corners.clear();
    }

    /// Adds a corner; they come in ascending order.
    #[inline]
    pub fn add(&mut self, corner: u32) {
        self.bits[corner as usize / 64] |= 1 << (corner % 64);
        self.corners.push(corner);
    }

    /// All corners were added: each is a chain of its own.
    pub fn number(&mut self) {
        self.parent.clear();
        self.parent.extend(0..self.corners.len() as u32);
        self.ranks.clear();
        if self.corners.is_empty() {
            return;
        }
        let mut sum = 0;
        self.ranks.extend(self.bits.iter().map(|word| {
            let before = sum;
            sum += word.count_ones();
            before
        }));
    }

    fn find(&mut self, corner: u32) -> u32 {
        let (word, bit) = (corner as usize / 64, corner % 64);
        let before = self.bits[word] & ((1 << bit) - 1);
        let mut at = self.ranks[word] + before.count_ones();
        while self.parent[at as usize] != at {
            let above = self.parent[self.parent[at as usize] as usize];
            self.parent[at as usize] = above;
            at = above;
        }
        at
    }

    /// Joins the chains of two corners; false when they are one already.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a != b
    }

    /// The smallest corner of a chain.
    pub fn name(&mut self, corner: u32) -> u32 {
        let at = self.find(corner);
        self.corners[at as usize]
    }
}
