//! Shared vertices: which fans meet at a vertex, and what that says of components.
//!
//! Why it works: once components are known, the fans of the vertices that have several are sorted
//! by (vertex, component). A component has as many distinct vertices as fans, but for the fans that
//! meet another one of its own at their vertex; components that meet at a vertex are joined there.
//!
//! Memory: a writer, a sorter, blocks; 8 bytes a component, or a contraction. I/O: 2 words a fan
//! read twice, a label for each, 2 words written and read by vertex.

use super::super::appender::{Appender, BLOCK};
use super::super::arrays::OutArray;
use super::super::graph::labels::{Labels, split};
use super::super::nodes::Nodes;
use super::super::{Job, scratch_items};
use super::records::{Keyed, Shared};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::Result;
use crate::folder;
use crate::shuffle::{Buckets, Shuffle};

/// What the shared vertices say.
pub struct Meetings {
    /// The vertices with several fans, ascending, as words.
    vertices: ScratchFile,
    /// Number of sets of components when shared vertices join them.
    pub joined: u64,
}

/// Brings the fans that share vertices together. `again` is told each component that has a vertex
/// once more than it counts fans there, with how many times.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`], and those of
/// `again`.
pub fn meet<W: Index>(
    job: &Job,
    nodes: &Nodes,
    labels: &Labels<W>,
    shared: &ScratchFile,
    again: &mut dyn FnMut(u64, u64) -> Result<()>,
) -> Result<Meetings> {
    let vertices = job.ws.scratch.file("vertices with several fans")?;
    if shared.is_empty() {
        return Ok(Meetings {
            vertices,
            joined: labels.components,
        });
    }
    let fans = by_vertex(job, nodes, labels, shared)?;
    let _lease = job.ws.budget.lease("shared vertices", BLOCK as u64)?;
    let mut list = Appender::<W>::new(&vertices);
    let mut joins = job.joins::<W>(labels.components)?;
    let mut sorter = fans.sorter(job.sort_memory(0))?;
    let mut at: Option<Vertex> = None;
    fans.sorted_all(&mut sorter, &mut |batch| {
        for fan in batch {
            let [vertex, component] = fan.0.map(W::wide);
            match &mut at {
                Some(here) if here.vertex == vertex => {
                    if !here.listed {
                        list.push(W::of(vertex))?;
                        here.listed = true;
                    }
                    if here.component == component {
                        again(component, 1)?;
                    } else {
                        joins.join(here.component, component)?;
                        here.component = component;
                    }
                }
                _ => {
                    at = Some(Vertex {
                        vertex,
                        component,
                        listed: false,
                    });
                }
            }
        }
        Ok(())
    })?;
    list.flush()?;
    Ok(Meetings {
        vertices,
        joined: joins.sets()?,
    })
}

/// The vertex whose fans are arriving, and the component of the last.
struct Vertex {
    vertex: u64,
    component: u64,
    listed: bool,
}

/// The fans by vertex and component.
fn by_vertex<W: Index>(
    job: &Job,
    nodes: &Nodes,
    labels: &Labels<W>,
    shared: &ScratchFile,
) -> Result<Buckets<Keyed<W>>> {
    let (ws, n) = (job.ws, job.shape.vertices.max(1));
    let numbers = ws.scratch.file("local components at shared vertices")?;
    {
        let _lease = ws.budget.lease("local components", BLOCK as u64)?;
        let mut list = Appender::<W>::new(&numbers);
        scratch_items(ws, shared, 0, shared.len(), &mut |fans: &[Shared<W>]| {
            fans.iter().try_for_each(|fan| list.push(fan.0[1]))
        })?;
        list.flush()?;
    }
    let found = job.labels_of_list(labels, nodes.count(), &numbers)?;
    let count = shared.len() / size_of::<Shared<W>>() as u64;
    let plan = job.single_plan(size_of::<Keyed<W>>(), count);
    let fans = Shuffle::<Keyed<W>>::new(ws, "fans by vertex", 0..n, plan)?;
    let mut writer = fans.writer()?;
    let _lease = ws.budget.lease("labels of fans", BLOCK as u64)?;
    let (mut at, mut block) = (0, Vec::<W>::new());
    scratch_items(ws, shared, 0, shared.len(), &mut |fans: &[Shared<W>]| {
        block.resize(fans.len(), W::NONE);
        found.read_at(bytemuck::cast_slice_mut(&mut block), at)?;
        at += size_of_val(&block[..]) as u64;
        for (Shared([vertex, _]), &label) in fans.iter().zip(&block) {
            writer.push(Keyed([*vertex, W::of(split(label).0)]))?;
        }
        Ok(())
    })?;
    writer.finish()?;
    fans.finish()
}

impl Keep for Meetings {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.file(&self.vertices)?;
        to.number(self.joined)
    }

    fn restore(from: &mut Reader) -> Result<Meetings> {
        Ok(Meetings {
            vertices: from.file()?,
            joined: from.number()?,
        })
    }
}

impl Meetings {
    /// Number of vertices with several fans.
    pub fn count<W: Index>(&self) -> u64 {
        self.vertices.len() / W::BYTES as u64
    }

    /// Writes the list of them.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`].
    pub fn list<I: Index, W: Index>(&self, job: &Job) -> Result<OutArray> {
        let (name, bytes) = (folder::NONMANIFOLD_VERTICES, I::BYTES as u64);
        let rows = [self.count::<W>()];
        let array = OutArray::create(job.dir, name, I::DESCR, &rows, bytes, job.ws)?;
        let _lease = job.ws.budget.lease("shared vertices", BLOCK as u64 * 2)?;
        let (file, mut done, mut ids) = (&self.vertices, 0, Vec::new());
        scratch_items(job.ws, file, 0, file.len(), &mut |some: &[W]| {
            ids.clear();
            ids.extend(some.iter().map(|v| I::of(v.wide())));
            array.write(done, &ids)?;
            done += ids.len() as u64;
            Ok(())
        })?;
        Ok(array)
    }
}
