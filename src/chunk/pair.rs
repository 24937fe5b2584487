//! Opposite corners inside one chunk, by per-vertex lists (the text's L(v)).
//!
//! Why it works: an edge with a vertex that no other chunk names has *all* its corners in this
//! chunk, so counting them here settles it for good: one is a border, two are opposite, three
//! or more are non-manifold. An edge between two seam vertices may go on elsewhere and is
//! handed out. Each corner is listed at the smaller local vertex of the edge it faces; a list
//! is sorted by the larger vertex, so the corners of one edge stand together and the whole
//! group is seen before anything is decided.
//!
//! Memory: 24 bytes a triangle for lists, 12 for the result, 4 for each local vertex; at most
//! 12 a triangle for what is handed out. O(C log k) time for lists of k corners.

/// What a corner has instead of an opposite: values of [`Pairs::opposite`] from here on.
pub const SPECIAL: u32 = u32::MAX - 3;
/// The corner faces a border edge: the only corner on it in the whole mesh.
pub const BORDER: u32 = u32::MAX;
/// The corner faces a non-manifold edge.
pub const CUT: u32 = u32::MAX - 1;
/// The corner faces an edge between two seam vertices, settled elsewhere.
pub const SEAM: u32 = u32::MAX - 2;
/// The corner's triangle has a repeated vertex.
pub const DEGENERATE: u32 = u32::MAX - 3;

/// The most triangles a chunk may have: a corner and a bit must stay below [`SPECIAL`].
pub const MAX_CHUNK: u64 = 1 << 28;

/// A corner with the direction of the edge it faces: bit 0 is 1 when the edge runs from the
/// larger vertex to the smaller in the corner's own triangle (`n.v > p.v`).
pub type Directed = u32;

/// The result of pairing one chunk. Reused from chunk to chunk.
#[derive(Debug, Default)]
pub struct Pairs {
    /// For each corner `2 * opposite + parity`, or a [`SPECIAL`] value. Parity is 1 when the
    /// two triangles disagree in orientation.
    pub opposite: Vec<u32>,
    /// Corners that face an edge between two seam vertices.
    pub seams: Vec<Directed>,
    /// Corners on settled non-manifold edges, edge by edge.
    pub cuts: Vec<Directed>,
    /// Settled regular edges.
    pub regular: u64,
    /// Settled border edges.
    pub borders: u64,
    /// Settled non-manifold edges.
    pub nonmanifold: u64,
    /// Settled regular edges of parity 1.
    pub inconsistent: u64,
    /// Triangles with a repeated vertex.
    pub degenerate: u64,
    /// End of each vertex's list.
    ends: Vec<u32>,
    /// The lists: larger vertex in the high half, directed corner in the low.
    lists: Vec<u64>,
}

impl Pairs {
    /// Pairs the corners of a chunk. `local` holds the local vertex of each corner, all below
    /// `seam.len()`; `seam[v]` tells whether another chunk names local vertex v too.
    pub fn pair(&mut self, local: &[u32], seam: &[bool]) {
        self.regular = 0;
        self.borders = 0;
        self.nonmanifold = 0;
        self.inconsistent = 0;
        self.degenerate = 0;
        self.seams.clear();
        self.cuts.clear();
        // Every entry is written below: by its triangle being degenerate, or by its group.
        self.opposite.resize(local.len(), DEGENERATE);
        self.count(local, seam.len());
        self.fill(local);
        let mut from = 0;
        for v in 0..seam.len() {
            let to = self.ends[v] as usize;
            if to > from {
                self.settle_list(from, to, seam[v], seam);
            }
            from = to;
        }
    }

    /// Counts the corners of each list into `ends`, shifted so that filling makes them ends.
    fn count(&mut self, local: &[u32], span: usize) {
        self.ends.clear();
        self.ends.resize(span + 1, 0);
        for t in local.as_chunks::<3>().0 {
            let [a, b, c] = *t;
            if a == b || b == c || c == a {
                self.degenerate += 1;
                continue;
            }
            self.ends[b.min(c) as usize + 1] += 1;
            self.ends[c.min(a) as usize + 1] += 1;
            self.ends[a.min(b) as usize + 1] += 1;
        }
        let mut sum = 0;
        for end in &mut self.ends {
            sum += *end;
            *end = sum;
        }
        self.lists.resize(sum as usize, 0);
    }

    fn fill(&mut self, local: &[u32]) {
        for (t, v) in local.as_chunks::<3>().0.iter().enumerate() {
            let [a, b, c] = *v;
            let first = 3 * t as u32;
            if a == b || b == c || c == a {
                self.opposite[3 * t..3 * t + 3].fill(DEGENERATE);
                continue;
            }
            for (k, (from, to)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
                let (lo, hi, down) = if from < to {
                    (from, to, 0)
                } else {
                    (to, from, 1)
                };
                let end = &mut self.ends[lo as usize];
                let directed = (first + k as u32) << 1 | down;
                self.lists[*end as usize] = u64::from(hi) << 32 | u64::from(directed);
                *end += 1;
            }
        }
    }

