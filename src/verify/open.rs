//! The arrays of a folder, opened, when their types, shapes and lengths agree with each other.
//!
//! Memory, I/O: none.

use super::read::Ids;
use super::verdict::{At, Check, Findings};
use crate::disk::{DataFile, Workspace};
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::folder::{self, EdgeRow, Manifest, Orient};
use std::path::Path;

/// The format of the input of a filtered folder.
const FILTERED: &str = "filter";

/// The arrays of a folder, opened, each as long as its shape says.
pub(super) struct Arrays {
    /// T.
    pub(super) triangles: u64,
    /// N.
    pub(super) vertices: u64,
    /// Rows of `components.npy`.
    pub(super) components: u64,
    /// Rows of `nonmanifold_edges.npy`.
    pub(super) edges: u64,
    /// True when ids have 8 bytes.
    pub(super) wide: bool,
    pub(super) orient: Orient,
    pub(super) v: Ids,
    pub(super) o: Ids,
    pub(super) component: Ids,
    pub(super) degenerate: Ids,
    pub(super) nonmanifold_corners: Ids,
    pub(super) flipped: DataFile,
    pub(super) component_rows: DataFile,
    pub(super) edge_rows: DataFile,
    /// Coordinates, and whether they have 8 bytes.
    pub(super) g: Option<(DataFile, bool)>,
    /// What only measured folders have.
    pub(super) measured: Option<Lists>,
    /// What only filtered folders have: the ids that triangles and vertices had.
    pub(super) maps: Option<[Ids; 2]>,
}

/// The lists of measured folders.
pub(super) struct Lists {
    pub(super) nonmanifold_vertices: Ids,
    pub(super) duplicate: Ids,
}

/// A type and shape that the manifest must give an array.
struct Want<'a> {
    manifest: &'a Manifest,
    findings: &'a Findings,
    sound: bool,
}

impl Want<'_> {
    /// Number of rows of an array when its type is `dtype`, its rows have `columns` items of
    /// `item` bytes, and its length agrees; `rows` when the number is known.
    fn rows(
        &mut self,
        name: &'static str,
        dtype: &str,
        (columns, item): (Option<u64>, u64),
        rows: Option<u64>,
    ) -> u64 {
        let Some(entry) = self.manifest.files.iter().find(|f| f.name == name) else {
            self.findings
                .add(Check::Manifest, folder::MANIFEST, At::Key("files"), || {
                    (format!("no {name}"), "an array of that name".into())
                });
            self.sound = false;
            return 0;
        };
        let found = entry.shape.first().copied().unwrap_or(0);
        let mut shape = vec![rows.unwrap_or(found)];
        shape.extend(columns);
        let bytes = shape
            .iter()
            .try_fold(item, |n, &d| n.checked_mul(d))
            .and_then(|n| n.checked_add(DATA_START));
        if entry.dtype != dtype || entry.shape != shape || bytes != Some(entry.bytes) {
            self.findings.add(Check::Manifest, name, At::File, || {
                let found = format!(
                    "type {}, shape {:?} in {} bytes",
                    entry.dtype, entry.shape, entry.bytes
                );
                (
                    found,
                    format!("{dtype}, {shape:?} in {} bytes", bytes.unwrap_or(u64::MAX)),
                )
            });
            self.sound = false;
        }
        found
    }

    /// Measures are in the manifest, in the table and as lists, or nowhere.
    fn all_or_nothing(&mut self, measured: bool) {
        for entry in &self.manifest.files {
            let other = match entry.name.as_str() {
                folder::COMPONENTS => entry.dtype == folder::row_type(!measured).0,
                folder::NONMANIFOLD_VERTICES | folder::DUPLICATE => !measured,
                _ => false,
            };
            if !other {
                continue;
            }
            self.sound = false;
            let at = At::Key("measures");
            self.findings
                .add(Check::Manifest, folder::MANIFEST, at, || {
                    let name = &entry.name;
                    if measured {
                        let found = format!("measures, and a {name} without their columns");
                        (found, "the columns too".into())
                    } else {
                        let found = format!("null, and a {name} of a measured folder");
                        (found, "all measures or none".into())
                    }
                });
        }
    }
}

