//! Opposite corners inside one chunk, by per-vertex lists (the text's L(v)).
//!
//! Why it works: an edge with a vertex that no other chunk names has *all* its corners in this
//! chunk, so counting them here settles it for good: one is a border, two are opposite, three
//! or more are non-manifold. An edge between two seam vertices may go on elsewhere and is
//! handed out. Each corner is listed at the smaller local vertex of the edge it faces; a list
//! is sorted by the larger vertex, so the corners of one edge stand together and the whole
//! group is seen before anything is decided.
//!
//! In a *cell* (see `build/cells`) all edges are complete: the one edge
//! of a triangle that belongs elsewhere is left out, and lone edges of triangles that lie
//! elsewhere are paired like the others.
//!
//! Memory: 24 bytes a triangle for lists, 12 for the result, 4 for each local vertex; at most
//! 12 a triangle for what is handed out. O(C log k) time for lists of k corners.

/// What a corner has instead of an opposite: values of [`Pairs::opposite`] from here on.
pub const SPECIAL: u32 = u32::MAX - 4;
/// The corner faces a border edge: the only corner on it in the whole mesh.
pub const BORDER: u32 = u32::MAX;
/// The corner faces a non-manifold edge.
pub const CUT: u32 = u32::MAX - 1;
/// The corner faces an edge that is settled elsewhere: between two seam vertices, or of another
/// cell.
pub const SEAM: u32 = u32::MAX - 2;
/// The corner faces a non-manifold edge, and triangles that lie elsewhere have some of its corners.
pub const CUT_APART: u32 = u32::MAX - 4;
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
    /// Corners of triangles that lie here: those from here on face lone edges.
    here: u32,
    /// End of each vertex's list.
    ends: Vec<u32>,
    /// The lists: larger vertex in the high half, directed corner in the low.
    lists: Vec<u64>,
}

impl Pairs {
    /// Pairs the corners of a chunk. `local` holds the local vertex of each corner, all below
    /// `seam.len()`; `seam[v]` tells whether another chunk names local vertex v too.
    pub fn pair(&mut self, local: &[u32], seam: &[bool]) {
        self.opposite.resize(local.len(), DEGENERATE);
        self.here = local.len() as u32;
        self.list(seam.len(), &Whole(local));
        self.settle(seam.len(), |v| seam[v as usize]);
    }

    /// Pairs what was dealt to a cell: triangles, of which some have one edge that is settled
    /// elsewhere (`aside[t]` is 1 + the corner that faces it, else 0), and lone edges of
    /// triangles elsewhere, as (from, to). Every edge handed in is complete. Corners of the lone
    /// edges are numbered behind those of the triangles; vertices lie below `span`.
    pub fn pair_dealt(&mut self, local: &[u32], aside: &[u8], lone: &[u32], span: usize) {
        self.opposite
            .resize(local.len() + lone.len() / 2, DEGENERATE);
        self.here = local.len() as u32;
        self.list(span, &Dealt { local, aside, lone });
        self.settle(span, |_| false);
    }

    /// Lists each corner at the smaller vertex of its edge.
    fn list(&mut self, span: usize, edges: &impl Edges) {
        let (ends, opposite) = (&mut self.ends, &mut self.opposite);
        ends.clear();
        ends.resize(span + 1, 0);
        let mut degenerate = 0;
        // Counted one place up, so that filling makes the sums ends.
        edges.each(
            |_, from, to| ends[from.min(to) as usize + 1] += 1,
            |corner, mark| {
                opposite[corner as usize] = mark;
                degenerate += u64::from(mark == DEGENERATE);
            },
        );
        self.degenerate = degenerate / 3;
        let mut sum = 0;
        for end in ends.iter_mut() {
            sum += *end;
            *end = sum;
        }
        let lists = &mut self.lists;
        lists.resize(sum as usize, 0);
        edges.each(
            |corner, from, to| {
                let (lo, hi, down) = if from < to {
                    (from, to, 0)
                } else {
                    (to, from, 1)
                };
                let end = &mut ends[lo as usize];
                lists[*end as usize] = u64::from(hi) << 32 | u64::from(corner << 1 | down);
                *end += 1;
            },
            |_, _| (),
        );
    }

    /// Settles the listed edges; those between two seam vertices are handed out. Every entry of
    /// `opposite` is written here, by its group, or was marked when the edges were listed.
    fn settle(&mut self, span: usize, seam: impl Fn(u32) -> bool) {
        self.regular = 0;
        self.borders = 0;
        self.nonmanifold = 0;
        self.inconsistent = 0;
        self.seams.clear();
        self.cuts.clear();
        let mut from = 0;
        for v in 0..span {
            let to = self.ends[v] as usize;
            if to > from {
                self.settle_list(from, to, seam(v as u32), &seam);
            }
            from = to;
        }
    }

