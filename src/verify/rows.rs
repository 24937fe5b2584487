//! The table of components and the rule of orientation: each component's row against what was
//! recounted.
//!
//! Why the numbering is proved: every label has a triangle, the first triangles that were
//! recounted ascend with the labels, and each label is one piece.
//!
//! Memory: the buffers of the merge. I/O: `components.npy` and the recounted parts once.

use super::coords::Frame;
use super::measures;
use super::open::Arrays;
use super::read::Rows;
use super::shape;
use super::sort::Sorter;
use super::tally::Tally;
use super::verdict::{At, Check, Findings};
use crate::disk::Workspace;
use crate::error::Result;
use crate::folder::{COMPONENT, COMPONENTS, ComponentMeasures, ComponentRow, FLIPPED, Orient, V};
use bytemuck::{Pod, Zeroable};

/// What is counted over all components.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counted {
    pub(super) nonorientable: u64,
    pub(super) closed: u64,
    pub(super) watertight: u64,
    pub(super) flipped: u64,
    /// Simple meshes, as [`shape`] defines them.
    pub(super) smesh: u64,
}

/// A row of the table, measured or not.
pub(super) trait TableRow: Pod {
    /// The columns that every table has.
    fn base(&self) -> ComponentRow;
    /// The columns of a measured one.
    fn measures(&self) -> Option<ComponentMeasures>;
}

impl TableRow for ComponentRow {
    fn base(&self) -> ComponentRow {
        *self
    }
    fn measures(&self) -> Option<ComponentMeasures> {
        None
    }
}

/// A row of a measured table.
#[repr(C, packed)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct MeasuredRow {
    base: ComponentRow,
    measures: ComponentMeasures,
}

impl TableRow for MeasuredRow {
    fn base(&self) -> ComponentRow {
        self.base
    }
    fn measures(&self) -> Option<ComponentMeasures> {
        Some(self.measures)
    }
}

/// Checks every row.
pub(super) fn run<R: TableRow>(
    ws: &Workspace,
    arrays: &Arrays,
    frame: Option<&Frame>,
    findings: &Findings,
    tallies: Sorter<Tally>,
    memory: u64,
) -> Result<Counted> {
    let all = arrays.components;
    ws.progress.begin("verify: components", "components", all);
    let mut merge = tallies.merge(ws, memory / 2)?;
    let mut rows = Rows::<R>::new(ws, &arrays.component_rows, all, memory / 8)?;
    let mut next = merge.next()?;
    let mut before = None;
    let mut counted = Counted::default();
    while let Some((label, row)) = rows.next()? {
        let mut tally = Tally::empty(label);
        while let Some(part) = next.filter(|part| part.label == label) {
            tally.absorb(&part);
            next = merge.next()?;
        }
        ws.progress.advance(1);
        if tally.triangles == 0 {
            findings.add(Check::Label, COMPONENT, At::Component(label), || {
                let found = format!("no triangle has label {label}");
                (found, format!("each label below {all}"))
            });
            continue;
        }
        let component = Component {
            orient: arrays.orient,
            frame,
            findings,
            label,
            row: row.base(),
            tally,
        };
        component.numbering(&mut before);
        component.columns(&mut counted);
        component.orientation();
        measures::check(findings, label, &component.row, &tally, frame);
        if let Some(said) = row.measures() {
            let (closed, orientable) = (component.closed(), component.orientable());
            let own = shape::of(&tally, closed, orientable);
            shape::check(findings, label, &said, &own);
            counted.smesh += u64::from(own.is_smesh);
        }
    }
    ws.progress.end();
    Ok(counted)
}

/// A component: what its row says, and what was recounted.
struct Component<'a> {
    orient: Orient,
    frame: Option<&'a Frame>,
    findings: &'a Findings,
    label: u64,
    row: ComponentRow,
    tally: Tally,
}

