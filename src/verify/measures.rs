//! Volumes, areas and boxes of components, against sums of this check's own.
//!
//! The folder's volumes are exact sums over coordinates rounded to a grid of 2^30 steps over
//! the mesh's box; the sums here are floating sums over the coordinates as they are. How far
//! they may lie apart is bounded: let h be the grid step, A the area, E the length of the
//! sides without an opposite, S that of all sides, T the triangles, all in units of the
//! largest extent. Moving each vertex by at most h changes six times the volume by at most
//! 6 h A within the surface, h times the diagonal for each unit of a side that no other
//! triangle balances, 3 h^2 S and 8 T h^3 in higher orders. Twice that is allowed, and 2^-40
//! of the area for rounding. Areas are sums over the coordinates as they are, each triangle's
//! rounded to a fixed step: 2^-40 of the area, 2^-48 S for what cancels in a thin triangle,
//! and 2^-50 T for the step are allowed. Boxes are exact.
//!
//! Memory, I/O: none.

use super::coords::Frame;
use super::tally::Tally;
use super::verdict::{At, Check, Findings};
use crate::folder::{COMPONENTS, ComponentRow};

/// The grid step in units of the largest extent: 2^-30.
const STEP: f64 = 1.0 / (1u64 << 30) as f64;
/// The diagonal of a unit cube, rounded up.
const DIAGONAL: f64 = 1.733;

/// Checks the measures of a component; `tight` says that it is watertight.
pub(super) fn check(
    findings: &Findings,
    label: u64,
    row: &ComponentRow,
    tally: &Tally,
    frame: Option<&Frame>,
    tight: bool,
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
            let (own, slack) = (tally.volume.value(), volume_slack(tally, tight));
            if let Some(expected) = apart(volume, own, slack, frame, 3) {
                say("six_volume", volume, expected);
            }
            let (own, slack) = (tally.area.value(), area_slack(tally));
            if let Some(expected) = apart(area, own, slack, frame, 2) {
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
                found == own
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

fn volume_slack(tally: &Tally, tight: bool) -> f64 {
    let (area, sides) = (tally.area.value(), tally.sides.value());
    // Sides balance each other only in a consistent orientation.
    let open = match (tally.disagree > 0, tight) {
        (true, _) => sides,
        (false, true) => 0.0,
        (false, false) => tally.seams.value(),
    };
    let first = 6.0 * area + DIAGONAL * open;
    let second = 3.0 * sides + 8.0 * tally.triangles as f64 * STEP;
    2.0 * STEP * (first + STEP * second) + area * 2f64.powi(-40)
}

fn area_slack(tally: &Tally) -> f64 {
    let thin = tally.sides.value() * 2f64.powi(-48);
    tally.area.value() * 2f64.powi(-40) + thin + tally.triangles as f64 * 2f64.powi(-50)
}

/// None when `found` is `own` within `slack`, both in units of the largest extent to the
/// given power; else what was expected.
fn apart(found: f64, own: f64, slack: f64, frame: &Frame, powers: u32) -> Option<String> {
    let (least, most) = (
        frame.scale(own - slack, powers),
        frame.scale(own + slack, powers),
    );
    // What is too large or too small for the type may have been rounded on another way.
    let widen = |x: f64, by: f64| {
        let x = x.clamp(-f64::MAX, f64::MAX);
        x + by * (x.abs() * 2f64.powi(-40) + f64::MIN_POSITIVE)
    };
    let fits = found >= widen(least, -1.0) && found <= widen(most, 1.0)
        || found.is_infinite() && (found == least || found == most);
    let middle = frame.scale(own, powers);
    let around = frame.scale(slack, powers);
    (!fits).then(|| format!("{middle:e} within {around:e}"))
}
