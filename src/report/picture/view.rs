//! Where the viewer stands, and where a position of the mesh falls in the image.
//!
//! Projection is orthographic. A position becomes three integers: right and down in the image,
//! and depth away from the viewer, in units of 2^-14 of a sample ([`FRACTION`] bits).
//!
//! Why integers: all triangles at a vertex get the same three, from its coordinates alone, so
//! that edges which two triangles share are the same edge to both, and what decides whether a
//! sample lies within is exact ([`facet`](super::facet)).
//!
//! Memory: a few words. I/O: none.

use crate::error::{Error, Result};

/// Bits of a coordinate below a whole sample.
pub(super) const FRACTION: u32 = 14;
/// Coordinates in the image stay within ± 2^28, which 16384 samples fill; depth within 2^29.
const MOST: f64 = (1u64 << 28) as f64;
/// Depth of the nearest position, in samples: room in front of it for lines that are drawn nearer
/// than the surface.
const FRONT_ROOM: f64 = 64.0;
/// The deepest that is not clamped.
const MOST_DEPTH: f64 = (1u64 << 29) as f64;
/// Part of the image that stays empty at each side.
const MARGIN: f64 = 0.04;

/// Where [`View::Iso`] is seen from: parts of right, front and up.
const ISO: [f64; 3] = [0.8, 1.2, 0.7];

/// Where the viewer stands, seen from the middle of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum View {
    /// In front: towards +Z when +Y is up, towards -Y when +Z is up.
    Front,
    /// Behind.
    Back,
    /// To the left of one who stands in front.
    Left,
    /// To the right.
    Right,
    /// Above.
    Top,
    /// Below.
    Bottom,
    /// In front, to the right and above, in unequal parts, so that the faces of a box differ in
    /// shade.
    #[default]
    Iso,
    /// In this direction from the mesh.
    From([f64; 3]),
}

/// The names of the views that have one.
const NAMED: [(&str, View); 7] = [
    ("front", View::Front),
    ("back", View::Back),
    ("left", View::Left),
    ("right", View::Right),
    ("top", View::Top),
    ("bottom", View::Bottom),
    ("iso", View::Iso),
];

impl std::str::FromStr for View {
    type Err = Error;

    /// A name, or a direction `X,Y,Z`.
    fn from_str(text: &str) -> Result<View> {
        if let Some((_, view)) = NAMED.iter().find(|(name, _)| *name == text) {
            return Ok(*view);
        }
        direction(text).map(View::From).map_err(|_| {
            Error::Usage(format!(
                "view '{text}': expected front, back, left, right, top, bottom, iso, or a \
                 direction X,Y,Z from the mesh to the viewer"
            ))
        })
    }
}

/// Reads a direction `X,Y,Z`.
///
/// # Errors
/// [`Error::Usage`] unless it is three finite numbers that are not all 0.
pub fn direction(text: &str) -> Result<[f64; 3]> {
    let parts: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    match parts.as_deref() {
        Some(&[x, y, z]) if unit([x, y, z]).is_some() => Ok([x, y, z]),
        _ => Err(Error::Usage(format!(
            "direction '{text}': expected three finite numbers X,Y,Z, not all 0"
        ))),
    }
}

/// Three directions at right angles: right and up in the image, and towards the viewer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    right: [f64; 3],
    up: [f64; 3],
    toward: [f64; 3],
}

impl Frame {
    /// The directions of a view, for a mesh whose top is `up`.
    ///
    /// # Errors
    /// [`Error::Usage`] when a direction is none.
    pub(super) fn new(view: View, up: [f64; 3]) -> Result<Frame> {
        let none = || Error::Usage("a direction needs three finite numbers, not all 0".into());
        let up = unit(up).ok_or_else(none)?;
        // The right hand of the viewer in front: +X unless that is up or down.
        let level = |v: [f64; 3]| unit(add(v, scaled(up, -dot(v, up))));
        let right = if up[0].abs() < 0.999 {
            level([1.0, 0.0, 0.0])
        } else {
            level([0.0, -1.0, 0.0])
        };
        let right = right.ok_or_else(none)?;
        let front = cross(right, up);
        let toward = match view {
            View::Front => front,
            View::Back => scaled(front, -1.0),
            View::Left => scaled(right, -1.0),
            View::Right => right,
            View::Top => up,
            View::Bottom => scaled(up, -1.0),
            View::Iso => {
                let side = add(scaled(right, ISO[0]), scaled(front, ISO[1]));
                unit(add(side, scaled(up, ISO[2]))).ok_or_else(none)?
            }
            View::From(from) => unit(from).ok_or_else(none)?,
        };
        // From straight above or below, the right hand stays where it was.
        let across = cross(up, toward);
        let right = if dot(across, across) < 1e-12 {
            right
        } else {
            unit(across).ok_or_else(none)?
        };
        Ok(Frame {
            right,
            up: cross(toward, right),
            toward,
        })
    }
}

