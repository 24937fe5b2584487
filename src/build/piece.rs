//! Sums by component on their way through scratch, in pieces as short as what they hold.
//!
//! Why it works: everything that is summed is an integer, a minimum or a maximum, so counts,
//! volumes, areas and boxes may travel apart, and whoever gathers them adds up what comes. A sum
//! takes as many pieces as its numbers need, and what is nothing takes none. Most components of a
//! crowd are one triangle: its corners are shorter than all that they tell, and one piece holds
//! them with its counts.
//!
//! Memory: none. I/O: 48 bytes a piece: one for a triangle alone with coordinates of 32 bits, three or
//! four for other components.

use super::tally::{Measured, Sums};
use crate::chunk::grid::Grid;
use crate::chunk::measure::Measure;
use crate::error::Result;
use crate::shuffle::Record;
use bytemuck::{Pod, Zeroable};

/// Words of a piece behind its head.
const WORDS: usize = 10;

/// A part of what is known of a component.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Piece([u32; 2 + WORDS]);

/// What a piece holds: its number is in the low bits of the head.
#[derive(Clone, Copy)]
enum Kind {
    /// A triangle, whose few counts are in the head: its number and its corners.
    Alone,
    /// First triangle, triangles, flipped, borders, rings, loops, below 2^32.
    Few,
    /// First triangle, triangles, flipped.
    Triangles,
    /// Borders, rings, loops.
    Rims,
    /// Both volumes; and whether a vertex is not finite.
    Volumes,
    /// The area, and the box in 32 bits.
    Narrow,
    /// The area, and the least corner of the box.
    Least,
    /// The greatest corner of the box.
    Greatest,
}

/// Bits of the kind.
const KIND: u64 = 3;
/// Bits of the head below the component, which has the other 48.
const BELOW: u64 = 16;

/// What a head tells of a triangle alone, above the kind: whether it is counted, whether it differs
/// from the first in orientation, whether its measure does, and three counts of two bits.
#[derive(Clone, Copy)]
struct Head {
    counted: bool,
    flipped: bool,
    against: bool,
    rims: [u64; 3],
}

impl Head {
    fn word(self) -> u64 {
        let flags = [self.counted, self.flipped, self.against];
        let [a, b, c] = flags.map(u64::from);
        let [d, e, f] = self.rims;
        a | b << 1 | c << 2 | d << 3 | e << 5 | f << 7
    }

    fn of(word: u64) -> Head {
        let [counted, flipped, against] = [0, 1, 2].map(|bit| word >> bit & 1 == 1);
        Head {
            counted,
            flipped,
            against,
            rims: [3, 5, 7].map(|at| word >> at & 3),
        }
    }
}

impl Record for Piece {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.component()
    }
}

impl Piece {
    fn new(component: u64, kind: Kind, more: u64, words: &[u32]) -> Piece {
        let head = component << BELOW | more << KIND | kind as u64;
        let mut piece = [0; 2 + WORDS];
        (piece[0], piece[1]) = (head as u32, (head >> 32) as u32);
        piece[2..2 + words.len()].copy_from_slice(words);
        Piece(piece)
    }

    fn head(&self) -> u64 {
        u64::from(self.0[0]) | u64::from(self.0[1]) << 32
    }

    /// The component.
    #[inline]
    pub fn component(&self) -> u64 {
        self.head() >> BELOW
    }

