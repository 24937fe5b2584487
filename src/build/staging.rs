//! The folder under construction: a working folder beside the target, out of which the finished
//! folder is renamed.
//!
//! ```text
//!   .NAME.partial/lock      held by the process that builds; a mark and its number
//!                 out/      becomes NAME
//!                 scratch/  scratch files, unless they lie elsewhere
//!                 state     what a build that was stopped goes on from
//!                 rooms     the folders of scratch files that lie elsewhere
//!                 replaced/ what NAME was, for a moment, where names cannot be exchanged
//! ```
//!
//! Why beside: a rename within one file system is atomic, so the target either does not exist
//! or is whole. With `--force` the new folder and the old one exchange their names in one step
//! where the system can; else the old one is put aside, and put back by the next run when the
//! process was killed before the new one had its name.
//!
//! Why a lock: two builds of one target never meet, and what a killed one left is known for dead
//! (see [`Lock`]). A build that fails removes what it made, unless it can be gone on with.

use super::working::{ROOMS, STATE, discard_rooms, joined, room_name, rooms_of, work_of};
use crate::disk::{Fleeting, Lock, Tried, discard, discard_dead, fs, go_on, parent};
use crate::error::{Error, Result};
use crate::folder::Outputs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The folder that will be the target.
const OUT: &str = "out";
/// The folder of scratch files.
const SCRATCH: &str = "scratch";
/// What the target was.
const REPLACED: &str = "replaced";
/// A folder that is removed on drop unless it was put in its place, or its state is kept.
#[derive(Debug)]
pub struct Staging {
    work: PathBuf,
    out: PathBuf,
    target: PathBuf,
    outputs: Outputs,
    done: bool,
    /// Folders of scratch files elsewhere.
    rooms: Vec<(PathBuf, Lock)>,
    fleeting: Vec<Fleeting>,
    _lock: Lock,
}

/// What to do with the state that a stopped build left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Former {
    /// Refuse to begin.
    Refuse,
    /// Begin anew.
    Remove,
    /// Go on with it.
    Resume,
}

impl Staging {
    /// Makes the working folder for `target`, or takes over that of a build that was stopped.
    /// `spare` names what must not be replaced with the target: the files that the build reads, and
    /// the folders of its scratch files.
    ///
    /// # Errors
    /// Those of [`Outputs::folder`]; [`Error::Usage`] when another process builds the target, and when a
    /// stopped build can be gone on with, and `former` refuses; [`Error::Io`].
    pub fn new(target: &Path, force: bool, former: Former, spare: &[&Path]) -> Result<Staging> {
        let outputs = Outputs::new(spare, force);
        let work = work_of(target);
        if let Err(refused) = outputs.folder(target) {
            let there = target.symlink_metadata().is_ok();
            if there && !work.join(STATE).is_file() && !work.join(REPLACED).exists() {
                // Of a build that was killed when all but its end was done.
                // Together: the list of the ones is in the other.
                let _ = discard_rooms(&work) && discard_dead(&work);
            }
            return Err(refused);
        }
        let lock = match Lock::of_folder(&work)? {
            Tried::Taken(lock) => lock,
            Tried::Held(by) => return Err(at_work(target, by)),
        };
        let staging = Staging {
            out: work.join(OUT),
            target: target.to_owned(),
            outputs,
            done: false,
            rooms: Vec::new(),
            fleeting: vec![Fleeting::unless(&work, &work.join(STATE))],
            _lock: lock,
            work,
        };
        staging.take_over(former)?;
        Ok(staging)
    }

