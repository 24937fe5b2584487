//! Which vertices are in use, and their numbers when the others are left out.
//!
//! The new number of a vertex is the count of marks before it: the count at the start of its
//! group of 512 bits, kept, and at most eight words counted on the spot.
//!
//! Memory: [`Used::bytes`]: N/8 bytes of marks and N/64 of counts. I/O: none.

/// Words under one count.
const GROUP: usize = 8;

pub(super) struct Used {
    marks: Vec<u64>,
    before: Vec<u64>,
}

impl Used {
    /// Memory for n vertices.
    pub(super) fn bytes(n: u64) -> u64 {
        let words = n.div_ceil(64);
        8 * (words + words.div_ceil(GROUP as u64))
    }

    pub(super) fn new(n: u64) -> Used {
        let words = n.div_ceil(64) as usize;
        Used {
            marks: vec![0; words],
            before: vec![0; words.div_ceil(GROUP)],
        }
    }

    pub(super) fn mark(&mut self, v: u64) {
        self.marks[(v / 64) as usize] |= 1 << (v % 64);
    }

    /// Marks what is not marked of the first n, and nothing else.
    pub(super) fn invert(&mut self, n: u64) {
        self.marks.iter_mut().for_each(|word| *word = !*word);
        if let Some(last) = self.marks.last_mut().filter(|_| !n.is_multiple_of(64)) {
            *last &= (1 << (n % 64)) - 1;
        }
    }

    pub(super) fn has(&self, v: u64) -> bool {
        self.marks[(v / 64) as usize] >> (v % 64) & 1 == 1
    }

    /// True when some vertex from `from` to before `to` is marked.
    pub(super) fn any(&self, from: u64, to: u64) -> bool {
        let words = &self.marks[(from / 64) as usize..to.div_ceil(64) as usize];
        let near = words.iter().any(|&w| w != 0);
        near && (from..to).any(|v| self.has(v))
    }

    /// Counts the marks, after the last of them; returns how many there are.
    pub(super) fn seal(&mut self) -> u64 {
        let mut sum = 0;
        for (group, before) in self.marks.chunks(GROUP).zip(&mut self.before) {
            *before = sum;
            sum += group.iter().map(|w| u64::from(w.count_ones())).sum::<u64>();
        }
        sum
    }

    /// Marks before v.
    pub(super) fn rank(&self, v: u64) -> u64 {
        let word = (v / 64) as usize;
        let group = word / GROUP;
        let whole = &self.marks[group * GROUP..word];
        let part = self.marks[word] & ((1 << (v % 64)) - 1);
        let near: u32 = whole.iter().map(|w| w.count_ones()).sum();
        self.before[group] + u64::from(near + part.count_ones())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_agree_with_counting() {
        for n in [1u64, 63, 64, 65, 512, 513, 3000] {
            let wanted = |v: u64| v * v % 7 < 3 || v.is_multiple_of(511);
            let mut used = Used::new(n);
            (0..n).filter(|&v| wanted(v)).for_each(|v| used.mark(v));
            assert_eq!(used.seal(), (0..n).filter(|&v| wanted(v)).count() as u64);
            for v in 0..n {
                assert_eq!(used.has(v), wanted(v));
                let before = (0..v).filter(|&u| wanted(u)).count() as u64;
                assert_eq!(used.rank(v), before, "{v} of {n}");
                for to in [v + 1, v + 2, v + 70].map(|to| to.min(n)) {
                    assert_eq!(used.any(v, to), (v..to).any(wanted), "{v} to {to}");
                }
            }
            used.invert(n);
            assert!((0..n).all(|v| used.has(v) != wanted(v)));
            assert_eq!(used.seal(), (0..n).filter(|&v| !wanted(v)).count() as u64);
            let held = 8 * (used.marks.len() + used.before.len());
            assert_eq!(Used::bytes(n), held as u64);
        }
    }
}
