//! Whether there is room for what a build is certain to write, before hours are spent on it; and
//! how much more it wants when the disk turns out full.
//!
//! Why nothing is refused that would fit: only what every build of this mesh writes counts. That
//! is the folder's arrays, which the counts give to the byte but for lists of culprits, and in
//! scratch the decoded triangles, and the whole triangles that are dealt to cells. Where the
//! system does not tell what is free, or files may be compressed, nothing is refused.
//!
//! Memory: none. I/O: none.

use super::Job;
use super::plan::Shape;
use super::predict::{Prediction, least_arrays};
use super::way::Way;
use crate::disk::{Scratch, Workspace, space};
use crate::error::{Error, Result};
use crate::folder::{self, FileEntry};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Records that a shuffle's writer may keep in memory instead of writing them, in bytes.
const KEPT: u64 = 256 << 10;

/// Bytes that are certain to be written.
#[derive(Clone, Copy, Debug, Default)]
struct Certain {
    output: u64,
    scratch: u64,
}

/// Where scratch files go, and how much of them there may be.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    /// The folders; those of one device share its room.
    pub dirs: &'a [PathBuf],
    /// Bytes that are in use.
    pub used: u64,
    /// The most that may be.
    pub limit: u64,
}

impl<'a> From<&'a Scratch> for Place<'a> {
    fn from(scratch: &'a Scratch) -> Self {
        Place {
            dirs: scratch.dirs(),
            used: scratch.used(),
            limit: scratch.limit(),
        }
    }
}

/// Refuses a build, before it reads its input, when what it certainly writes does not fit: the
/// folder of as many triangles and vertices as the mesh has at least, and as many decoded triangles.
///
/// # Errors
/// [`Error::Io`] naming the folder that is too full, [`Error::DiskLimit`].
pub fn check_before(told: &Prediction, place: Place, dir: &Path) -> Result<()> {
    let (shape, survey) = (&told.certain, &told.survey);
    // A weld leaves such a file, too.
    let row = match survey.decoded {
        true => survey.v_row.min(3 * shape.index),
        false => 0,
    };
    let certain = Certain {
        output: output_bytes(shape),
        scratch: shape.triangles * row,
    };
    check(certain, place, dir)
}

/// Refuses a build whose counts and way are known when what it still writes does not fit.
///
/// # Errors
/// As [`check_before`].
pub fn check_after_read(job: &Job, way: Way) -> Result<()> {
    let dealt = match way {
        Way::Cells(_) => 4 * job.shape.record() * job.shape.triangles,
        Way::InOrder { .. } => 0,
    };
    let certain = Certain {
        output: output_bytes(&job.shape).saturating_sub(written(job.dir)),
        scratch: dealt.saturating_sub(2 * KEPT * job.shape.threads),
    };
    check(certain, Place::from(&job.ws.scratch), job.dir)
}

fn check(certain: Certain, place: Place, dir: &Path) -> Result<()> {
    let Place { dirs, used, limit } = place;
    let need = used.saturating_add(certain.scratch);
    if need > limit {
        return Err(Error::DiskLimit { need, limit });
    }
    let Some(target) = space::room(dir) else {
        return Ok(());
    };
    if certain.output > target.free {
        return Err(full(dir, "the mesh folder", certain.output, target.free));
    }
    let Some(free) = free(&mut vec![target], dirs) else {
        return Ok(());
    };
    let need = certain.output.saturating_add(certain.scratch);
    if need > free {
        let what = "the mesh folder and scratch files";
        let first = dirs.first().map_or(dir, PathBuf::as_path);
        return Err(full(first, what, need, free));
    }
    Ok(())
}

/// Bytes of scratch that there is room for now, as far as the system tells.
pub fn room_for(scratch: &Scratch) -> u64 {
    let free = free(&mut Vec::new(), scratch.dirs());
    free.map_or(scratch.limit(), |free| free.min(scratch.limit()))
}

/// Bytes that are free in these rooms and in those of the folders, each device once; `None` where
/// the system does not tell.
fn free(rooms: &mut Vec<space::Room>, dirs: &[PathBuf]) -> Option<u64> {
    for dir in dirs {
        let room = space::room(dir)?;
        if rooms.iter().all(|r| r.device != room.device) {
            rooms.push(room);
        }
    }
    Some(rooms.iter().fold(0, |sum, r| sum.saturating_add(r.free)))
}

/// Says so when more scratch is expected than there is room for. That is no refusal: what is
/// expected is not certain.
pub fn note_tight(told: &Prediction, ws: &Workspace) {
    let (expected, room) = (told.expected_scratch, room_for(&ws.scratch));
    if expected > room {
        ws.progress.note(&format!(
            "about {expected} bytes of scratch are expected, and there is room for {room}; \
             --dry-run tells more, and --tmp adds another folder"
        ));
    }
}

fn full(dir: &Path, what: &str, need: u64, free: u64) -> Error {
    let said = format!("only {free} bytes are free");
    let source = std::io::Error::new(ErrorKind::StorageFull, said);
    Error::io(dir, format!("write {need} bytes of {what} there"), source).with_more(need - free)
}

/// An error of a full disk, with what the folder at least wants still.
pub fn with_need(error: Error, job: &Job) -> Error {
    if !error.is_no_space() {
        return error;
    }
    error.with_more(output_bytes(&job.shape).saturating_sub(written(job.dir)))
}

fn output_bytes(shape: &Shape) -> u64 {
    // Bits of triangles that are not flipped are holes.
    let written = |array: &&FileEntry| array.name != folder::FLIPPED;
    let arrays = least_arrays(shape);
    arrays.iter().filter(written).map(|a| a.bytes).sum()
}

/// Bytes that the files of a folder take on disk.
fn written(dir: &Path) -> u64 {
    use std::os::unix::fs::MetadataExt;
    let Ok(list) = crate::disk::fs::read_dir(dir) else {
        return 0;
    };
    let blocks = list.filter_map(|item| Some(item.ok()?.metadata().ok()?.blocks()));
    blocks.sum::<u64>() * 512
}
