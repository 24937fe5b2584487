//! Coordinates to integers and back.
//!
//! Why nothing else is lost: integers are coded exactly, so what a decoder hands out are the nodes
//! of the grid nearest to the coordinates. The grid has one step for all axes: with `--bits` the
//! largest extent over 2^bits - 1, as Draco's quantisation has it. With `--exact` there is no grid:
//! the 32 bits of each coordinate are taken for an integer, turned so that order is kept.
//!
//! Memory: none. I/O: G once, to find its extent.

use super::file::Head;
use crate::disk::{DataFile, Workspace};
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::table::array::Coords;

/// What the user asked of the coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Precision {
    /// So many bits for the largest extent, 8 to 24.
    Bits(u32),
    /// A step of so many units.
    Step(f64),
    /// All bits of f4 coordinates.
    Exact,
}

/// How integers and coordinates belong together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grid {
    /// The mesh has no coordinates: all integers are 0.
    None,
    /// Nodes from `min` on, `step` apart.
    Nodes {
        /// The least coordinates.
        min: [f64; 3],
        /// The distance of nodes.
        step: f64,
    },
    /// The bits of f4 coordinates.
    Bits,
}

/// Rows of G that are read at a time.
const ROWS: u64 = 1 << 12;
/// Integers of a grid stay below this.
const MOST: f64 = (1u32 << 30) as f64;

impl Grid {
    /// The grid for the coordinates of `g`.
    ///
    /// # Errors
    /// [`Error::Usage`] when the precision and the coordinates do not go together;
    /// [`Error::Input`] for a coordinate that is no number, when there is a grid.
    pub(super) fn find(
        ws: &Workspace,
        g: Option<&(Coords, DataFile)>,
        vertices: u64,
        precision: Precision,
    ) -> Result<Grid> {
        match precision {
            Precision::Bits(bits) if !(8..=24).contains(&bits) => {
                let what = format!("--bits goes from 8 to 24, not {bits}");
                return Err(Error::Usage(what));
            }
            Precision::Step(step) if !(step.is_finite() && step > 0.0) => {
                let what = format!("--step must be above 0, not {step}");
                return Err(Error::Usage(what));
            }
            _ => {}
        }
        let Some((kind, file)) = g else {
            return Ok(Grid::None);
        };
        match precision {
            Precision::Exact if *kind == Coords::F8 => Err(Error::Usage(
                "--exact is for f4 coordinates, and these are f8; give --step, or build the \
                 folder with --coords f4"
                    .into(),
            )),
            Precision::Exact => Ok(Grid::Bits),
            _ => {
                let (min, extent) = extent(ws, *kind, file, vertices)?;
                let step = match precision {
                    Precision::Step(step) => step,
                    Precision::Bits(bits) => extent / f64::from((1u32 << bits) - 1),
                    Precision::Exact => 1.0,
                };
                // Of a mesh without extent any step will do.
                let step = if extent > 0.0 { step } else { 1.0 };
                if !extent.is_finite() || step <= 0.0 {
                    return Err(Error::Usage(format!(
                        "the largest extent, {extent}, is beyond what a grid in 8 bytes can cut \
                         up; scale the mesh"
                    )));
                }
                if extent / step >= MOST {
                    return Err(Error::Usage(format!(
                        "a step of {step} cuts the largest extent, {extent}, into more than 2^30 \
                         parts; give a larger one"
                    )));
                }
                Ok(Grid::Nodes { min, step })
            }
        }
    }

    /// The integers of row `i` of G.
    #[inline]
    pub(super) fn integers(&self, kind: Coords, rows: &[u8], i: usize) -> [i32; 3] {
        match self {
            Grid::None => [0; 3],
            Grid::Nodes { min, step } => {
                let row = kind.row(rows, i);
                std::array::from_fn(|k| ((row[k] - min[k]) / step + 0.5).floor() as i32)
            }
            Grid::Bits => std::array::from_fn(|k| {
                let mut bytes = [0; 4];
                bytes.copy_from_slice(&rows[12 * i + 4 * k..][..4]);
                ordered(u32::from_le_bytes(bytes))
            }),
        }
    }

