//! The memory budget: an object that passes draw from before they allocate.
//!
//! Why that bounds memory: every buffer, bit array, table and window of a pass is covered by
//! a [`Lease`] taken *before* the allocation, a lease that does not fit is refused, and a
//! lease is given back when its owner drops it. What is not leased (code, stacks, the
//! allocator's slack, small fixed structures) stays within the 64 MiB above the budget.
//!
//! Memory: a few words. I/O: none.

use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Debug)]
struct Inner {
    limit: u64,
    used: AtomicU64,
    peak: AtomicU64,
}

/// Memory in bytes that the user allowed, and what is drawn from it now. Clones share it.
///
/// ```
/// use cornermill::disk::Budget;
/// let budget = Budget::new(1 << 20);
/// let lease = budget.lease("sort space", 600 << 10)?;
/// assert!(budget.lease("more", 600 << 10).is_err());
/// drop(lease);
/// assert_eq!(budget.used(), 0);
/// # Ok::<(), cornermill::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Budget(Arc<Inner>);

/// Bytes drawn from a [`Budget`]; given back on drop.
#[derive(Debug)]
pub struct Lease {
    budget: Budget,
    bytes: u64,
}

impl Budget {
    /// A budget of `limit` bytes.
    pub fn new(limit: u64) -> Budget {
        Budget(Arc::new(Inner {
            limit,
            used: AtomicU64::new(0),
            peak: AtomicU64::new(0),
        }))
    }

    /// Draws `bytes` for `what`.
    ///
    /// # Errors
    /// [`Error::Budget`] when that would pass the limit; it names the total that would do.
    pub fn lease(&self, what: &str, bytes: u64) -> Result<Lease> {
        let inner = &self.0;
        #[cfg(debug_assertions)]
        if super::faults::refused() {
            return Err(Error::Budget {
                what: what.to_owned(),
                need: self.used().saturating_add(bytes),
                have: inner.limit,
            });
        }
        let taken = inner
            .used
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |used| {
                used.checked_add(bytes).filter(|&sum| sum <= inner.limit)
            });
        match taken {
            Ok(before) => {
                inner.peak.fetch_max(before + bytes, Ordering::Relaxed);
                Ok(Lease {
                    budget: self.clone(),
                    bytes,
                })
            }
            Err(used) => Err(Error::Budget {
                what: what.to_owned(),
                need: used.saturating_add(bytes),
                have: inner.limit,
            }),
        }
    }

    /// Refuses at once what will want `bytes` in all, before a part of it is drawn and a figure
    /// named with which the next would be refused.
    ///
    /// # Errors
    /// [`Error::Budget`]; it names the total that would do.
    pub fn check(&self, what: &str, bytes: u64) -> Result<()> {
        if bytes <= self.free() {
            return Ok(());
        }
        Err(Error::Budget {
            what: what.to_owned(),
            need: self.used().saturating_add(bytes),
            have: self.limit(),
        })
    }

    /// Does work for which `bytes` suffice: a refusal in it names no less, so that whoever gives what
    /// it names is not refused again later on.
    ///
    /// # Errors
    /// Those of the work.
    pub fn within<T>(&self, bytes: u64, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let enough = self.used().saturating_add(bytes);
        work().map_err(|e| match e {
            Error::Budget { what, need, have } => Error::Budget {
                what,
                need: need.max(enough),
                have,
            },
            other => other,
        })
    }

    /// The limit in bytes.
    pub fn limit(&self) -> u64 {
        self.0.limit
    }

    /// Bytes drawn now.
    pub fn used(&self) -> u64 {
        self.0.used.load(Ordering::Relaxed)
    }

    /// The most bytes that were ever drawn at once.
    pub fn peak(&self) -> u64 {
        self.0.peak.load(Ordering::Relaxed)
    }

    /// Bytes that can still be drawn.
    pub fn free(&self) -> u64 {
        self.0.limit - self.used()
    }
}

impl Lease {
    /// Bytes of this lease.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Gives back all but `bytes` of it, once what it covered has shrunk.
    pub fn shrink(&mut self, bytes: u64) {
        let back = self.bytes.saturating_sub(bytes);
        self.bytes -= back;
        self.budget.0.used.fetch_sub(back, Ordering::Relaxed);
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.budget.0.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_within_work_names_what_suffices_for_all_of_it() {
        let budget = Budget::new(100);
        let _before = budget.lease("before", 30).unwrap();
        for (bytes, named) in [(90, 120), (75, 110)] {
            let work = || budget.lease("a", 80).map(drop);
            match budget.within(bytes, work) {
                Err(Error::Budget { need, have, .. }) => assert_eq!((need, have), (named, 100)),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(budget.within(90, || Ok(7)).unwrap(), 7);
        let usage = budget.within(90, || Err::<(), _>(Error::Usage("as it was".into())));
        assert!(matches!(usage, Err(Error::Usage(what)) if what == "as it was"));
    }

    #[test]
    fn refuses_beyond_the_limit_and_names_the_least() {
        let budget = Budget::new(100);
        let first = budget.lease("a", 60).unwrap();
        match budget.lease("b", 50) {
            Err(Error::Budget { need, have, .. }) => assert_eq!((need, have), (110, 100)),
            other => panic!("{other:?}"),
        }
        assert!(budget.lease("c", u64::MAX).is_err());
        let mut first = first;
        first.shrink(70);
        assert_eq!((budget.used(), first.bytes()), (60, 60));
        first.shrink(20);
        assert_eq!((budget.used(), first.bytes()), (20, 20));
        drop(first);
        assert_eq!((budget.used(), budget.peak()), (0, 60));
    }
}
