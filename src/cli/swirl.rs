//! `cornermill swirl`: the triangles of a component in swirl order, each with its letter.

use super::Outcome;
use super::pieces::Pieces;
use super::work::WorkArgs;
use crate::corner::Corner;
use crate::error::Result;
use crate::folder::Folder;
use crate::table::CornerTable;
use crate::walk::{Clers, Entered, Letter, Side, Step, Tip, Walked};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Version of the keys of `--json`.
const VERSION: u32 = 1;

/// Arguments of `swirl`.
#[derive(Debug, Args)]
pub struct SwirlArgs {
    /// Mesh folder
    folder: PathBuf,
    /// Corner to begin at: its triangle, entered by the edge that it faces
    #[arg(long, value_name = "C")]
    from: u64,
    /// Triangles to list [default: the whole component]
    #[arg(long, value_name = "N")]
    limit: Option<u64>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// What was met so far.
#[derive(Default)]
struct Met {
    letters: [u64; 5],
    joined: u64,
}

impl Met {
    fn triangles(&self) -> u64 {
        self.letters.iter().sum()
    }
}

/// Runs `swirl`.
///
/// # Errors
/// Those of [`Clers`].
pub(super) fn run(args: &SwirlArgs) -> Result<Outcome> {
    let ws = args.work.workspace(&std::env::temp_dir())?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let table = CornerTable::from_folder(&folder)?;
    let start = Corner::new(args.from);
    let mut walk = Clers::new(&ws, &folder, &table, start)?;
    let component = table.component(start.t());
    let mut out = Pieces::new();
    if args.json {
        let head = json!({ "version": VERSION, "from": args.from, "component": component });
        out.begin(&head, "walk")?;
    } else if !args.work.quiet {
        out.text("letter    triangle  tip                 right               left              ")?;
        out.text("  entered from\n")?;
    }
    let mut met = Met::default();
    // One more is looked for than listed: it tells whether the walk was complete.
    let complete = loop {
        let walked = walk.next().transpose();
        if walked.is_err() {
            table.intact()?;
        }
        let Some(walked) = walked? else {
            break true;
        };
        match walked {
            Walked::Triangle(_) if args.limit == Some(met.triangles()) => break false,
            Walked::Triangle(step) => met.letters[step.letter as usize] += 1,
            Walked::Joined(_) => met.joined += 1,
        }
        if args.json {
            out.item(&item(&table, &walked))?;
        } else if !args.work.quiet {
            out.text(&line(&table, &walked))?;
        }
    };
    table.intact()?;
    finish(args, out, &met, complete)?;
    Ok(Outcome::Done)
}

fn finish(args: &SwirlArgs, mut out: Pieces, met: &Met, complete: bool) -> Result<()> {
    let [c, l, e, r, s] = met.letters;
    if args.json {
        return out.end(&json!({
            "triangles": met.triangles(),
            "letters": { "C": c, "L": l, "E": e, "R": r, "S": s },
            "joined": met.joined,
            "complete": complete,
        }));
    }
    if args.work.quiet {
        return out.done();
    }
    let (triangles, joined) = (met.triangles(), met.joined);
    let rest = if complete { "all of them" } else { "not all" };
    out.text(&format!(
        "{triangles} triangles of the component, {rest}: C {c}, L {l}, E {e}, R {r}, S {s}; \
         {joined} forks joined\n"
    ))?;
    out.done()
}

fn letter(letter: Letter) -> &'static str {
    match letter {
        Letter::C => "C",
        Letter::L => "L",
        Letter::E => "E",
        Letter::R => "R",
        Letter::S => "S",
    }
}

fn tip(tip: Tip) -> &'static str {
    match tip {
        Tip::New => "new",
        Tip::Visited => "visited",
        Tip::Border => "border",
    }
}

/// The state of a side, and the corner there.
fn side(side: Side) -> (&'static str, Option<u64>) {
    match side {
        Side::Open(c) => ("open", Some(c.id())),
        Side::Visited(c) => ("visited", Some(c.id())),
        Side::Border => ("border", None),
        Side::Cut => ("cut", None),
        Side::Degenerate => ("degenerate", None),
    }
}

/// Where the walk came from: the way, and the triangle.
fn entered(entered: Entered) -> (&'static str, Option<u64>) {
    match entered {
        Entered::Start => ("start", None),
        Entered::Right(t) => ("right", Some(t.id())),
        Entered::Left(t) => ("left", Some(t.id())),
        Entered::Across(t) => ("across", Some(t.id())),
    }
}

fn item(table: &CornerTable, walked: &Walked) -> Value {
    let step = match walked {
        Walked::Joined(fork) => {
            return json!({ "kind": "joined", "fork": fork.t().id(), "corner": fork.id() });
        }
        Walked::Triangle(step) => step,
    };
    let place = |at: Side| {
        let (state, corner) = side(at);
        json!({ "state": state, "corner": corner })
    };
    let (by, triangle) = entered(step.entered);
    json!({
        "kind": "triangle",
        "letter": letter(step.letter),
        "triangle": step.corner.t().id(),
        "corner": step.corner.id(),
        "tip": { "state": tip(step.tip), "vertex": table.v(step.corner).id() },
        "right": place(step.right),
        "left": place(step.left),
        "entered": { "by": by, "triangle": triangle },
    })
}

fn line(table: &CornerTable, walked: &Walked) -> String {
    match walked {
        Walked::Joined(fork) => format!(
            "          {:>10}  the left of this fork was visited meanwhile\n",
            fork.t().id()
        ),
        Walked::Triangle(step) => row(table, step),
    }
}

fn row(table: &CornerTable, step: &Step) -> String {
    let place = |at: Side| match side(at) {
        (state, Some(c)) => format!("{} {state}", c / 3),
        (state, None) => state.to_owned(),
    };
    let tip = format!("{} {}", table.v(step.corner).id(), tip(step.tip));
    let from = match entered(step.entered) {
        (by, Some(t)) => format!("{by} of {t}"),
        (by, None) => by.to_owned(),
    };
    format!(
        "{}         {:>10}  {tip:<18}  {:<18}  {:<18}  {from}\n",
        letter(step.letter),
        step.corner.t().id(),
        place(step.right),
        place(step.left),
    )
}
