//! How likely each bit is: adaptive contexts, one a bit (*fast*) or several mixed (*strong*).
//!
//! Why both sides agree: a probability depends on the bits coded before and on nothing else, by
//! integer arithmetic alone.
//!
//! Memory: fast 4 bytes a context; strong 2 MiB besides: see [`mix`](super::mix).

use super::range::{BITS, Coder};

/// Most contexts that one decision is given besides the main one.
pub const MORE: usize = 8;

/// A sort of decision: its contexts are its own.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// Where its contexts begin in the fast table.
    base: u32,
    /// Bins of each context.
    bins: u32,
    /// Number of main contexts.
    mains: u32,
    /// Its number.
    id: u32,
}

/// Lays families out one behind the other.
const fn family(before: Option<Family>, mains: u32, bins: u32) -> Family {
    let (base, id) = match before {
        Some(f) => (f.base + f.bins * f.mains, f.id + 1),
        None => (0, 0),
    };
    Family {
        base,
        bins,
        mains,
        id,
    }
}

impl Family {
    /// The place of a bin of a main context among those of all families.
    #[inline]
    pub fn place(self, main: u32, bin: u32) -> usize {
        debug_assert!(main < self.mains && bin < self.bins);
        (self.base + main * self.bins + bin) as usize
    }

    /// The place of one of its coarser contexts among those of all families.
    #[inline]
    pub fn kin(self, kin: u32) -> usize {
        debug_assert!(kin < KINS as u32);
        self.id as usize * KINS + kin as usize
    }

    /// Its number.
    #[inline]
    pub fn number(self) -> u32 {
        self.id
    }
}

/// Main contexts of ears: the way of the sweep, the gap, the triangles at the vertex.
const EARS: u32 = 2 * 24 * 10;
/// Is the triangle across the one across the next edge?
pub const RIGHT: Family = family(None, EARS, 1);
/// Is it the one across the edge before?
pub const LEFT: Family = family(Some(RIGHT), EARS, 1);
/// Is there no triangle across?
pub const BORDER: Family = family(Some(LEFT), 16, 1);
/// Is its tip a vertex that is not on the border?
pub const NEW: Family = family(Some(BORDER), 24, 1);
/// Was the vertex met before all the same?
pub const SEEN: Family = family(Some(NEW), 3, 1);
/// Does the fan go on to the right of a new vertex?
pub const FAN_RIGHT: Family = family(Some(SEEN), EARS, 1);
/// And to the left?
pub const FAN_LEFT: Family = family(Some(FAN_RIGHT), EARS, 1);
/// Are two edges that meet in both ends one?
pub const ZIP: Family = family(Some(FAN_LEFT), 2, 1);
/// Is the triangle coded in the other orientation?
pub const REVERSED: Family = family(Some(ZIP), 2, 1);
/// Where a linked edge lies.
pub const LINK: Family = family(Some(REVERSED), 4, NUMBER_BINS);
/// Which earlier vertex is meant.
pub const BACK: Family = family(Some(LINK), 2, NUMBER_BINS);
/// Coordinates that nothing predicts.
pub const LONE: Family = family(Some(BACK), 6, NUMBER_BINS);
/// Residuals of predicted coordinates.
pub const RESIDUAL: Family = family(Some(LONE), 4 * 3 * 64, NUMBER_BINS);
/// Is a coordinate one of those that repeat?
pub const LISTED: Family = family(Some(RESIDUAL), 3 * 3 * 8 * 8, 1);
/// Which of them it is, from the one nearest to the prediction.
pub const STEP: Family = family(Some(LISTED), 3 * 64, NUMBER_BINS);
/// The repeated coordinates.
pub const LIST: Family = family(Some(STEP), 2, NUMBER_BINS);
/// Which vertex of an earlier chunk is meant.
pub const REFERENCE: Family = family(Some(LIST), 3, NUMBER_BINS);
/// Runs of triangles of one component.
pub const LABEL: Family = family(Some(REFERENCE), 3, NUMBER_BINS);
/// The numbers that triangles and vertices had.
pub const NUMBER: Family = family(Some(LABEL), 2 * 36 + 1, NUMBER_BINS);
/// Which corner of a triangle had been the first.
pub const TURN: Family = family(Some(NUMBER), 6, 1);
const LAST: Family = TURN;
/// Number of main contexts with their bins, of all families.
pub const FAST_SIZE: usize = (LAST.base + LAST.bins * LAST.mains) as usize;
/// Number of families.
pub const FAMILIES: usize = LAST.id as usize + 1;

