//! The builder: the same options as the command line, and the one call that runs a build.

use super::clock::Clock;
use super::identity::Inputs;
use super::pipeline::{BuildReport, Wishes, run, settle_in};
use super::plan::{Strategy, check_least};
use super::read::read;
use super::staging::{Former, Staging};
use super::steps::{Identity, Opened, STATE, Steps};
use crate::chunk::pair::MAX_CHUNK;
use crate::disk::{Budget, Counters, NoProgress, Progress, Scratch, Workers, Workspace, fs};
use crate::error::{Error, Result};
use crate::folder::{self, Orient};
use crate::input::{CoordKind, Endian, Format, IndexKind, Request};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Work at stake that is worth being written down.
const CHECKPOINT: Duration = Duration::from_secs(20);

/// Width of the indices that a build writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Index {
    /// 4 bytes while 3T and N stay below 2^32 - 1, else 8.
    #[default]
    Auto,
    /// 4 bytes; a larger mesh is refused.
    U4,
    /// 8 bytes.
    U8,
}

/// Builds a mesh folder from a mesh file.
///
/// Memory: the stated budget and at most 64 MiB. I/O: see [`crate::build`].
#[derive(Clone)]
pub struct Builder {
    pub(super) request: Request,
    pub(super) memory: u64,
    pub(super) threads: usize,
    pub(super) tmp: Vec<PathBuf>,
    pub(super) max_disk: u64,
    orient: Orient,
    pub(super) index: Index,
    force: bool,
    resume: bool,
    checkpoint: Option<Duration>,
    pub(super) chunk: Option<u64>,
    pub(super) buckets: Option<usize>,
    pub(super) strategy: Strategy,
    pub(super) measures: bool,
    progress: Arc<dyn Progress>,
}

impl Builder {
    /// A builder for the mesh in `input` (`-` is standard input) with default options: 1 GiB,
    /// all threads, scratch beside the output, outward orientation.
    pub fn new(input: impl Into<PathBuf>) -> Builder {
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        Builder {
            request: Request {
                path: input.into(),
                positions: None,
                weld: None,
                coords: None,
                raw_index: None,
                endian: None,
                vertices: None,
                format: None,
                wide: false,
                g_path: PathBuf::new(),
            },
            memory: 1 << 30,
            threads,
            tmp: Vec::new(),
            max_disk: u64::MAX,
            orient: Orient::Outward,
            index: Index::Auto,
            force: false,
            resume: false,
            checkpoint: Some(CHECKPOINT),
            chunk: None,
            buckets: None,
            strategy: Strategy::Auto,
            measures: true,
            progress: Arc::new(NoProgress),
        }
    }

    /// The memory budget in bytes: buffers, tables, windows of every thread.
    pub fn memory(mut self, bytes: u64) -> Self {
        self.memory = bytes;
        self
    }

    /// Number of threads. The output does not depend on it.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Adds a folder for scratch files; several are used by turns.
    pub fn tmp(mut self, dir: impl Into<PathBuf>) -> Self {
        self.tmp.push(dir.into());
        self
    }

    /// The most scratch space to use, in bytes.
    pub fn max_disk(mut self, bytes: u64) -> Self {
        self.max_disk = bytes;
        self
    }

    /// How triangles are oriented.
    pub fn orient(mut self, orient: Orient) -> Self {
        self.orient = orient;
        self
    }

    /// Width of the indices.
    pub fn index(mut self, index: Index) -> Self {
        self.index = index;
        self
    }

    /// Type of the stored coordinates; by default as the input has them, f4 for text.
    pub fn coords(mut self, kind: CoordKind) -> Self {
        self.request.coords = Some(kind);
        self
    }

    /// Welds vertices of equal position (true), or refuses to where the format demands it.
    pub fn weld(mut self, weld: bool) -> Self {
        self.request.weld = Some(weld);
        self
    }

