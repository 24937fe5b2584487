//! SIGINT and SIGTERM: the passes are asked to stop, and the process ends soon in any case.
//!
//! Why it may end at any moment: what a build has on disk is safe whenever the process is killed.
//! The passes end at their next read or write; a second signal, or a pass that takes too long
//! over its memory alone, ends the process without waiting for them.

use super::say;
use crate::disk;
use crate::error::Error;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

/// How long the passes are waited for.
const PATIENCE: Duration = Duration::from_millis(1500);

/// The state that a stopped build leaves, when a build is what runs.
static STATE: Mutex<Option<PathBuf>> = Mutex::new(None);

/// A build runs that leaves its state in this file when it is stopped.
pub(super) fn can_resume(state: PathBuf) {
    *STATE.lock().unwrap_or_else(|e| e.into_inner()) = Some(state);
}

/// How to go on, when there is something to go on with.
pub(super) fn advice() -> Option<String> {
    let state = STATE.lock().unwrap_or_else(|e| e.into_inner()).clone()?;
    if !state.is_file() {
        return None;
    }
    // The step leads the first line.
    let first = BufReader::new(File::open(state).ok()?)
        .lines()
        .next()?
        .ok()?;
    let line: serde_json::Value = serde_json::from_str(&first).ok()?;
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+%@".contains(c);
    let quoted = |word: String| match word.chars().all(plain) && !word.is_empty() {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    };
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let mut words: Vec<String> = words
        .filter(|word| word != "--resume")
        .map(quoted)
        .collect();
    // Behind the subcommand: what follows `--` is no option.
    words.insert(words.len().min(2), "--resume".into());
    let step = line["step"].as_str().unwrap_or("the first pass");
    Some(format!(
        "what was done up to the pass \"{step}\" is kept; to go on: {}",
        words.join(" ")
    ))
}

/// The exit code of a process that a signal ended, as shells count them.
pub(super) fn code(signal: i32) -> u8 {
    128u8.saturating_add(u8::try_from(signal).unwrap_or(0))
}

/// Listens from now on. Where that cannot be, signals end the process as they always do.
pub(super) fn listen() {
    let wanted = [SIGINT, SIGTERM].into_iter().filter(|&s| !ignored(s));
    let Ok(mut signals) = Signals::new(wanted) else {
        return;
    };
    std::thread::spawn(move || {
        let mut came = signals.forever();
        let Some(signal) = came.next() else {
            return;
        };
        disk::interrupt(signal);
        std::thread::spawn(move || {
            std::thread::sleep(PATIENCE);
            end(signal);
        });
        if let Some(second) = came.next() {
            end(second);
        }
    });
}

/// True for a signal that whoever started the process wants to be ignored, as a shell does for what
/// runs behind it.
fn ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Ends the process without waiting for anything.
fn end(signal: i32) -> ! {
    disk::remove_fleeting();
    say(&Error::Interrupted { signal });
    std::process::exit(i32::from(code(signal)));
}
