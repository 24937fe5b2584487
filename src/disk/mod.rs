//! Files, windows, scratch space, the memory budget and the counters. Knows no mesh word.
//!
//! A [`Workspace`] is what every pass is given: the budget it draws on, the scratch space it
//! spills to, the counters its I/O is added to, the workers it runs on and the progress sink
//! it reports to. Nothing here allocates in proportion to a file.

mod budget;
mod counters;
#[cfg(debug_assertions)]
#[doc(hidden)]
pub mod faults;
mod file;
#[doc(hidden)]
pub mod fs;
mod hints;
pub mod journal;
mod keep;
mod left;
mod lock;
mod lost;
mod progress;
mod scratch;
pub mod space;
mod stop;
mod target;
mod window;
mod workers;

pub use budget::{Budget, Lease};
pub use counters::{Counters, IoCount};
pub use file::DataFile;
pub use left::left_behind;
pub use lock::{Lock, TempFolder, Tried, discard, discard_dead, sweep};
pub use lost::report_long_files;
pub use progress::{NoProgress, Progress};
pub use scratch::{Scratch, ScratchFile};
pub use stop::{Fleeting, go_on, interrupt, remove_fleeting};
pub use target::{Target, parent};
pub use window::Window;
pub use workers::Workers;

use std::sync::Arc;

/// What every pass is given.
pub struct Workspace {
    /// Memory, in bytes, that the passes draw on.
    pub budget: Budget,
    /// Space for temporary files.
    pub scratch: Scratch,
    /// Bytes read and written so far.
    pub io: Arc<Counters>,
    /// The threads.
    pub workers: Workers,
    /// Where progress goes.
    pub progress: Arc<dyn Progress>,
}
