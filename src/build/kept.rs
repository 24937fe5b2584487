//! What the passes hand on, written down and read back.
//!
//! Memory: what each had leased. I/O: with each.

use super::arrays::OutArray;
use super::pipeline::Built;
use super::stars::Valences;
use super::tail::Rows;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};

/// A list of another length than its kind has.
fn odd(what: &str) -> Error {
    Error::Internal(format!("a journal with other numbers of {what}"))
}

impl Keep for Valences {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.list(&self.counted())?;
        to.number(self.largest)?;
        to.number(self.corners)
    }

    fn restore(from: &mut Reader) -> Result<Valences> {
        let classes = from.list::<u64>()?;
        let (largest, corners) = (from.number()?, from.number()?);
        Valences::of(&classes, largest, corners).ok_or_else(|| odd("valences"))
    }
}

impl Keep for Rows {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        [&self.v, &self.o, &self.component]
            .into_iter()
            .try_for_each(|array| array.keep(to))
    }

    fn restore(from: &mut Reader) -> Result<Rows> {
        Ok(Rows {
            v: OutArray::restore(from)?,
            o: OutArray::restore(from)?,
            component: OutArray::restore(from)?,
        })
    }
}

impl Keep for Built {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(self.files.len() as u64)?;
        self.files.iter().try_for_each(|file| file.keep(to))?;
        let text = serde_json::to_string(&(&self.counts, &self.measures));
        to.text(&text.map_err(|e| Error::Internal(format!("counts that are no JSON: {e}")))?)?;
        to.number(self.seam_corners)?;
        to.number(self.local_components)
    }

    fn restore(from: &mut Reader) -> Result<Built> {
        let files = (0..from.number()?)
            .map(|_| OutArray::restore(from))
            .collect::<Result<_>>()?;
        let (counts, measures) = serde_json::from_str(&from.text()?)
            .map_err(|e| Error::Internal(format!("counts that are no JSON: {e}")))?;
        Ok(Built {
            files,
            counts,
            measures,
            seam_corners: from.number()?,
            local_components: from.number()?,
        })
    }
}