    /// Hands what is known of a component to `push`, in pieces.
    ///
    /// # Errors
    /// Those of `push`.
    pub fn all_of(
        component: u64,
        sums: &Sums,
        grid: &Grid,
        push: &mut dyn FnMut(Piece) -> Result<()>,
    ) -> Result<()> {
        if let Some(piece) = Piece::alone(component, sums) {
            return push(piece);
        }
        let triangles = [sums.first, sums.triangles, sums.flipped];
        let rims = [sums.borders, sums.rings, sums.loops];
        if sums.triangles > 0 {
            let few = triangles.iter().chain(&rims).all(|&x| x >> 32 == 0);
            if few {
                let [[a, b, c], [d, e, f]] = [triangles, rims].map(|all| all.map(|x| x as u32));
                push(Piece::new(component, Kind::Few, 0, &[a, b, c, d, e, f]))?;
            } else {
                push(Piece::longs(component, Kind::Triangles, triangles))?;
                push(Piece::longs(component, Kind::Rims, rims))?;
            }
        }
        let m = sums.measure(grid);
        if m.six_oriented != 0 || m.six_input != 0 || m.nonfinite {
            let both = [halves(m.six_oriented), halves(m.six_input)];
            let more = u64::from(m.nonfinite);
            push(Piece::new(
                component,
                Kind::Volumes,
                more,
                both.as_flattened(),
            ))?;
        }
        if m.min[0] <= m.max[0] {
            let mut words = [0; WORDS];
            words[..4].copy_from_slice(&halves(m.area));
            let corners = [m.min, m.max];
            let bounds = corners.as_flattened().iter().map(|&x| shorter(x));
            if bounds.clone().all(|x| x.is_some()) {
                (words[4..].iter_mut().zip(bounds.flatten())).for_each(|(word, x)| *word = x);
                return push(Piece::new(component, Kind::Narrow, 0, &words));
            }
            let [min, max] = corners.map(|corner| corner.map(f64::to_bits));
            words[4..].copy_from_slice(&longs(min));
            push(Piece::new(component, Kind::Least, 0, &words))?;
            push(Piece::longs(component, Kind::Greatest, max))?;
        }
        Ok(())
    }

    /// A component of which one triangle is known, and not much else.
    fn alone(component: u64, sums: &Sums) -> Option<Piece> {
        let Measured::One(corners, against) = sums.measured else {
            return None;
        };
        let counts = [sums.borders, sums.rings, sums.loops];
        if sums.triangles > 1 || counts.iter().any(|&x| x > 3) {
            return None;
        }
        let counted = sums.triangles == 1;
        let t = if counted { sums.first } else { 0 };
        let mut words = [0; WORDS];
        words[0] = u32::try_from(t).ok()?;
        for (word, &x) in words[1..].iter_mut().zip(corners.as_flattened()) {
            *word = shorter(x)?;
        }
        let head = Head {
            counted,
            flipped: sums.flipped == 1,
            against,
            rims: counts,
        };
        Some(Piece::new(component, Kind::Alone, head.word(), &words))
    }

    fn longs(component: u64, kind: Kind, words: [u64; 3]) -> Piece {
        Piece::new(component, kind, 0, &longs(words))
    }

    /// Adds what it holds to the sums of its component.
    pub fn add_to(&self, sums: &mut Sums, grid: &Grid) {
        let words = &self.0[2..];
        let long = |i: usize| u64::from(words[i]) | u64::from(words[i + 1]) << 32;
        let wide = |i: usize| i128::from(long(i)) | (long(i + 2) as i128) << 64;
        let float = |i: usize| f64::from_bits(long(i));
        let short = |i: usize| f64::from(f32::from_bits(words[i]));
        let more = self.head() << (64 - BELOW) >> (64 - BELOW + KIND);
        let mut m = Measure::default();
        // In the order of the kinds.
        match self.head() & ((1 << KIND) - 1) {
            0 => {
                let head = Head::of(more);
                if head.counted {
                    let [borders, rings, loops] = head.rims;
                    sums.first = sums.first.min(u64::from(words[0]));
                    sums.triangles += 1;
                    sums.flipped += u64::from(head.flipped);
                    sums.rims([borders, rings, loops]);
                }
                let corner = |k: usize| [0, 1, 2].map(|a| short(1 + 3 * k + a));
                return sums.add(grid, [0, 1, 2].map(corner), head.against);
            }
            1 => {
                let [first, triangles, flipped, borders, rings, loops] =
                    [0, 1, 2, 3, 4, 5].map(|i| u64::from(words[i]));
                sums.first = sums.first.min(first);
                sums.triangles += triangles;
                sums.flipped += flipped;
                return sums.rims([borders, rings, loops]);
            }
            2 => {
                sums.first = sums.first.min(long(0));
                sums.triangles += long(2);
                sums.flipped += long(4);
                return;
            }
            3 => return sums.rims([long(0), long(2), long(4)]),
            4 => {
                (m.six_oriented, m.six_input) = (wide(0), wide(4));
                m.nonfinite = more != 0;
            }
            5 => {
                m.area = wide(0);
                (m.min, m.max) = ([4, 5, 6].map(short), [7, 8, 9].map(short));
            }
            6 => (m.area, m.min) = (wide(0), [4, 6, 8].map(float)),
            _ => m.max = [0, 2, 4].map(float),
        }
        sums.merge_measure(grid, &m, false);
    }
}

