//! Verdicts for scripts: whether a folder is what somebody requires, and if not, where.
//!
//! Why it can be told at once: all that is required was counted when the folder was built, so a
//! verdict is a look at the manifest. Only for a requirement that failed (and for the genus, which
//! is a column) are culprits looked up, in the file that lists all of them.
//!
//! Memory: 64 KiB. I/O: the manifest; the table of components once when a requirement on
//! components failed; the first rows of a list of culprits; G, up to the first few vertices that
//! are not finite, when there are any.

use super::{NAMED, first_edges, first_ids};
use crate::disk::DataFile;
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::folder::{self, ComponentMeasures, ComponentRow, Folder, Measures, Orient, Rows};
use crate::table::array::Coords;
use serde::Serialize;

/// Something that a mesh shall be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Requirement {
    /// There is a component, and in each every corner has an opposite.
    Closed,
    /// There is a component, and each is watertight.
    Watertight,
    /// No edge has three corners or more, no vertex more than one fan.
    Manifold,
    /// No edge has three corners or more.
    ManifoldEdges,
    /// No edge has one corner alone.
    NoBorders,
    /// Triangles agree across every edge between two: each component can be oriented, and is.
    Oriented,
    /// There is a component, and each was oriented by the sign of its volume.
    Outward,
    /// There is one component.
    Single,
    /// There is a component, and each is a simple mesh.
    SMesh,
    /// No triangle has the vertices of another.
    NoDuplicates,
    /// No triangle has a vertex twice.
    NoDegenerates,
    /// Every vertex is in some triangle.
    NoUnreferenced,
    /// Every coordinate is finite.
    Finite,
    /// There are so many components.
    Components(u64),
    /// There is a component, and each has this genus.
    Genus(u64),
    /// There are so many border loops in all.
    BorderLoops(u64),
}

use Requirement::*;

/// The requirements without a number, by name.
const PLAIN: [(&str, Requirement); 13] = [
    ("closed", Closed),
    ("watertight", Watertight),
    ("manifold", Manifold),
    ("manifold-edges", ManifoldEdges),
    ("no-borders", NoBorders),
    ("oriented", Oriented),
    ("outward", Outward),
    ("single", Single),
    ("smesh", SMesh),
    ("no-duplicates", NoDuplicates),
    ("no-degenerates", NoDegenerates),
    ("no-unreferenced", NoUnreferenced),
    ("finite", Finite),
];

/// A requirement made of a number.
type Made = fn(u64) -> Requirement;

/// Those with one.
const COUNTED: [(&str, Made); 3] = [
    ("components", Components),
    ("genus", Genus),
    ("border-loops", BorderLoops),
];

impl Requirement {
    /// The requirement that a text names: `closed`, `components=3`.
    ///
    /// # Errors
    /// [`Error::Usage`] that lists what there is.
    pub fn parse(text: &str) -> Result<Requirement> {
        let plain = PLAIN.iter().find(|(name, _)| *name == text);
        if let Some((_, requirement)) = plain {
            return Ok(*requirement);
        }
        let counted = text.split_once('=').and_then(|(name, number)| {
            let (_, made) = COUNTED.iter().find(|(known, _)| *known == name)?;
            Some(made(number.parse().ok()?))
        });
        counted.ok_or_else(|| {
            let plain = PLAIN.iter().map(|(name, _)| (*name).to_owned());
            let counted = COUNTED.iter().map(|(name, _)| format!("{name}=N"));
            let all: Vec<String> = plain.chain(counted).collect();
            Error::Usage(format!(
                "unknown requirement '{text}'; there are {}",
                all.join(", ")
            ))
        })
    }

    /// Its name, as [`parse`](Requirement::parse) takes it.
    pub fn name(self) -> String {
        let plain = PLAIN.iter().find(|(_, r)| *r == self);
        match (self, plain) {
            (Components(n), _) => format!("components={n}"),
            (Genus(n), _) => format!("genus={n}"),
            (BorderLoops(n), _) => format!("border-loops={n}"),
            (_, plain) => plain.map_or(String::new(), |(name, _)| (*name).to_owned()),
        }
    }

