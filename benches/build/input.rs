//! The mesh of a row on disk and in the page cache, and what the build must find in it.

use crate::cases::Shape;
use crate::{Result, at, length};
use clap::Parser;
use cornermill::folder::Counts;
use data_gen::Truth;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A mesh that data-gen wrote.
pub struct Input {
    /// What it is.
    pub shape: Shape,
    /// V, or the whole mesh.
    pub v: PathBuf,
    /// G, where it is a file of its own.
    pub g: Option<PathBuf>,
    /// Bytes of both.
    pub bytes: u64,
    /// What data-gen's closed forms say.
    pub truth: Truth,
    /// The manifests of the first builds of it, with measures and without: all others must be the
    /// same.
    pub manifests: [Option<Vec<u8>>; 2],
}

impl Input {
    /// Makes the mesh in `dir`; what was there before is replaced.
    pub fn make(dir: &Path, shape: &Shape) -> Result<Input> {
        if dir.exists() {
            fs::remove_dir_all(dir).map_err(at(dir))?;
        }
        fs::create_dir(dir).map_err(at(dir))?;
        let name = format!("mesh.{}", shape.format);
        let (v, flip) = (dir.join(&name), shape.flip.to_string());
        let mut words = vec!["data-gen", shape.kind, "-t", &shape.triangles];
        words.extend(["--order", shape.order, "--flip", &flip, "-o"]);
        if !shape.positions {
            words.insert(1, "--no-positions");
        }
        let words = words.iter().map(AsRef::as_ref).chain([v.as_os_str()]);
        data_gen::args::run(&data_gen::Args::try_parse_from(words)?)?;
        let g = Some(dir.join("mesh.G.npy")).filter(|g| g.exists());
        let mut bytes = 0;
        for path in [Some(&v), g.as_ref()].into_iter().flatten() {
            let mut file = fs::File::open(path).map_err(at(path))?;
            file.sync_all().map_err(at(path))?;
            io::copy(&mut file, &mut io::sink()).map_err(at(path))?;
            bytes += length(path)?;
        }
        let truth = closed_forms(&dir.join(format!("{name}.json")))?;
        let (shape, manifests) = (shape.clone(), [None, None]);
        Ok(Input {
            shape,
            v,
            g,
            bytes,
            truth,
            manifests,
        })
    }

    /// The files, for the floor to read.
    pub fn files(&self) -> Vec<&Path> {
        let files = [Some(&self.v), self.g.as_ref()];
        files.into_iter().flatten().map(PathBuf::as_path).collect()
    }

    /// Compares what a build found with what the mesh is known to hold.
    ///
    /// Flips of the build are flips of data-gen where triangles hang together: a closed surface
    /// has its outside, and elsewhere fewer than half were flipped. A triangle on its own stays.
    pub fn check(&self, found: &Counts) -> Result<()> {
        let truth = &self.truth;
        let regular = truth.distinct_edges - truth.border_edges - truth.nonmanifold_edges;
        let apart = truth.components == truth.triangles;
        let corners = 3 * (truth.triangles - truth.degenerate);
        let expected = Counts {
            triangles: truth.triangles,
            vertices: truth.vertices,
            unreferenced_vertices: truth.unreferenced,
            degenerate: truth.degenerate,
            distinct_edges: truth.distinct_edges,
            regular_edges: regular,
            border_edges: truth.border_edges,
            nonmanifold_edges: truth.nonmanifold_edges,
            nonmanifold_corners: corners - truth.border_edges - 2 * regular,
            inconsistent_edges: truth.inconsistent_edges,
            components: truth.components,
            components_joined: truth.components_joined,
            nonorientable_components: truth.nonorientable_components,
            closed_components: truth.closed_components,
            watertight_components: truth.closed_components,
            flipped_triangles: if apart { 0 } else { truth.flipped },
            ..Counts::default()
        };
        if *found == expected {
            return Ok(());
        }
        Err(format!("expected {expected:#?}, found {found:#?}").into())
    }
}

/// The counts that data-gen wrote beside its mesh.
fn closed_forms(path: &Path) -> Result<Truth> {
    let text = fs::read(path).map_err(at(path))?;
    let facts: serde_json::Value = serde_json::from_slice(&text)?;
    let count = |key: &str| {
        let count = facts[key].as_u64();
        count.ok_or_else(|| format!("{}: no count `{key}`", path.display()))
    };
    Ok(Truth {
        triangles: count("triangles")?,
        vertices: count("vertices")?,
        distinct_edges: count("distinct_edges")?,
        border_edges: count("border_edges")?,
        nonmanifold_edges: count("nonmanifold_edges")?,
        components: count("components")?,
        components_joined: count("components_joined")?,
        closed_components: count("closed_components")?,
        nonorientable_components: count("nonorientable_components")?,
        degenerate: count("degenerate")?,
        unreferenced: count("unreferenced")?,
        inconsistent_edges: count("inconsistent_edges")?,
        flipped: count("flipped")?,
        ..Truth::default()
    })
}
