//! Files that are damaged, cut short, gone, or not what the manifest says.

use crate::breaks::pair;
use crate::naive::parts;
use crate::{check, meshes, said};
use cornermill::Error;
use cornermill::folder::{self, Manifest, Orient};
use cornermill::verify::{At, Check, Limits, least_memory};

#[test]
fn notices_every_changed_byte() {
    let mut soup = meshes::two_on_an_edge();
    soup.v.push([3, 3, 4]);
    let parts = parts(&soup, Orient::Outward);
    let dir = tempfile::tempdir().unwrap();
    parts.write(dir.path());
    let mut files = 0;
    for item in std::fs::read_dir(dir.path()).unwrap() {
        let path = item.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let sound = std::fs::read(&path).unwrap();
        if name == folder::MANIFEST {
            continue;
        }
        files += 1;
        for byte in (0..sound.len())
            .step_by(sound.len() / 40)
            .chain([sound.len() - 1])
        {
            let mut bytes = sound.clone();
            bytes[byte] ^= 0x10;
            std::fs::write(&path, &bytes).unwrap();
            let verdict = check(dir.path(), 16 << 20, 2, Limits::default()).unwrap();
            let sums: Vec<_> = verdict
                .findings
                .iter()
                .filter(|f| f.check == Check::Checksum)
                .map(|f| (f.file.clone(), f.at))
                .collect();
            assert_eq!(
                sums,
                [(name.clone(), At::Block(0))],
                "byte {byte} of {name}"
            );
            let header = verdict.findings.iter().find(|f| f.check == Check::Header);
            assert_eq!(
                header.map(|f| f.at),
                (byte < 4096).then_some(At::Byte(byte as u64))
            );
        }
        std::fs::write(&path, &sound).unwrap();
    }
    assert_eq!(files, 11);
}

#[test]
fn notices_files_cut_short_or_gone() {
    let (soup, orient) = pair();
    let parts = parts(&soup, orient);
    for name in [folder::V, folder::G, folder::FLIPPED, folder::COMPONENTS] {
        for keep in [None, Some(0), Some(100), Some(4096), Some(4097)] {
            let dir = tempfile::tempdir().unwrap();
            parts.write(dir.path());
            let path = dir.path().join(name);
            let mut bytes = std::fs::read(&path).unwrap();
            match keep {
                None => std::fs::remove_file(&path).unwrap(),
                Some(n) => {
                    // flipped.npy has one byte of data: make it longer instead.
                    bytes.resize(if n == bytes.len() { n + 1 } else { n }, 0);
                    std::fs::write(&path, &bytes).unwrap();
                }
            }
            let verdict = check(dir.path(), 16 << 20, 2, Limits::default()).unwrap();
            assert!(!verdict.ok() && !verdict.complete);
            let found = verdict
                .findings
                .iter()
                .any(|f| f.check == Check::Header && f.file == name && f.at == At::File);
            assert!(found, "{name} {keep:?}: {}", said(&verdict));
        }
    }
}

/// What must be said, after which change.
type Change = (&'static str, fn(&mut Manifest));

#[test]
fn notices_a_manifest_at_odds_with_itself() {
    let (soup, orient) = pair();
    let parts = parts(&soup, orient);
    let changes: [Change; 9] = [
        ("an array of that name", |m| {
            m.files.retain(|f| f.name != folder::COMPONENT);
        }),
        ("a plain file name", |m| m.files[0].name = "../V.npy".into()),
        ("a plain file name", |m| m.files.push(m.files[0].clone())),
        ("O.npy: whole file", |m| m.files[1].shape = vec![3, 8]),
        ("V.npy: whole file", |m| m.files[0].dtype = "<i4".into()),
        ("V.npy: whole file", |m| {
            m.files[0].shape = vec![u64::MAX, 3]
        }),
        ("u4 or u8 wide enough", |m| m.index = "u2".into()),
        ("null beside a G.npy", |m| m.coords = None),
        ("the conventions of the format", |m| m.conventions.clear()),
    ];
    for (says, change) in changes {
        let dir = tempfile::tempdir().unwrap();
        parts.write_with(dir.path(), change);
        let verdict = check(dir.path(), 16 << 20, 2, Limits::default()).unwrap();
        assert!(verdict.count(Check::Manifest) > 0, "{says}");
        assert!(said(&verdict).contains(says), "{says}: {}", said(&verdict));
    }
}

#[test]
fn tells_files_that_do_not_belong() {
    let (soup, orient) = pair();
    let dir = tempfile::tempdir().unwrap();
    parts(&soup, orient).write(dir.path());
    std::fs::write(dir.path().join("notes.txt"), "mine").unwrap();
    let verdict = check(dir.path(), 16 << 20, 1, Limits::default()).unwrap();
    assert!(verdict.ok());
    assert_eq!(
        verdict.notes,
        ["notes.txt: not part of the folder, not checked"]
    );
}

#[test]
fn refuses_what_is_no_folder_and_what_is_no_memory() {
    let dir = tempfile::tempdir().unwrap();
    let empty = check(dir.path(), 16 << 20, 1, Limits::default());
    assert!(matches!(empty, Err(Error::Input(_))));
    let (soup, orient) = pair();
    parts(&soup, orient).write(dir.path());
    let small = check(dir.path(), least_memory(2) - 1, 2, Limits::default());
    match small {
        Err(Error::Budget { need, .. }) => assert_eq!(need, least_memory(2)),
        other => panic!("{other:?}"),
    }
    let path = dir.path().join(folder::MANIFEST);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(
        &path,
        text.replace("\"edges\"", "\"edgse\"").replace(": 8", ": 9"),
    )
    .unwrap();
    let damaged = check(dir.path(), 16 << 20, 1, Limits::default());
    assert!(matches!(damaged, Err(Error::Input(_))));
}
