//! One reading of the table of components: the largest, the sizes, the first that are not as one
//! hopes.
//!
//! Memory: 64 KiB and a few rows. I/O: `components.npy` once.

use super::{Component, Measured, NAMED, Report, SizeClass};
use crate::error::Result;
use crate::folder::{self, Folder, Row, Rows};

/// Components that a report lists.
const LARGEST: usize = 8;

/// Reads the components once: the largest, the sizes, the first that are not as one hopes.
pub(super) fn survey(folder: &Folder, report: &mut Report) -> Result<()> {
    let mut sizes = [(0u64, 0u64); 64];
    let outward = report.options.orient == folder::Orient::Outward;
    Rows::open(folder)?.each(|number, whole| {
        let row = &whole.base;
        let triangles = row.triangles;
        let class = &mut sizes[triangles.max(1).ilog2() as usize];
        class.0 += 1;
        class.1 += triangles;
        keep_largest(&mut report.largest, number, whole);
        let culprits = &mut report.culprits;
        if row.orientable == 0 {
            name(&mut culprits.nonorientable_components, number);
        } else if outward && row.watertight == 0 {
            name(&mut culprits.not_watertight_components, number);
        }
        Ok(())
    })?;
    let class = |(i, &(components, triangles)): (usize, &(u64, u64))| SizeClass {
        from: 1 << i,
        to: (1u64 << i) - 1 + (1 << i),
        components,
        triangles,
    };
    let some = sizes.iter().enumerate().filter(|(_, class)| class.0 > 0);
    report.sizes = some.map(class).collect();
    Ok(())
}

fn name(list: &mut Vec<u64>, number: u64) {
    if list.len() < NAMED {
        list.push(number);
    }
}

/// Keeps the list of the largest, larger ones first, smaller numbers first among equals.
fn keep_largest(largest: &mut Vec<Component>, number: u64, whole: &Row) {
    let row = &whole.base;
    let triangles = row.triangles;
    let at = largest.partition_point(|c| c.triangles >= triangles);
    if at >= LARGEST {
        return;
    }
    let known = |x: f64| x.is_finite().then_some(x);
    largest.truncate(LARGEST - 1);
    largest.insert(
        at,
        Component {
            component: number,
            triangles,
            border_edges: row.border_edges,
            closed: row.closed == 1,
            orientable: row.orientable == 1,
            volume: known(row.six_volume / 6.0),
            area: known(row.area),
            measures: whole.measures.map(|m| Measured {
                vertices: m.vertices,
                fans: m.fans,
                border_loops: m.border_loops,
                euler: m.euler,
                genus: m.genus,
                is_smesh: m.is_smesh == 1,
            }),
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::ComponentRow;
    use bytemuck::Zeroable;

    #[test]
    fn the_largest_are_kept_in_order() {
        let mut largest = Vec::new();
        for (number, triangles) in [3u64, 9, 4, 9, 1, 7, 7, 7, 7, 8, 2].into_iter().enumerate() {
            let row = Row {
                base: ComponentRow {
                    triangles,
                    ..ComponentRow::zeroed()
                },
                measures: None,
            };
            keep_largest(&mut largest, number as u64, &row);
        }
        let kept: Vec<(u64, u64)> = largest.iter().map(|c| (c.component, c.triangles)).collect();
        let expected = [
            (1, 9),
            (3, 9),
            (9, 8),
            (5, 7),
            (6, 7),
            (7, 7),
            (8, 7),
            (2, 4),
        ];
        assert_eq!(kept, expected);
    }
}
