//! The files of a folder as files: there, of the right length, type and shape, with the exact
//! header and the checksums of the manifest.
//!
//! Why first: every later check reads at places computed from the shapes, so these are held
//! to the true length of each file before anything else is read.
//!
//! Memory: 4 KiB, and 256 KiB a thread for the checksums. I/O: each file once.

use super::verdict::{At, Check, Checked, Findings};
use crate::disk::{DataFile, Workspace, fs};
use crate::error::{Error, Result, printable};
use crate::folder::npy::header_bytes;
use crate::folder::{self, FileEntry, Manifest, block_sums};
use std::io::ErrorKind;
use std::path::Path;

/// The arrays that are checked beyond their checksums.
const KNOWN: [&str; 13] = [
    folder::V,
    folder::O,
    folder::G,
    folder::COMPONENT,
    folder::FLIPPED,
    folder::COMPONENTS,
    folder::NONMANIFOLD_EDGES,
    folder::NONMANIFOLD_CORNERS,
    folder::NONMANIFOLD_VERTICES,
    folder::DUPLICATE,
    folder::DEGENERATE,
    folder::MAP_TRIANGLE,
    folder::MAP_VERTEX,
];

/// Most remarks about unknown files.
const FEW_NOTES: usize = 20;

/// Checks the files named in the manifest as files; true when the known ones can be read.
pub(super) fn check(
    ws: &Workspace,
    path: &Path,
    manifest: &Manifest,
    findings: &Findings,
    checked: &mut Checked,
) -> Result<bool> {
    if manifest.conventions != Manifest::conventions() {
        let at = At::Key("conventions");
        findings.add(Check::Manifest, folder::MANIFEST, at, || {
            ("other words".into(), "the conventions of the format".into())
        });
    }
    let mut readable = true;
    let mut open = Vec::new();
    for (place, entry) in manifest.files.iter().enumerate() {
        let again = manifest.files[..place].iter().any(|f| f.name == entry.name);
        if again || !folder::is_plain(&entry.name) {
            findings.add(Check::Manifest, folder::MANIFEST, At::Key("files"), || {
                let found = format!("the name {:?}", entry.name);
                (found, "a plain file name, each once".into())
            });
            readable = false;
            continue;
        }
        match open_file(ws, path, entry, findings)? {
            Some((file, whole)) => {
                readable &= whole || !KNOWN.contains(&entry.name.as_str());
                open.push((entry, file));
            }
            None => readable &= !KNOWN.contains(&entry.name.as_str()),
        }
    }
    sums(ws, &open, findings, checked)?;
    Ok(readable)
}

/// Opens a file and holds length and header to the manifest; the flag says that it is as long
/// as it should be.
fn open_file(
    ws: &Workspace,
    path: &Path,
    entry: &FileEntry,
    findings: &Findings,
) -> Result<Option<(DataFile, bool)>> {
    let path = path.join(&entry.name);
    let name = entry.name.as_str();
    let found = match fs::metadata(&path) {
        Ok(meta) if meta.is_file() => None,
        Ok(meta) if meta.is_dir() => Some("a folder"),
        // Opening a pipe would wait for its writer.
        Ok(_) => Some("a pipe or device"),
        Err(e) if e.kind() == ErrorKind::NotFound => Some("no such file"),
        Err(e) => return Err(Error::io(&path, "look for it", e)),
    };
    if let Some(found) = found {
        findings.add(Check::Header, name, At::File, || {
            let expected = format!("{} bytes, as the manifest says", entry.bytes);
            (found.into(), expected)
        });
        return Ok(None);
    }
    let file = DataFile::open(&path, &ws.io)?;
    let len = file.len()?;
    if len != entry.bytes {
        findings.add(Check::Header, name, At::File, || {
            let expected = format!("{} bytes, as the manifest says", entry.bytes);
            (format!("{len} bytes"), expected)
        });
    }
    let expected = header_bytes(&entry.dtype, &entry.shape);
    let mut found = vec![0; expected.len()];
    let got = file.read_some_at(&mut found, 0)?;
    let differs = (0..expected.len()).find(|&i| i >= got || found[i] != expected[i]);
    if let Some(byte) = differs {
        findings.add(Check::Header, name, At::Byte(byte as u64), || {
            let found = match found.get(byte).filter(|_| byte < got) {
                Some(value) => format!("{value:#04x}"),
                None => "the end of the file".into(),
            };
            let what = format!(
                "{:#04x} of the header for {} {:?}",
                expected[byte], entry.dtype, entry.shape
            );
            (found, what)
        });
    }
    Ok(Some((file, len == entry.bytes)))
}

/// Compares the checksum of every block with the manifest.
fn sums(
    ws: &Workspace,
    open: &[(&FileEntry, DataFile)],
    findings: &Findings,
    checked: &mut Checked,
) -> Result<()> {
    let mut bytes = 0;
    for (_, file) in open {
        bytes += file.len()?;
    }
    ws.progress.begin("verify: checksums", "bytes", bytes);
    let files: Vec<&DataFile> = open.iter().map(|(_, file)| file).collect();
    let sums = block_sums(ws, &files)?;
    for ((entry, _), sums) in open.iter().zip(&sums) {
        for (block, sum) in sums.iter().enumerate() {
            let found = format!("{sum:016x}");
            let expected = entry.blocks.get(block).map_or("none", |s| s.as_str());
            if found != expected {
                let at = At::Block(block as u64);
                findings.add(Check::Checksum, &entry.name, at, || {
                    (format!("xxh3 {found}"), format!("{expected} (manifest)"))
                });
            }
        }
        if entry.blocks.len() > sums.len() {
            let at = At::Block(sums.len() as u64);
            findings.add(Check::Checksum, &entry.name, at, || {
                (
                    "no such block".into(),
                    format!("{} blocks", entry.blocks.len()),
                )
            });
        }
    }
    ws.progress.end();
    checked.files = open.len() as u64;
    checked.bytes = bytes;
    Ok(())
}

/// Remarks about files that are not part of the format, or not checked further.
pub(super) fn notes(path: &Path, manifest: &Manifest) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    for entry in &manifest.files {
        if !KNOWN.contains(&entry.name.as_str()) {
            notes.push(printable(format!(
                "{}: only its checksum was checked",
                entry.name
            )));
        }
    }
    let list = fs::read_dir(path).map_err(|e| Error::io(path, "list it", e))?;
    let mut names = Vec::new();
    for item in list {
        let item = item.map_err(|e| Error::io(path, "list it", e))?;
        let name = item.file_name().to_string_lossy().into_owned();
        let ours = name == folder::MANIFEST || manifest.files.iter().any(|f| f.name == name);
        if !ours && names.len() <= FEW_NOTES {
            names.push(printable(format!(
                "{name}: not part of the folder, not checked"
            )));
        }
    }
    names.sort();
    notes.extend(names);
    notes.truncate(FEW_NOTES);
    Ok(notes)
}
