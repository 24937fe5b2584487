//! Keyed hashes, and keyed bijections of `0..n` in constant memory.
//!
//! Why [`Permutation`] is a bijection: on words of b bits, multiplying by an odd number, adding a
//! constant and `x ^= x >> s` are each invertible, so their composition permutes `0..2^b`. Walking the
//! cycle of x until it comes back below n restricts it to `0..n`: distinct starts below n end in
//! distinct places. As 2^b < 2n, a walk has fewer than two steps on average.

/// A well-mixed 64-bit hash of `x` under `key`.
pub fn mix(key: u64, x: u64) -> u64 {
    let mut h = (x ^ key.rotate_left(32)).wrapping_add(key) ^ 0x9E37_79B9_7F4A_7C15;
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h = (h ^ (h >> 29)).wrapping_mul(0xA24B_AED4_963E_E407);
    h ^ (h >> 32)
}

/// A number in `0.0..1.0` from a hash.
pub fn unit(hash: u64) -> f64 {
    (hash >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

const ROUNDS: usize = 4;

/// A keyed bijection of `0..n`; see the module.
#[derive(Clone, Debug)]
pub struct Permutation {
    n: u64,
    mask: u64,
    shift: u32,
    times: [u64; ROUNDS],
    inverse: [u64; ROUNDS],
    plus: [u64; ROUNDS],
}

impl Permutation {
    /// The bijection of `0..n` that belongs to `key`.
    pub fn new(n: u64, key: u64) -> Permutation {
        let bits = u64::BITS - n.saturating_sub(1).leading_zeros();
        let times: [u64; ROUNDS] =
            std::array::from_fn(|r| mix(key, 2 * r as u64).rotate_left(17) | 1);
        Permutation {
            n,
            mask: if bits == 0 {
                0
            } else {
                u64::MAX >> (64 - bits)
            },
            // At least half of the bits, so that the shift undoes itself.
            shift: bits.div_ceil(2).max(1),
            times,
            inverse: times.map(inverse_of_odd),
            plus: std::array::from_fn(|r| mix(key, 2 * r as u64 + 1)),
        }
    }

    /// The image of `x < n`.
    pub fn apply(&self, mut x: u64) -> u64 {
        debug_assert!(x < self.n);
        loop {
            for r in 0..ROUNDS {
                x = x.wrapping_mul(self.times[r]).wrapping_add(self.plus[r]) & self.mask;
                x ^= x >> self.shift;
            }
            if x < self.n {
                return x;
            }
        }
    }

    /// The `x` whose image is `y < n`.
    pub fn invert(&self, mut y: u64) -> u64 {
        debug_assert!(y < self.n);
        loop {
            for r in (0..ROUNDS).rev() {
                y ^= y >> self.shift;
                y = y.wrapping_sub(self.plus[r]).wrapping_mul(self.inverse[r]) & self.mask;
            }
            if y < self.n {
                return y;
            }
        }
    }
}

/// The inverse of an odd number modulo 2^64: each step of Newton's iteration doubles the right bits.
fn inverse_of_odd(a: u64) -> u64 {
    let mut x = a;
    for _ in 0..5 {
        x = x.wrapping_mul(2u64.wrapping_sub(a.wrapping_mul(x)));
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_small_domain_is_permuted_and_undone() {
        for n in 1..600 {
            let p = Permutation::new(n, n * 7 + 3);
            let mut seen = vec![false; n as usize];
            for x in 0..n {
                let y = p.apply(x);
                assert!(
                    !std::mem::replace(&mut seen[y as usize], true),
                    "{n}: {y} twice"
                );
                assert_eq!(p.invert(y), x);
            }
        }
    }

    #[test]
    fn large_domains_are_undone() {
        for n in [(1 << 32) - 1, (1 << 33) + 5, 3 << 40] {
            let p = Permutation::new(n, 1);
            for x in (0..1000).map(|i| i * (n / 1000)) {
                assert_eq!(p.invert(p.apply(x)), x);
            }
        }
    }

    #[test]
    fn neighbours_are_scattered() {
        let n = 1_000_003;
        let p = Permutation::new(n, 42);
        let near = (1..n)
            .filter(|&x| p.apply(x).abs_diff(p.apply(x - 1)) < n / 100)
            .count();
        // Two random places are nearer than n/100 with a probability of 2 %.
        assert!((15_000..25_000).contains(&near), "{near}");
    }
}
