//! Parts of mapped files that were lost while they were mapped: the signal that the system sends
//! then ends no process, but becomes an error.
//!
//! Reading a mapped page that the file no longer has (another process cut it short), or that the
//! device cannot deliver, raises SIGBUS. The handler looks whether the address lies in a mapping
//! that is registered here; if so it maps zeros over the rest of that mapping, notes the loss in
//! the mapping's slot, and lets the read go on. Who used the bytes asks the slot before anything
//! that follows from them is believed. Any other SIGBUS goes to whoever handled it before.
//!
//! Why the handler is safe where it runs: it allocates and locks nothing. It walks blocks of slots
//! that are never given back, reads each slot between two readings of its generation, which is odd
//! while the slot changes, and makes one system call. A slot that covers the address cannot change
//! meanwhile: its mapping is borrowed by the very thread that reads from it.
//!
//! Memory: 40 bytes for each mapping that there is at once. I/O: none.

#![allow(unsafe_code)]

use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};
use std::sync::{Mutex, Once};

/// Slots of a block.
const SLOTS: usize = 64;

/// A mapping's place in the register.
#[derive(Debug)]
struct Slot {
    generation: AtomicUsize,
    start: AtomicUsize,
    end: AtomicUsize,
    lost: AtomicBool,
}

struct Block {
    slots: [Slot; SLOTS],
    next: AtomicPtr<Block>,
}

static BLOCKS: AtomicPtr<Block> = AtomicPtr::new(std::ptr::null_mut());
static FREE: Mutex<Vec<&'static Slot>> = Mutex::new(Vec::new());

/// A registered mapping; forgotten on drop, which must come before the mapping's end.
#[derive(Debug)]
pub(super) struct Watch(&'static Slot);

impl Slot {
    const fn empty() -> Slot {
        Slot {
            generation: AtomicUsize::new(0),
            start: AtomicUsize::new(0),
            end: AtomicUsize::new(0),
            lost: AtomicBool::new(false),
        }
    }

    fn set(&self, start: usize, end: usize) {
        self.generation.fetch_add(1, Ordering::SeqCst);
        self.start.store(start, Ordering::SeqCst);
        self.end.store(end, Ordering::SeqCst);
        self.lost.store(false, Ordering::SeqCst);
        self.generation.fetch_add(1, Ordering::SeqCst);
    }

    /// The end of the slot's mapping, when `at` lies in it.
    fn covers(&self, at: usize) -> Option<usize> {
        let before = self.generation.load(Ordering::SeqCst);
        let start = self.start.load(Ordering::SeqCst);
        let end = self.end.load(Ordering::SeqCst);
        let after = self.generation.load(Ordering::SeqCst);
        let whole = before == after && before.is_multiple_of(2);
        (whole && (start..end).contains(&at)).then_some(end)
    }
}

impl Watch {
    /// Registers the mapping of these bytes.
    pub(super) fn over(bytes: &[u8]) -> Watch {
        static HANDLED: Once = Once::new();
        HANDLED.call_once(handle);
        let start = bytes.as_ptr() as usize;
        let slot = free_slot();
        slot.set(start, start + bytes.len());
        Watch(slot)
    }

    /// True when a part of the mapping was lost since it was registered.
    pub(super) fn lost(&self) -> bool {
        self.0.lost.load(Ordering::SeqCst)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.0.set(0, 0);
        free_slots().push(self.0);
    }
}

fn free_slots() -> std::sync::MutexGuard<'static, Vec<&'static Slot>> {
    FREE.lock().unwrap_or_else(|e| e.into_inner())
}

/// A slot that no mapping has; when there is none, those of a new block.
fn free_slot() -> &'static Slot {
    let mut free = free_slots();
    if let Some(slot) = free.pop() {
        return slot;
    }
    let block = Box::leak(Box::new(Block {
        slots: [const { Slot::empty() }; SLOTS],
        next: AtomicPtr::new(BLOCKS.load(Ordering::SeqCst)),
    }));
    // Blocks are added under the lock alone, so nothing comes between.
    BLOCKS.store(block, Ordering::SeqCst);
    let (first, rest) = block.slots.split_at(1);
    free.extend(rest);
    &first[0]
}