/// Least and greatest of some coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
}

impl Bounds {
    /// Those of nothing.
    pub(super) const NOTHING: Bounds = Bounds {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// Takes a position in; coordinates that are no numbers change nothing.
    pub(super) fn add(&mut self, p: [f64; 3]) {
        self.join(&Bounds { min: p, max: p });
    }

    /// Takes in all that another has.
    pub(super) fn join(&mut self, other: &Bounds) {
        for k in 0..3 {
            self.min[k] = self.min[k].min(other.min[k]);
            self.max[k] = self.max[k].max(other.max[k]);
        }
    }

    /// True when they are finite and hold this position.
    #[inline]
    pub(super) fn hold(&self, p: [f64; 3]) -> bool {
        (0..3).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    pub(super) fn is_finite(&self) -> bool {
        self.min.iter().chain(&self.max).all(|x| x.is_finite())
    }
}

/// Positions on their way to the image, before it is known where in it they fall: turned to the
/// viewer, and scaled by a power of two so that no number is too large for what follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    frame: Frame,
    scale: f64,
    middle: [f64; 3],
}

impl Turn {
    /// For positions within the bounds, which are finite.
    pub(super) fn new(frame: Frame, bounds: &Bounds) -> Turn {
        let numbers = bounds.min.iter().chain(&bounds.max);
        let most = numbers.fold(0.0f64, |most, x| most.max(x.abs()));
        let power = if most > 0.0 {
            -most.log2().floor()
        } else {
            0.0
        };
        let scale = power.clamp(-1022.0, 1000.0).exp2();
        let middle = [0, 1, 2].map(|k| (bounds.min[k] * scale + bounds.max[k] * scale) / 2.0);
        Turn {
            frame,
            scale,
            middle,
        }
    }

    /// True when every direction of the view is along one of the mesh's axes.
    pub(super) fn along_axes(&self) -> bool {
        let straight = |v: [f64; 3]| v.iter().filter(|x| **x != 0.0).count() == 1;
        straight(self.frame.right) && straight(self.frame.up) && straight(self.frame.toward)
    }

    /// Right, down, and away from the viewer; not finite for a position that is not.
    #[inline]
    pub(super) fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        let q = [0, 1, 2].map(|k| p[k] * self.scale - self.middle[k]);
        let Frame { right, up, toward } = &self.frame;
        [dot(*right, q), -dot(*up, q), -dot(*toward, q)]
    }
}

/// A position in the image: right, down and depth, in 2^-14 samples.
pub(super) type Spot = [i32; 3];

/// What a position becomes that is not finite.
pub(super) const NOWHERE: Spot = [i32::MIN; 3];

/// The way from a position to its spot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    turn: Turn,
    scale: [f64; 3],
    offset: [f64; 3],
    /// What a unit of depth is, in units of right and down.
    pub(super) depth_unit: f64,
}

impl Projection {
    /// Fits positions, whose bounds after the turn are `turned`, into so many samples.
    pub(super) fn fit(turn: Turn, turned: &Bounds, samples: [u32; 2]) -> Projection {
        let extent = [0, 1, 2].map(|k| turned.max[k] - turned.min[k]);
        let room = samples.map(|n| f64::from(n) * (1.0 - 2.0 * MARGIN));
        let unit = f64::from(1 << FRACTION);
        let fits = |k: usize| {
            if extent[k] > 0.0 {
                room[k] / extent[k]
            } else {
                f64::MAX
            }
        };
        let mut scale = fits(0).min(fits(1)) * unit;
        if !scale.is_finite() {
            // A single spot, or a line straight away from the viewer.
            scale = unit;
        }
        let deep = MOST_DEPTH - 2.0 * FRONT_ROOM * unit;
        let depth_scale = if extent[2] > 0.0 {
            scale.min(deep / extent[2])
        } else {
            scale
        };
        let offset = |k: usize| {
            f64::from(samples[k]) / 2.0 * unit - (turned.min[k] + extent[k] / 2.0) * scale
        };
        Projection {
            turn,
            scale: [scale, scale, depth_scale],
            offset: [
                offset(0),
                offset(1),
                FRONT_ROOM * unit - turned.min[2] * depth_scale,
            ],
            depth_unit: scale / depth_scale,
        }
    }