    /// The coordinates of a vertex, appended as f4 or f8.
    pub fn restore(&self, wide: bool, at: [i32; 3], out: &mut Vec<u8>) {
        for (k, &x) in at.iter().enumerate() {
            match self {
                Grid::None => {}
                Grid::Bits => out.extend(disordered(x).to_le_bytes()),
                Grid::Nodes { min, step } => {
                    let place = min[k] + f64::from(x) * step;
                    if wide {
                        out.extend(place.to_le_bytes());
                    } else {
                        // Rounded, a coordinate near the largest may lie beyond it.
                        let place = place.clamp(f32::MIN.into(), f32::MAX.into());
                        out.extend((place as f32).to_le_bytes());
                    }
                }
            }
        }
    }

    /// The grid as a head has it: kind, least coordinates, step.
    pub fn to_head(self) -> (u8, [f64; 3], f64) {
        match self {
            Grid::None => (0, [0.0; 3], 0.0),
            Grid::Nodes { min, step } => (1, min, step),
            Grid::Bits => (2, [0.0; 3], 0.0),
        }
    }

    /// The grid of a head; `None` when it has none that is known.
    pub fn of_head(head: &Head) -> Option<Grid> {
        let step = head.step;
        match (head.grid, head.coords) {
            (0, 0) => Some(Grid::None),
            (1, 4 | 8) if step.is_finite() && step > 0.0 => Some(Grid::Nodes {
                min: head.min,
                step,
            }),
            (2, 4) => Some(Grid::Bits),
            _ => None,
        }
    }
}

/// The bits of an f4 as an integer that is larger when the number is.
fn ordered(bits: u32) -> i32 {
    let sign = (bits as i32) >> 31;
    (bits ^ ((sign as u32) >> 1)) as i32
}

fn disordered(x: i32) -> u32 {
    let sign = x >> 31;
    (x as u32) ^ ((sign as u32) >> 1)
}

/// Least coordinates and largest extent.
fn extent(ws: &Workspace, kind: Coords, file: &DataFile, vertices: u64) -> Result<([f64; 3], f64)> {
    let row = kind.row_bytes() as u64;
    let _lease = ws.budget.lease("a block of G", ROWS * row)?;
    let mut buf = vec![0; (ROWS * row) as usize];
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut from = 0;
    while from < vertices {
        let n = ROWS.min(vertices - from);
        let bytes = &mut buf[..(n * row) as usize];
        file.read_at(bytes, DATA_START + from * row)?;
        for i in 0..n as usize {
            let at = kind.row(bytes, i);
            if at.iter().any(|x| !x.is_finite()) {
                return Err(Error::input(
                    file.path(),
                    format!("vertex {}", from + i as u64),
                    "finite coordinates, since the grid has no place for others",
                    format!("{at:?}"),
                    match kind {
                        Coords::F4 => "encode with --exact, which keeps all bits of f4 coordinates",
                        Coords::F8 => {
                            "build the folder with --coords f4, and encode it with --exact"
                        }
                    },
                ));
            }
            for k in 0..3 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
        }
        from += n;
    }
    let extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    if vertices == 0 {
        return Ok(([0.0; 3], 0.0));
    }
    Ok((low, extent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_floats_keep_their_order_and_come_back() {
        let floats = [
            f32::NEG_INFINITY,
            -2.5,
            -1e-40,
            -0.0,
            0.0,
            1e-40,
            1.0,
            f32::INFINITY,
        ];
        let ints = floats.map(|x| ordered(x.to_bits()));
        assert!(ints.is_sorted() && ints[3] < ints[4]);
        for bits in [0, 1, 0x7fc0_0001, 0xffc1_2345, 0x8000_0000, u32::MAX] {
            assert_eq!(disordered(ordered(bits)), bits);
        }
    }
}