    /// Puts back what was put aside, and removes what cannot be gone on with.
    fn take_over(&self, former: Former) -> Result<()> {
        let aside = self.work.join(REPLACED);
        if aside.symlink_metadata().is_ok() {
            if self.target.symlink_metadata().is_err() {
                fs::rename(&aside, &self.target)
                    .map_err(|e| Error::io(&self.target, "put the old folder back to it", e))?;
                sync_dir(parent(&self.target))?;
                self.outputs.folder(&self.target)?;
            } else {
                remove(&aside)?;
            }
        }
        if self.state().is_file() {
            match former {
                Former::Resume => return self.make_folders(),
                Former::Remove => {}
                Former::Refuse => {
                    return Err(Error::Usage(format!(
                        "{}: a build of it was stopped and can be gone on with: `build --resume` \
                         goes on, --force begins anew",
                        self.target.display()
                    )));
                }
            }
        }
        // The state first: a killed removal must not leave a state without its files.
        if self.state().symlink_metadata().is_ok() {
            remove(&self.state())?;
            sync_dir(&self.work)?;
        }
        // Without the list nobody knows of a room that stays.
        if discard_rooms(&self.work) {
            remove(&self.work.join(ROOMS))?;
        }
        for name in [OUT, SCRATCH] {
            remove(&self.work.join(name))?;
        }
        self.make_folders()
    }