/// A coordinate in 32 bits, when those are all that it has. What is no number stays none.
fn shorter(x: f64) -> Option<u32> {
    let short = x as f32;
    (f64::from(short) == x || x.is_nan()).then_some(short.to_bits())
}

/// A wide sum as words: i128 would bring padding and an alignment of 16.
fn halves(x: i128) -> [u32; 4] {
    [
        x as u32,
        (x >> 32) as u32,
        (x >> 64) as u32,
        (x >> 96) as u32,
    ]
}

fn longs(words: [u64; 3]) -> [u32; 6] {
    let [a, b, c] = words;
    let (low, high) = (|x: u64| x as u32, |x: u64| (x >> 32) as u32);
    [low(a), high(a), low(b), high(b), low(c), high(c)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chunk::grid::Bounds;

    fn grid() -> Grid {
        let mut bounds = Bounds::default();
        bounds.add([0.0; 3]);
        bounds.add([8.0; 3]);
        Grid::new(&bounds)
    }

    /// What comes back of sums that were taken to pieces; how many there were.
    fn back(sums: &Sums) -> (Sums, usize) {
        let (mut found, mut pieces) = (Sums::default(), 0);
        let mut take = |piece: Piece| {
            assert_eq!(piece.component(), (1 << 47) + 5);
            piece.add_to(&mut found, &grid());
            pieces += 1;
            Ok(())
        };
        Piece::all_of((1 << 47) + 5, sums, &grid(), &mut take).unwrap();
        (found, pieces)
    }

    #[track_caller]
    fn same(sums: &Sums, pieces: usize) {
        let (found, count) = back(sums);
        let counts = |s: &Sums| [s.first, s.triangles, s.flipped, s.borders, s.rings, s.loops];
        assert_eq!(counts(&found), counts(sums));
        assert_eq!(found.measure(&grid()), sums.measure(&grid()));
        assert_eq!(count, pieces);
    }

    const CORNERS: [[f64; 3]; 3] = [[1.0, 2.5, 3.0], [4.0, 0.5, 6.0], [7.0, 8.0, 0.25]];

    #[test]
    fn a_triangle_alone_is_one_piece() {
        same(&Sums::default(), 0);
        for against in [false, true] {
            let mut sums = Sums::default();
            sums.add(&grid(), CORNERS, against);
            same(&sums, 1);
            (sums.first, sums.triangles, sums.flipped) = (77, 1, 1);
            sums.rims([3, 0, 1]);
            same(&sums, 1);
            sums.borders = 4;
            same(&sums, 3);
        }
        let mut sums = Sums::default();
        sums.add(
            &grid(),
            [[f64::NAN; 3], [1.0; 3], [f64::INFINITY, 2.0, 2.0]],
            false,
        );
        assert!(sums.measure(&grid()).nonfinite);
        same(&sums, 1);
    }

    #[test]
    fn what_is_wide_takes_more_pieces() {
        let mut sums = Sums::default();
        sums.add(&grid(), CORNERS.map(|p| p.map(|x| x / 3.0)), true);
        same(&sums, 3);
        sums.add(&grid(), CORNERS, false);
        (sums.first, sums.triangles) = (3, 2);
        same(&sums, 4);
        (sums.first, sums.triangles, sums.loops) = (1 << 40, 1 << 41, 1 << 42);
        same(&sums, 5);
        let mut most = Sums::default();
        let m = Measure {
            six_oriented: -(1 << 120),
            six_input: 1 << 126,
            area: 1 << 125,
            min: [-1.0; 3],
            max: [1.0; 3],
            nonfinite: true,
        };
        most.merge_measure(&grid(), &m, false);
        same(&most, 2);
    }
}
