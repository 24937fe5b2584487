//! A mesh folder as one page of HTML: verdicts first, then pictures, histograms, culprits,
//! components, files, and what the build cost.
//!
//! The page needs nothing but itself: style and pictures are inside, there is no script, and no
//! address in it leads elsewhere. All text from outside is escaped.
//!
//! Memory: that of a picture ([`least_memory`]) and the text of the tables, whose rows are few
//! whatever the mesh; pictures are written as they are made. I/O: `components.npy` once, a row
//! of V and G for each culprit that is named, and the mesh once for each picture.

mod base64;
mod chart;
mod cost;
mod markup;
mod tables;
mod verdicts;

use super::picture::{self, ColorBy, PictureRequest, View};
use super::{Report, gather};
use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::{Folder, Manifest, Measures, Outputs};
use base64::Base64;
use chart::{Class, histogram, range};
use cost::Cost;
use markup::{count, escape};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The style of the page.
const STYLE: &str = include_str!("style.css");

/// What to put on the page.
#[derive(Clone, Debug)]
pub struct PageRequest {
    /// Pixels of a picture each way; 0 leaves pictures out.
    pub pixels: u32,
    /// The direction that is up in the mesh.
    pub up: [f64; 3],
    /// The report of the build (`build --json=FILE`), for what it cost.
    pub build: Option<PathBuf>,
}

impl Default for PageRequest {
    fn default() -> PageRequest {
        PageRequest {
            pixels: 480,
            up: [0.0, 1.0, 0.0],
            build: None,
        }
    }
}

/// The pictures: what each shows, from where, and what its colours tell.
const PICTURES: [(&str, View, ColorBy); 6] = [
    ("By component", View::Iso, ColorBy::Component),
    ("Fronts blue, backs orange", View::Iso, ColorBy::Orientation),
    ("Front", View::Front, ColorBy::Component),
    ("Right", View::Right, ColorBy::Component),
    ("Back", View::Back, ColorBy::Component),
    ("Top", View::Top, ColorBy::Component),
];

fn picture_request(request: &PageRequest, view: View, color: ColorBy) -> PictureRequest {
    PictureRequest {
        size: [request.pixels; 2],
        view,
        up: request.up,
        color,
        samples: Some(2),
        ..PictureRequest::default()
    }
}

/// The least budget in bytes with which a page is not refused, on so many threads.
pub fn least_memory(folder: &Folder, request: &PageRequest, threads: usize) -> u64 {
    let of = |&(_, view, color): &(&str, View, ColorBy)| {
        picture::least_memory(folder, &picture_request(request, view, color), threads)
    };
    match request.pixels {
        0 => 0,
        _ => PICTURES.iter().map(of).max().unwrap_or(0),
    }
}

/// Writes the page of a folder to a file, and returns its length in bytes.
///
/// The target must not exist unless `force` is set, nor lie in a mesh folder. It appears
/// under its name when it is complete; on an error it does not.
///
/// # Errors
/// [`Error::Usage`] when the target exists; [`Error::Budget`] when pictures do not fit;
/// [`Error::Input`] when the folder is damaged or `build` is the report of another mesh;
/// [`Error::Io`], [`Error::DiskLimit`].
pub fn write(
    ws: &Workspace,
    folder: &Folder,
    request: &PageRequest,
    target: &Path,
    force: bool,
) -> Result<u64> {
    let manifest = folder.manifest();
    let cost = request.build.as_deref();
    let cost = cost
        .map(|path| Cost::read(path, &manifest.counts))
        .transpose()?;
    let inputs = [Some(folder.path()), request.build.as_deref()];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().collect();
    let mut target = Outputs::new(&inputs, force).create(target)?;
    let path = target.path().to_owned();
    let report = gather(folder, None)?;
    let mut page = Page {
        out: BufWriter::with_capacity(64 << 10, target.file()),
        path: &path,
    };
    page.put(&head(folder, &report))?;
    page.put(&verdicts::section(manifest, &report))?;
    page.put(&tables::counts(manifest))?;
    pictures(&mut page, ws, folder, request)?;
    page.put(&sizes(&report))?;
    if let Some(measures) = &manifest.measures {
        page.put(&valences(measures))?;
    }
    page.put(&tables::culprits(folder, &report)?)?;
    page.put(&tables::largest(&report))?;
    page.put(&tables::files(&report))?;
    if let Some(cost) = &cost {
        page.put(&tables::cost(cost))?;
    }
    page.put(&foot(manifest))?;
    page.out
        .flush()
        .map_err(|e| Error::io(&path, "write the page", e))?;
    drop(page);
    let bytes = target.bytes()?;
    target.keep()?;
    ws.io.add_written(bytes);
    Ok(bytes)
}