impl Component<'_> {
    fn at(&self) -> At {
        At::Component(self.label)
    }

    fn first(&self) -> u64 {
        self.tally.first >> 1
    }

    fn orientable(&self) -> bool {
        self.tally.odd == 0
    }

    fn closed(&self) -> bool {
        self.tally.border + self.tally.cut == 0
    }

    /// Watertight by its edges: no border, and cut edges cancel in the final orientation.
    fn tight(&self) -> bool {
        self.tally.border == 0 && self.tally.uneven == 0
    }

    /// Labels are numbered by first triangle, and one label is one piece.
    fn numbering(&self, before: &mut Option<u64>) {
        let (first, label) = (self.first(), self.label);
        if let Some(before) = before.filter(|&b| b >= first) {
            self.findings.add(Check::Label, COMPONENT, self.at(), || {
                let found = format!("its first triangle is {first}");
                let last = label - 1;
                (
                    found,
                    format!("one after {before}, that of component {last}"),
                )
            });
        }
        *before = Some(first);
        let tally = &self.tally;
        if tally.pieces > 1 {
            let stray = tally.last_piece;
            self.findings
                .add(Check::Connected, COMPONENT, At::Triangle(stray), || {
                    let found = format!(
                        "label {label}, but no path over regular edges leads to triangle {first} \
                     ({} pieces)",
                        tally.pieces
                    );
                    (found, "one label for one component".into())
                });
        }
    }

    fn columns(&self, counted: &mut Counted) {
        let (row, tally) = (&self.row, &self.tally);
        let equal = |what: &str, found: u64, expected: u64| {
            let check = Check::ComponentTable;
            self.findings
                .equal(check, COMPONENTS, self.at(), what, found, expected);
        };
        equal("first_triangle", row.first_triangle, self.first());
        equal("triangles", row.triangles, tally.triangles);
        equal("flipped", row.flipped, tally.flipped);
        let edges = tally.regular + tally.border + tally.cut;
        equal("edges", row.edges, edges);
        equal("border_edges", row.border_edges, tally.border);
        equal("cut_edges", row.cut_edges, tally.cut);
        let orientable = u64::from(self.orientable());
        equal("orientable", u64::from(row.orientable), orientable);
        let closed = u64::from(self.closed());
        equal("closed", u64::from(row.closed), closed);
        let tight = u64::from(self.tight());
        equal("watertight", u64::from(row.watertight), tight);
        let outward = u64::from(self.outward());
        equal("outward", u64::from(row.outward), outward);
        counted.nonorientable += 1 - orientable;
        counted.closed += closed;
        counted.watertight += tight;
        counted.flipped += u64::from(tally.flipped == tally.triangles);
    }

    /// True when the sign of the volume decides the orientation.
    fn outward(&self) -> bool {
        let measured = self.frame.is_some() && self.tally.nonfinite == 0;
        self.orient == Orient::Outward
            && self.orientable()
            && self.tight()
            && measured
            && self.tally.volume.value() != 0
    }

    fn orientation(&self) {
        let (row, tally) = (&self.row, &self.tally);
        let add = |file: &str, at: At, found: String, expected: &str| {
            self.findings
                .add(Check::Orientation, file, at, || (found, expected.into()));
        };
        if !self.orientable() || self.orient == Orient::Keep {
            if tally.flipped > 0 {
                let found = format!("{} of {} triangles flipped", tally.flipped, tally.triangles);
                let expected = match self.orient {
                    Orient::Keep => "0 (the option keeps the input's orientation)",
                    _ => "0 (the component has no consistent orientation)",
                };
                add(FLIPPED, self.at(), found, expected);
            }
            return;
        }
        if tally.disagree > 0 {
            let corner = tally.disagree_corner;
            let found = format!(
                "its edge runs the same way in both triangles ({} such edges in component {})",
                tally.disagree, self.label
            );
            add(V, At::Corner(corner), found, "opposite ways");
        }
        let first_flipped = tally.first & 1 != 0;
        let kept = tally.triangles - tally.flipped;
        if self.outward() {
            if row.six_volume < 0.0 {
                let found = format!("six_volume is {:e}", { row.six_volume });
                add(COMPONENTS, self.at(), found, "a positive one (outward)");
            }
        } else if self.orient == Orient::First {
            if first_flipped {
                let found = format!("its first triangle {} is flipped", self.first());
                add(FLIPPED, self.at(), found, "one that is not");
            }
        } else if tally.flipped > kept || tally.flipped == kept && first_flipped {
            let found = format!("{} of {} triangles flipped", tally.flipped, tally.triangles);
            let expected = "fewer than half, or half without the first triangle";
            add(FLIPPED, self.at(), found, expected);
        }
    }
}