/// Coarser contexts of a family.
pub const KINS: usize = 192;

/// Bins of a number: classes, signs, mantissas.
pub const NUMBER_BINS: u32 = 36 + 8 + 36 + 72;

/// What a decision is judged by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contexts {
    /// Index below the family's number of main contexts.
    pub main: u32,
    /// A coarser view, below [`KINS`]: what a main context that knows nothing yet starts from.
    pub kin: u32,
    /// Any numbers: further views, which the strong level hashes.
    pub more: [u32; MORE],
}

impl Contexts {
    /// The main context alone.
    pub fn of(main: u32) -> Contexts {
        Contexts {
            main,
            kin: 0,
            more: [main; MORE],
        }
    }
}

/// A probability that learns: fast at first, then slower.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    one: u16,
    seen: u16,
}

/// 65536 / (n + 1.6): the step when n bits were seen.
const RATE: [u16; 256] = rates();

const fn rates() -> [u16; 256] {
    let mut rates = [0; 256];
    let mut n = 0;
    while n < 256 {
        rates[n] = (655_360 / (10 * n + 16)) as u16;
        n += 1;
    }
    rates
}

impl Cell {
    /// Knows nothing.
    pub const NEW: Cell = Cell {
        one: 1 << (BITS - 1),
        seen: 0,
    };

    /// The probability of a 1, kept away from certainty.
    #[inline]
    pub fn one(self) -> u32 {
        u32::from(self.one).clamp(24, (1 << BITS) - 24)
    }

    /// Bits seen, up to the limit.
    #[inline]
    pub fn seen(self) -> u16 {
        self.seen
    }

    /// Starts from what a coarser context knows.
    #[inline]
    pub fn inherit(&mut self, kin: &Cell) {
        self.one = kin.one;
        self.seen = kin.seen.min(TRUST);
    }

    /// Learns a bit; `limit` bits are remembered, fewer than 256.
    #[inline]
    pub fn learn(&mut self, bit: bool, limit: u16) {
        let target = if bit { (1 << BITS) - 1 } else { 0 };
        let gap = target - i32::from(self.one);
        let step = gap * i32::from(RATE[self.seen as usize]);
        self.one = (i32::from(self.one) + (step >> BITS)) as u16;
        if self.seen < limit {
            self.seen += 1;
        }
    }
}

/// A level: how probabilities are had from contexts.
pub trait Model {
    /// True when the further contexts are looked at.
    const MIXES: bool;

    /// A model that knows nothing.
    fn new() -> Self;

    /// Codes one bit of a decision of `family`, at `bin` of its contexts; `kin`, below [`KINS`],
    /// is its place among the coarser contexts of the family.
    fn judge(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        bins: (u32, u32),
        contexts: &Contexts,
        bit: bool,
    ) -> bool;

    /// Codes a decision of one bit.
    fn bit(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        contexts: &Contexts,
        bit: bool,
    ) -> bool {
        self.judge(coder, family, (0, contexts.kin), contexts, bit)
    }