    /// True when only a measured folder tells.
    fn measured(self) -> bool {
        matches!(
            self,
            Manifold | SMesh | NoDuplicates | Genus(_) | BorderLoops(_)
        )
    }
}

/// The verdict on a folder, as `check --json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct Checked {
    /// Version of these keys.
    pub version: u32,
    /// True when every requirement is met.
    pub passed: bool,
    /// The requirements, in the order asked for.
    pub requirements: Vec<Judged>,
}

/// The verdict on one requirement.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// Its name.
    pub name: String,
    /// True when it is met.
    pub passed: bool,
    /// The figure that decided, in words.
    pub found: String,
    /// What is against it; empty when it is met, or when nothing can be pointed at.
    pub culprits: Vec<Culprit>,
}

/// What is against a requirement.
#[derive(Clone, Debug, Serialize)]
pub struct Culprit {
    /// "edge", "vertex", "triangle" or "component".
    pub kind: &'static str,
    /// How many there are.
    pub total: u64,
    /// The first few: the number of each, of an edge those of its two vertices.
    pub first: Vec<Vec<u64>>,
    /// The file that lists all.
    pub file: &'static str,
}

/// Holds a folder to requirements.
///
/// # Errors
/// [`Error::Input`] when the folder cannot tell: it has no measures, or no coordinates, that a
/// requirement asks for; or when it is damaged. [`Error::Io`].
///
/// # Example
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # by_hand::tetrahedron().write(&folder);
/// # let ws = by_hand::workspace(dir.path(), 1 << 20);
/// use cornermill::folder::Folder;
/// use cornermill::report::{Requirement, check};
///
/// let folder = Folder::open(&folder, &ws.io)?; // a tetrahedron
/// let wanted = ["single", "components=2"].map(Requirement::parse);
/// let checked = check(&folder, &wanted.into_iter().collect::<Result<Vec<_>, _>>()?)?;
/// assert!(checked.requirements[0].passed);
/// assert_eq!(checked.requirements[1].found, "1 component");
/// assert!(!checked.passed);
/// # Ok::<(), cornermill::Error>(())
/// ```
pub fn check(folder: &Folder, requirements: &[Requirement]) -> Result<Checked> {
    // What cannot be told is said before anything else is.
    for &requirement in requirements {
        can_tell(folder, requirement)?;
    }
    let judged = requirements.iter().map(|&r| judge(folder, r));
    let judged: Vec<Judged> = judged.collect::<Result<_>>()?;
    Ok(Checked {
        version: 1,
        passed: judged.iter().all(|j| j.passed),
        requirements: judged,
    })
}

/// A line for each requirement.
pub fn render_checked(checked: &Checked) -> String {
    let line = |judged: &Judged| {
        let word = if judged.passed { "passed" } else { "FAILED" };
        let culprits: String = judged.culprits.iter().map(pointed).collect();
        format!("{}: {word}, {}{culprits}\n", judged.name, judged.found)
    };
    checked.requirements.iter().map(line).collect()
}

fn pointed(culprit: &Culprit) -> String {
    let one = |ids: &Vec<u64>| -> String {
        let ids: Vec<String> = ids.iter().map(u64::to_string).collect();
        ids.join("-")
    };
    let first: Vec<String> = culprit.first.iter().map(one).collect();
    let (kind, file) = (culprit.kind, culprit.file);
    format!("; first {kind}: {} (all in {file})", first.join(" "))
}

fn can_tell(folder: &Folder, requirement: Requirement) -> Result<()> {
    let lacks = |expected: &str, found: &str, help: String| {
        Err(Error::input(folder.path(), "", expected, found, help))
    };
    let name = requirement.name();
    if requirement.measured() && folder.manifest().measures.is_none() {
        return lacks(
            &format!("a measured folder, which '{name}' needs"),
            "one without measures",
            "build it again without --no-measures".into(),
        );
    }
    if requirement == Finite && folder.manifest().coords.is_none() {
        return lacks(
            "a folder with coordinates, which 'finite' needs",
            "one built from V alone",
            "build it again with --positions".into(),
        );
    }
    Ok(())
}

