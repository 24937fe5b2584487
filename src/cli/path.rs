//! `cornermill path`: the shortest path between two corners, listed or exported as a strip.

use super::export::FormatArg;
use super::pieces::Pieces;
use super::work::WorkArgs;
use super::{Outcome, print};
use crate::build::parent;
use crate::corner::Corner;
use crate::disk::Workspace;
use crate::error::Result;
use crate::export::{ExportCount, ExportRequest, Strip, export_strip, least_strip_memory};
use crate::folder::Folder;
use crate::table::CornerTable;
use crate::walk::{self, Path, Search};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Version of the keys of `--json`.
const VERSION: u32 = 1;

/// Arguments of `path`.
#[derive(Debug, Args)]
pub struct PathArgs {
    /// Mesh folder
    folder: PathBuf,
    /// Corner to begin at (its triangle; 3t, 3t + 1 and 3t + 2 are those of triangle t)
    #[arg(long, value_name = "C")]
    from: u64,
    /// Corner to end at
    #[arg(long, value_name = "C")]
    to: u64,
    /// Write the triangles of the path there, instead of listing its corners
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Format, instead of what the name ends in
    #[arg(long, value_enum, requires = "output")]
    format: Option<FormatArg>,
    /// PLY as text
    #[arg(long, requires = "output")]
    ascii: bool,
    /// Replace an existing file
    #[arg(long, requires = "output")]
    force: bool,
    /// Print as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// Runs `path`: two corners that nothing joins are a failed check, exit code 1.
///
/// # Errors
/// Those of [`walk::path`] and [`export_strip`].
pub(super) fn run(args: &PathArgs) -> Result<Outcome> {
    let request = match &args.output {
        None => None,
        Some(output) => Some(ExportRequest {
            ascii: args.ascii,
            force: args.force,
            ..ExportRequest::new(FormatArg::of(args.format, output)?, output)
        }),
    };
    // Scratch goes beside what is written; the folder may be read-only.
    let temp = std::env::temp_dir();
    let beside = args.output.as_deref().map_or(&*temp, parent);
    let ws = args.work.workspace(beside)?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let table = CornerTable::from_folder(&folder)?;
    let ends = [args.from, args.to].map(Corner::new);
    let mut path = match find(&ws, &folder, &table, ends, request.as_ref())? {
        Search::Found(path) => path,
        Search::Apart { from, to } => {
            apart(args, from, to)?;
            return Ok(Outcome::CheckFailed);
        }
    };
    let written = match &request {
        None => None,
        Some(request) => Some(write(&ws, &folder, &table, &mut path, request)?),
    };
    if args.json {
        print_json(args, &table, &mut path, written.as_ref())?;
    } else if !args.work.quiet {
        print_text(args, &table, &mut path, written.as_ref())?;
    }
    table.intact()?;
    Ok(Outcome::Done)
}

/// Finds the path, in memory that leaves the export its own.
fn find<'a>(
    ws: &'a Workspace,
    folder: &'a Folder,
    table: &'a CornerTable,
    [from, to]: [Corner; 2],
    request: Option<&ExportRequest>,
) -> Result<Search<'a>> {
    let search = walk::least_path_memory(table);
    let export = request.map_or(0, |request| least_strip_memory(folder, request));
    // What the search gives back when it is done, the export may have.
    let kept = export.saturating_sub(search - walk::LEAST_FOUND_MEMORY);
    ws.budget.check("a path and its export", search + kept)?;
    let _kept = ws.budget.lease("the export of a path", kept)?;
    walk::path(ws, folder, table, from, to)
}

/// The triangles of a path, as the folder has them.
struct Triangles<'p, 'a> {
    folder: &'p Folder,
    table: &'p CornerTable,
    path: &'p mut Path<'a>,
}

impl Strip for Triangles<'_, '_> {
    fn count(&self) -> u64 {
        self.path.triangles()
    }

