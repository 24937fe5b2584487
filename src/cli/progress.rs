//! Progress on a terminal, as plain lines, as JSON lines, or none.

use super::size::show;
use crate::disk::{NoProgress, Progress};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Instant;

/// A line on stderr; where that cannot be written, progress is silent.
macro_rules! say {
    ($($arg:tt)*) => {{
        let _ = writeln!(std::io::stderr(), $($arg)*);
    }};
}

/// `--progress`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A bar on a terminal, else nothing
    #[default]
    Auto,
    /// A line when a pass begins and ends
    Plain,
    /// The same as JSON, a line each, and lines in between
    Json,
    /// Nothing
    None,
}

/// The sink for a kind of progress, on stderr.
pub fn sink(kind: Kind, quiet: bool) -> Arc<dyn Progress> {
    match kind {
        _ if quiet => Arc::new(NoProgress),
        Kind::None => Arc::new(NoProgress),
        Kind::Auto if std::io::stderr().is_terminal() => Arc::new(Bar::default()),
        Kind::Auto => Arc::new(Notes),
        Kind::Plain => Arc::new(Lines::new(false)),
        Kind::Json => Arc::new(Lines::new(true)),
    }
}

/// Notes alone: what a script's log should hold.
struct Notes;

impl Progress for Notes {
    fn begin(&self, _: &'static str, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn usage(&self, _: u64, _: u64) {}
    fn end(&self) {}
    fn note(&self, text: &str) {
        say!("cornermill: note: {text}");
    }
}

/// A bar for each pass with rate, time to go, memory and scratch in use. Passes may nest.
#[derive(Default)]
struct Bar {
    bars: Mutex<Vec<ProgressBar>>,
}

impl Bar {
    fn with(&self, run: impl FnOnce(&ProgressBar)) {
        if let Some(bar) = self.bars.lock().unwrap_or_else(|e| e.into_inner()).last() {
            run(bar);
        }
    }
}

impl Progress for Bar {
    fn begin(&self, pass: &'static str, unit: &'static str, total: u64) {
        let bar = if total > 0 {
            let template = if unit == "bytes" {
                "{prefix:>12} [{bar:30}] {bytes}/{total_bytes} {bytes_per_sec} ETA {eta} {msg}"
            } else {
                "{prefix:>12} [{bar:30}] {human_pos}/{human_len} {per_sec} ETA {eta} {msg}"
            };
            let style = ProgressStyle::with_template(template);
            ProgressBar::new(total)
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        } else {
            let style = ProgressStyle::with_template("{prefix:>12} {spinner} {elapsed} {msg}");
            ProgressBar::new_spinner()
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
        };
        bar.set_prefix(pass);
        self.bars
            .lock()
            .unwrap_or_else(|e| e.into_inner())
            .push(bar);
    }

    fn advance(&self, units: u64) {
        self.with(|bar| bar.inc(units));
    }

    fn usage(&self, memory: u64, scratch: u64) {
        self.with(|bar| {
            bar.set_message(format!("memory {} scratch {}", show(memory), show(scratch)))
        });
    }

    fn end(&self) {
        if let Some(bar) = self.bars.lock().unwrap_or_else(|e| e.into_inner()).pop() {
            bar.finish_and_clear();
        }
    }

    fn note(&self, text: &str) {
        self.with(|bar| bar.println(format!("cornermill: note: {text}")));
    }
}

/// Lines, for logs and for programs. Passes may nest.
struct Lines {
    json: bool,
    open: Mutex<Vec<Open>>,
}

/// A pass that has begun.
struct Open {
    pass: &'static str,
    unit: &'static str,
    total: u64,
    done: AtomicU64,
    start: Instant,
    said: Instant,
    /// Memory and scratch told last.
    usage: Option<(u64, u64)>,
}

impl Lines {
    fn new(json: bool) -> Self {
        let open = Mutex::default();
        Lines { json, open }
    }

    fn open(&self) -> MutexGuard<'_, Vec<Open>> {
        self.open.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn say(&self, event: &str, at: &Open) {
        let done = at.done.load(Ordering::Relaxed);
        let seconds = at.start.elapsed().as_secs_f64();
        let rate = if seconds > 0.0 {
            done as f64 / seconds
        } else {
            0.0
        };
        if self.json {
            let eta = (rate > 0.0 && at.total > done).then(|| (at.total - done) as f64 / rate);
            let line = serde_json::json!({
                "event": event, "pass": at.pass, "unit": at.unit, "done": done,
                "total": at.total, "seconds": seconds, "rate": rate, "eta": eta,
                "memory": at.usage.map(|m| m.0), "scratch": at.usage.map(|m| m.1),
            });
            say!("{line}");
        } else if event == "end" {
            say!(
                "cornermill: {} done, {done} {} in {seconds:.2} s",
                at.pass,
                at.unit
            );
        } else {
            say!("cornermill: {} ({} {})", at.pass, at.total, at.unit);
        }
    }
}

impl Progress for Lines {
    fn begin(&self, pass: &'static str, unit: &'static str, total: u64) {
        let now = Instant::now();
        let at = Open {
            pass,
            unit,
            total,
            done: AtomicU64::new(0),
            start: now,
            said: now,
            usage: None,
        };
        self.say("begin", &at);
        self.open().push(at);
    }

    fn advance(&self, units: u64) {
        if let Some(at) = self.open().last() {
            at.done.fetch_add(units, Ordering::Relaxed);
        }
    }

    fn usage(&self, memory: u64, scratch: u64) {
        if let Some(at) = self.open().last_mut() {
            at.usage = Some((memory, scratch));
            if self.json && at.said.elapsed().as_secs_f64() >= 0.5 {
                at.said = Instant::now();
                self.say("progress", at);
            }
        }
    }

    fn end(&self) {
        if let Some(at) = self.open().pop() {
            self.say("end", &at);
        }
    }

    fn note(&self, text: &str) {
        if self.json {
            say!("{}", serde_json::json!({"event": "note", "text": text}));
        } else {
            say!("cornermill: note: {text}");
        }
    }
}
