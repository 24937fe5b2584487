//! Steps: passes whose result is written down, so that a build that was stopped is gone on with
//! behind them.
//!
//! Why a result alone is enough: each step is asked for its result by what comes after it, and
//! either reads it back or makes it, for which it asks the steps before. So the last result
//! written down is all that is needed, and what led to it is never asked for. Only the opened mesh is
//! needed by all that comes behind it, so it leads every journal, once there is one.
//!
//! A step that is followed by a long pass is written down with as much of that pass as is done, at
//! each of its stops; so what is read back is behind the step, or further.
//!
//! Why it costs nothing that matters: a result is written down only when so much work would be
//! lost without it that waiting for the device is little beside it.
//!
//! Memory: none. I/O: the state of each step that is written down, and syncing its files.

use super::arrays::OutArray;
use super::coords::{Placed, array_of};
use super::staging::sync_dir;
use crate::chunk::grid::Bounds;
use crate::disk::journal::{Keep, Pen, Reader, check_length};
use crate::disk::{DataFile, Workspace, fs, parent};
use crate::error::{Error, Result};
use crate::folder::{self, WarmSums, npy::DATA_START};
use crate::input::{CoordKind, Mesh};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The step behind which the mesh is open and G in its place.
pub const OPENED: &str = "coordinates";

/// The form in which states are written; another is refused.
pub const STATE: u32 = 3;

/// What says whether a state belongs to a build: by name, what must be the same.
pub type Identity = BTreeMap<String, String>;

/// The first line of a journal.
#[derive(Debug, Serialize, Deserialize)]
struct Line {
    step: String,
    identity: Identity,
}

/// The mesh, opened, and G in its place: what every pass needs.
pub struct Opened {
    /// The input.
    pub mesh: Mesh,
    /// G.
    pub placed: Option<Placed>,
    /// N.
    pub vertices: u64,
}

/// Where the state of a build is kept, and what one that was stopped left there.
pub struct Steps {
    state: PathBuf,
    identity: Identity,
    /// Work at stake that is worth being written down; never, when there is none.
    every: Option<Duration>,
    since: Instant,
    /// What the last writing took.
    took: Duration,
    left: Option<(String, Reader)>,
    /// What is written down names rows of the folder, which must stay as they are.
    names_rows: bool,
    unread: Arc<AtomicBool>,
}

impl Steps {
    /// Steps whose state is kept in the file `state`.
    pub fn new(state: PathBuf, identity: Identity, every: Option<Duration>) -> Steps {
        Steps {
            state,
            identity,
            every,
            since: Instant::now(),
            took: Duration::ZERO,
            left: None,
            names_rows: false,
            unread: Arc::default(),
        }
    }

