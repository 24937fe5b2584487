//! Gives a folder that was built without measures the ones that naive counting finds, so that what
//! reads them can be tried apart from what finds them.

use super::common::folder::Folder as Read;
use super::stars::Stars;
use cornermill::disk::Counters;
use cornermill::folder::{self, ComponentMeasures, Folder, Manifest, Measures, Row, Rows, npy};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Measures a folder, unless it is measured.
pub fn measure(path: &Path) {
    let opened = Folder::open(path, &Arc::new(Counters::default())).expect("a folder");
    if opened.manifest().measures.is_some() {
        return;
    }
    let read = Read::read(path);
    let stars = Stars::of(&read.v.ids(), &read.o.ids());
    let mut rows = Vec::new();
    let mut table = Rows::open(&opened).expect("a table");
    table
        .each(|_, row| {
            rows.push(*row);
            Ok(())
        })
        .expect("its rows");
    let labels = read.component.ids();
    let mut bytes = Vec::new();
    let mut sums = Measures::default();
    for (number, row) in rows.iter().enumerate() {
        let measures = component(&read, &stars, &labels, number as u64, row);
        sums.fans += measures.fans;
        sums.euler += measures.euler;
        sums.smesh_components += u64::from(measures.is_smesh);
        bytes.extend_from_slice(bytemuck::bytes_of(&row.base));
        bytes.extend_from_slice(bytemuck::bytes_of(&measures));
    }
    sums.border_loops = stars.loops as u64;
    sums.nonmanifold_vertices = stars.nonmanifold.len() as u64;
    sums.duplicate = stars.duplicate.len() as u64;
    let mut manifest = opened.manifest().clone();
    let count = rows.len() as u64;
    write(
        path,
        &mut manifest,
        folder::COMPONENTS,
        folder::MEASURED_DESCR,
        count,
        &bytes,
    );
    let id = format!("<{}", manifest.index);
    for (name, list) in [
        (folder::NONMANIFOLD_VERTICES, &stars.nonmanifold),
        (folder::DUPLICATE, &stars.duplicate),
    ] {
        let bytes: Vec<u8> = list
            .iter()
            .flat_map(|&i| (i as u32).to_le_bytes())
            .collect();
        write(path, &mut manifest, name, &id, list.len() as u64, &bytes);
    }
    manifest.measures = Some(sums);
    std::fs::write(path.join(folder::MANIFEST), manifest.to_text()).expect("a manifest");
}

fn component(
    read: &Read,
    stars: &Stars,
    labels: &[u64],
    number: u64,
    row: &Row,
) -> ComponentMeasures {
    let v = read.v.ids();
    let mine = |c: &usize| labels[c / 3] == number;
    let corners = || (0..v.len()).filter(mine);
    let vertices = corners().map(|c| v[c]).collect::<BTreeSet<_>>().len() as u64;
    let fans = corners()
        .filter_map(|c| stars.fan[c])
        .collect::<BTreeSet<_>>()
        .len() as u64;
    let loops = corners().filter_map(|c| stars.loop_of.get(&c));
    let border_loops = loops.collect::<BTreeSet<_>>().len() as u64;
    let (edges, triangles) = (row.base.edges, row.base.triangles);
    let euler = fans as i64 - edges as i64 + triangles as i64;
    let rest = (2 - border_loops as i64 - euler) as u64;
    let orientable = row.base.orientable == 1;
    let sphere = row.base.closed == 1 && orientable && fans == vertices;
    ComponentMeasures {
        vertices,
        fans,
        border_loops,
        euler,
        genus: if orientable { rest / 2 } else { rest },
        is_smesh: u8::from(sphere && triangles + 4 == 2 * vertices),
    }
}

/// Writes an array, and its place in the manifest.
fn write(path: &Path, manifest: &mut Manifest, name: &str, descr: &str, rows: u64, data: &[u8]) {
    let bytes = [&npy::header_bytes(descr, &[rows])[..], data].concat();
    std::fs::write(path.join(name), &bytes).expect("an array");
    manifest.files.retain(|f| f.name != name);
    manifest.files.push(folder::FileEntry {
        name: name.into(),
        dtype: descr.into(),
        shape: vec![rows],
        bytes: bytes.len() as u64,
        blocks: vec![],
    });
}
