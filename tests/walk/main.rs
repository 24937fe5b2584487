//! Walks over folders that `build` made, against naive ones over the same V and O: shortest paths
//! and the smallest of them, the letters of swirls, scratch space in the least memory, and the
//! commands.

#[path = "../common/mod.rs"]
mod common;

mod command;
mod damaged;
mod naive;
mod paths;
mod swirls;

use common::folder::Folder as Read;
use common::formats::write_npy;
use common::mesh::Mesh;
use cornermill::CornerTable;
use cornermill::build::{Builder, IndexChoice};
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::Folder;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A folder, as the program has it and as the naive walks do.
struct Home {
    dir: tempfile::TempDir,
    path: PathBuf,
    folder: Folder,
    table: CornerTable,
    naive: naive::Surface,
    name: String,
}

impl Home {
    fn of(mesh: &Mesh, wide: bool) -> Home {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (v, g) = write_npy(mesh, dir.path());
        let index = if wide {
            IndexChoice::U8
        } else {
            IndexChoice::Auto
        };
        let builder = Builder::new(&v).positions(&g).index(index);
        Home::built(dir, builder, &mesh.name)
    }

    /// From a file of `tests/meshes`.
    fn real(name: &str) -> Home {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/meshes")
            .join(name);
        let dir = tempfile::tempdir().expect("a temporary directory");
        Home::built(dir, Builder::new(file).weld(true), name)
    }

    fn built(dir: tempfile::TempDir, builder: Builder, name: &str) -> Home {
        let path = dir.path().join("OUT.ct");
        builder
            .memory(64 << 20)
            .threads(1)
            .build(&path)
            .expect(name);
        let read = Read::read(&path);
        let folder = Folder::open(&path, &Arc::new(Counters::default())).expect("a folder");
        let table = CornerTable::from_folder(&folder).expect("a table");
        let naive = naive::Surface {
            v: read.v.ids(),
            o: read.o.ids(),
        };
        Home {
            dir,
            path,
            folder,
            table,
            naive,
            name: name.into(),
        }
    }

    fn workspace(&self, memory: u64) -> Workspace {
        let io = Arc::new(Counters::default());
        Workspace {
            budget: Budget::new(memory),
            scratch: Scratch::new(&[self.dir.path().to_owned()], u64::MAX, &io).expect("scratch"),
            io,
            workers: Workers::new(1).expect("a thread"),
            progress: Arc::new(NoProgress),
        }
    }
}
