//! How the corners of polygons and strips make triangles.
//!
//! A polygon v0 v1 v2 v3 is cut into its fan, v0 v1 v2 and v0 v2 v3. In a strip each corner from the
//! third on makes a triangle with the two before, every other one turned, so that all face alike;
//! [`RESTART`] begins a strip anew.
//!
//! Memory, I/O: none.

/// Stands between two strips of a list, where the file has -1.
pub(super) const RESTART: u64 = u64::MAX;

/// The corners of a strip seen last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Strip {
    before: u64,
    last: u64,
    corners: u64,
}

impl Strip {
    /// The triangle that the next corner of the strip makes.
    #[inline]
    pub fn corner(&mut self, v: u64) -> Option<[u64; 3]> {
        let [a, b] = match self.corners % 2 {
            0 => [self.before, self.last],
            _ => [self.last, self.before],
        };
        let makes = self.corners >= 2;
        *self = Strip {
            before: self.last,
            last: v,
            corners: self.corners + 1,
        };
        makes.then_some([a, b, v])
    }
}

/// Cuts a polygon.
pub(super) fn fan(corners: &[u64], into: &mut Vec<[u64; 3]>) {
    let pairs = corners.windows(2).skip(1);
    into.extend(pairs.map(|pair| [corners[0], pair[0], pair[1]]));
}

/// Cuts strips.
pub(super) fn strips(corners: &[u64], into: &mut Vec<[u64; 3]>) {
    for corners in corners.split(|&v| v == RESTART) {
        let mut strip = Strip::default();
        into.extend(corners.iter().filter_map(|&v| strip.corner(v)));
    }
}
