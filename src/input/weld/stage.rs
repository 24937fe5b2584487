//! A weld between its passes: what those that are done leave for the others, brought on pass by
//! pass, and written down in between when a build is to be gone on with.
//!
//! Why a value is enough: a pass reads files that the pass before has finished, and writes files of
//! its own. The last one alone would write V over the ways back, in one file; where a journal
//! keeps those as they are, V has a file of its own, or the journal is given up for the room.
//!
//! Memory: of its own none; bits and counts of first uses where they are held. I/O: none but what is
//! asked for.

use super::bits::{Bits, Pair, Place};
use super::cut::Cut;
use super::firsts::{FirstUses, Held, place};
use super::group::{Groups, group};
use super::{Tuning, Welded, corners};
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{DataFile, ScratchFile, Workspace, fs, space};
use crate::error::{Error, Result, conserve};
use crate::folder::npy::DATA_START;
use crate::input::{CoordArray, Endian, IndexArray, IndexKind, Request, Source};
use crate::shuffle::Buckets;
use std::path::{Path, PathBuf};

/// The steps behind which a weld can be gone on with, as its passes come.
pub const STEPS: [&str; 3] = ["weld: read", "weld: group", "weld: place"];

/// What all passes of a weld know.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// The memory of each pass, and the windows.
    pub cut: Cut,
    /// Bits and counts of first uses go to a file, however few they are.
    pub filed: bool,
    /// The mesh's former G lies where the new one shall.
    pub placed: bool,
    /// Corners.
    pub count: u64,
}

/// A weld whose corners were read, with positions of bits `B` and corners of numbers `R`.
pub struct Weld<B: Bits, R: Index> {
    /// What all passes know.
    pub known: Known,
    /// For each corner the way back to the first of its block.
    pub backs: ScratchFile,
    /// What the last pass left besides.
    pub left: Left<B, R>,
}

/// What a pass leaves for the next.
pub enum Left<B: Bits, R: Index> {
    /// Positions with their corners.
    Places(Buckets<Place<B, R>>),
    /// Which of them are first uses.
    Groups(Groups<B, R>),
    /// The numbers of these, and G.
    Numbered(Numbered<R>),
}

/// First uses with their numbers.
pub struct Numbered<R: Index> {
    uses: FirstUses,
    others: Buckets<Pair<R>>,
    g: CoordArray,
}

/// A weld on its way, whatever the widths.
pub struct Welding(Box<dyn Between>);

/// What a pass comes to.
pub enum Next {
    /// Another one follows.
    Going(Welding),
    /// It was the last.
    Done(Welded),
}

/// A [`Weld`].
trait Between {
    fn step(&self) -> &'static str;
    fn on(self: Box<Self>, ws: &Workspace, request: &Request) -> Result<Next>;
    fn keep(&self, to: &mut Pen) -> Result<()>;
}

impl Welding {
    /// What is known of a weld once its corners were read.
    pub fn new<B: Bits, R: Index>(weld: Weld<B, R>) -> Welding {
        Welding(Box::new(weld))
    }

    /// The one of [`STEPS`] behind which it is.
    pub fn step(&self) -> &'static str {
        self.0.step()
    }

    /// Runs the next pass.
    ///
    /// # Errors
    /// As [`super::begin`].
    pub fn on(self, ws: &Workspace, request: &Request) -> Result<Next> {
        self.0.on(ws, request)
    }

    /// Runs all passes that are left.
    ///
    /// # Errors
    /// As [`super::begin`].
    #[cfg(test)]
    pub fn finish(mut self, ws: &Workspace, request: &Request) -> Result<Welded> {
        loop {
            match self.on(ws, request)? {
                Next::Going(weld) => self = weld,
                Next::Done(welded) => return Ok(welded),
            }
        }
    }
}

impl std::fmt::Debug for Welding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Welding").field(&self.step()).finish()
    }
}

impl<B: Bits, R: Index> Between for Weld<B, R> {
    fn step(&self) -> &'static str {
        STEPS[match self.left {
            Left::Places(_) => 0,
            Left::Groups(_) => 1,
            Left::Numbered(_) => 2,
        }]
    }

    fn on(self: Box<Self>, ws: &Workspace, request: &Request) -> Result<Next> {
        let Weld { known, backs, left } = *self;
        let left = match left {
            Left::Places(places) => {
                Left::Groups(group(ws, &known.cut, places, known.count, !known.held())?)
            }
            Left::Groups(groups) => Left::Numbered(number(ws, request, &known, groups)?),
            Left::Numbered(numbered) => {
                return end(ws, request, &known, (backs, numbered)).map(Next::Done);
            }
        };
        Ok(Next::Going(Welding::new(Weld { known, backs, left })))
    }

    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.list(&[B::KIND.bytes(), R::BYTES as u64])?;
        self.known.keep(to)?;
        to.file(&self.backs)?;
        match &self.left {
            Left::Places(places) => {
                to.number(0)?;
                places.keep(to)
            }
            Left::Groups(Groups { firsts, others }) => {
                to.number(1)?;
                firsts.keep(to)?;
                others.keep(to)
            }
            Left::Numbered(Numbered { uses, others, g }) => {
                to.number(2)?;
                uses.keep(to)?;
                others.keep(to)?;
                g.keep(to)
            }
        }
    }
}