    fn make_folders(&self) -> Result<()> {
        for dir in [self.out.clone(), self.scratch()] {
            match fs::create_dir(&dir) {
                Err(e) if e.kind() != ErrorKind::AlreadyExists => {
                    return Err(Error::io(&dir, "create the folder", e));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// A folder for scratch files in each of `dirs`, named from the target; or the one beside it
    /// when there are none.
    ///
    /// # Errors
    /// [`Error::Usage`] when another process uses one; [`Error::Io`].
    pub fn rooms(&mut self, dirs: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let was = rooms_of(&self.work)?;
        if dirs.is_empty() && was.is_empty() {
            return Ok(vec![self.scratch()]);
        }
        let real = fs::canonicalize(&self.work).map_err(|e| Error::io(&self.work, "find it", e))?;
        let name = room_name(&self.target, &real);
        let mut rooms: Vec<PathBuf> = Vec::new();
        for dir in dirs {
            let dir = fs::canonicalize(dir).map_err(|e| Error::io(dir, "find it", e))?;
            let room = dir.join(&name);
            // A folder that was given twice is one.
            if !rooms.contains(&room) {
                rooms.push(room);
            }
        }
        let list = self.work.join(ROOMS);
        if !self.state().is_file() {
            // On the device before any state: a state without it would be that of another --tmp.
            let written = fs::create(&list).and_then(|mut file| {
                file.write_all(&joined(&rooms))?;
                file.sync()
            });
            written.map_err(|e| Error::io(&list, "write it", e))?;
        } else if was != rooms {
            return Err(Error::Usage(
                "the build that was stopped cannot be resumed: --tmp was another; give what was \
                 given then, or begin anew with --force"
                    .into(),
            ));
        }
        for room in rooms {
            let lock = match Lock::of_folder(&room)? {
                Tried::Taken(lock) => lock,
                Tried::Held(by) => return Err(at_work(&self.target, by)),
            };
            self.fleeting.push(Fleeting::unless(&room, &self.state()));
            let above = parent(&room).to_owned();
            // Ours from here on, so that it goes with an error.
            self.rooms.push((room, lock));
            sync_dir(&above)?;
        }
        let rooms: Vec<PathBuf> = self.rooms.iter().map(|(room, _)| room.clone()).collect();
        if !self.state().is_file() {
            rooms.iter().try_for_each(|room| empty(room))?;
        }
        Ok(rooms)
    }

    /// The folder that will be the target.
    pub fn path(&self) -> &Path {
        &self.out
    }

    /// The folder for scratch files beside the target.
    pub fn scratch(&self) -> PathBuf {
        self.work.join(SCRATCH)
    }

    /// The file of the state that a stopped build goes on from.
    pub fn state(&self) -> PathBuf {
        self.work.join(STATE)
    }

    /// Syncs the folder and gives it the name of its target.
    ///
    /// # Errors
    /// [`Error::Interrupted`]; [`Error::Io`], also when something that is not to be replaced has the
    /// name meanwhile.
    pub fn finish(&mut self) -> Result<()> {
        sync_dir(&self.out)?;
        // Who ends the process at once has removed the folder by now, and then says so here, or
        // does not know of it any more.
        self.fleeting.clear();
        go_on()?;
        let replaces = self.target.symlink_metadata().is_ok();
        if replaces {
            // It was not there when the build began: the build is kept, as for any other want of room.
            let refused = |e: Error| {
                let source = std::io::Error::new(ErrorKind::AlreadyExists, e.to_string());
                Error::io(&self.target, "give the finished folder its name", source)
            };
            self.outputs.folder(&self.target).map_err(refused)?;
        }
        // A state names arrays in the folder of that name, which after an exchange is the old one.
        if self.state().symlink_metadata().is_ok() {
            remove(&self.state())?;
            sync_dir(&self.work)?;
        }
        if !(replaces && exchange(&self.out, &self.target)) {
            self.rename(replaces)?;
        }
        self.done = true;
        let synced = sync_dir(parent(&self.target));
        if replaces && synced.is_err() {
            // What was replaced stays until the new name is certain to be on the device.
            return synced;
        }
        self.discard();
        synced
    }

    /// Removes the working folders; what stays is recognised by the next run.
    fn discard(&self) {
        let gone = |all: bool, room: &PathBuf| discard(room) && all;
        if self.rooms.iter().map(|(room, _)| room).fold(true, gone) {
            discard(&self.work);
        } else {
            // With the list of those that stay.
            for name in [OUT, SCRATCH] {
                let _ = remove(&self.work.join(name));
            }
        }
    }

    /// Gives the folder its name in two steps: what has it now is put aside.
    fn rename(&self, replaces: bool) -> Result<()> {
        let aside = self.work.join(REPLACED);
        if replaces {
            fs::rename(&self.target, &aside)
                .map_err(|e| Error::io(&self.target, "put the old one aside", e))?;
        }
        fs::rename(&self.out, &self.target).map_err(|e| {
            if replaces {
                // Best effort: what was there is better than nothing under that name.
                let _ = fs::rename(&aside, &self.target);
            }
            Error::io(&self.target, "rename the finished folder to it", e)
        })
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if !self.done && !self.state().is_file() && !self.work.join(REPLACED).exists() {
            self.discard();
        }
    }
}

/// Two builds of one target.
fn at_work(target: &Path, by: Option<u32>) -> Error {
    let who = by.map_or("another process".into(), |pid| format!("process {pid}"));
    Error::Usage(format!(
        "{}: {who} is at work on it; wait for it, or choose another name with -o",
        target.display()
    ))
}

/// Exchanges two names in one step; false where the system cannot, and nothing happened.
#[cfg(target_os = "linux")]
fn exchange(new: &Path, old: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, new, CWD, old, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> bool {
    false
}

/// Removes what a dead build left in its folder of scratch files: all but the lock.
fn empty(room: &Path) -> Result<()> {
    let list = fs::read_dir(room).map_err(|e| Error::io(room, "list it", e))?;
    let others = list.flatten().filter(|entry| entry.file_name() != "lock");
    others
        .map(|entry| entry.path())
        .try_for_each(|path| remove(&path))
}

/// Removes a file or folder, if it is there; links are not followed.
fn remove(path: &Path) -> Result<()> {
    let done = match path.symlink_metadata() {
        Ok(meta) if meta.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(_) => Ok(()),
    };
    done.map_err(|e| Error::io(path, "remove it", e))
}

/// Makes the names in a folder durable.
///
/// # Errors
/// [`Error::Io`].
pub fn sync_dir(path: &Path) -> Result<()> {
    fs::sync_dir(path).map_err(|e| Error::io(path, "sync the folder", e))
}
