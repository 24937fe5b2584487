//! The table of the new folder: measured on the grid of what is left, and oriented by the rules
//! of `build`.
//!
//! Why a set of components turns as a whole: inside a component all agrees already, and between
//! components their parity says how. So each set has the two orientations of its first
//! triangle, and the choice is one bit: by the sign of the volume where there is one, else as
//! most triangles had it. A set that can no longer be oriented goes back to how the input had it,
//! triangle by triangle.
//!
//! Memory: 290 bytes a chosen component. I/O: V and labels once, G as `gather` says; the table of
//! components once.

use super::super::gather::Gather;
use super::Job;
use super::edges::{Change, Edges};
use super::least::ROW_BYTES;
use super::sets::Sets;
use crate::build::arrays::OutArray;
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Measure;
use crate::corner::flip_k;
use crate::disk::Lease;
use crate::error::Result;
use crate::folder::{self, COMPONENT_DESCR, ComponentRow, Counts, Orient, Rows};

/// How the triangles of a set turn against the source.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    /// Those that disagree with the set's first.
    Agree,
    /// Those that agree with it.
    Over,
    /// Those that the source had turned.
    Back,
}

/// The rows of the new folder, and how its triangles turn.
pub(super) struct Table<'a> {
    sets: &'a Sets,
    rows: Vec<ComponentRow>,
    turns: Vec<Turn>,
    _lease: Lease,
}

impl Table<'_> {
    /// The new component of a chosen one, and whether its triangles turn that the source had
    /// turned, or not.
    #[inline]
    pub(super) fn place(&self, component: u64, flipped: bool) -> (u64, bool) {
        let (set, parity) = self.sets.of(component);
        let turn = match self.turns[set as usize] {
            Turn::Agree => parity,
            Turn::Over => !parity,
            Turn::Back => flipped,
        };
        (set, turn)
    }

    /// The new id of a corner that is taken.
    pub(super) fn corner(&self, job: &Job, c: u64) -> Result<u64> {
        let row = job.source.one(c / 3)?;
        let component = job.taken.chosen.rank(row.component);
        let turn = self.place(component, row.flipped).1;
        Ok(3 * job.taken.triangles.rank(c / 3) + flip_k((c % 3) as usize, turn) as u64)
    }

    /// Writes the table, and counts.
    pub(super) fn write(&self, job: &Job, counts: &mut Counts) -> Result<OutArray> {
        let (shape, row) = ([self.rows.len() as u64], size_of::<ComponentRow>() as u64);
        let array = job.array(folder::COMPONENTS, COMPONENT_DESCR, &shape, row)?;
        array.write(0, &self.rows)?;
        for row in &self.rows {
            counts.components += 1;
            counts.border_edges += row.border_edges;
            counts.nonorientable_components += u64::from(row.orientable == 0);
            counts.closed_components += u64::from(row.closed);
            counts.watertight_components += u64::from(row.watertight);
            counts.flipped_triangles += row.flipped;
            counts.flipped_components += u64::from(row.flipped == row.triangles);
        }
        Ok(array)
    }
}

/// Measures and orients the sets of chosen components.
pub(super) fn decide<'a>(job: &Job, edges: &'a Edges, bounds: &Bounds) -> Result<Table<'a>> {
    let count = edges.sets.count();
    let bytes = count * ROW_BYTES;
    let lease = job.ws.budget.lease("rows of components", bytes)?;
    let sums = count * size_of::<Measure>() as u64;
    let _sums = job.ws.budget.lease("sums by component", sums)?;
    let grid = Grid::new(bounds);
    let measures = measure(job, &edges.sets, &grid)?;
    let mut rows = gather_rows(job, &edges.sets)?;
    let mut turns = Vec::with_capacity(rows.len());
    for (set, row) in rows.iter_mut().enumerate() {
        let orientable = edges.sets.orientable(set as u64);
        let measure = measures.get(set);
        turns.push(orient(
            job,
            &grid,
            row,
            (&edges.changes[set], orientable, measure),
        )?);
    }
    Ok(Table {
        sets: &edges.sets,
        rows,
        turns,
        _lease: lease,
    })
}