    /// A number and its sign. `start` is the class (bits of the magnitude) that is looked at
    /// first, `hint` (below 8) what is known of the sign.
    fn number(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        contexts: &Contexts,
        (start, hint): (u32, u32),
        value: i64,
    ) -> i64 {
        let size = self.size(coder, family, contexts, start, value.unsigned_abs());
        if size == 0 {
            return 0;
        }
        // How large it is says which of two guesses it may be.
        let far = (67 - size.leading_zeros())
            .saturating_sub(start.min(34))
            .min(6);
        let bins = (36 + hint, 72 + far);
        let minus = self.judge(coder, family, bins, contexts, value < 0);
        if minus { -(size as i64) } else { size as i64 }
    }

    /// A number of up to 64 bits and its sign; most are small. The second of `mains` is the context
    /// that says whether it is not.
    fn step(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        mains: (u32, u32),
        start: u32,
        value: i64,
    ) -> i64 {
        let far = value.unsigned_abs() >> 34 != 0;
        if self.bit(coder, family, &Contexts::of(mains.1), far) {
            let [high, low] = [value as u64 >> 32, value as u64 & 0xffff_ffff];
            let high = coder.plain(32, high);
            return (high << 32 | coder.plain(32, low)) as i64;
        }
        self.number(coder, family, &Contexts::of(mains.0), (start, 0), value)
    }

    /// A number without sign.
    fn size(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        contexts: &Contexts,
        start: u32,
        value: u64,
    ) -> u64 {
        let truth = 64 - value.leading_zeros();
        let mut class = start.min(34);
        // What a class means depends on where the start is: so do the coarser contexts.
        let far = move |class: u32| class + 35 - start.min(34);
        let above = |class: u32| (class, far(class));
        if self.judge(coder, family, above(class), contexts, truth > class) {
            class += 1;
            while class < 35 && self.judge(coder, family, above(class), contexts, truth > class) {
                class += 1;
            }
        } else {
            while class > 0
                && !self.judge(coder, family, above(class - 1), contexts, truth > class - 1)
            {
                class -= 1;
            }
        }
        if class < 2 {
            return u64::from(class);
        }
        // The two bits below the leading one have contexts, the others hardly need any.
        let below = class - 1;
        let bit = |i: u32| value >> i & 1 == 1;
        let bins = (44 + class, 80 + far(class));
        let first = self.judge(coder, family, bins, contexts, bit(below - 1));
        let mut back = 2 | u64::from(first);
        if below > 1 {
            let bins = (80 + 2 * class + u32::from(first), 160 + u32::from(first));
            let second = self.judge(coder, family, bins, contexts, bit(below - 2));
            back = back << 1 | u64::from(second);
        }
        if below > 2 {
            let rest = below - 2;
            back = back << rest | coder.plain(rest, value & ((1 << rest) - 1));
        }
        back
    }
}

/// A cell that inherited counts as having seen so many bits.
const TRUST: u16 = 3;
/// A cell that has seen so many bits no longer teaches its kin.
const INHERITS: u16 = 40;

/// One context a bit.
#[derive(Debug)]
pub struct Fast {
    cells: Vec<Cell>,
    kin: Vec<Cell>,
}

/// How many bits a fast context remembers.
const FAST_LIMIT: u16 = 160;

impl Model for Fast {
    const MIXES: bool = false;

    fn new() -> Fast {
        Fast {
            cells: vec![Cell::NEW; FAST_SIZE],
            kin: vec![Cell::NEW; FAMILIES * KINS],
        }
    }

    #[inline]
    fn judge(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        (bin, kin): (u32, u32),
        contexts: &Contexts,
        bit: bool,
    ) -> bool {
        let cell = &mut self.cells[family.place(contexts.main, bin)];
        if cell.seen < INHERITS {
            let kin = &mut self.kin[family.kin(kin)];
            if cell.seen == 0 {
                cell.inherit(kin);
            }
            let bit = coder.code(cell.one(), bit);
            kin.learn(bit, FAST_LIMIT);
            cell.learn(bit, FAST_LIMIT);
            return bit;
        }
        let bit = coder.code(cell.one(), bit);
        cell.learn(bit, FAST_LIMIT);
        bit
    }
}