    /// Is set when a result could not be read back: what a build that was stopped left is another's
    /// to mend, and stays.
    pub fn unread(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.unread)
    }

    /// Reads what a build that was stopped left, if it left anything: the opened mesh, unless it was
    /// stopped before there was one.
    ///
    /// # Errors
    /// [`Error::Usage`] when it was another build, naming what differs; [`Error::Input`] when what
    /// it left is damaged; [`Error::Io`].
    pub fn take_up(&mut self, ws: &Workspace, dir: &std::path::Path) -> Result<Option<Opened>> {
        if !self.state.is_file() {
            ws.progress
                .note("nothing to resume: beginning at the start");
            return Ok(None);
        }
        let mut reader = Reader::open(&self.state, (&ws.budget, &ws.scratch), &ws.io, dir)?;
        let line: Line = serde_json::from_str(reader.line())
            .map_err(|e| Error::Internal(format!("a journal that is no JSON: {e}")))?;
        let keys = line.identity.keys().chain(self.identity.keys());
        for key in keys {
            let (was, is) = (line.identity.get(key), self.identity.get(key));
            if was != is {
                let said = |value: Option<&String>| value.cloned().unwrap_or("not there".into());
                return Err(Error::Usage(format!(
                    "the build that was stopped cannot be resumed: {key} was {}, and is {}; give \
                     what was given then, or begin anew with --force",
                    said(was),
                    said(is)
                )));
            }
        }
        let opened = Option::<Opened>::restore(&mut reader)?;
        ws.progress.note(&format!("resumed behind: {}", line.step));
        self.names_rows = opened.is_some() && line.step != OPENED;
        if line.step == OPENED {
            reader.finish()?;
        } else {
            self.left = Some((line.step, reader));
        }
        self.since = Instant::now();
        Ok(opened)
    }

    /// The step behind which the build goes on, as long as it was not asked for.
    pub fn left(&self) -> Option<&str> {
        self.left.as_ref().map(|(step, _)| &**step)
    }

    /// The result of a step, if the build that was stopped left it.
    ///
    /// # Errors
    /// As [`Keep::restore`].
    pub fn restored<T: Keep>(&mut self, step: &str) -> Result<Option<T>> {
        match self.left.take() {
            Some((left, mut reader)) if left == step => {
                let result = T::restore(&mut reader).and_then(|result| {
                    reader.finish()?;
                    Ok(result)
                });
                self.unread.store(result.is_err(), Ordering::Relaxed);
                self.since = Instant::now();
                result.map(Some)
            }
            other => {
                self.left = other;
                Ok(None)
            }
        }
    }

    /// The moment from which so much is at stake that it is written down; never, when there is
    /// none. Writing that takes long is done the less often, so that it stays beside the work.
    pub fn until(&self) -> Option<Instant> {
        let seconds = u32::try_from(self.took.as_secs()).unwrap_or(u32::MAX);
        let work = self.every?.saturating_mul(seconds.max(1));
        self.since.checked_add(work)
    }

    /// Writes down the result of a step, when enough is at stake.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn done<T: Keep>(&mut self, ws: &Workspace, at: At, result: &T) -> Result<()> {
        if self.due() {
            self.put(ws, at, result)?;
        }
        Ok(())
    }

    /// Runs a pass by rounds: see [`Clock::rounds`](super::clock::Clock::rounds).
    ///
    /// # Errors
    /// Those of the pass, and of writing down.
    pub fn rounds<T: Keep>(
        &mut self,
        ws: &Workspace,
        at: At,
        state: &mut T,
        mut run: impl FnMut(&mut T, Option<Instant>) -> Result<bool>,
    ) -> Result<()> {
        loop {
            self.done(ws, at, state)?;
            // What came of a file that shrank must not be written down.
            if ws.io.intact(run(state, self.until()))? {
                return Ok(());
            }
        }
    }

    /// Writes down the result of a step, however little is at stake; false when there is no room.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn put<T: Keep>(&mut self, ws: &Workspace, at: At, result: &T) -> Result<bool> {
        match self.write(ws, at, result) {
            // The build may have room where its state has none.
            Err(e) if e.is_no_space() => {
                let _ = fs::remove_file(self.state.with_extension("new"));
                // What the state before this one keeps is in the way of the build.
                ws.scratch.give_up();
                let step = at.step;
                ws.progress
                    .note(&format!("not kept for --resume behind {step}: {e}"));
                self.since = Instant::now();
                Ok(false)
            }
            done => done.map(|()| true),
        }
    }

    /// Whether rows of the folder are, or are to be, what a build that is stopped goes on from.
    pub fn at_stake(&self) -> bool {
        self.due() || self.names_rows
    }

    fn due(&self) -> bool {
        self.until().is_some_and(|until| Instant::now() >= until)
    }

    fn write<T: Keep>(&mut self, ws: &Workspace, at: At, result: &T) -> Result<()> {
        let line = Line {
            step: at.step.to_owned(),
            identity: self.identity.clone(),
        };
        let line = serde_json::to_string(&line)
            .map_err(|e| Error::Internal(format!("a line that is no JSON: {e}")))?;
        let start = Instant::now();
        let mut pen = Pen::new(&self.state, &ws.scratch, &line)?;
        pen.number(u64::from(at.opened.is_some()))?;
        at.opened.map_or(Ok(()), |opened| opened.keep(&mut pen))?;
        result.keep(&mut pen)?;
        // Before it is certain: it may be in force though the device was not heard of.
        self.names_rows |= at.names_rows();
        pen.finish()?;
        self.names_rows = at.names_rows();
        self.since = Instant::now();
        self.took = start.elapsed();
        Ok(())
    }

    /// What was written down is about to be changed in place: goes back to the opened mesh.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn back(&mut self, ws: &Workspace, opened: &Opened) -> Result<()> {
        if !self.names_rows {
            return Ok(());
        }
        match self.write(ws, At::behind(OPENED, opened), &()) {
            // Removing a state takes no room.
            Err(e) if e.is_no_space() => ws.scratch.forget(),
            done => done,
        }
    }
}