/// Maps zeros over what is left of the registered mapping that `at` lies in; false when it lies in
/// none, or the system refuses.
fn cover(at: usize) -> bool {
    let mut block = BLOCKS.load(Ordering::SeqCst);
    // SAFETY: the pointers are null or lead to blocks that were leaked whole before they were
    // stored, and never change but for their atomic fields.
    while let Some(b) = unsafe { block.as_ref() } {
        for slot in &b.slots {
            let Some(end) = slot.covers(at) else {
                continue;
            };
            slot.lost.store(true, Ordering::SeqCst);
            return zeros(at, end);
        }
        block = b.next.load(Ordering::SeqCst);
    }
    false
}

/// Maps zeros from the page of `at` to `end`.
fn zeros(at: usize, end: usize) -> bool {
    // SAFETY: asks for a number.
    let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
    let start = at - at % page.max(1) as usize;
    // SAFETY: the range begins in a page of a live read-only mapping of this process, which the
    // thread that was interrupted borrows, and ends with that mapping; it is replaced as a whole
    // by pages that read as zeros, with the same right to read, and unmapped with the rest.
    let made = unsafe {
        libc::mmap(
            start as *mut libc::c_void,
            end - start,
            libc::PROT_READ,
            libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_FIXED | libc::MAP_NORESERVE,
            -1,
            0,
        )
    };
    made != libc::MAP_FAILED
}

/// From now on a file that would pass the process's limit (`ulimit -f`) is an error of the write,
/// instead of the end of the process. For programs; a library leaves it to its user.
pub fn report_long_files() {
    // SAFETY: sets a disposition that needs no handler.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

/// Who handled the signal before; set before the handler is.
static BEFORE: AtomicPtr<libc::sigaction> = AtomicPtr::new(std::ptr::null_mut());

/// Takes over the signal.
fn handle() {
    // SAFETY: the structures are plain data for which zeros are valid; the handler has the
    // signature that SA_SIGINFO demands, and runs on the alternative stack where there is one.
    unsafe {
        let mut before: libc::sigaction = std::mem::zeroed();
        if libc::sigaction(libc::SIGBUS, std::ptr::null(), &mut before) != 0 {
            return;
        }
        BEFORE.store(Box::leak(Box::new(before)), Ordering::SeqCst);
        let mut own: libc::sigaction = std::mem::zeroed();
        let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) = on_bus;
        own.sa_sigaction = handler as usize;
        own.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        libc::sigemptyset(&mut own.sa_mask);
        libc::sigaction(libc::SIGBUS, &own, std::ptr::null_mut());
    }
}

extern "C" fn on_bus(signal: libc::c_int, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    // SAFETY: the system passes a valid structure; for SIGBUS it has an address.
    let at = unsafe { (*info).si_addr() } as usize;
    if !cover(at) {
        pass_on(signal, info, context);
    }
}

/// Hands the signal to whoever handled it before. Where that was the system, its default is
/// restored, and the read that raised the signal raises it again.
fn pass_on(signal: libc::c_int, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    // SAFETY: the pointer was set, to a structure that is never freed, before this handler was;
    // a handler in it has the signature that its flags say.
    unsafe {
        let before = BEFORE.load(Ordering::SeqCst);
        match (*before).sa_sigaction {
            libc::SIG_DFL | libc::SIG_IGN => {
                libc::signal(signal, libc::SIG_DFL);
            }
            handler if (*before).sa_flags & libc::SA_SIGINFO != 0 => {
                let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) =
                    std::mem::transmute(handler);
                handler(signal, info, context);
            }
            handler => {
                let handler: extern "C" fn(libc::c_int) = std::mem::transmute(handler);
                handler(signal);
            }
        }
    }
}
