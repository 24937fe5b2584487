//! `cornermill picture`: a folder as a PNG.

use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::parent;
use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::report::picture::{Background, ColorBy, PictureRequest, View, direction, draw};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `picture`.
#[derive(Debug, Args)]
pub struct PictureArgs {
    /// Mesh folder
    folder: PathBuf,
    /// PNG file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Pixels: N, or WxH, up to 8192 each
    #[arg(long, value_name = "SIZE", default_value = "1024", value_parser = size)]
    size: [u32; 2],
    /// Where the viewer stands: front, back, left, right, top, bottom, iso, or in direction X,Y,Z
    #[arg(
        long,
        value_name = "VIEW",
        default_value = "iso",
        allow_hyphen_values = true
    )]
    #[arg(value_parser = |text: &str| text.parse::<View>())]
    view: View,
    /// The direction that is up in the mesh
    #[arg(
        long,
        value_name = "X,Y,Z",
        default_value = "0,1,0",
        allow_hyphen_values = true
    )]
    #[arg(value_parser = up)]
    up: Up,
    /// What colours tell apart
    #[arg(long, value_enum, default_value_t)]
    color: ColorArg,
    /// Draw border edges (dark) and non-manifold edges (red) as lines [default]
    #[arg(long, overrides_with = "no_marks")]
    marks: bool,
    /// Draw no lines
    #[arg(long)]
    no_marks: bool,
    /// What lies behind: white, black, transparent, or #rrggbb
    #[arg(long, value_name = "COLOR", default_value = "white")]
    #[arg(value_parser = |text: &str| text.parse::<Background>())]
    background: Background,
    /// Samples along each side of a pixel, 1 to 4 [default: 4 up to 512 pixels, 2 up to 4096,
    /// else 1]
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    work: WorkArgs,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum ColorArg {
    /// A hue for each component
    #[default]
    Component,
    /// Blue where the front is seen, orange where the back is
    Orientation,
    /// By place in the swirl order of the component, from dark to bright
    Swirl,
    /// One colour
    Plain,
}

/// A direction, in a type that clap takes for one value.
#[derive(Clone, Copy, Debug)]
struct Up([f64; 3]);

fn up(text: &str) -> Result<Up> {
    direction(text).map(Up)
}

/// `N` or `WxH`.
fn size(text: &str) -> Result<[u32; 2]> {
    let number = |part: &str| part.parse::<u32>().ok();
    let parts = match text.split_once('x') {
        Some((width, height)) => number(width).zip(number(height)),
        None => number(text).map(|n| (n, n)),
    };
    parts
        .map(|(width, height)| [width, height])
        .ok_or_else(|| Error::Usage(format!("size '{text}': expected pixels as N or as WxH")))
}

/// Runs `picture`.
///
/// # Errors
/// Those of [`draw`].
pub(super) fn run(args: &PictureArgs) -> Result<Outcome> {
    let request = PictureRequest {
        size: args.size,
        view: args.view,
        up: args.up.0,
        color: match args.color {
            ColorArg::Component => ColorBy::Component,
            ColorArg::Orientation => ColorBy::Orientation,
            ColorArg::Swirl => ColorBy::Swirl,
            ColorArg::Plain => ColorBy::Plain,
        },
        marks: !args.no_marks,
        background: args.background,
        samples: args.samples,
    };
    let ws = args.work.workspace(parent(&args.output))?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let count = draw(&ws, &folder, &request, &args.output, args.force)?;
    if count.nonfinite > 0 {
        ws.progress.note(&format!(
            "{} triangles are left out: a vertex of theirs is not finite",
            count.nonfinite
        ));
    }
    if !args.work.quiet {
        let [width, height] = request.size;
        tell(&format!(
            "{}: {width} x {height}, {} triangles drawn, {} left out (not finite), {} \
             degenerate, {} bytes\n",
            args.output.display(),
            count.triangles,
            count.nonfinite,
            count.degenerate,
            count.bytes
        ))?;
    }
    Ok(Outcome::Done)
}