/// Behind what a result is written down.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// The step.
    pub step: &'a str,
    /// The opened mesh, once there is one.
    pub opened: Option<&'a Opened>,
}

impl<'a> At<'a> {
    /// Behind a step that comes behind the opened mesh.
    pub fn behind(step: &'a str, opened: &'a Opened) -> At<'a> {
        let opened = Some(opened);
        At { step, opened }
    }

    fn names_rows(&self) -> bool {
        self.opened.is_some() && self.step != OPENED
    }
}

impl Keep for Opened {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.mesh.keep(to)?;
        to.number(self.vertices)?;
        to.number(u64::from(self.placed.is_some()))?;
        let Some(placed) = &self.placed else {
            return Ok(());
        };
        placed.file.keep(to)?;
        to.list(&[placed.bounds.min, placed.bounds.max])?;
        to.number(placed.bounds.nonfinite)
    }

    fn restore(from: &mut Reader) -> Result<Opened> {
        let mesh = Mesh::restore(from)?;
        let vertices = from.number()?;
        let placed = match from.number()? {
            0 => None,
            _ => {
                let file = OutArray::restore(from)?;
                let ends = from.list::<[f64; 3]>()?;
                let [min, max] = ends[..] else {
                    return Err(Error::Internal("a box without two ends".into()));
                };
                let nonfinite = from.number()?;
                let kind = match &*file.descr {
                    "<f8" => CoordKind::F8,
                    _ => CoordKind::F4,
                };
                Some(Placed {
                    array: array_of(&file, kind, &from.io)?,
                    file,
                    bounds: Bounds {
                        min,
                        max,
                        nonfinite,
                    },
                })
            }
        };
        Ok(Opened {
            mesh,
            placed,
            vertices,
        })
    }
}

/// The arrays of the folder, by name.
const NAMES: [&str; 11] = [
    folder::V,
    folder::O,
    folder::G,
    folder::COMPONENT,
    folder::FLIPPED,
    folder::COMPONENTS,
    folder::NONMANIFOLD_EDGES,
    folder::NONMANIFOLD_CORNERS,
    folder::NONMANIFOLD_VERTICES,
    folder::DUPLICATE,
    folder::DEGENERATE,
];

impl Keep for OutArray {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.file.sync()?;
        sync_dir(parent(self.file.path()))?;
        to.text(self.name)?;
        to.text(&self.descr)?;
        to.list(&self.shape)?;
        to.number(self.sums.bytes())
    }

    /// The sums are taken anew.
    fn restore(from: &mut Reader) -> Result<OutArray> {
        let name = from.text()?;
        let Some(name) = NAMES.into_iter().find(|known| *known == name) else {
            return Err(Error::Internal(format!("{name} is no array of a folder")));
        };
        let (descr, shape, bytes) = (from.text()?, from.list::<u64>()?, from.number()?);
        let path = from.dir.join(name);
        let file = DataFile::open_rw(&path, &from.io)?;
        check_length(&file, bytes.max(DATA_START))?;
        from.stays(name);
        Ok(OutArray {
            sums: WarmSums::new(&from.budget, bytes, false)?,
            file,
            name,
            descr,
            shape,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_that_takes_long_is_done_less_often() {
        let steps = |every, took| Steps {
            took,
            ..Steps::new(PathBuf::new(), Identity::new(), every)
        };
        let second = Duration::from_secs(1);
        let work = |every: Option<Duration>, took| {
            let steps = steps(every, took);
            steps.until().map(|until| until - steps.since)
        };
        let every = Some(20 * second);
        assert_eq!(work(every, Duration::ZERO), every);
        assert_eq!(work(every, second / 2), every);
        assert_eq!(work(every, 3 * second), Some(60 * second));
        assert_eq!(work(Some(Duration::ZERO), 3 * second), Some(Duration::ZERO));
        // Never, also when that is longer than there are moments.
        assert_eq!(work(None, second), None);
        assert_eq!(work(Some(Duration::MAX), second), None);
        assert!(steps(Some(Duration::ZERO), second).at_stake());
        assert!(!steps(every, second).at_stake());
    }
}