fn judge(folder: &Folder, requirement: Requirement) -> Result<Judged> {
    let c = &folder.manifest().counts;
    let m = folder.manifest().measures.as_ref();
    let measured = |figure: fn(&Measures) -> u64| m.map_or(0, figure);
    // Those that ask the same of every component.
    let each = |word: &str, good: u64, row: fn(&ComponentRow) -> bool| {
        each_component(folder, word, good, |base, _| row(base))
    };
    let (found, culprits) = match requirement {
        Closed => each("closed", c.closed_components, |r| r.closed == 1)?,
        Watertight => each("watertight", c.watertight_components, |r| r.watertight == 1)?,
        Outward => each_counted(folder, "turned outward", |base, _| base.outward == 1)?,
        SMesh => each_component(folder, "simple meshes", measured(|m| m.smesh_components), {
            |_, m| m.is_some_and(|m| m.is_smesh == 1)
        })?,
        Genus(n) => each_counted(folder, &format!("of genus {n}"), move |_, m| {
            m.is_some_and(|m| m.genus == n)
        })?,
        Oriented => oriented(folder)?,
        Manifold => manifold(folder, measured(|m| m.nonmanifold_vertices))?,
        ManifoldEdges => (
            many(c.nonmanifold_edges, "non-manifold edge"),
            edges(folder, c.nonmanifold_edges)?,
        ),
        NoBorders => (many(c.border_edges, "border edge"), {
            components(folder, c.border_edges > 0, |base, _| base.border_edges == 0)?
        }),
        NoDuplicates => {
            let total = measured(|m| m.duplicate);
            let list = ids(folder, folder::DUPLICATE, "triangle", total)?;
            (many(total, "duplicate triangle"), list)
        }
        NoDegenerates => {
            let list = ids(folder, folder::DEGENERATE, "triangle", c.degenerate)?;
            (many(c.degenerate, "degenerate triangle"), list)
        }
        Finite => (many(c.nonfinite_vertices, "non-finite vertex"), {
            nonfinite(folder, c.nonfinite_vertices)?
        }),
        NoUnreferenced => (many(c.unreferenced_vertices, "unreferenced vertex"), vec![]),
        Single | Components(_) => (many(c.components, "component"), vec![]),
        BorderLoops(_) => (many(measured(|m| m.border_loops), "border loop"), vec![]),
    };
    let passed = match requirement {
        Components(n) => c.components == n,
        Single => c.components == 1,
        BorderLoops(n) => measured(|m| m.border_loops) == n,
        NoUnreferenced => c.unreferenced_vertices == 0,
        // Nothing is against it. Of no component nothing good can be said.
        Closed | Watertight | Outward | SMesh | Genus(_) => culprits.is_empty() && c.components > 0,
        Oriented => culprits.is_empty() && !(kept(folder) && c.inconsistent_edges > 0),
        _ => culprits.is_empty(),
    };
    Ok(Judged {
        name: requirement.name(),
        passed,
        found,
        culprits,
    })
}

/// The figure in words, and what is against the requirement.
type Found = (String, Vec<Culprit>);

fn many(count: u64, what: &str) -> String {
    let what = match (count, what) {
        (1, what) => what.to_owned(),
        (_, what) if what.ends_with("vertex") => what.replace("vertex", "vertices"),
        (_, what) => format!("{what}s"),
    };
    format!("{count} {what}")
}

/// Every component is good, as the manifest counts them; the first that are not.
fn each_component(
    folder: &Folder,
    word: &str,
    good: u64,
    is_good: impl Fn(&ComponentRow, Option<&ComponentMeasures>) -> bool,
) -> Result<Found> {
    let all = folder.manifest().counts.components;
    let culprits = components(folder, good < all, is_good)?;
    Ok((
        format!("{good} of {} {word}", many(all, "component")),
        culprits,
    ))
}

/// The same where no count of the manifest tells: the table is read.
fn each_counted(
    folder: &Folder,
    word: &str,
    is_good: impl Fn(&ComponentRow, Option<&ComponentMeasures>) -> bool,
) -> Result<Found> {
    let all = folder.manifest().counts.components;
    let culprits = components(folder, true, is_good)?;
    let bad = culprits.first().map_or(0, |c| c.total);
    let figure = format!(
        "{} of {} {word}",
        all - bad.min(all),
        many(all, "component")
    );
    Ok((figure, culprits))
}

