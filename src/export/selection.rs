//! Which components are meant: one type for every command that takes some of a folder.
//!
//! All conditions narrow. `largest` chooses last, among those that meet the others, and `invert`
//! takes what would be left out instead. A number that is not known (NaN: an area without finite
//! coordinates, a box without a finite vertex) meets no bound.
//!
//! Memory: a few words. I/O: none.

use crate::error::{Error, Result};
use crate::folder::{self, Folder, Row};
use std::ops::{Range, RangeInclusive};
use std::str::FromStr;

/// Numbers as people list them: `3`, `0,4,7-9`.
///
/// ```
/// use cornermill::export::Numbers;
/// let numbers: Numbers = "0,7-9".parse()?;
/// assert!(numbers.has(8) && !numbers.has(1));
/// assert!("9-7".parse::<Numbers>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbers(
    /// Ascending, with a gap between each two.
    Vec<RangeInclusive<u64>>,
);

impl Numbers {
    /// This number alone.
    pub fn one(number: u64) -> Numbers {
        Numbers(vec![number..=number])
    }

    fn merged(mut ranges: Vec<RangeInclusive<u64>>) -> Numbers {
        ranges.sort_unstable_by_key(|range| *range.start());
        let mut merged: Vec<RangeInclusive<u64>> = Vec::new();
        for range in ranges {
            match merged.last_mut() {
                Some(last) if *range.start() <= last.end().saturating_add(1) => {
                    *last = *last.start()..=*last.end().max(range.end());
                }
                _ => merged.push(range),
            }
        }
        Numbers(merged)
    }

    /// True when the number is listed.
    pub fn has(&self, number: u64) -> bool {
        let at = self.0.partition_point(|range| *range.start() <= number);
        at > 0 && *self.0[at - 1].end() >= number
    }

    /// True when a number of this range is listed.
    pub fn meets(&self, range: &Range<u64>) -> bool {
        let at = self.0.partition_point(|listed| *listed.start() < range.end);
        at > 0 && !range.is_empty() && *self.0[at - 1].end() >= range.start
    }

    /// The greatest number listed.
    pub fn greatest(&self) -> u64 {
        self.0.last().map_or(0, |range| *range.end())
    }
}

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Numbers, String> {
        let range = |part: &str| {
            let (from, to) = part.split_once('-').unwrap_or((part, part));
            let (from, to) = (from.trim().parse().ok()?, to.trim().parse().ok()?);
            (from <= to).then_some(from..=to)
        };
        let ranges: Option<Vec<_>> = text.split(',').map(range).collect();
        ranges
            .map(Numbers::merged)
            .ok_or_else(|| format!("'{text}' lists no numbers; write for example 0,4,7-9"))
    }
}

/// A box with sides along the axes, faces included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bbox {
    /// Smallest coordinates.
    pub min: [f64; 3],
    /// Largest coordinates.
    pub max: [f64; 3],
}

impl Bbox {
    /// True when a box lies within this one.
    fn holds(&self, min: [f64; 3], max: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= min[a] && max[a] <= self.max[a])
    }

    /// True when a box has a point in common with this one.
    fn meets(&self, min: [f64; 3], max: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= max[a] && min[a] <= self.max[a])
    }
}

impl FromStr for Bbox {
    type Err = String;

    fn from_str(text: &str) -> Result<Bbox, String> {
        let numbers = text.split(',').map(|x| x.trim().parse().ok());
        let numbers: Option<Vec<f64>> = numbers.collect();
        match numbers.as_deref() {
            Some(&[a, b, c, d, e, f]) if a <= d && b <= e && c <= f => Ok(Bbox {
                min: [a, b, c],
                max: [d, e, f],
            }),
            _ => Err(format!(
                "'{text}' is no box; write its smallest and its largest coordinates, \
                 for example 0,0,0,1,2.5,1"
            )),
        }
    }
}

