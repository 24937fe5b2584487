//! The sink that passes report to. A terminal is one implementation, silence another.

/// Told by passes how far they are. Calls come from one thread at a time per pass boundary,
/// but [`advance`](Progress::advance) may come from any worker.
pub trait Progress: Send + Sync {
    /// A pass begins; `total` units (of the kind named by `unit`) will be done, 0 if unknown.
    fn begin(&self, pass: &'static str, unit: &'static str, total: u64);
    /// `units` more are done.
    fn advance(&self, units: u64);
    /// Memory drawn from the budget and scratch in use, in bytes: told now and then.
    fn usage(&self, memory: u64, scratch: u64);
    /// The pass that began last is done.
    fn end(&self);
    /// Something that the user should know, in one line.
    fn note(&self, text: &str);
}

/// Says nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn begin(&self, _: &'static str, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn usage(&self, _: u64, _: u64) {}
    fn end(&self) {}
    fn note(&self, _: &str) {}
}