    /// Settles the edges of one vertex, listed at `from..to`.
    #[inline]
    fn settle_list(&mut self, from: usize, to: usize, lo_is_seam: bool, seam: &[bool]) {
        sort_small(&mut self.lists[from..to]);
        let mut at = from;
        while at < to {
            let hi = self.lists[at] >> 32;
            let mut end = at + 1;
            while end < to && self.lists[end] >> 32 == hi {
                end += 1;
            }
            if lo_is_seam && seam[hi as usize] {
                for i in at..end {
                    let directed = self.lists[i] as u32;
                    self.opposite[(directed >> 1) as usize] = SEAM;
                    self.seams.push(directed);
                }
            } else {
                self.settle_edge(at, end);
            }
            at = end;
        }
    }

    #[inline]
    fn settle_edge(&mut self, at: usize, end: usize) {
        let first = self.lists[at] as u32;
        match end - at {
            1 => {
                self.opposite[(first >> 1) as usize] = BORDER;
                self.borders += 1;
            }
            2 => {
                let second = self.lists[at + 1] as u32;
                // Consistent neighbours run the edge in opposite directions.
                let parity = !(first ^ second) & 1;
                self.opposite[(first >> 1) as usize] = second & !1 | parity;
                self.opposite[(second >> 1) as usize] = first & !1 | parity;
                self.regular += 1;
                self.inconsistent += u64::from(parity);
            }
            _ => {
                for i in at..end {
                    let directed = self.lists[i] as u32;
                    self.opposite[(directed >> 1) as usize] = CUT;
                    self.cuts.push(directed);
                }
                self.nonmanifold += 1;
            }
        }
    }
}

/// Sorts a list; most have about six entries, a hub's has any number.
#[inline]
fn sort_small(list: &mut [u64]) {
    if list.len() > 24 {
        list.sort_unstable();
        return;
    }
    for i in 1..list.len() {
        let x = list[i];
        let mut j = i;
        while j > 0 && list[j - 1] > x {
            list[j] = list[j - 1];
            j -= 1;
        }
        list[j] = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(local: &[u32], seam: &[bool]) -> Pairs {
        let mut pairs = Pairs::default();
        // A used state must not leak into the next chunk.
        pairs.pair(&[0, 1, 2, 2, 1, 3, 1, 1, 0], &[true; 4]);
        pairs.pair(local, seam);
        pairs
    }

    #[test]
    fn two_triangles_agree_or_not() {
        let pairs = pair(&[0, 1, 2, 2, 1, 3], &[false; 4]);
        assert_eq!(pairs.opposite, [5 << 1, BORDER, BORDER, BORDER, BORDER, 0]);
        assert_eq!(
            (pairs.regular, pairs.borders, pairs.inconsistent),
            (1, 4, 0)
        );
        let pairs = pair(&[0, 1, 2, 1, 2, 3], &[false; 4]);
        assert_eq!(pairs.opposite[0], 5 << 1 | 1);
        assert_eq!(pairs.inconsistent, 1);
    }

    #[test]
    fn three_corners_are_cut_and_one_seam_vertex_settles() {
        let fan = [0, 1, 2, 0, 1, 3, 0, 1, 4];
        let pairs = pair(&fan, &[true, false, false, false, false]);
        assert_eq!(pairs.cuts, [2 << 1, 5 << 1, 8 << 1]);
        assert_eq!((pairs.nonmanifold, pairs.opposite[5]), (1, CUT));
        let pairs = pair(&fan, &[true, true, false, false, false]);
        assert_eq!(pairs.seams, [2 << 1, 5 << 1, 8 << 1]);
        assert_eq!((pairs.nonmanifold, pairs.opposite[5]), (0, SEAM));
    }

    #[test]
    fn degenerate_triangles_face_nothing() {
        let pairs = pair(&[0, 1, 1, 0, 1, 2], &[false; 3]);
        assert_eq!(pairs.opposite[..3], [DEGENERATE; 3]);
        assert_eq!((pairs.degenerate, pairs.borders), (1, 3));
    }

    #[test]
    fn hubs_sort_like_small_lists() {
        // A closed fan of 40 triangles around vertex 0.
        let local: Vec<u32> = (0..40).flat_map(|i| [0, 1 + i, 1 + (i + 1) % 40]).collect();
        let pairs = pair(&local, &[false; 41]);
        assert_eq!((pairs.regular, pairs.borders), (40, 40));
        for t in 0..40u32 {
            // Corner 1 faces the spoke to the next triangle, whose corner 2 faces it.
            let next = 3 * ((t + 1) % 40) + 2;
            assert_eq!(pairs.opposite[3 * t as usize + 1], next << 1);
        }
    }
}
