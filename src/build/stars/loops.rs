//! Loops: joins the open fans that chunks and cells could not, end to end.
//!
//! Why it works: a corner without opposite lies at the ends of two fans. Inside a chunk such corners
//! are joined into chains; a chain that leaves it has one fan at either end, and both name it. So
//! every name comes twice, the fans are linked in rings by their common names, and each ring is a
//! loop.
//!
//! Memory: one writer, a sorter, blocks; a label for each open fan, or a contraction. I/O: 12 bytes
//! a fan read three times, 16 written and read by name, 8 for each link (twice that for wide ids).

use super::super::appender::{Appender, BLOCK};
use super::super::{Job, scratch_items};
use super::gather::Gathered;
use super::paths::{Firsts, Links, sets};
use super::records::{Keyed, Open};
use crate::corner::Index;
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Shuffle};

/// Finds the loops.
///
/// # Errors
/// [`Error::Internal`] for a name that does not come twice; [`Error::Budget`], [`Error::Io`],
/// [`Error::DiskLimit`].
pub fn loops<W: Index>(job: &Job, gathered: &Gathered) -> Result<()> {
    let (ws, opens) = (job.ws, &gathered.opens);
    let fans = opens.len() / size_of::<Open<W>>() as u64;
    if fans == 0 {
        return Ok(());
    }
    let links = ws.scratch.file("links of open fans")?;
    link(
        job,
        &by_name::<W>(job, gathered, fans)?,
        &mut Links::new(job, &links)?,
    )?;
    let labels = sets::<W>(job, fans, &links)?;
    let _lease = ws.budget.lease("loops", BLOCK as u64)?;
    let mut firsts = Firsts::new(job, &labels, fans)?;
    let mut loops = Appender::new(&gathered.loops);
    scratch_items(ws, opens, 0, opens.len(), &mut |fans: &[Open<W>]| {
        for Open([_, _, number]) in fans {
            if firsts.advance()?.1 {
                loops.push(*number)?;
            }
        }
        Ok(())
    })?;
    loops.flush()
}

/// The fans by the names of the chains at their ends.
fn by_name<W: Index>(job: &Job, gathered: &Gathered, fans: u64) -> Result<Buckets<Keyed<W>>> {
    let corners = 0..4 * job.shape.triangles.max(1);
    let plan = job.single_plan(size_of::<Keyed<W>>(), 2 * fans);
    let names = Shuffle::<Keyed<W>>::new(job.ws, "open fans by chain", corners, plan)?;
    let mut writer = names.writer()?;
    let (opens, mut fan) = (&gathered.opens, 0);
    scratch_items(job.ws, opens, 0, opens.len(), &mut |fans: &[Open<W>]| {
        for Open([a, b, _]) in fans {
            writer.push(Keyed([*a, W::of(fan)]))?;
            writer.push(Keyed([*b, W::of(fan)]))?;
            fan += 1;
        }
        Ok(())
    })?;
    writer.finish()?;
    names.finish()
}

/// Links the two fans at each name.
fn link<W: Index>(job: &Job, names: &Buckets<Keyed<W>>, links: &mut Links<W>) -> Result<()> {
    let mut sorter = names.sorter(job.sort_memory(0))?;
    let mut before: Option<Keyed<W>> = None;
    let lonely = |Keyed([name, _]): Keyed<W>| {
        let (t, k) = (name.wide() >> 2, name.wide() & 3);
        Error::Internal(format!(
            "the pass over stars found the chain of corner {k} of triangle {t} once, not twice"
        ))
    };
    names.sorted_all(&mut sorter, &mut |batch| {
        for &now in batch {
            match before.take() {
                None => before = Some(now),
                Some(first) if first.0[0] == now.0[0] => links.join(first.0[1], now.0[1])?,
                Some(first) => return Err(lonely(first)),
            }
        }
        Ok(())
    })?;
    match before {
        Some(last) => Err(lonely(last)),
        None => links.finish(),
    }
}
