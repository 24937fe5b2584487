//! Coordinates that are rounded to 4 bytes, and whether it may show.
//!
//! Why not each is told: every decimal such as 0.1 is rounded, by far less than anybody measures. It
//! shows where a mesh lies far from the origin, as surveys do: what 4 bytes tell apart there may be
//! coarser than its triangles.
//!
//! Memory: none beyond itself.

/// A mesh is told of when so many of the steps that 4 bytes have would not cross it.
const STEPS: f64 = 16_384.0;

/// The box of what was rounded.
#[derive(Clone, Copy, Debug)]
pub struct Rounded {
    low: [f32; 3],
    high: [f32; 3],
}

impl Default for Rounded {
    /// Nothing was.
    fn default() -> Rounded {
        Rounded {
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
        }
    }
}

impl Rounded {
    /// Sees a vertex.
    #[inline]
    pub fn see(&mut self, at: [f32; 3]) {
        for ((low, high), c) in self.low.iter_mut().zip(&mut self.high).zip(at) {
            if c.is_finite() {
                *low = low.min(c);
                *high = high.max(c);
            }
        }
    }

    /// What is to be told, if anything.
    pub fn told(&self) -> Option<String> {
        let axes = || self.low.iter().zip(&self.high).filter(|(l, h)| l <= h);
        let extent = axes().map(|(&l, &h)| f64::from(h) - f64::from(l));
        let extent = extent.fold(0.0, f64::max);
        let far = axes()
            .map(|(l, h)| l.abs().max(h.abs()))
            .fold(0.0, f32::max);
        let step = f64::from(far) - f64::from(far.next_down());
        (extent > 0.0 && step * STEPS > extent).then(|| {
            format!(
                "coordinates are stored in 4 bytes, which are {step} apart at {far}, and the mesh is \
                 {extent} across: --coords f8 keeps more of what the input says"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(points: &[[f32; 3]]) -> Option<String> {
        let mut rounded = Rounded::default();
        points.iter().for_each(|&at| rounded.see(at));
        rounded.told()
    }

    #[test]
    fn meshes_far_from_the_origin_are_told() {
        // At 4,000,000 the steps are a quarter.
        let text = told(&[[4e6, 0.0, 0.0], [4_001_000.0, 3.0, f32::NAN]]).expect("a note");
        assert!(text.contains("0.25 apart at 4001000") && text.contains("1000 across"));
        assert!(told(&[[-4e6, 0.0, 0.0], [-3_999_000.0, 0.0, 0.0]]).is_some());
        assert_eq!(told(&[[4e6, 0.0, 0.0], [4_005_000.0, 0.0, 0.0]]), None);
        assert_eq!(told(&[[0.1, 0.2, 0.3], [1e-3, 0.0, 0.5]]), None);
        assert_eq!(told(&[[7e8, 1.0, 1.0]; 2]), None, "it has no extent");
        assert_eq!(told(&[]), None);
    }
}