/// Conditions on components; without any, everything is meant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Their numbers.
    pub components: Option<Numbers>,
    /// Fewest triangles.
    pub min_triangles: Option<u64>,
    /// Most triangles.
    pub max_triangles: Option<u64>,
    /// Least area.
    pub min_area: Option<f64>,
    /// Greatest area.
    pub max_area: Option<f64>,
    /// Least volume, whatever its sign.
    pub min_volume: Option<f64>,
    /// Greatest volume, whatever its sign.
    pub max_volume: Option<f64>,
    /// Every corner has an opposite, or not.
    pub closed: Option<bool>,
    /// Watertight, or not.
    pub watertight: Option<bool>,
    /// Orientable, or not.
    pub orientable: Option<bool>,
    /// Genus.
    pub genus: Option<Numbers>,
    /// The bounding box lies within this box.
    pub inside: Option<Bbox>,
    /// The bounding box has a point in common with this box.
    pub touching: Option<Bbox>,
    /// Those with the most triangles, this many; of equals the lower number.
    pub largest: Option<u64>,
    /// What would be left out is taken, and what would be taken left out.
    pub invert: bool,
}

impl Selection {
    /// True when there is no condition.
    pub fn is_empty(&self) -> bool {
        *self == Selection::default()
    }

    /// True when a component meets all conditions but that of being among the largest.
    pub fn meets(&self, component: u64, row: &Row) -> bool {
        let base = &row.base;
        let within = |x: f64, min: Option<f64>, max: Option<f64>| {
            min.is_none_or(|min| x >= min) && max.is_none_or(|max| x <= max)
        };
        let is = |verdict: u8, wanted: Option<bool>| wanted.is_none_or(|w| w == (verdict != 0));
        let listed = |number: Option<u64>, list: &Option<Numbers>| {
            let has = |list: &Numbers| number.is_some_and(|number| list.has(number));
            list.as_ref().is_none_or(has)
        };
        let triangles = base.triangles;
        let (min, max) = (base.bbox_min, base.bbox_max);
        listed(Some(component), &self.components)
            && self.min_triangles.is_none_or(|least| triangles >= least)
            && self.max_triangles.is_none_or(|most| triangles <= most)
            && within(base.area, self.min_area, self.max_area)
            && within(
                base.six_volume.abs() / 6.0,
                self.min_volume,
                self.max_volume,
            )
            && is(base.closed, self.closed)
            && is(base.watertight, self.watertight)
            && is(base.orientable, self.orientable)
            && listed(row.measures.map(|m| m.genus), &self.genus)
            && self.inside.is_none_or(|b| b.holds(min, max))
            && self.touching.is_none_or(|b| b.meets(min, max))
    }

    /// What makes no sense on this folder is refused before anything is read.
    pub(super) fn check(&self, folder: &Folder) -> Result<()> {
        let manifest = folder.manifest();
        let components = manifest.counts.components;
        let refuse = |what: String| Err(Error::Usage(what));
        if self.is_empty() {
            return Ok(());
        }
        if components == 0 {
            return refuse("the mesh has no component to choose; leave the selection out".into());
        }
        if let Some(last) = self.components.as_ref().map(Numbers::greatest)
            && last >= components
        {
            return refuse(format!(
                "there is no component {last}: the mesh has {components}, numbered 0 to {}",
                components - 1
            ));
        }
        if self.largest == Some(0) {
            return refuse("--largest 0 asks for no component; give 1 or more".into());
        }
        if self.genus.is_some() && manifest.measures.is_none() {
            return refuse(format!(
                "{}: was built with --no-measures, so the genus of its components is not known; \
                 build it again without that",
                folder.path().display()
            ));
        }
        let bounds = [
            self.min_area,
            self.max_area,
            self.min_volume,
            self.max_volume,
        ];
        let placed =
            bounds.iter().any(Option::is_some) || self.inside.is_some() || self.touching.is_some();
        if placed && !folder.has(folder::G) {
            return refuse(
                "the folder has no coordinates (it was built from V alone), so nothing is known \
                 of areas, volumes and boxes"
                    .into(),
            );
        }
        if bounds.iter().flatten().any(|x| x.is_nan()) {
            return refuse("a bound of area or volume is not a number".into());
        }
        Ok(())
    }
}