    fn each(&mut self, f: &mut dyn FnMut([u64; 3]) -> Result<()>) -> Result<()> {
        for c in self.path.corners() {
            let mut triangle = [0; 3];
            for (v, c) in triangle.iter_mut().zip(c?.t().corners()) {
                *v = walk::vertex(self.folder, self.table, c)?.id();
            }
            f(triangle)?;
        }
        self.table.intact()
    }
}

fn write(
    ws: &Workspace,
    folder: &Folder,
    table: &CornerTable,
    path: &mut Path<'_>,
    request: &ExportRequest,
) -> Result<ExportCount> {
    let mut triangles = Triangles {
        folder,
        table,
        path,
    };
    export_strip(ws, folder, request, &mut triangles)
}

/// The vertices of the triangle of c, from its corner 0.
fn vertices(table: &CornerTable, c: Corner) -> [u64; 3] {
    c.t().corners().map(|c| table.v(c).id())
}

/// Says why there is no path.
fn apart(args: &PathArgs, from: Option<u64>, to: Option<u64>) -> Result<()> {
    let place = |corner: u64, component: Option<u64>| match component {
        Some(component) => format!("corner {corner} is in component {component}"),
        None => format!("corner {corner} is in a degenerate triangle, which no edge joins"),
    };
    let why = format!("{}, {}", place(args.from, from), place(args.to, to));
    if !args.json {
        return print(&format!("no path: {why}\n"));
    }
    let mut out = Pieces::new();
    let head = json!({
        "version": VERSION, "found": false, "from": args.from, "to": args.to,
        "from_component": from, "to_component": to, "reason": why, "triangles": 0,
        "exported": null,
    });
    out.begin(&head, "corners")?;
    out.end(&json!({}))
}

fn print_json(
    args: &PathArgs,
    table: &CornerTable,
    path: &mut Path<'_>,
    written: Option<&ExportCount>,
) -> Result<()> {
    let component = table.component(Corner::new(args.to).t());
    let exported = |w: &ExportCount| {
        let files: Vec<String> = w.files.iter().map(|f| f.display().to_string()).collect();
        json!({ "vertices": w.vertices, "bytes": w.bytes, "files": files })
    };
    let head = json!({
        "version": VERSION, "found": true, "from": args.from, "to": args.to,
        "from_component": component, "to_component": component, "reason": null,
        "triangles": path.triangles(), "exported": written.map_or(Value::Null, exported),
    });
    let mut out = Pieces::new();
    out.begin(&head, "corners")?;
    if written.is_none() {
        for c in path.corners() {
            let c = c?;
            let [corner, triangle] = [c.id(), c.t().id()];
            let vertices = vertices(table, c);
            out.item(&json!({ "corner": corner, "triangle": triangle, "vertices": vertices }))?;
        }
    }
    out.end(&json!({}))
}

fn print_text(
    args: &PathArgs,
    table: &CornerTable,
    path: &mut Path<'_>,
    written: Option<&ExportCount>,
) -> Result<()> {
    let mut out = Pieces::new();
    let (from, to) = (args.from, args.to);
    out.text(&format!(
        "path of {} triangles from corner {from} to corner {to}\n",
        path.triangles()
    ))?;
    if let Some(written) = written {
        let names: Vec<String> = written
            .files
            .iter()
            .map(|f| f.display().to_string())
            .collect();
        let (vertices, bytes) = (written.vertices, written.bytes);
        let names = names.join(", ");
        out.text(&format!("{vertices} vertices in {bytes} bytes: {names}\n"))?;
        return out.done();
    }
    out.text("      corner    triangle  vertices\n")?;
    for c in path.corners() {
        let c = c?;
        let [a, b, d] = vertices(table, c);
        let (corner, triangle) = (c.id(), c.t().id());
        out.text(&format!("{corner:>12}{triangle:>12}  {a} {b} {d}\n"))?;
    }
    out.done()
}
