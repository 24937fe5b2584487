//! Changes that are put aside before they are made, so that a build that is killed while it makes
//! them makes them again.
//!
//! Why it works: what is aside depends on nothing that is in place by then, and writing the same
//! bytes to the same place twice is harmless. So once all changes are aside and written down,
//! whatever became of the arrays, they are made right from the beginning.
//!
//! Memory: `BUFFER` and a block of places a thread. I/O: what is changed once to scratch, once from
//! there, and once to its place; 32 bytes for each range.

use super::Job;
use super::arrays::OutArray;
use super::finish::Tables;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{ScratchFile, Workspace};
use crate::error::{Error, Result};
use bytemuck::{Pod, Zeroable};

/// Bytes that are copied at a time.
const BUFFER: usize = 256 << 10;
/// Ranges that a thread takes at a time.
const TAKEN: u64 = 64;

/// An array whose rows change.
#[derive(Clone, Copy, Debug)]
pub enum Array {
    /// V.
    V,
    /// O.
    O,
    /// Component.
    Component,
}

impl Array {
    const ALL: [Array; 3] = [Array::V, Array::O, Array::Component];

    /// The array itself.
    pub fn of<'a>(self, tables: &Tables<'a>) -> &'a OutArray {
        match self {
            Array::V => tables.v,
            Array::O => tables.o,
            Array::Component => tables.component,
        }
    }
}

/// Where some bytes go, and where they lie until then.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Place {
    array: u64,
    to: u64,
    bytes: u64,
    from: u64,
}

/// Changes of arrays that were not made yet.
pub struct Changes {
    rows: ScratchFile,
    places: ScratchFile,
}

impl Changes {
    /// None yet.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(ws: &Workspace) -> Result<Changes> {
        Ok(Changes {
            rows: ws.scratch.file("changed rows")?,
            places: ws.scratch.file("places of changed rows")?,
        })
    }

    /// Puts items aside that an array will have from item `first`. No two may overlap.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn put<I: Index>(&self, array: Array, first: u64, items: &[I]) -> Result<()> {
        let place = Place {
            array: array as u64,
            to: first * I::BYTES as u64,
            bytes: size_of_val(items) as u64,
            from: self.rows.append(bytemuck::cast_slice(items))?,
        };
        self.places.append(bytemuck::bytes_of(&place)).map(|_| ())
    }

    /// Makes them all.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn make(&self, job: &Job, tables: &Tables) -> Result<()> {
        let (ws, size) = (job.ws, size_of::<Place>() as u64);
        let count = self.places.len() / size;
        let each = BUFFER as u64 + TAKEN * size;
        let threads = ws.workers.count() as u64;
        let _lease = ws.budget.lease("rows that change", threads * each)?;
        ws.workers.run(
            count.div_ceil(TAKEN),
            || Ok((vec![Place::zeroed(); TAKEN as usize], vec![0; BUFFER])),
            |(places, buffer), unit| {
                let first = unit * TAKEN;
                let places = &mut places[..TAKEN.min(count - first) as usize];
                let into = bytemuck::cast_slice_mut(places);
                self.places.read_at(into, first * size)?;
                let mut places = places.iter();
                places.try_for_each(|place| self.copy(place, tables, buffer))
            },
            |_| Ok(()),
        )
    }

    fn copy(&self, place: &Place, tables: &Tables, buffer: &mut [u8]) -> Result<()> {
        let Some(array) = Array::ALL.get(place.array as usize) else {
            return Err(Error::Internal("a change of no array".into()));
        };
        let mut done = 0;
        while done < place.bytes {
            let n = (buffer.len() as u64).min(place.bytes - done);
            let part = &mut buffer[..n as usize];
            self.rows.read_at(part, place.from + done)?;
            array.of(tables).write(place.to + done, part)?;
            done += n;
        }
        Ok(())
    }
}

impl Keep for Changes {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.file(&self.rows)?;
        to.file(&self.places)
    }

    fn restore(from: &mut Reader) -> Result<Changes> {
        Ok(Changes {
            rows: from.file()?,
            places: from.file()?,
        })
    }
}