    /// File of coordinates beside an `.npy` or raw array of indices.
    pub fn positions(mut self, path: impl Into<PathBuf>) -> Self {
        self.request.positions = Some(path.into());
        self
    }

    /// The input is a raw array of such indices.
    pub fn raw_index(mut self, kind: IndexKind) -> Self {
        self.request.raw_index = Some(kind);
        self
    }

    /// Byte order of raw arrays.
    pub fn endian(mut self, endian: Endian) -> Self {
        self.request.endian = Some(endian);
        self
    }

    /// Number of vertices of a raw or `.npy` array of indices.
    pub fn vertices(mut self, vertices: u64) -> Self {
        self.request.vertices = Some(vertices);
        self
    }

    /// The input's format, instead of looking at its name and first bytes.
    pub fn format(mut self, format: Format) -> Self {
        self.request.format = Some(format);
        self
    }

    /// Replaces an existing output.
    pub fn force(mut self, force: bool) -> Self {
        self.force = force;
        self
    }

    /// Goes on with a build of the same mesh, with the same options, that was stopped; begins at
    /// the start when there is none.
    pub fn resume(mut self, resume: bool) -> Self {
        self.resume = resume;
        self
    }

    /// How much work must be at stake before it is written down for [`resume`](Builder::resume);
    /// nothing is ever, without. By default 20 seconds.
    pub fn checkpoint(mut self, every: Option<Duration>) -> Self {
        self.checkpoint = every;
        self
    }

    /// Where progress goes.
    pub fn progress(mut self, progress: Arc<dyn Progress>) -> Self {
        self.progress = progress;
        self
    }

    /// For tests: triangles of a chunk. The output does not depend on it.
    #[doc(hidden)]
    pub fn chunk_triangles(mut self, triangles: u64) -> Self {
        self.chunk = Some(triangles.clamp(1, MAX_CHUNK));
        self
    }

    /// For tests: buckets of a shuffle. The output does not depend on it.
    #[doc(hidden)]
    pub fn buckets(mut self, buckets: usize) -> Self {
        self.buckets = Some(buckets);
        self
    }

    /// Whether to measure the vertices: fans, border loops, genus, non-manifold vertices, duplicate
    /// triangles. By default yes.
    pub fn measures(mut self, measures: bool) -> Self {
        self.measures = measures;
        self
    }

    /// For tests: the way to go. The output does not depend on it.
    #[doc(hidden)]
    pub fn strategy(mut self, strategy: Strategy) -> Self {
        self.strategy = strategy;
        self
    }

    /// Builds the folder `output`.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for contradictory options or an existing output, [`crate::Error::Input`] for a
    /// file that is not what its format demands, [`crate::Error::Budget`] with the least budget that
    /// would do, [`crate::Error::DiskLimit`], [`crate::Error::Io`].
    pub fn build(&self, output: &Path) -> Result<BuildReport> {
        check_least(self.memory, self.threads.max(1) as u64)?;
        let mut spare = vec![self.request.path.as_path()];
        spare.extend(self.request.positions.as_deref());
        spare.extend(self.tmp.iter().map(PathBuf::as_path));
        // A pipe by name is gone when it was read, too; what is not there is told by opening it.
        let input = &self.request.path;
        let passes_by = input == Path::new("-")
            || fs::metadata(input).is_ok_and(|meta| !meta.is_file() && !meta.is_dir());
        if self.resume && passes_by {
            let what = "--resume needs a file to compare: standard input and pipes are gone when \
                        they were read";
            return Err(Error::Usage(what.into()));
        }
        let former = match (self.resume, self.force) {
            (true, _) => Former::Resume,
            (_, true) => Former::Remove,
            _ => Former::Refuse,
        };
        let mut staging = Staging::new(output, self.force, former, &spare)?;
        let every = self.checkpoint.filter(|_| !passes_by);
        let ws = self.workspace(&mut staging, every.is_some())?;
        let mut files = vec![("the input", input.as_path())];
        files.retain(|_| !passes_by);
        files.extend(
            self.request
                .positions
                .iter()
                .map(|path| ("the file of positions", path.as_path())),
        );
        let inputs = Inputs::new(&files, &ws.io)?;
        let steps = Steps::new(staging.state(), self.identity(&inputs), every);
        let unread = steps.unread();
        let mut clock = Clock::new(&ws, steps);
        let left = match self.resume {
            true => clock.take_up(staging.path())?,
            false => None,
        };
        let state = staging.state();
        let built = self.passes(clock, left, &inputs, &mut staging);
        if let Err(Error::Usage(_) | Error::Input(_) | Error::Budget { .. } | Error::Internal(_)) =
            &built
            && !unread.load(Ordering::Relaxed)
        {
            // It would end like this again.
            let _ = fs::remove_file(state);
        }
        built
    }

