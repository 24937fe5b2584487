//! `.npy`: V and G as the folder stores them, with ids as narrow as they can be.
//!
//! Memory: none of its own. I/O: none of its own.

use super::job::Job;
use super::sink::Sink;
use crate::corner::Index;
use crate::error::Result;
use crate::folder::npy::header_bytes;
use std::path::{Path, PathBuf};

/// Where the coordinates go: `NAME.G.npy` beside `NAME.npy`.
pub(super) fn path_of_g(target: &Path) -> PathBuf {
    match target.extension() {
        Some(end) if end.eq_ignore_ascii_case("npy") => target.with_extension("G.npy"),
        _ => {
            let mut name = target.as_os_str().to_owned();
            name.push(".G.npy");
            name.into()
        }
    }
}

/// V, (T,3): u4 when every id fits, whatever the folder's width.
pub(super) fn write_v(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    let narrow = job.vertices < u64::from(u32::NONE);
    let descr = if narrow { u32::DESCR } else { u64::DESCR };
    let head = header_bytes(descr, &[job.triangles, 3]);
    sink.put(|buf| buf.extend_from_slice(&head))?;
    job.each_face(|t| {
        sink.put(|buf| {
            for v in t {
                if narrow {
                    buf.extend_from_slice(&u32::of(v).to_le_bytes());
                } else {
                    buf.extend_from_slice(&v.to_le_bytes());
                }
            }
        })
    })
}

/// G, (N,3), of the folder's type.
pub(super) fn write_g(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    let Some(descr) = job.g.as_ref().map(|(kind, _)| kind.descr()) else {
        return Ok(());
    };
    let head = header_bytes(descr, &[job.vertices, 3]);
    sink.put(|buf| buf.extend_from_slice(&head))?;
    job.each_point(|_, row| sink.put(|buf| buf.extend_from_slice(row)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn g_is_named_after_v() {
        assert_eq!(path_of_g("a/scan.npy".as_ref()), Path::new("a/scan.G.npy"));
        assert_eq!(path_of_g("scan.1".as_ref()), Path::new("scan.1.G.npy"));
    }
}
