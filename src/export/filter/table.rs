//! The table of the chosen components: measured on the grid of what is left, and oriented anew
//! where that grid says so.
//!
//! Why only whole components turn: what agrees inside a component agreed before. The rules are
//! those of `build`: by the sign of the volume where there is one, else as most triangles had it.
//!
//! Memory: 120 bytes a chosen component. I/O: V and labels once, G as `gather` says; the table
//! of components twice.

use super::super::gather::Gather;
use super::Job;
use super::edges::Edges;
use crate::build::arrays::OutArray;
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Measure;
use crate::disk::Lease;
use crate::error::Result;
use crate::folder::{self, COMPONENT_DESCR, ComponentRow, Counts, Orient, Rows};

/// The rows, and which components turn against the source.
pub(super) struct Table {
    rows: Vec<ComponentRow>,
    turned: Vec<bool>,
    _lease: Lease,
}

impl Table {
    /// True when a (new) component turns against the source.
    pub(super) fn flips(&self, component: u64) -> bool {
        self.turned[component as usize]
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

/// Measures and orients the chosen components.
pub(super) fn decide(job: &Job, edges: &Edges, bounds: &Bounds) -> Result<Table> {
    let components = job.taken.chosen.count;
    let row = (size_of::<ComponentRow>() + 1) as u64;
    let lease = job
        .ws
        .budget
        .lease("rows of components", components * row)?;
    let sums = components * size_of::<Measure>() as u64;
    let _sums = job.ws.budget.lease("sums by component", sums)?;
    let grid = Grid::new(bounds);
    let measures = measure(job, &grid)?;
    let mut rows: Vec<ComponentRow> = Vec::with_capacity(components as usize);
    let mut turned = Vec::with_capacity(components as usize);
    Rows::open(job.folder)?.each(|c, row| {
        if job.taken.chosen.has(c) {
            let new = rows.len();
            let (row, turn) = orient(job, &grid, row.base, edges.lone[new], measures.get(new))?;
            rows.push(row);
            turned.push(turn);
        }
        Ok(())
    })?;
    Ok(Table {
        rows,
        turned,
        _lease: lease,
    })
}

/// Sums by new component, as the source has its triangles; nothing without coordinates.
fn measure(job: &Job, grid: &Grid) -> Result<Vec<Measure>> {
    let Some((kind, g)) = &job.source.g else {
        return Ok(Vec::new());
    };
    let mut measures = vec![Measure::default(); job.taken.chosen.count as usize];
    let mut gather = Gather::new(*kind, job.step);
    let mut block = Vec::with_capacity(job.step as usize);
    let chosen = job.taken.chosen;
    job.source.each(
        "measure",
        false,
        |c| chosen.has(c),
        |rows| {
            block.clear();
            block.extend(rows.iter().map(|row| row.v));
            let spots = gather.read(g, &block)?.as_chunks::<3>().0;
            for (row, spots) in rows.iter().zip(spots) {
                measures[chosen.rank(row.component) as usize].add(grid, *spots, false);
            }
            Ok(())
        },
    )?;
    Ok(measures)
}

/// The new row of a component, and whether it turns.
fn orient(
    job: &Job,
    grid: &Grid,
    mut row: ComponentRow,
    lone: u64,
    measure: Option<&Measure>,
) -> Result<(ComponentRow, bool)> {
    let rule = job.folder.manifest().options.orient;
    let measured = measure.filter(|m| !m.nonfinite);
    let six = measured.map_or(0, |m| m.six_input);
    let by_volume =
        rule == Orient::Outward && row.orientable == 1 && row.watertight == 1 && six != 0;
    let (flipped, triangles) = (row.flipped, row.triangles);
    let turn = if by_volume {
        six < 0
    } else if row.orientable == 0 || matches!(rule, Orient::Keep | Orient::First) {
        false
    } else if 2 * flipped == triangles {
        job.source.flipped(row.first_triangle)?
    } else {
        2 * flipped > triangles
    };
    row.first_triangle = job.taken.triangles.rank(row.first_triangle);
    row.outward = u8::from(by_volume);
    // A corner that is alone on its edge now was an edge of its own before.
    row.border_edges += lone;
    row.cut_edges -= lone;
    if turn {
        row.flipped = triangles - flipped;
    }
    if let Some(m) = measured {
        row.six_volume = grid.six_volume(if turn { -six } else { six });
        row.area = grid.area(m.area);
    }
    Ok((row, turn))
}
