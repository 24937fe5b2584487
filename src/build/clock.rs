//! The clock: runs passes, measures them, and has written down what they come to.
//!
//! Memory: a line a pass. I/O: that of the passes, and of what is written down ([`Steps`]).

use super::steps::{At, OPENED, Opened, Steps};
use crate::disk::journal::Keep;
use crate::disk::{IoCount, Workspace};
use crate::error::Result;
use std::path::Path;
use std::time::Instant;

/// What one pass cost.
#[derive(Clone, Debug)]
pub struct PassReport {
    /// Its name.
    pub name: &'static str,
    /// Wall time in seconds.
    pub seconds: f64,
    /// Bytes read and written, scratch included.
    pub io: IoCount,
}

/// Measures passes as they run.
pub struct Clock<'a> {
    ws: &'a Workspace,
    steps: Steps,
    passes: Vec<PassReport>,
}

impl<'a> Clock<'a> {
    /// A clock before the first pass.
    pub fn new(ws: &'a Workspace, steps: Steps) -> Self {
        Clock {
            ws,
            steps,
            passes: Vec::new(),
        }
    }

    /// The workspace.
    pub fn workspace(&self) -> &'a Workspace {
        self.ws
    }

    /// The opened mesh of a build that was stopped, if it left one in `dir`; it may have left what
    /// comes before.
    ///
    /// # Errors
    /// As [`Steps::take_up`].
    pub fn take_up(&mut self, dir: &Path) -> Result<Option<Opened>> {
        self.steps.take_up(self.ws, dir)
    }

    /// The step behind which a stopped build goes on, as long as it was not asked for.
    pub fn left(&self) -> Option<&str> {
        self.steps.left()
    }

    /// The result of a step that a stopped build left.
    ///
    /// # Errors
    /// As [`Steps::restored`].
    pub fn restored<T: Keep>(&mut self, step: &str) -> Result<Option<T>> {
        self.steps.restored(step)
    }

    /// A step is done: its result is written down when enough is at stake.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn done<T: Keep>(&mut self, step: &str, opened: &Opened, result: &T) -> Result<()> {
        let at = At::behind(step, opened);
        self.steps.done(self.ws, at, result)
    }

    /// The mesh is open, and G in its place: written down when enough is at stake.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn opened(&mut self, opened: &Opened) -> Result<()> {
        self.steps.done(self.ws, At::behind(OPENED, opened), &())
    }

    /// Whether rows of the folder are, or are to be, what a build that is stopped goes on from.
    pub fn at_stake(&self) -> bool {
        self.steps.at_stake()
    }

    /// Another way makes the rows anew: what is written down of this one names them no longer.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn back(&mut self, opened: &Opened) -> Result<()> {
        self.steps.back(self.ws, opened)
    }

    /// Runs and measures one pass of `total` units.
    ///
    /// # Errors
    /// Those of the pass.
    pub fn pass<T>(
        &mut self,
        name: &'static str,
        unit: &'static str,
        total: u64,
        run: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        self.measured((name, unit, total), |_, ws| ws.io.intact(run()))
    }

    /// Runs and measures one pass that stops in between: `run` brings `state` on until the pass is
    /// done, and says so, or until the moment that it is given is past. `state` is written down, as
    /// what `step` is followed by, before the pass and wherever it stops, when enough is at stake.
    ///
    /// # Errors
    /// Those of the pass, and of writing down.
    pub fn rounds<T: Keep>(
        &mut self,
        pass: (&'static str, &'static str, u64),
        (step, opened): (&str, &Opened),
        state: &mut T,
        run: impl FnMut(&mut T, Option<Instant>) -> Result<bool>,
    ) -> Result<()> {
        let at = At::behind(step, opened);
        self.measured(pass, |steps, ws| steps.rounds(ws, at, state, run))
    }

    /// As [`rounds`](Clock::rounds); `state` is written down once more behind them, when enough is
    /// at stake, and then the pass ends with what `last` makes of it.
    ///
    /// # Errors
    /// Those of the pass, and of writing down.
    pub fn rounds_and<T: Keep, U>(
        &mut self,
        pass: (&'static str, &'static str, u64),
        (step, opened): (&str, &Opened),
        mut state: T,
        run: impl FnMut(&mut T, Option<Instant>) -> Result<bool>,
        last: impl FnOnce(T) -> Result<U>,
    ) -> Result<U> {
        let at = At::behind(step, opened);
        self.measured(pass, |steps, ws| {
            steps.rounds(ws, at, &mut state, run)?;
            steps.done(ws, at, &state)?;
            ws.io.intact(last(state))
        })
    }

    /// Runs and measures one pass that writes steps down itself.
    ///
    /// # Errors
    /// Those of the pass.
    pub fn measured<T>(
        &mut self,
        (name, unit, total): (&'static str, &'static str, u64),
        run: impl FnOnce(&mut Steps, &Workspace) -> Result<T>,
    ) -> Result<T> {
        let ws = self.ws;
        let (start, before) = (Instant::now(), ws.io.now());
        ws.progress.begin(name, unit, total);
        let usage = || (ws.budget.used(), ws.scratch.used());
        ws.progress.usage(usage().0, usage().1);
        let done = run(&mut self.steps, ws);
        ws.progress.usage(usage().0, usage().1);
        ws.progress.end();
        let after = ws.io.now();
        self.passes.push(PassReport {
            name,
            seconds: start.elapsed().as_secs_f64(),
            io: IoCount {
                read: after.read - before.read,
                written: after.written - before.written,
            },
        });
        done
    }

    /// What the passes cost, in order.
    pub fn passes(self) -> Vec<PassReport> {
        self.passes
    }
}
