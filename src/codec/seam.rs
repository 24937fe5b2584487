//! Vertices that several chunks have: each belongs to the first of them, and the others refer to it.
//!
//! Why three sorts: chunks are coded in any order, so which number a vertex has in its first chunk
//! is known only when all are. Sorted by vertex, the chunks that have it stand together, the first
//! ahead; sorted by (chunk, number), each asked-for vertex learns how many before it in its chunk
//! are references themselves, and so its rank among the chunk's own; sorted back, each chunk has
//! its references in order.
//!
//! Memory: what is leased for writers and one sorter at a time. I/O: 24, 40 and 32 bytes for each
//! use of a shared vertex, written and read once.

use super::Damaged;
use super::chunk::MODEL_BYTES;
use super::file::Entry;
use super::model::{self, Contexts, Fast, Model};
use super::range::{Coder, Decoder, Encoder};
use crate::disk::{ScratchFile, Workspace};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Plan, Record, Shuffle};
use bytemuck::{Pod, Zeroable};

/// A vertex that may be shared: vertex, chunk, its place there.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Use(pub [u64; 3]);

impl Record for Use {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        self.0[level]
    }
}

/// Chunk, number there, and either 0 (it is a reference) or 1 with the chunk and the number of
/// the reference to it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Asked([u64; 5]);

impl Record for Asked {
    const LEVELS: usize = 5;
    fn key(&self, level: usize) -> u64 {
        self.0[level]
    }
}

/// Chunk, number there, the chunk whose vertex it is, and its rank among that chunk's own.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Answer([u64; 4]);

impl Record for Answer {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        self.0[level]
    }
}

/// A vertex of a chunk that is an earlier chunk's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reference {
    /// Its place in the chunk.
    pub place: u64,
    /// The chunk whose vertex it is.
    pub chunk: u64,
    /// Its rank among the vertices of that chunk that are its own.
    pub rank: u64,
}

/// Where the coded references of a chunk lie.
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    /// Byte where they begin.
    pub at: u64,
    /// Bytes.
    pub bytes: u64,
    /// References.
    pub count: u64,
}

/// Memory of a sorter, or of the writers of a sort, at most.
const SORT_BYTES: u64 = 4 << 20;

/// Memory of a sorter of so many records: all of them twice, when they are few.
fn sorter_bytes(record: u64, records: u64) -> u64 {
    records
        .saturating_mul(4 * record)
        .saturating_add(256 << 10)
        .min(SORT_BYTES)
}

/// Bytes that the coded references of a chunk take at most: three a triangle, of eight bytes.
fn coded_bytes(references: u64) -> u64 {
    MODEL_BYTES + 8 * references.min(3 * super::file::MOST_TRIANGLES)
}

/// Memory in which so many uses of shared vertices are resolved.
pub fn least(uses: u64) -> u64 {
    let asked = plan(40, uses.saturating_mul(2)).writer_bytes();
    let answers = plan(32, uses).writer_bytes();
    let first = sorter_bytes(24, uses) + asked;
    let second = asked + sorter_bytes(40, uses.saturating_mul(2)) + answers;
    let third = answers + coded_bytes(uses) + sorter_bytes(32, uses);
    first.max(second).max(third) + (64 << 10)
}

/// A plan for the sort of so many records.
pub fn plan(record: usize, records: u64) -> Plan {
    Plan::within(SORT_BYTES, 1, record, records, SORT_BYTES)
}

/// Resolves the uses of shared vertices; the coded references of each chunk go to `out`.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn resolve(
    ws: &Workspace,
    uses: Buckets<Use>,
    spans: &mut [Span],
    out: &ScratchFile,
) -> Result<()> {
    let (records, chunks) = (uses.records(), (spans.len() as u64).max(1));
    ws.budget.check("shared vertices", least(records))?;
    let asked = Shuffle::new(ws, "shared vertices", 0..chunks, plan(40, 2 * records))?;
    let mut writer = asked.writer()?;
    let (mut first, mut firsts) = (Use([u64::MAX; 3]), 0);
    uses.sorted_all(&mut uses.sorter(sorter_bytes(24, records))?, &mut |uses| {
        for &one in uses {
            let [v, chunk, place] = one.0;
            if v != first.0[0] {
                (first, firsts) = (one, firsts + 1);
                continue;
            }
            writer.push(Asked([chunk, place, 0, 0, 0]))?;
            writer.push(Asked([first.0[1], first.0[2], 1, chunk, place]))?;
        }
        Ok(())
    })?;
    writer.finish()?;
    drop(uses);
    let asked = asked.finish()?;
    let met = firsts + asked.records() / 2;
    conserve("shared vertices", "uses", records, met)?;
    let answers = Shuffle::new(ws, "references", 0..chunks, plan(32, asked.records() / 2))?;
    let mut writer = answers.writer()?;
    let (mut current, mut before) = (u64::MAX, 0);
    asked.sorted_all(
        &mut asked.sorter(sorter_bytes(40, asked.records()))?,
        &mut |asked| {
            for &Asked([chunk, place, kind, to_chunk, to_place]) in asked {
                if chunk != current {
                    (current, before) = (chunk, 0);
                }
                if kind == 0 {
                    before += 1;
                } else {
                    writer.push(Answer([to_chunk, to_place, chunk, place - before]))?;
                }
            }
            Ok(())
        },
    )?;
    writer.finish()?;
    let answers = answers.finish()?;
    conserve(
        "references",
        "questions",
        asked.records() / 2,
        answers.records(),
    )?;
    drop(asked);
    let given = answers.records();
    code_all(ws, answers, spans, out)?;
    let coded = spans.iter().map(|span| span.count).sum();
    conserve("references", "answers", given, coded)
}