    /// The passes, behind those of a stopped build.
    fn passes(
        &self,
        mut clock: Clock,
        left: Option<Opened>,
        inputs: &Inputs,
        staging: &mut Staging,
    ) -> Result<BuildReport> {
        let mut request = self.request.clone();
        request.g_path = staging.path().join(folder::G);
        request.wide = self.index == Index::U8;
        let wishes = Wishes {
            orient: self.orient,
            wide: request.wide,
            narrow: self.index == Index::U4,
            coords: request.coords,
            chunk: self.chunk,
            buckets: self.buckets,
            strategy: self.strategy,
            measures: self.measures,
        };
        let opened = match left {
            Some(opened) => opened,
            None => {
                let ws = clock.workspace();
                if clock.left().is_none() {
                    self.refuse_early(ws, staging.path())?;
                }
                let mesh = read(&mut clock, &request, inputs)?;
                settle_in(&mut clock, mesh, &wishes, staging.path())?
            }
        };
        run(clock, &opened, &wishes, inputs, staging)
    }

    /// What must be the same for a stopped build to be gone on with.
    fn identity(&self, inputs: &Inputs) -> Identity {
        let request = &self.request;
        let said = |option: &dyn std::fmt::Debug| {
            let text = format!("{option:?}").to_lowercase();
            let given = text.strip_prefix("some(").and_then(|t| t.strip_suffix(')'));
            given.map_or(text.clone(), str::to_owned)
        };
        let options: [(&str, String); 15] = [
            ("the form of the state", said(&STATE)),
            ("the version", env!("CARGO_PKG_VERSION").to_owned()),
            ("--memory in bytes", said(&self.memory)),
            ("--threads", said(&self.threads)),
            ("--orient", said(&self.orient)),
            ("--index", said(&self.index)),
            ("--no-measures", said(&!self.measures)),
            ("--weld", said(&request.weld)),
            ("--coords", said(&request.coords)),
            ("--raw-index", said(&request.raw_index)),
            ("--endian", said(&request.endian.unwrap_or_default())),
            ("--vertices", said(&request.vertices)),
            ("--format", said(&request.format)),
            ("--strategy", said(&self.strategy)),
            ("the plan", said(&(self.chunk, self.buckets))),
        ];
        let mut identity: Identity = options
            .into_iter()
            .map(|(name, value)| (name.to_owned(), value))
            .collect();
        identity.extend(inputs.identity().clone());
        identity
    }

    fn workspace(&self, staging: &mut Staging, named: bool) -> Result<Workspace> {
        let io = Arc::new(Counters::default());
        let dirs = staging.rooms(&self.tmp)?;
        let scratch = if named {
            Scratch::named(&dirs, self.max_disk, &io, &staging.state())?
        } else {
            Scratch::new(&dirs, self.max_disk, &io)?
        };
        Ok(Workspace {
            budget: Budget::new(self.memory),
            scratch,
            io,
            workers: Workers::new(self.threads)?,
            progress: Arc::clone(&self.progress),
        })
    }
}
