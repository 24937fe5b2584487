//! Which component each triangle of a chunk is of: runs, in the order in which triangles are coded.
//!
//! Why runs: a walk leaves a component when it has coded all that hangs together of it in the
//! chunk, so a chunk has few more runs than components. A chunk of one component has no runs at
//! all; the index says which component it is.
//!
//! Memory: the bytes; a model. O(1) time a run.

use super::Damaged;
use super::model::{Contexts, Fast, LABEL, Model};
use super::range::{Coder, Decoder, Encoder};
use std::ops::Range;

/// Contexts of the lengths of runs, of steps from component to component, of steps that are far.
const LENGTH: u32 = 0;
const STEP: u32 = 1;
const FAR: u32 = 2;

/// The model, and the component of the run before.
struct State {
    model: Fast,
    last: u64,
}

impl State {
    fn new(first: u64) -> State {
        let model = Fast::new();
        State { model, last: first }
    }

    /// Codes a run: how many triangles, and of which component.
    fn code(&mut self, coder: &mut impl Coder, triangles: u64, component: u64) -> (u64, u64) {
        let (model, length) = (&mut self.model, Contexts::of(LENGTH));
        let triangles = model.size(coder, LABEL, &length, 8, triangles);
        let step = component.wrapping_sub(self.last) as i64;
        let step = model.step(coder, LABEL, (STEP, FAR), 1, step);
        self.last = self.last.wrapping_add(step as u64);
        (triangles, self.last)
    }
}

/// Codes the components of triangles, in their order; `first` is the least of them.
pub(super) fn encode(components: impl Iterator<Item = u64>, first: u64) -> Vec<u8> {
    let mut coder = Encoder::new(Vec::new());
    let mut state = State::new(first);
    let mut components = components.peekable();
    while let Some(component) = components.next() {
        let mut triangles = 1;
        while components.next_if_eq(&component).is_some() {
            triangles += 1;
        }
        state.code(&mut coder, triangles, component);
    }
    coder.finish()
}

/// Hands out the runs of a chunk, each as triangles and their component: so many triangles in all,
/// of components in this range.
///
/// # Errors
/// [`Damaged`] when the bytes are none that such triangles have.
pub(super) fn decode(
    bytes: &[u8],
    triangles: u64,
    components: &Range<u64>,
    mut each: impl FnMut(u64, u64),
) -> Result<(), Damaged> {
    let mut coder = Decoder::new(bytes);
    let mut state = State::new(components.start);
    let mut left = triangles;
    while left > 0 {
        let (run, component) = state.code(&mut coder, 0, 0);
        if run == 0 || run > left {
            return Err(Damaged("components of another number of triangles"));
        }
        if !components.contains(&component) {
            return Err(Damaged("a component that its entry does not name"));
        }
        each(run, component);
        left -= run;
    }
    if !coder.ended() {
        return Err(Damaged("another number of bytes than its components take"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn back(bytes: &[u8], triangles: u64, range: Range<u64>) -> Result<Vec<u64>, Damaged> {
        let mut all = Vec::new();
        decode(bytes, triangles, &range, |n, component| {
            all.extend((0..n).map(|_| component));
        })?;
        Ok(all)
    }

    #[test]
    fn components_come_back() {
        let far = 1 << 50;
        for components in [
            vec![7; 1000],
            vec![7, 8, 7, 7, 900, 8],
            (0..5000).map(|i| i * i % 97).collect(),
            vec![3, far, far, 5, 3 + (1 << 35), 4],
        ] {
            let [least, most] = [components.iter().min(), components.iter().max()];
            let range = *least.unwrap()..most.unwrap() + 1;
            let bytes = encode(components.iter().copied(), range.start);
            let n = components.len() as u64;
            assert_eq!(back(&bytes, n, range.clone()).unwrap(), components);
            for other in [n - 1, n + 1] {
                back(&bytes, other, range.clone()).unwrap_err();
            }
            back(&bytes, n, range.start + 1..range.end).unwrap_err();
            back(&bytes, n, range.start..range.end - 1).unwrap_err();
        }
    }

    #[test]
    fn a_component_costs_little() {
        let components = (0..1000u64).flat_map(|c| std::iter::repeat_n(c, 100 + c as usize % 7));
        let bytes = encode(components, 0);
        assert!(bytes.len() < 1000, "{}", bytes.len());
    }
}