/// Opens the arrays, when types, shapes and lengths agree with each other.
pub(super) fn arrays(
    ws: &Workspace,
    path: &Path,
    manifest: &Manifest,
    findings: &Findings,
) -> Result<Option<Arrays>> {
    let mut want = Want {
        manifest,
        findings,
        sound: true,
    };
    let (index, item) = match manifest.index.as_str() {
        "u8" => ("<u8", 8),
        _ => ("<u4", 4),
    };
    let triangles = want.rows(folder::V, index, (Some(3), item), None);
    want.rows(folder::O, index, (Some(3), item), Some(triangles));
    want.rows(folder::COMPONENT, index, (None, item), Some(triangles));
    let packed = Some(triangles.div_ceil(8));
    want.rows(folder::FLIPPED, "|u1", (None, 1), packed);
    let measured = manifest.measures.is_some();
    want.all_or_nothing(measured);
    let (descr, row) = folder::row_type(measured);
    let components = want.rows(folder::COMPONENTS, descr, (None, row), None);
    let mut lists = [0; 2];
    if measured {
        lists = [folder::NONMANIFOLD_VERTICES, folder::DUPLICATE]
            .map(|name| want.rows(name, index, (None, item), None));
    }
    let row = size_of::<EdgeRow>() as u64;
    let edges = want.rows(
        folder::NONMANIFOLD_EDGES,
        folder::EDGE_DESCR,
        (None, row),
        None,
    );
    let corners = want.rows(folder::NONMANIFOLD_CORNERS, index, (None, item), None);
    let degenerate = want.rows(folder::DEGENERATE, index, (None, item), None);
    let mut vertices = manifest.counts.vertices;
    let coords = match manifest.coords.as_deref() {
        None => None,
        Some("f8") => Some(("<f8", 8)),
        Some(_) => Some(("<f4", 4)),
    };
    if let Some((dtype, item)) = coords {
        vertices = want.rows(folder::G, dtype, (Some(3), item), None);
    }
    if coords.is_none() && manifest.files.iter().any(|f| f.name == folder::G) {
        findings.add(Check::Manifest, folder::MANIFEST, At::Key("coords"), || {
            ("null beside a G.npy".into(), "f4 or f8".into())
        });
    }
    let mapped = manifest.input.format == FILTERED;
    if mapped {
        want.rows(folder::MAP_TRIANGLE, "<u8", (None, 8), Some(triangles));
        want.rows(folder::MAP_VERTEX, "<u8", (None, 8), Some(vertices));
    }
    let known = matches!(manifest.index.as_str(), "u4" | "u8")
        && matches!(manifest.coords.as_deref(), None | Some("f4" | "f8"));
    let large = u64::from(u32::MAX);
    let narrow = item == 4 && (triangles >= large / 3 || vertices >= large);
    if !known || narrow {
        findings.add(Check::Manifest, folder::MANIFEST, At::Key("index"), || {
            let found = format!("index {}, coords {:?}", manifest.index, manifest.coords);
            (found, "u4 or u8 wide enough, and f4, f8 or null".into())
        });
        want.sound &= known;
    }
    if !want.sound {
        return Ok(None);
    }
    let file = |name: &str| DataFile::open(&path.join(name), &ws.io);
    let ids = |name: &str, len: u64| -> Result<Ids> {
        Ok(Ids {
            file: file(name)?,
            wide: item == 8,
            len,
        })
    };
    let map = |name: &str, len: u64| -> Result<Ids> {
        Ok(Ids {
            file: file(name)?,
            wide: true,
            len,
        })
    };
    Ok(Some(Arrays {
        triangles,
        vertices,
        components,
        edges,
        wide: item == 8,
        orient: manifest.options.orient,
        v: ids(folder::V, triangles * 3)?,
        o: ids(folder::O, triangles * 3)?,
        component: ids(folder::COMPONENT, triangles)?,
        degenerate: ids(folder::DEGENERATE, degenerate)?,
        nonmanifold_corners: ids(folder::NONMANIFOLD_CORNERS, corners)?,
        flipped: file(folder::FLIPPED)?,
        component_rows: file(folder::COMPONENTS)?,
        edge_rows: file(folder::NONMANIFOLD_EDGES)?,
        g: match coords {
            Some((_, item)) => Some((file(folder::G)?, item == 8)),
            None => None,
        },
        measured: match measured {
            true => Some(Lists {
                nonmanifold_vertices: ids(folder::NONMANIFOLD_VERTICES, lists[0])?,
                duplicate: ids(folder::DUPLICATE, lists[1])?,
            }),
            false => None,
        },
        maps: match mapped {
            true => Some([
                map(folder::MAP_TRIANGLE, triangles)?,
                map(folder::MAP_VERTEX, vertices)?,
            ]),
            false => None,
        },
    }))
}