/// The page on its way to the file.
struct Page<'a, W> {
    out: W,
    path: &'a Path,
}

impl<W: Write> Page<'_, W> {
    fn put(&mut self, html: &str) -> Result<()> {
        self.out
            .write_all(html.as_bytes())
            .map_err(|e| Error::io(self.path, "write the page", e))
    }
}

fn head(folder: &Folder, report: &Report) -> String {
    let name = folder
        .path()
        .file_name()
        .unwrap_or(folder.path().as_os_str());
    let name = escape(&name.to_string_lossy());
    let c = &report.counts;
    let coords = report.coords.as_deref().unwrap_or("no");
    let orient = format!("{:?}", report.options.orient).to_lowercase();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <link rel=\"icon\" href=\"data:,\">\
         <title>{name}: mesh report</title><style>\n{STYLE}</style></head><body>\n\
         <a class=\"skip\" href=\"#verdicts\">Skip to the verdicts</a>\n\
         <header><h1>{name}</h1><p>{} and {}, from {} input; {} coordinates, {} indices, \
         orientation by {}{}.</p></header>\n<main>\n",
        count(c.triangles, "triangle", "triangles"),
        count(c.vertices, "vertex", "vertices"),
        escape(&report.format),
        escape(coords),
        escape(&report.index),
        escape(&orient),
        if report.options.weld { ", welded" } else { "" },
    )
}

fn foot(manifest: &Manifest) -> String {
    format!(
        "</main>\n<footer><p>Made from the mesh folder alone by Cornermill {}. Folder format {}, \
         manifest checksum {}.</p></footer>\n</body></html>\n",
        env!("CARGO_PKG_VERSION"),
        manifest.version,
        escape(&manifest.checksum)
    )
}

fn pictures<W: Write>(
    page: &mut Page<W>,
    ws: &Workspace,
    folder: &Folder,
    request: &PageRequest,
) -> Result<()> {
    page.put("<section aria-labelledby=\"pictures\"><h2 id=\"pictures\">Pictures</h2>\n")?;
    if request.pixels == 0 {
        return page.put("<p>Left out, as asked.</p></section>\n");
    }
    if !picture::drawable(folder)? {
        return page.put(
            "<p>There is nothing to draw: no triangle with finite coordinates.</p></section>\n",
        );
    }
    page.put(
        "<p class=\"soft\">Border edges are dark lines, non-manifold edges red ones. Backs of \
         triangles are darker.</p><div class=\"plates\">\n",
    )?;
    let pixels = request.pixels;
    for (name, view, color) in PICTURES {
        page.put(&format!(
            "<figure><img width=\"{pixels}\" height=\"{pixels}\" alt=\"The mesh drawn: {}\" \
             src=\"data:image/png;base64,",
            escape(&name.to_lowercase())
        ))?;
        let drawn = picture_request(request, view, color);
        let mut encoded = Base64::new(&mut page.out);
        picture::draw_to(ws, folder, &drawn, &mut encoded, page.path)?;
        encoded
            .finish()
            .map_err(|e| Error::io(page.path, "write the page", e))?;
        page.put(&format!(
            "\"><figcaption>{}</figcaption></figure>\n",
            escape(name)
        ))?;
    }
    page.put("</div></section>\n")
}

fn sizes(report: &Report) -> String {
    let classes: Vec<Class> = report
        .sizes
        .iter()
        .map(|s| Class {
            name: range(s.from, s.to),
            count: s.components,
        })
        .collect();
    let chart = match classes.len() {
        0 => "<p>There are no components.</p>\n".to_owned(),
        _ => histogram(
            "size",
            "Components by size",
            ["Triangles", "Components"],
            &classes,
        ),
    };
    format!(
        "<section aria-labelledby=\"sizes\"><h2 id=\"sizes\">Components by size</h2>\
         <p class=\"soft\">Triangles of a component, and how many components have so many. The \
         bars are logarithmic.</p>\n{chart}</section>\n"
    )
}

fn valences(measures: &Measures) -> String {
    let classes: Vec<Class> = measures
        .valences
        .iter()
        .map(|v| Class {
            name: range(v.from, v.to),
            count: v.vertices,
        })
        .collect();
    let chart = match classes.len() {
        0 => "<p>There are no vertices.</p>\n".to_owned(),
        _ => histogram(
            "valence",
            "Vertices by valence",
            ["Valence", "Vertices"],
            &classes,
        ),
    };
    format!(
        "<section aria-labelledby=\"valences\"><h2 id=\"valences\">Vertices by valence</h2>\
         <p class=\"soft\">Triangles at a vertex, and how many vertices have so many; {} at most. \
         The bars are logarithmic.</p>\n{chart}</section>\n",
        markup::number(measures.largest_valence)
    )
}