/// Codes the references of all chunks.
fn code_all(
    ws: &Workspace,
    answers: Buckets<Answer>,
    spans: &mut [Span],
    out: &ScratchFile,
) -> Result<()> {
    let _lease = ws
        .budget
        .lease("coded references", coded_bytes(answers.records()))?;
    let mut state: Option<(u64, State, Encoder)> = None;
    let mut flush = |state: Option<(u64, State, Encoder)>| -> Result<()> {
        if let Some((chunk, state, coder)) = state {
            let bytes = coder.finish();
            spans[chunk as usize] = Span {
                at: out.append(&bytes)?,
                bytes: bytes.len() as u64,
                count: state.count,
            };
        }
        Ok(())
    };
    answers.sorted_all(
        &mut answers.sorter(sorter_bytes(32, answers.records()))?,
        &mut |answers| {
            for &Answer([to, place, chunk, rank]) in answers {
                if state.as_ref().is_none_or(|s| s.0 != to) {
                    flush(state.take())?;
                }
                let (_, code, coder) =
                    state.get_or_insert_with(|| (to, State::new(), Encoder::new(Vec::new())));
                let reference = Reference { place, chunk, rank };
                code.code(coder, reference);
            }
            Ok(())
        },
    )?;
    flush(state)
}

/// The model of references, and the last one.
struct State {
    model: Fast,
    last: Reference,
    count: u64,
}

impl State {
    fn new() -> State {
        State {
            model: Fast::new(),
            last: Reference {
                place: 0,
                chunk: 0,
                rank: 0,
            },
            count: 0,
        }
    }

    /// Codes a reference, by what it is more than the last.
    fn code(&mut self, coder: &mut impl Coder, truth: Reference) -> Reference {
        let contexts = [0, 1, 2].map(Contexts::of);
        let gap = truth.place.wrapping_sub(self.last.place);
        let gap = self
            .model
            .size(coder, model::REFERENCE, &contexts[0], 4, gap);
        let step = truth.chunk.wrapping_sub(self.last.chunk) as i64;
        let step = self
            .model
            .number(coder, model::REFERENCE, &contexts[1], (0, 0), step);
        let ranks = truth.rank.wrapping_sub(self.last.rank) as i64;
        let ranks = self
            .model
            .number(coder, model::REFERENCE, &contexts[2], (6, 0), ranks);
        self.last = Reference {
            place: self.last.place.wrapping_add(gap),
            chunk: self.last.chunk.wrapping_add(step as u64),
            rank: self.last.rank.wrapping_add(ranks as u64),
        };
        self.count += 1;
        self.last
    }
}

/// Decodes the references of a chunk and holds them to the chunks before it.
///
/// # Errors
/// [`Damaged`].
pub fn decode(bytes: &[u8], entry: &Entry, earlier: &[Entry]) -> Result<Vec<Reference>, Damaged> {
    let mut references = Vec::new();
    if entry.references == 0 {
        return if bytes.is_empty() {
            Ok(references)
        } else {
            Err(Damaged("bytes for no reference"))
        };
    }
    let mut coder = Decoder::new(bytes);
    let mut state = State::new();
    for i in 0..entry.references {
        let last = state.last.place;
        let none = Reference {
            place: 0,
            chunk: 0,
            rank: 0,
        };
        let reference = state.code(&mut coder, none);
        let owner = usize::try_from(reference.chunk)
            .ok()
            .and_then(|c| earlier.get(c));
        let ascends = i == 0 || reference.place > last;
        let known = owner.is_some_and(|o| reference.rank < o.own());
        if !ascends || !known || reference.place >= entry.vertices {
            return Err(Damaged("a reference to no vertex of an earlier chunk"));
        }
        references.push(reference);
    }
    if !coder.ended() {
        return Err(Damaged("another number of bytes than its references take"));
    }
    Ok(references)
}
