//! The file that is written: under a temporary name beside its target until it is complete.
//!
//! Memory: a block of 1 MiB while bytes are copied, leased. I/O: each byte written once.

use crate::disk::{ScratchFile, Workspace};
use crate::error::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use xxhash_rust::xxh3::Xxh3;

/// Bytes that are copied at a time.
const BLOCK: u64 = 1 << 20;

/// A file that gets its name when it is complete.
pub(super) struct Out<'a> {
    temp: NamedTempFile,
    pub(super) written: u64,
    pub(super) summed: Xxh3,
    ws: &'a Workspace,
    target: PathBuf,
}

impl<'a> Out<'a> {
    pub(super) fn create(ws: &'a Workspace, target: &Path) -> Result<Out<'a>> {
        let dir = crate::build::parent(target);
        // A plain new file's permissions (less the umask), not a private temporary one's.
        let temp = tempfile::Builder::new()
            .prefix(".cornermill-")
            .suffix(".tmp")
            .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666))
            .tempfile_in(dir)
            .map_err(|e| Error::io(dir, "create a file there", e))?;
        Ok(Out {
            temp,
            written: 0,
            summed: Xxh3::new(),
            ws,
            target: target.to_owned(),
        })
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.temp
            .write_all(bytes)
            .map_err(|e| Error::io(&self.target, "write to it", e))?;
        self.summed.update(bytes);
        self.written += bytes.len() as u64;
        self.ws.io.add_written(bytes.len() as u64);
        Ok(())
    }

    /// Copies bytes of a scratch file.
    pub(super) fn copy(&mut self, from: &ScratchFile, at: u64, bytes: u64) -> Result<()> {
        let _lease = self.ws.budget.lease("a block of coded bytes", BLOCK)?;
        let mut buf = vec![0; BLOCK.min(bytes) as usize];
        let mut done = 0;
        while done < bytes {
            let n = (bytes - done).min(buf.len() as u64) as usize;
            from.read_at(&mut buf[..n], at + done)?;
            self.put(&buf[..n])?;
            done += n as u64;
        }
        Ok(())
    }

    /// Syncs the file and gives it its name; its length.
    pub(super) fn finish(self, target: &Path, force: bool) -> Result<u64> {
        let sync = self.temp.as_file().sync_all();
        sync.map_err(|e| Error::io(target, "sync it to the device", e))?;
        let kept = if force {
            self.temp.persist(target)
        } else {
            self.temp.persist_noclobber(target)
        };
        match kept {
            Ok(_) => Ok(self.written),
            Err(e) if e.error.kind() == std::io::ErrorKind::AlreadyExists => Err(exists(target)),
            Err(e) => Err(Error::io(
                target,
                "give the finished file its name",
                e.error,
            )),
        }
    }
}

pub(super) fn exists(path: &Path) -> Error {
    Error::Usage(format!(
        "{}: exists; give --force to replace it, or another name",
        path.display()
    ))
}