/// The components that are not good, when there are some.
fn components(
    folder: &Folder,
    some: bool,
    is_good: impl Fn(&ComponentRow, Option<&ComponentMeasures>) -> bool,
) -> Result<Vec<Culprit>> {
    let (mut first, mut total) = (Vec::new(), 0);
    if some {
        Rows::open(folder)?.each(|number, row| {
            if !is_good(&row.base, row.measures.as_ref()) {
                total += 1;
                if first.len() < NAMED {
                    first.push(vec![number]);
                }
            }
            Ok(())
        })?;
    }
    Ok(culprit("component", total, first, folder::COMPONENTS))
}

/// A list of culprits, unless it is empty.
fn culprit(
    kind: &'static str,
    total: u64,
    first: Vec<Vec<u64>>,
    file: &'static str,
) -> Vec<Culprit> {
    let some = (total > 0).then_some(Culprit {
        kind,
        total,
        first,
        file,
    });
    some.into_iter().collect()
}

fn edges(folder: &Folder, total: u64) -> Result<Vec<Culprit>> {
    if total == 0 {
        return Ok(vec![]);
    }
    let first = first_edges(folder)?
        .iter()
        .map(|e| vec![e.lo, e.hi])
        .collect();
    Ok(culprit("edge", total, first, folder::NONMANIFOLD_EDGES))
}

fn ids(
    folder: &Folder,
    file: &'static str,
    kind: &'static str,
    total: u64,
) -> Result<Vec<Culprit>> {
    if total == 0 {
        return Ok(vec![]);
    }
    let first = first_ids(folder, file)?
        .into_iter()
        .map(|id| vec![id])
        .collect();
    Ok(culprit(kind, total, first, file))
}

fn manifold(folder: &Folder, vertices: u64) -> Result<Found> {
    let total = folder.manifest().counts.nonmanifold_edges;
    let mut culprits = edges(folder, total)?;
    culprits.extend(ids(
        folder,
        folder::NONMANIFOLD_VERTICES,
        "vertex",
        vertices,
    )?);
    let (edges, vertices) = (
        many(total, "non-manifold edge"),
        many(vertices, "non-manifold vertex"),
    );
    Ok((format!("{edges}, {vertices}"), culprits))
}

/// True when the folder has the input's orientation, whatever it was.
fn kept(folder: &Folder) -> bool {
    folder.manifest().options.orient == Orient::Keep
}

fn oriented(folder: &Folder) -> Result<Found> {
    let c = &folder.manifest().counts;
    let lost = c.nonorientable_components;
    let culprits = components(folder, lost > 0, |base, _| base.orientable == 1)?;
    let mut figure = format!("{} that cannot be oriented", many(lost, "component"));
    if kept(folder) {
        let edges = many(c.inconsistent_edges, "edge");
        figure += &format!(", {edges} whose triangles disagree (built with --orient keep)");
    }
    Ok((figure, culprits))
}

/// The first vertices with a coordinate that is not finite: no list has them, so G is read.
fn nonfinite(folder: &Folder, total: u64) -> Result<Vec<Culprit>> {
    const STEP: u64 = 2048;
    let mut first = Vec::new();
    if let (true, Some(kind)) = (total > 0, Coords::of(folder)?) {
        let (file, row) = (folder.file(folder::G)?, kind.row_bytes());
        let vertices = folder.manifest().counts.vertices;
        let mut bytes = vec![0; STEP as usize * row];
        for from in (0..vertices).step_by(STEP as usize) {
            let count = STEP.min(vertices - from) as usize;
            read_rows(&file, &mut bytes[..count * row], from, row)?;
            for i in 0..count {
                if first.len() < NAMED && kind.row(&bytes, i).iter().any(|x| !x.is_finite()) {
                    first.push(vec![from + i as u64]);
                }
            }
            if first.len() as u64 == total.min(NAMED as u64) {
                break;
            }
        }
    }
    Ok(culprit("vertex", total, first, folder::G))
}

fn read_rows(file: &DataFile, bytes: &mut [u8], from: u64, row: usize) -> Result<()> {
    file.read_at(bytes, DATA_START + from * row as u64)
}