/// The rows of the sets, as sums over their components; flips as if all agreed with the first.
fn gather_rows(job: &Job, sets: &Sets) -> Result<Vec<ComponentRow>> {
    let mut rows: Vec<ComponentRow> = Vec::with_capacity(sets.count() as usize);
    let mut component = 0;
    Rows::open(job.folder)?.each(|c, row| {
        if !job.taken.chosen.has(c) {
            return Ok(());
        }
        let (set, parity) = sets.of(component);
        component += 1;
        let mut row = row.base;
        let (first, end) = (row.first_triangle, job.folder.manifest().counts.triangles);
        job.source.bound(folder::COMPONENTS, c, first, end)?;
        if row.flipped > row.triangles || !job.taken.triangles.has(first) {
            let expected = format!("its first triangle, and at most {} flipped", {
                row.triangles
            });
            let found = format!("triangle {first}, {} flipped", { row.flipped });
            let at = format!("row {c}");
            return Err(job.source.damaged(folder::COMPONENTS, at, expected, found));
        }
        if parity {
            row.flipped = row.triangles - row.flipped;
        }
        match rows.get_mut(set as usize) {
            // Components ascend, so the first of a set is the next.
            None => rows.push(row),
            Some(sum) => {
                sum.triangles += row.triangles;
                sum.flipped += row.flipped;
                sum.edges += row.edges;
                sum.border_edges += row.border_edges;
                sum.cut_edges += row.cut_edges;
            }
        }
        Ok(())
    })?;
    Ok(rows)
}

/// Sums by set, oriented like its first triangle in the source; nothing without coordinates.
fn measure(job: &Job, sets: &Sets, grid: &Grid) -> Result<Vec<Measure>> {
    let Some((kind, g)) = &job.source.g else {
        return Ok(Vec::new());
    };
    let mut measures = vec![Measure::default(); sets.count() as usize];
    let mut gather = Gather::new(*kind, job.step);
    let mut block = Vec::with_capacity(job.step as usize);
    job.source.each("measure", false, &job.taken, |rows| {
        block.clear();
        // As the input had them.
        block.extend(rows.iter().map(|row| match (row.flipped, row.v) {
            (true, [a, b, c]) => [a, c, b],
            (false, v) => v,
        }));
        let spots = gather.read(g, &block)?.as_chunks::<3>().0;
        for (row, spots) in rows.iter().zip(spots) {
            let (set, parity) = sets.of(job.taken.chosen.rank(row.component));
            measures[set as usize].add(grid, *spots, row.flipped ^ parity);
        }
        Ok(())
    })?;
    Ok(measures)
}

/// Completes the row of a set, and says how it turns.
fn orient(
    job: &Job,
    grid: &Grid,
    row: &mut ComponentRow,
    (change, orientable, measure): (&Change, bool, Option<&Measure>),
) -> Result<Turn> {
    let rule = job.folder.manifest().options.orient;
    // Two cuts have become one edge.
    let (edges, cuts) = (row.edges, row.cut_edges);
    let left = edges
        .checked_sub(change.links)
        .zip(cuts.checked_sub(change.borders + 2 * change.links));
    let Some((edges, cuts)) = left else {
        let expected = format!("cut edges as in {}", folder::NONMANIFOLD_CORNERS);
        let (at, found) = (
            format!("triangle {}", { row.first_triangle }),
            cuts.to_string(),
        );
        return Err(job.source.damaged(folder::COMPONENTS, at, expected, found));
    };
    (row.edges, row.cut_edges) = (edges, cuts);
    row.border_edges += change.borders;
    let (borders, cuts) = (row.border_edges, row.cut_edges);
    let closed = borders == 0 && cuts == 0;
    let watertight = closed || (borders == 0 && !change.unbalanced);
    let measured = measure.filter(|m| !m.nonfinite);
    let six = measured.map_or(0, |m| m.six_oriented);
    let by_volume = rule == Orient::Outward && orientable && watertight && six != 0;
    let (flipped, triangles) = (row.flipped, row.triangles);
    let over = if by_volume {
        six < 0
    } else if rule == Orient::First {
        false
    } else if flipped == triangles - flipped {
        job.taken.flipped(row.first_triangle)
    } else {
        flipped > triangles - flipped
    };
    let turn = match (rule == Orient::Keep || !orientable, over) {
        (true, _) => Turn::Back,
        (_, true) => Turn::Over,
        (_, false) => Turn::Agree,
    };
    row.flipped = match turn {
        Turn::Back => 0,
        Turn::Over => triangles - flipped,
        Turn::Agree => flipped,
    };
    row.first_triangle = job.taken.triangles.rank(row.first_triangle);
    row.orientable = u8::from(orientable);
    row.closed = u8::from(closed);
    row.watertight = u8::from(watertight);
    row.outward = u8::from(by_volume);
    row.six_volume = f64::NAN;
    row.area = f64::NAN;
    if let Some(m) = measured {
        row.six_volume = grid.six_volume(match turn {
            Turn::Back => m.six_input,
            Turn::Over => -six,
            Turn::Agree => six,
        });
        row.area = grid.area(m.area);
    }
    if let Some(m) = measure {
        let boxed = m.min[0] <= m.max[0];
        row.bbox_min = if boxed { m.min } else { [f64::NAN; 3] };
        row.bbox_max = if boxed { m.max } else { [f64::NAN; 3] };
    }
    Ok(turn)
}