impl<B: Bits, R: Index> Weld<B, R> {
    /// Reads back what is written behind the widths.
    fn restore(from: &mut Reader) -> Result<Welding> {
        let known = Known::restore(from)?;
        let backs = from.file()?;
        let left = match from.number()? {
            0 => Left::Places(Buckets::restore(from)?),
            1 => Left::Groups(Groups {
                firsts: Buckets::restore(from)?,
                others: Buckets::restore(from)?,
            }),
            _ => Left::Numbered(Numbered {
                uses: FirstUses::restore(from)?,
                others: Buckets::restore(from)?,
                g: CoordArray::restore(from)?,
            }),
        };
        Ok(Welding::new(Weld::<B, R> { known, backs, left }))
    }
}

impl Keep for Known {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let Cut {
            threads,
            window,
            memory,
        } = self.cut;
        let [filed, placed] = [self.filed, self.placed].map(u64::from);
        to.list(&[threads, window, memory, filed, placed, self.count])
    }

    fn restore(from: &mut Reader) -> Result<Known> {
        let [threads, window, memory, filed, placed, count] = from.list::<u64>()?[..] else {
            return Err(Error::Internal("a journal of another weld".into()));
        };
        Ok(Known {
            cut: Cut {
                threads,
                window,
                memory,
            },
            filed: filed == 1,
            placed: placed == 1,
            count,
        })
    }
}

impl Keep for Welding {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.0.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Welding> {
        match from.list::<u64>()?[..] {
            [4, 4] => Weld::<u32, u32>::restore(from),
            [4, 8] => Weld::<u32, u64>::restore(from),
            [8, 4] => Weld::<u64, u32>::restore(from),
            [8, 8] => Weld::<u64, u64>::restore(from),
            _ => Err(Error::Internal("a journal of another weld".into())),
        }
    }
}

impl Known {
    /// What is known of a weld of so many corners.
    pub(super) fn new(cut: Cut, tuning: Tuning, count: u64) -> Known {
        Known {
            cut,
            filed: tuning.filed,
            placed: false,
            count,
        }
    }

    /// True when bits and counts of first uses stay in memory.
    fn held(&self) -> bool {
        Held::bytes(self.count) <= self.cut.memory / 4 && !self.filed
    }
}

/// Writes G, in the order of first uses, and numbers these.
fn number<B: Bits, R: Index>(
    ws: &Workspace,
    request: &Request,
    known: &Known,
    groups: Groups<B, R>,
) -> Result<Numbered<R>> {
    let Groups { firsts, others } = groups;
    let vertices = firsts.records();
    let path = path_of_g(request, known.placed);
    let file = DataFile::create_new(&path, &ws.io)?;
    // Without a vertex nothing is written behind the hole for the header.
    file.set_len(DATA_START + vertices * size_of::<[B; 3]>() as u64)?;
    let uses = place(ws, &known.cut, firsts, known.count, known.held(), &file)?;
    drop(file);
    let g = take_name::<B>(ws, request, &path, vertices)?;
    Ok(Numbered { uses, others, g })
}

/// Writes V.
fn end<R: Index>(
    ws: &Workspace,
    request: &Request,
    known: &Known,
    (backs, numbered): (ScratchFile, Numbered<R>),
) -> Result<Welded> {
    let Numbered { uses, others, g } = numbered;
    let (cut, count) = (&known.cut, known.count);
    let apart = others.records();
    let others = if known.held() {
        others
    } else {
        corners::resolve(ws, cut, others, count, &uses)?
    };
    conserve("weld: resolve", "positions", apart, others.records())?;
    let wide = request.wide || count >= u64::from(u32::MAX);
    let kind = if wide { IndexKind::U8 } else { IndexKind::U4 };
    let apart = if wide || !may_be_written_over(ws, &backs, count * kind.bytes())? {
        Some(ws.scratch.file("welded indices")?)
    } else {
        None
    };
    let files = (&backs, apart.as_ref().unwrap_or(&backs));
    if wide {
        corners::corners::<R, u64>(ws, cut, others, count, &uses, files)?;
    } else {
        corners::corners::<R, u32>(ws, cut, others, count, &uses, files)?;
    }
    let v = IndexArray {
        source: Source::Scratch(apart.unwrap_or(backs)),
        at: 0,
        kind,
        endian: Endian::Little,
        triangles: count / 3,
    };
    Ok((v, g))
}

/// True when V goes over the ways back: they are not kept, or are no longer, since there is no room
/// for `bytes` besides.
fn may_be_written_over(ws: &Workspace, backs: &ScratchFile, bytes: u64) -> Result<bool> {
    if !backs.is_kept() {
        return Ok(true);
    }
    let scratch = &ws.scratch;
    let mut rooms = scratch.dirs().iter().filter_map(|dir| space::room(dir));
    let fits = scratch.used().saturating_add(bytes) <= scratch.limit()
        && rooms.all(|room| room.free >= bytes);
    if !fits {
        scratch.forget()?;
    }
    Ok(!fits)
}

/// Where G is written: beside the former one when that has the name that it shall have.
fn path_of_g(request: &Request, placed: bool) -> PathBuf {
    if !placed {
        return request.g_path.clone();
    }
    let mut name = request.g_path.clone().into_os_string();
    name.push(".weld");
    PathBuf::from(name)
}

/// Gives G its name.
fn take_name<B: Bits>(
    ws: &Workspace,
    request: &Request,
    path: &Path,
    vertices: u64,
) -> Result<CoordArray> {
    if path != request.g_path {
        fs::rename(path, &request.g_path).map_err(|e| {
            let what = format!("rename it to {}", request.g_path.display());
            Error::io(path, what, e)
        })?;
    }
    Ok(CoordArray {
        source: Source::Named(DataFile::open_rw(&request.g_path, &ws.io)?),
        at: DATA_START,
        kind: B::KIND,
        endian: Endian::Little,
        vertices,
        placed: true,
    })
}
