//! What a mesh can be required to be, by name.
//!
//! Memory: none. I/O: none.

use crate::error::{Error, Result};

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
    pub(super) fn measured(self) -> bool {
        matches!(
            self,
            Manifold | SMesh | NoDuplicates | Genus(_) | BorderLoops(_)
        )
    }
}
