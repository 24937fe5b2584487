//! The options that every command shares: memory, threads, scratch space, progress.

use super::progress::{self, Kind};
use super::size::{Size, memory_limit};
use crate::disk::{Budget, Counters, Scratch, Workers, Workspace, fs};
use crate::error::{Error, Result};
use clap::Args;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Memory, threads, scratch space and progress.
#[derive(Debug, Args)]
pub struct WorkArgs {
    /// Memory to keep within: KiB MiB GiB, kB MB GB, B, or % of the limit that the process sees
    #[arg(long, value_name = "SIZE", default_value = "25%")]
    pub memory: Size,
    /// Number of threads [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Folder for scratch files; several are used by turns [default: beside the
    /// output; the system's where nothing is written]
    #[arg(long, value_name = "DIR")]
    pub tmp: Vec<PathBuf>,
    /// The most scratch space to use
    #[arg(long, value_name = "SIZE")]
    pub max_disk: Option<Size>,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t)]
    pub progress: Kind,
    /// No progress and no report
    #[arg(short, long)]
    pub quiet: bool,
}

impl WorkArgs {
    /// The budget in bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.memory.bytes(memory_limit())
    }

    /// The most scratch space in bytes.
    pub fn max_disk_bytes(&self) -> u64 {
        self.max_disk
            .map_or(u64::MAX, |size| size.bytes(memory_limit()))
    }

    /// The number of threads.
    pub fn thread_count(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, |n| n.get());
        self.threads.map_or_else(all, usize::from)
    }

    /// Refuses a `--tmp` that is no folder before the work, not when scratch space is wanted.
    ///
    /// # Errors
    /// [`Error::Io`] naming it.
    pub fn check_tmp(&self) -> Result<()> {
        self.tmp.iter().try_for_each(|dir| {
            let found = fs::metadata(dir).and_then(|meta| match meta.is_dir() {
                true => Ok(()),
                false => Err(ErrorKind::NotADirectory.into()),
            });
            found.map_err(|e| Error::io(dir, "put scratch files there (--tmp)", e))
        })
    }

    /// A workspace whose scratch files lie in `beside` unless `--tmp` says otherwise.
    ///
    /// # Errors
    /// [`Error::Usage`] when threads cannot be started; as [`check_tmp`](WorkArgs::check_tmp).
    pub fn workspace(&self, beside: &Path) -> Result<Workspace> {
        self.check_tmp()?;
        let io = Arc::new(Counters::default());
        let beside = [beside.to_owned()];
        let dirs = if self.tmp.is_empty() {
            &beside[..]
        } else {
            &self.tmp
        };
        Ok(Workspace {
            budget: Budget::new(self.memory_bytes()),
            scratch: Scratch::new(dirs, self.max_disk_bytes(), &io)?,
            io,
            workers: Workers::new(self.thread_count())?,
            progress: progress::sink(self.progress, self.quiet),
        })
    }
}
