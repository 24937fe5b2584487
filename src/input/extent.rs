//! Where the faces of a file lie, between other rows whose bytes nobody states.
//!
//! Why halving finds it: all rows of an element follow each other, so from a place within the faces
//! there is one change to each side, and a glance at a place tells on which side of it that is. A
//! place within the faces is an end of the file, unless other rows lie on both sides: then some are
//! tried.
//!
//! Memory: none. I/O: a glance each time.

use super::sample::PART;
use crate::error::Result;
use std::ops::Range;

/// Places that are tried for faces.
const PLACES: u64 = 64;

/// Where faces lie `within` a range of bytes, each end at most two parts too far out; other rows are
/// `before` and `behind` them, or not. All of it, where no faces are found.
///
/// # Errors
/// Those of `faces`, which tells whether the rows at a byte are faces.
pub(super) fn extent(
    within: Range<u64>,
    [before, behind]: [bool; 2],
    mut faces: impl FnMut(u64) -> Result<bool>,
) -> Result<Range<u64>> {
    let inside = match (before, behind) {
        (_, false) => within.end,
        (false, true) => within.start,
        (true, true) => {
            let step = (within.end - within.start) / PLACES;
            let mut places = (0..PLACES).map(|i| within.start + i * step + step / 2);
            loop {
                match places.next() {
                    Some(place) if faces(place)? => break place,
                    Some(_) => {}
                    None => return Ok(within),
                }
            }
        }
    };
    let mut found = within;
    if before {
        found.start = halve(found.start..inside, &mut faces)?.start;
    }
    if behind {
        found.end = halve(inside..found.end, |at| Ok(!faces(at)?))?.end;
    }
    Ok(found)
}

/// Where the answer becomes yes.
fn halve(
    Range { mut start, mut end }: Range<u64>,
    mut yes: impl FnMut(u64) -> Result<bool>,
) -> Result<Range<u64>> {
    while end.saturating_sub(start) > 2 * PART {
        let middle = start + (end - start) / 2;
        if yes(middle)? {
            end = middle;
        } else {
            start = middle;
        }
    }
    Ok(start..end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_found_at_an_end_and_in_the_middle() {
        let length = 1 << 30;
        for faces in [0..length, 0..7 << 20, 9 << 26..length, 5 << 20..40 << 20] {
            let beside = [faces.start > 0, faces.end < length];
            let found = extent(0..length, beside, |at| Ok(faces.contains(&at))).unwrap();
            let off = [faces.start - found.start, found.end - faces.end];
            assert!(off.iter().all(|&n| n <= 2 * PART), "{faces:?}: {found:?}");
        }
        let none = extent(3..length, [true, true], |_| Ok(false)).unwrap();
        assert_eq!(none, 3..length);
    }
}
