//! Binary range coder: a stream of bits, each with its probability, as bytes and back.
//!
//! Why it works: the coder keeps an interval of numbers, and each bit keeps that part of it whose
//! width is the bit's probability, so that the bytes naming the last interval are as many as the
//! bits were unlikely. The upper bytes leave as they settle; a byte that a later carry may still
//! raise is held back, with the count of 255s behind it.
//!
//! Memory: the bytes written, which the caller bounds. O(1) time a bit, integers only.

/// Bits of a probability.
pub const BITS: u32 = 16;
/// The interval is widened when it is narrower than this.
const NARROW: u32 = 1 << 24;

/// One side of the codec. Both sides run the same code: the encoder is told each bit and hands
/// it back, the decoder ignores what it is told and hands back what the stream says.
pub trait Coder {
    /// Codes one bit; `one` is the probability of a 1 in 65536ths, from 1 to 65535.
    fn code(&mut self, one: u32, bit: bool) -> bool;

    /// What the bits so far cost, in 65536ths of a bit: the encoder's; else 0.
    fn spent(&self) -> u64 {
        0
    }

    /// Codes the low `count` bits of a value, all values as likely as each other.
    fn plain(&mut self, count: u32, value: u64) -> u64 {
        let mut back = 0;
        for i in (0..count).rev() {
            let bit = self.code(1 << (BITS - 1), value >> i & 1 == 1);
            back = back << 1 | u64::from(bit);
        }
        back
    }
}

/// The writing side.
#[derive(Debug)]
pub struct Encoder {
    low: u64,
    range: u32,
    held: u8,
    pending: u64,
    out: Vec<u8>,
    spent: u64,
    costs: Vec<u32>,
}

impl Encoder {
    /// A new stream, appended to `out`.
    pub fn new(out: Vec<u8>) -> Encoder {
        Encoder {
            low: 0,
            range: u32::MAX,
            held: 0,
            pending: 0,
            out,
            spent: 0,
            // Told to people, never to a decoder: so floating point will do.
            costs: (0..4096)
                .map(|i| (-65_536.0 * ((f64::from(i) + 0.5) / 4096.0).log2()) as u32)
                .collect(),
        }
    }

    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        if self.low < 0xff00_0000 || carry == 1 {
            self.out.push(self.held.wrapping_add(carry));
            for _ in 0..self.pending {
                self.out.push(0xffu8.wrapping_add(carry));
            }
            self.pending = 0;
            self.held = (self.low >> 24) as u8;
        } else {
            self.pending += 1;
        }
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    /// Ends the stream, and hands back all bytes.
    pub fn finish(mut self) -> Vec<u8> {
        for _ in 0..5 {
            self.shift();
        }
        self.out
    }
}

impl Coder for Encoder {
    #[inline]
    fn code(&mut self, one: u32, bit: bool) -> bool {
        let bound = (self.range >> BITS) * one;
        let likely = if bit { one } else { (1 << BITS) - one };
        self.spent += u64::from(self.costs[(likely >> 4) as usize]);
        if bit {
            self.range = bound;
        } else {
            self.low += u64::from(bound);
            self.range -= bound;
        }
        while self.range < NARROW {
            self.range <<= 8;
            self.shift();
        }
        bit
    }

    fn spent(&self) -> u64 {
        self.spent
    }
}

/// The reading side. Behind the end of the bytes it reads zeros, and says so when asked.
#[derive(Debug)]
pub struct Decoder<'a> {
    bytes: &'a [u8],
    at: usize,
    range: u32,
    code: u32,
}

impl<'a> Decoder<'a> {
    /// Reads the stream that begins at the first of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Decoder<'a> {
        let mut decoder = Decoder {
            bytes,
            at: 0,
            range: u32::MAX,
            code: 0,
        };
        for _ in 0..5 {
            decoder.shift();
        }
        decoder
    }

    #[inline]
    fn shift(&mut self) {
        let byte = self.bytes.get(self.at).copied().unwrap_or(0);
        self.at += 1;
        self.code = self.code << 8 | u32::from(byte);
    }

    /// True when more was read than there is: the stream was cut short, or is none of ours.
    pub fn overran(&self) -> bool {
        self.at > self.bytes.len()
    }

    /// True when exactly all bytes were read.
    pub fn ended(&self) -> bool {
        self.at == self.bytes.len()
    }
}

impl Coder for Decoder<'_> {
    #[inline]
    fn code(&mut self, one: u32, _: bool) -> bool {
        let bound = (self.range >> BITS) * one;
        let bit = self.code < bound;
        if bit {
            self.range = bound;
        } else {
            self.code -= bound;
            self.range -= bound;
        }
        while self.range < NARROW {
            self.range <<= 8;
            self.shift();
        }
        bit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits with their probabilities, from a small generator of its own.
    fn bits(n: usize, seed: u64) -> Vec<(u32, bool)> {
        let mut x = seed;
        let mut next = || {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            x
        };
        let bit = |_| {
            let one = match next() % 4 {
                0 => 1,
                1 => 65_535,
                _ => (next() % 65_535 + 1) as u32,
            };
            (one, next() % 65_536 < u64::from(one))
        };
        (0..n).map(bit).collect()
    }

    #[test]
    fn any_bits_come_back_and_all_bytes_are_read() {
        // Miri takes a thousand times as long.
        let seeds = if cfg!(miri) { 4 } else { 200 };
        for seed in 1..seeds {
            let bits = bits(seed as usize * 37 % 3000, seed);
            let mut encoder = Encoder::new(Vec::new());
            for &(one, bit) in &bits {
                encoder.code(one, bit);
            }
            let bytes = encoder.finish();
            let mut decoder = Decoder::new(&bytes);
            for &(one, bit) in &bits {
                assert_eq!(decoder.code(one, !bit), bit);
            }
            assert!(decoder.ended(), "seed {seed}");
        }
    }

    #[test]
    fn carries_run_through_held_bytes() {
        // Unlikely zeros drive the low end up to the edge of a carry again and again.
        let mut encoder = Encoder::new(Vec::new());
        let bits: Vec<bool> = (0..20_000).map(|i| i % 97 == 0 || i % 3 == 1).collect();
        for (i, &bit) in bits.iter().enumerate() {
            encoder.code(if i % 5 == 0 { 65_535 } else { 40_000 }, bit);
        }
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes);
        for (i, &bit) in bits.iter().enumerate() {
            let one = if i % 5 == 0 { 65_535 } else { 40_000 };
            assert_eq!(decoder.code(one, false), bit, "bit {i}");
        }
    }

    #[test]
    fn skewed_bits_cost_what_they_should() {
        let mut encoder = Encoder::new(Vec::new());
        for _ in 0..100_000 {
            encoder.code(65_000, true);
        }
        // 100,000 x log2(65536 / 65000) bits are 148 bytes.
        assert!(encoder.finish().len() < 160);
        let short = Decoder::new(&[1, 2, 3]);
        assert!(short.overran());
    }
}
