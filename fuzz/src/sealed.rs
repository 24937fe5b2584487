//! A folder with any manifest, and with arrays changed behind right checksums: opening and
//! `verify` end in order, and no changed relation passes.

use super::place::{Place, files, sane};
use cornermill::CornerTable;
use cornermill::build::Builder;
use cornermill::folder::{self, Manifest};
use cornermill::verify::{Limits, verify};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use xxhash_rust::xxh3::xxh3_64;

/// Two tetrahedra, a third triangle on an edge of the second, its twin, one with a vertex twice.
const MESH: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 5 0 1\n\
    f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 7 8 5\nf 5 6 1\nf 5 6 1\nf 2 2 3\n";

/// The bytes of `docs/`'s example folder, as the build makes them.
struct Sound {
    place: Place,
    files: BTreeMap<String, Vec<u8>>,
}

impl Sound {
    fn new() -> Sound {
        let place = Place::new(16 << 20);
        let mesh = place.put("mesh.obj", MESH);
        let folder = place.path("sound.ct");
        let builder = Builder::new(mesh).memory(16 << 20).threads(1);
        builder.build(&folder).expect("the mesh is sound");
        let files = files(&folder).into_iter().collect();
        Sound { place, files }
    }
}

thread_local! {
    static SOUND: OnceCell<Sound> = const { OnceCell::new() };
}

/// The text of a manifest; behind a zero byte, edits of four bytes each: which array, which byte
/// of its data (two), its new value. The manifest as it is when there is no text before the zero.
pub fn manifest(data: &[u8]) {
    SOUND.with(|sound| {
        let sound = sound.get_or_init(Sound::new);
        let end = data.iter().position(|&b| b == 0).unwrap_or(data.len());
        let (text, edits) = (&data[..end], data.get(end + 1..).unwrap_or_default());
        let own = &sound.files[folder::MANIFEST][..];
        let text = if text.is_empty() { own } else { text };
        let mut files = sound.files.clone();
        let names: Vec<String> = files.keys().cloned().collect();
        for &[which, low, high, value] in edits.as_chunks::<4>().0 {
            let file = files.get_mut(&names[usize::from(which) % names.len()]);
            let file = file.expect("a file of this name");
            // The manifest is the text, and arrays may be empty.
            if file.starts_with(b"\x93NUMPY") && file.len() > 4096 {
                let at = usize::from(u16::from_le_bytes([low, high])) % (file.len() - 4096);
                file[4096 + at] = value;
            }
        }
        files.insert(folder::MANIFEST.to_owned(), text.to_vec());
        let damaged = linked(sound, &files);
        for sealed in [false, true] {
            if sealed && !seal(&mut files) {
                break;
            }
            let passes = held(sound, &files);
            assert!(
                passes == Some(true) || files != sound.files,
                "a sound folder fails"
            );
            // A checksum tells any change, and then the relations do.
            if !sealed && files != sound.files {
                assert!(passes != Some(true), "a change without a checksum passes");
            }
            assert!(!damaged || passes != Some(true), "a wrong relation passes");
        }
    });
}

/// True when an array was changed that V and G determine.
fn linked(sound: &Sound, files: &BTreeMap<String, Vec<u8>>) -> bool {
    let same = |name: &str| files[name] == sound.files[name];
    let told = [
        folder::O,
        folder::COMPONENT,
        folder::DEGENERATE,
        folder::DUPLICATE,
        folder::NONMANIFOLD_CORNERS,
        folder::NONMANIFOLD_EDGES,
        folder::NONMANIFOLD_VERTICES,
    ];
    same(folder::V) && same(folder::G) && !told.into_iter().all(same)
}

/// Gives the manifest the checksums of what is there; false when the text is none.
fn seal(files: &mut BTreeMap<String, Vec<u8>>) -> bool {
    let text = &files[folder::MANIFEST];
    let Ok(mut manifest) = serde_json::from_slice::<Manifest>(text) else {
        return false;
    };
    for entry in &mut manifest.files {
        if let Some(bytes) = files.get(&entry.name) {
            entry.blocks = vec![format!("{:016x}", xxh3_64(bytes))];
        }
    }
    let text = manifest.to_text().into_bytes();
    files.insert(folder::MANIFEST.to_owned(), text);
    true
}

/// Opens and checks a folder of these files: whether it passes, none when it is refused.
fn held(sound: &Sound, files: &BTreeMap<String, Vec<u8>>) -> Option<bool> {
    let place = &sound.place;
    let folder = place.path("any.ct");
    if !folder.exists() {
        std::fs::create_dir(&folder).expect("a folder");
    }
    for (name, bytes) in files {
        place.put(&format!("any.ct/{name}"), bytes);
    }
    let table = CornerTable::open(&folder);
    match &table {
        Ok(table) => _ = table.check_bounds(&folder).map_err(|e| sane(&e)),
        Err(error) => sane(error),
    }
    let passes = match verify(&place.ws, &folder, Limits::default()) {
        Ok(verdict) => Some(verdict.ok()),
        Err(error) => {
            sane(&error);
            None
        }
    };
    if passes == Some(true) {
        let table = table.expect("what passes opens");
        table
            .check_bounds(&folder)
            .expect("what passes is in bounds");
        for c in (0..).map_while(|id| table.corner(id)) {
            assert!(table.o(c).is_none_or(|o| table.o(o) == Some(c)));
            assert!(table.fan(c).count() <= 33);
        }
    }
    place.settled();
    passes
}