    /// Settles the edges of one vertex, listed at `from..to`.
    #[inline]
    fn settle_list(
        &mut self,
        from: usize,
        to: usize,
        lo_is_seam: bool,
        seam: &impl Fn(u32) -> bool,
    ) {
        sort_small(&mut self.lists[from..to]);
        let mut at = from;
        while at < to {
            let hi = self.lists[at] >> 32;
            let mut end = at + 1;
            while end < to && self.lists[end] >> 32 == hi {
                end += 1;
            }
            if lo_is_seam && seam(hi as u32) {
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
                let mut edge = self.lists[at..end].iter();
                let apart = edge.any(|&corner| corner as u32 >> 1 >= self.here);
                for i in at..end {
                    let directed = self.lists[i] as u32;
                    self.opposite[(directed >> 1) as usize] = if apart { CUT_APART } else { CUT };
                    self.cuts.push(directed);
                }
                self.nonmanifold += 1;
            }
        }
    }
}

/// The corners to be paired, with the edges that they face.
trait Edges {
    /// Hands each corner with its edge (from, to) to `edge`, and each that faces none to be
    /// paired here to `aside`, with what it has instead. Always in the same order.
    fn each(&self, edge: impl FnMut(u32, u32, u32), aside: impl FnMut(u32, u32));
}

/// All corners of a chunk.
struct Whole<'a>(&'a [u32]);

impl Edges for Whole<'_> {
    #[inline]
    fn each(&self, mut edge: impl FnMut(u32, u32, u32), mut aside: impl FnMut(u32, u32)) {
        for (t, v) in self.0.as_chunks::<3>().0.iter().enumerate() {
            let [a, b, c] = *v;
            let first = 3 * t as u32;
            if a == b || b == c || c == a {
                (first..first + 3).for_each(|corner| aside(corner, DEGENERATE));
                continue;
            }
            edge(first, b, c);
            edge(first + 1, c, a);
            edge(first + 2, a, b);
        }
    }
}

/// What was dealt to a cell: see [`Pairs::pair_dealt`].
struct Dealt<'a> {
    local: &'a [u32],
    aside: &'a [u8],
    lone: &'a [u32],
}

impl Edges for Dealt<'_> {
    #[inline]
    fn each(&self, mut edge: impl FnMut(u32, u32, u32), mut aside: impl FnMut(u32, u32)) {
        let rows = self.local.as_chunks::<3>().0;
        for (t, (v, &out)) in rows.iter().zip(self.aside).enumerate() {
            let first = 3 * t as u32;
            let [a, b, c] = *v;
            for (k, (from, to)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
                if out as usize == k + 1 {
                    aside(first + k as u32, SEAM);
                } else {
                    edge(first + k as u32, from, to);
                }
            }
        }
        let corners = self.local.len() as u32..;
        for (corner, &[from, to]) in corners.zip(self.lone.as_chunks::<2>().0) {
            edge(corner, from, to);
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
    fn lone_edges_pair_like_others_and_edges_aside_do_not() {
        let mut pairs = Pairs::default();
        pairs.pair(&[0, 1, 2, 2, 1, 3, 1, 1, 0], &[true; 4]);
        // Triangles 0 1 2 and 0 2 3, whose edges 1 2 and 2 3 lie elsewhere; of triangles that lie
        // elsewhere the edges 1 0 and, the same way round as here, 3 0.
        pairs.pair_dealt(&[0, 1, 2, 3, 0, 2], &[1, 2], &[1, 0, 3, 0], 4);
        let own = |slot: u32, parity: u32| slot << 1 | parity;
        assert_eq!(pairs.opposite[..3], [SEAM, own(3, 0), own(6, 0)]);
        assert_eq!(pairs.opposite[3..6], [own(1, 0), SEAM, own(7, 1)]);
        assert_eq!(pairs.opposite[6..], [own(2, 0), own(5, 1)]);
        assert_eq!((pairs.regular, pairs.inconsistent), (3, 1));
        assert_eq!((pairs.borders, pairs.degenerate), (0, 0));
        // Three corners, of which two are lone.
        pairs.pair_dealt(&[0, 1, 2], &[0], &[0, 1, 1, 0], 3);
        let apart = [CUT_APART; 3];
        assert_eq!(pairs.opposite[..2], [BORDER, BORDER]);
        assert_eq!(pairs.opposite[2..], apart);
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