    /// The spot of a position; [`NOWHERE`] when it is not finite.
    #[inline]
    pub(super) fn spot(&self, p: [f64; 3]) -> Spot {
        if !(p[0].is_finite() && p[1].is_finite() && p[2].is_finite()) {
            return NOWHERE;
        }
        let turned = self.turn.apply(p);
        // Only a damaged folder has positions beyond its bounds: they stay within what the
        // arithmetic of edges can hold.
        [0, 1, 2].map(|k| {
            let most = if k == 2 { MOST_DEPTH } else { MOST };
            let x = turned[k] * self.scale[k] + self.offset[k];
            (x + 0.5).floor().clamp(-MOST, most) as i32
        })
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] + b[k])
}

fn scaled(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|x| x * by)
}

/// The direction with length 1; `None` when it is none, or not finite.
fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let most = a.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if !(most.is_finite() && most > 0.0) || a.iter().any(|x| x.is_nan()) {
        return None;
    }
    let a = a.map(|x| x / most);
    Some(scaled(a, 1.0 / dot(a, a).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 3], b: [f64; 3]) -> bool {
        (0..3).all(|k| (a[k] - b[k]).abs() < 1e-12)
    }

    #[test]
    fn views_stand_where_their_names_say() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let minus = |v| scaled(v, -1.0);
        for (view, up, right, above, toward) in [
            (View::Front, y, x, y, z),
            (View::Back, y, minus(x), y, minus(z)),
            (View::Right, y, minus(z), y, x),
            (View::Left, y, z, y, minus(x)),
            (View::Top, y, x, minus(z), y),
            (View::Bottom, y, x, z, minus(y)),
            (View::Front, z, x, z, minus(y)),
            (View::Right, z, y, z, x),
            (View::Top, z, x, y, z),
            (View::From([0.0, -3.0, 0.0]), z, x, z, minus(y)),
            (View::Front, x, minus(y), x, z),
        ] {
            let frame = Frame::new(view, up).unwrap();
            assert!(near(frame.right, right), "{view:?} {up:?}: {frame:?}");
            assert!(near(frame.up, above), "{view:?} {up:?}: {frame:?}");
            assert!(near(frame.toward, toward), "{view:?} {up:?}: {frame:?}");
        }
        assert!(Frame::new(View::From([0.0; 3]), y).is_err());
        assert!("sideways".parse::<View>().is_err());
        assert!("1,2".parse::<View>().is_err());
        assert!("1,nan,2".parse::<View>().is_err());
        assert_eq!(
            "1,-2, 3e1".parse::<View>().unwrap(),
            View::From([1.0, -2.0, 30.0])
        );
    }

    #[test]
    fn what_is_seen_lies_within_the_image_at_any_size() {
        for size in [1e-320, 1e-30, 1.0, 1e30, 1.7e308] {
            for shift in [0.0, 1.0, -0.9] {
                let bounds = Bounds {
                    min: [-size, -size / 2.0, size * shift / 2.0],
                    max: [size, size, size],
                };
                let turn = Turn::new(Frame::new(View::Iso, [0.0, 0.0, 1.0]).unwrap(), &bounds);
                let mut turned = Bounds::NOTHING;
                let corner =
                    |i: usize| [0, 1, 2].map(|k| [bounds.min[k], bounds.max[k]][i >> k & 1]);
                (0..8).for_each(|i| turned.add(turn.apply(corner(i))));
                assert!(turned.is_finite());
                let way = Projection::fit(turn, &turned, [300, 200]);
                for spot in (0..8).map(|i| way.spot(corner(i))) {
                    assert!((0..300 << FRACTION).contains(&spot[0]), "{size}: {spot:?}");
                    assert!((0..200 << FRACTION).contains(&spot[1]), "{size}: {spot:?}");
                    assert!((0..1 << 29).contains(&spot[2]), "{size}: {spot:?}");
                }
            }
        }
    }

    #[test]
    fn a_needle_keeps_its_depth_in_range() {
        let bounds = Bounds {
            min: [0.0; 3],
            max: [1e-6, 1e-6, 1.0],
        };
        let turn = Turn::new(Frame::new(View::Front, [0.0, 1.0, 0.0]).unwrap(), &bounds);
        let mut turned = Bounds::NOTHING;
        turned.add(turn.apply(bounds.min));
        turned.add(turn.apply(bounds.max));
        let way = Projection::fit(turn, &turned, [16384, 16384]);
        let (far, near) = (way.spot([0.0; 3])[2], way.spot([0.0, 0.0, 1.0])[2]);
        assert!(near > 0 && near < far && far < 1 << 29, "{near} {far}");
        assert!(way.depth_unit > 1.0);
        assert_eq!(way.spot([0.0, f64::NAN, 0.0]), NOWHERE);
    }
}
