//! The rows of an ascii PLY: one row a line.
//!
//! Why a row may not share or leave its line: the format writes each row on a line of its own,
//! so a value too many or too few is noticed where it stands, instead of shifting every value
//! behind it. Too many are passed over, with a note, when they follow properties that are not
//! used anyway (some writers spell colours otherwise than their header says); behind a
//! coordinate or a corner they are an error, since they may belong to it. Empty lines between
//! rows are passed over.
//!
//! Memory: the reader's buffer. I/O: the input once.

use super::{Plan, Step, TRAILING};
use crate::disk::Workspace;
use crate::error::Result;
use crate::input::CoordKind;
use crate::input::cut::Strip;
use crate::input::reader::ByteReader;
use crate::input::sink::MeshSink;
use crate::input::text::{Dialect, Lexer, shown};

/// Reads the rows of all elements, and that nothing follows.
pub(super) fn read(
    ws: &Workspace,
    reader: ByteReader,
    line: u64,
    plans: &[Plan],
    sink: &mut MeshSink,
) -> Result<ByteReader> {
    let path = reader.path().to_owned();
    let mut lexer = Lexer::new(reader, Dialect::Plain, line);
    // Rows with more values than the header says, and the line of the first.
    let mut surplus = (0u64, u64::MAX);
    for plan in plans {
        for row in 0..plan.rows {
            // A row of no property has no line either.
            if plan.steps.is_empty() {
                break;
            }
            if !lexer.seek_word()? {
                let reader = lexer.into_reader();
                return Err(reader.cut_short(plan.row(row)));
            }
            if plan.is_vertex() {
                vertex(&mut lexer, plan, sink)?;
            } else {
                other(&mut lexer, plan, sink)?;
            }
            if lexer.line_ended()? {
                continue;
            }
            let unused = matches!(
                plan.steps.last(),
                Some(Step::Skip(_) | Step::SkipList { .. })
            );
            if !unused {
                let found = shown(lexer.word()?.unwrap_or_default());
                let what = format!("the end of the line after {}", plan.row(row));
                let help = "a row has more values than the header says; correct one of them";
                return Err(lexer.error(what, found, help));
            }
            surplus.0 += 1;
            surplus.1 = surplus.1.min(lexer.line());
            lexer.next_line()?;
        }
    }
    if lexer.seek_word()? {
        let found = shown(lexer.word()?.unwrap_or_default());
        return Err(lexer.error("the end of the file", found, TRAILING));
    }
    if surplus.0 > 0 {
        ws.progress.note(&format!(
            "{}: {} rows, from line {} on, have more values than the header says; they follow \
             properties that are not used, and were passed over",
            path.display(),
            surplus.0,
            surplus.1
        ));
    }
    Ok(lexer.into_reader())
}

fn vertex(lexer: &mut Lexer, plan: &Plan, sink: &mut MeshSink) -> Result<()> {
    let what = "a coordinate";
    match sink.kind() {
        CoordKind::F4 => {
            let mut at = [0f32; 3];
            for step in &plan.steps {
                match *step {
                    Step::Coord(axis, _) => at[axis] = lexer.f4(what)?,
                    step => skip(lexer, step)?,
                }
            }
            sink.rounded4(at)
        }
        CoordKind::F8 => {
            let mut at = [0f64; 3];
            for step in &plan.steps {
                match *step {
                    Step::Coord(axis, _) => at[axis] = lexer.f8(what)?,
                    step => skip(lexer, step)?,
                }
            }
            sink.vertex8(at)
        }
    }
}

fn other(lexer: &mut Lexer, plan: &Plan, sink: &mut MeshSink) -> Result<()> {
    for step in &plan.steps {
        match *step {
            Step::Face { .. } => face(lexer, sink)?,
            Step::Strip { .. } => strip(lexer, sink)?,
            step => skip(lexer, step)?,
        }
    }
    Ok(())
}

fn face(lexer: &mut Lexer, sink: &mut MeshSink) -> Result<()> {
    let line = lexer.line();
    let corners = lexer.count("the number of corners")?;
    sink.begin_face();
    for _ in 0..corners {
        let v = index(lexer)?;
        sink.corner(v)?;
    }
    sink.end_face(|| format!("line {line}"))?;
    Ok(())
}

fn index(lexer: &mut Lexer) -> Result<u64> {
    let v = lexer.integer("an index of a vertex")?;
    u64::try_from(v).map_err(|_| {
        let what = "an index of a vertex, 0 or more";
        let help = "the file is damaged, or made by a faulty program";
        lexer.error(what, v.to_string(), help)
    })
}

fn strip(lexer: &mut Lexer, sink: &mut MeshSink) -> Result<()> {
    let corners = lexer.count("the length of the strip")?;
    let mut strip = Strip::default();
    for _ in 0..corners {
        match lexer.integer("an index of a vertex, or -1")? {
            -1 => strip = Strip::default(),
            v => match u64::try_from(v) {
                Ok(v) => {
                    if let Some(triangle) = strip.corner(v) {
                        sink.triangle(triangle)?;
                    }
                }
                Err(_) => {
                    let what = "an index of a vertex, or -1";
                    return Err(lexer.error(what, v.to_string(), ""));
                }
            },
        }
    }
    Ok(())
}

fn skip(lexer: &mut Lexer, step: Step) -> Result<()> {
    let words = match step {
        Step::SkipList { .. } => lexer.count("the length of a list")?,
        _ => 1,
    };
    for _ in 0..words {
        lexer.need("a value of a property that is not used")?;
    }
    Ok(())
}
