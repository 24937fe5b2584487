//! Volumes and areas for the oracle: plain `f64` sums, with how far off the program's exact sums on a
//! grid may be.

/// What the sign of a volume says, as far as plain floating point can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    Positive,
    Negative,
    Zero,
    /// Smaller than the rounding of the grid could make it: the program decides.
    Unclear,
}

/// The bounding box of the finite vertices.
pub struct Space {
    low: [f64; 3],
    pub extent: f64,
}

impl Space {
    pub fn of(positions: &[[f64; 3]]) -> Space {
        let finite = || positions.iter().filter(|p| is_finite(p));
        let edge = |i: usize, pick: fn(f64, f64) -> f64| finite().map(|p| p[i]).reduce(pick);
        let low = [0, 1, 2].map(|i| edge(i, f64::min).unwrap_or(0.0));
        let high = [0, 1, 2].map(|i| edge(i, f64::max).unwrap_or(0.0));
        let extent = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        Space { low, extent }
    }

    /// Six times the signed volume towards the low corner of the box, and how far off it may be.
    ///
    /// Moving one corner of a triangle moves the mixed product by the distance times the cross
    /// product of the other two, at most the box's diagonal times the edge between them. The grid
    /// moves each corner by a step or two; the rest is the rounding of this sum.
    pub fn six_volume(&self, corners: &[[[f64; 3]; 3]]) -> (f64, f64) {
        let from_low = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] - self.low[i]);
        let sum = corners.iter().map(|t| mixed_product(t.map(from_low))).sum();
        let edges: f64 = corners.iter().map(perimeter).sum();
        let rounding = corners.len() as f64 * self.extent.powi(3) * 1e-14;
        (
            sum,
            edges * self.extent * self.extent * 2f64.powi(-26) + rounding,
        )
    }

    /// The sign, or zero when every way of rounding to the grid gives exactly that.
    pub fn sign(&self, corners: &[[[f64; 3]; 3]]) -> Sign {
        let (sum, slack) = self.six_volume(corners);
        let on_grid = |round: fn(f64) -> f64| -> i128 {
            let step = 2f64.powi((self.extent / 2f64.powi(30)).log2().ceil() as i32);
            let cell = |p: [f64; 3]| [0, 1, 2].map(|i| round((p[i] - self.low[i]) / step) as i128);
            corners.iter().map(|t| mixed_product(t.map(cell))).sum()
        };
        if sum.abs() > slack {
            return if sum > 0.0 {
                Sign::Positive
            } else {
                Sign::Negative
            };
        }
        if self.extent == 0.0 || (on_grid(f64::round) == 0 && on_grid(f64::floor) == 0) {
            return Sign::Zero;
        }
        Sign::Unclear
    }
}

pub fn is_finite(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// (A x B) . C
fn mixed_product<T>([a, b, c]: [[T; 3]; 3]) -> T
where
    T: Copy + std::ops::Mul<Output = T> + std::ops::Sub<Output = T> + std::ops::Add<Output = T>,
{
    (a[1] * b[2] - a[2] * b[1]) * c[0]
        + (a[2] * b[0] - a[0] * b[2]) * c[1]
        + (a[0] * b[1] - a[1] * b[0]) * c[2]
}

fn perimeter([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    let length =
        |p: &[f64; 3], q: &[f64; 3]| [0, 1, 2].iter().map(|&i| (p[i] - q[i]).abs()).sum::<f64>();
    length(a, b) + length(b, c) + length(c, a)
}

pub fn area([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    let (p, q) = (
        [0, 1, 2].map(|i| b[i] - a[i]),
        [0, 1, 2].map(|i| c[i] - a[i]),
    );
    let cross =
        [0, 1, 2].map(|i| p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3]);
    // Scaled by the largest entry, since squares of far-out coordinates overflow.
    let largest = cross.iter().fold(0f64, |m, x| m.max(x.abs()));
    match largest {
        0.0 => 0.0,
        _ => {
            largest
                * cross
                    .iter()
                    .map(|x| (x / largest).powi(2))
                    .sum::<f64>()
                    .sqrt()
                / 2.0
        }
    }
}
