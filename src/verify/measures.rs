//! Volumes, areas and boxes of components, against sums of this check's own.
//!
//! Volumes are exact sums over coordinates rounded to a grid of 2^30 steps over the mesh's box, and
//! are summed here in the same way: every bit is right or wrong. So are boxes, whose zeros are +0.
//! An area has a square root for each triangle, which no rule of the format says how to round;
//! here it is a floating sum. Let S be the length of all sides and T the triangles, in units of the
//! largest extent: 2^-40 of the area, 2^-48 S for what cancels in a thin triangle, and 2^-50 T for
//! the step that each triangle's is rounded to are allowed.
//!
//! Memory, I/O: none.

use super::coords::Frame;
use super::tally::Tally;
use super::verdict::{At, Check, Findings};
use crate::folder::{COMPONENTS, ComponentRow};

/// Checks the measures of a component.
pub(super) fn check(
    findings: &Findings,
    label: u64,
    row: &ComponentRow,
    tally: &Tally,
    frame: Option<&Frame>,
) {
    let say = |what: &str, found: f64, expected: String| {
        let at = At::Component(label);
        findings.add(Check::ComponentTable, COMPONENTS, at, || {
            (format!("{what} is {found:e}"), expected)
        });
    };
    if tally.unmeasured > 0 {
        return;
    }
    let (volume, area) = (row.six_volume, row.area);
    match frame.filter(|_| tally.nonfinite == 0) {
        None => {
            for (what, found) in [("six_volume", volume), ("area", area)] {
                if !found.is_nan() {
                    let why = match frame {
                        None => "NaN (there are no coordinates)",
                        Some(_) => "NaN (a vertex is not finite)",
                    };
                    say(what, found, why.into());
                }
            }
        }
        Some(frame) => {
            let own = frame.volume(tally.volume.value());
            if volume.to_bits() != own.to_bits() {
                say("six_volume", volume, format!("{own:e}"));
            }
            if let Some(expected) = area_apart(area, tally, frame) {
                say("area", area, expected);
            }
        }
    }
    let (min, max) = (row.bbox_min, row.bbox_max);
    for axis in 0..3 {
        for (what, found, own) in [
            ("bbox_min", min[axis], tally.min[axis]),
            ("bbox_max", max[axis], tally.max[axis]),
        ] {
            // Infinite: no finite coordinate was seen.
            let same = if own.is_finite() {
                found.to_bits() == own.to_bits()
            } else {
                found.is_nan()
            };
            if !same {
                let own = if own.is_finite() { own } else { f64::NAN };
                say(&format!("{what}[{axis}]"), found, format!("{own:e}"));
            }
        }
    }
}

/// None when `found` is the area within what rounding may change; else what was expected.
fn area_apart(found: f64, tally: &Tally, frame: &Frame) -> Option<String> {
    let own = tally.area.value();
    let thin = tally.sides.value() * 2f64.powi(-48);
    let slack = own * 2f64.powi(-40) + thin + tally.triangles as f64 * 2f64.powi(-50);
    let (least, most) = (frame.square(own - slack), frame.square(own + slack));
    // What is too large or too small for the type may have been rounded on another way.
    let widen = |x: f64, by: f64| {
        let x = x.clamp(-f64::MAX, f64::MAX);
        x + by * (x.abs() * 2f64.powi(-40) + f64::MIN_POSITIVE)
    };
    let fits = found >= widen(least, -1.0) && found <= widen(most, 1.0)
        || found.is_infinite() && (found == least || found == most);
    let (middle, around) = (frame.square(own), frame.square(slack));
    (!fits).then(|| format!("{middle:e} within {around:e}"))
}
