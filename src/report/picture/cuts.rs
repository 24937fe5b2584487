//! The corners on non-manifold edges, ascending, to be asked for by ranges.
//!
//! Why sorted anew: the folder lists them edge by edge. The pass that draws meets triangles in
//! ascending order, and must know of each corner without an opposite whether its edge is a
//! border or non-manifold.
//!
//! Memory: a writer and a sorter while sorting, from `memory`; nothing after. I/O: the list
//! once, 8 bytes a corner to scratch and back, and again when ranges are read.

use crate::disk::{ScratchFile, Workspace};
use crate::error::Result;
use crate::folder::{self, Folder, npy::DATA_START};
use crate::shuffle::{Plan, Record, Shuffle, Sorter};
use crate::table::array::{self, Width};

#[repr(transparent)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Id(u64);

impl Record for Id {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0
    }
}

/// Bytes of the list that are read at a time.
const BLOCK: u64 = 64 << 10;

/// The least memory to sort with.
pub(super) fn least() -> u64 {
    2 * Sorter::<Id>::least().max(64 << 10) + BLOCK
}

/// The sorted corners, in a scratch file.
pub(super) struct Cuts {
    sorted: ScratchFile,
    count: u64,
}

impl Cuts {
    /// Sorts the folder's list with so much memory.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`], and
    /// [`crate::Error::Input`] when the folder is damaged.
    pub(super) fn sort(ws: &Workspace, folder: &Folder, memory: u64) -> Result<Cuts> {
        let counts = &folder.manifest().counts;
        let (count, width) = (counts.nonmanifold_corners, Width::of(folder)?);
        let name = folder::NONMANIFOLD_CORNERS;
        let file = array::open(folder, name, width.descr(), &[count])?;
        let half = (memory.saturating_sub(BLOCK) / 2).min(64 << 20);
        let plan = Plan::within(half, 1, size_of::<Id>(), count, half);
        let keys = 0..(3 * counts.triangles).max(1);
        let shuffle = Shuffle::new(ws, "corners on non-manifold edges", keys, plan)?;
        let mut writer = shuffle.writer()?;
        let mut bytes = vec![0; BLOCK as usize];
        let (mut at, end) = (0, count * width.bytes() as u64);
        while at < end {
            let part = &mut bytes[..BLOCK.min(end - at) as usize];
            file.read_at(part, DATA_START + at)?;
            for i in 0..part.len() / width.bytes() {
                let corner = width.get(part, i);
                if corner >= 3 * counts.triangles {
                    return Err(crate::Error::input(
                        file.path(),
                        format!("entry {}", at / width.bytes() as u64 + i as u64),
                        format!("a corner below {}", 3 * counts.triangles),
                        corner.to_string(),
                        "the folder is damaged; `cornermill verify` says how; build it again",
                    ));
                }
                writer.push(Id(corner))?;
            }
            at += BLOCK;
        }
        drop(bytes);
        writer.finish()?;
        let buckets = shuffle.finish()?;
        let sorted = ws.scratch.file("sorted corners")?;
        let mut sorter = buckets.sorter(half)?;
        buckets.sorted_all(&mut sorter, &mut |batch| {
            sorted.append(bytemuck::cast_slice(batch)).map(drop)
        })?;
        Ok(Cuts { sorted, count })
    }

    /// Appends the corners from `first` to before `end` to `into`, ascending.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub(super) fn range(&self, first: u64, end: u64, into: &mut Vec<u64>) -> Result<()> {
        let (from, to) = (self.before(first)?, self.before(end)?);
        let start = into.len();
        into.resize(start + (to - from) as usize, 0);
        self.sorted
            .read_at(bytemuck::cast_slice_mut(&mut into[start..]), 8 * from)
    }

    /// How many corners are smaller than this one.
    fn before(&self, corner: u64) -> Result<u64> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            let mut found = 0u64;
            self.sorted
                .read_at(bytemuck::bytes_of_mut(&mut found), 8 * middle)?;
            if found < corner {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        Ok(low)
    }
}
