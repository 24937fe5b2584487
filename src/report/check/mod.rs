//! Verdicts for scripts: whether a folder is what somebody requires, and if not, where.
//!
//! Why it can be told at once: all that is required was counted when the folder was built, so a
//! verdict is a look at the manifest. Only for a requirement that failed (and for the genus, which
//! is a column) are culprits looked up, in the file that lists all of them.
//!
//! Memory: 64 KiB. I/O: the manifest; the table of components once when a requirement on
//! components failed; the first rows of a list of culprits; G, up to the first few vertices that
//! are not finite, when there are any.

mod culprits;
mod requirement;

pub use requirement::Requirement;

use crate::error::{Error, Result};
use crate::folder::{self, ComponentMeasures, ComponentRow, Folder, Measures, Orient};
use culprits::{components, edges, ids, nonfinite};
use requirement::Requirement::*;
use serde::Serialize;

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
        // Of no component nothing good can be said.
        Closed => c.closed_components == c.components && c.components > 0,
        Watertight => c.watertight_components == c.components && c.components > 0,
        SMesh => measured(|m| m.smesh_components) == c.components && c.components > 0,
        // What the manifest does not count: nothing is against it.
        Outward | Genus(_) => culprits.is_empty() && c.components > 0,
        Oriented => c.nonorientable_components == 0 && !(kept(folder) && c.inconsistent_edges > 0),
        NoBorders => c.border_edges == 0,
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
