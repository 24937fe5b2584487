//! What the passes hand on, written down and read back.
//!
//! Memory: what each had leased. I/O: with each.

use super::arrays::OutArray;
use super::components::{Chosen, Measured};
use super::cuts::Cuts;
use super::graph::bits::Bits;
use super::pipeline::Built;
use super::stars::Valences;
use super::stars::shared::Meetings;
use super::tail::Rows;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::folder::{Counts, Measures};
use serde::{Serialize, de::DeserializeOwned};

/// A list of another length than its kind has.
fn odd(what: &str) -> Error {
    Error::Internal(format!("a journal with other numbers of {what}"))
}

/// What was counted, as the manifest has it.
fn keep_counted<T: Serialize>(to: &mut Pen, counted: &T) -> Result<()> {
    let text = serde_json::to_string(counted);
    to.text(&text.map_err(|e| Error::Internal(format!("counts that are no JSON: {e}")))?)
}

fn restore_counted<T: DeserializeOwned>(from: &mut Reader) -> Result<T> {
    serde_json::from_str(&from.text()?)
        .map_err(|e| Error::Internal(format!("counts that are no JSON: {e}")))
}

impl Keep for Counts {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        keep_counted(to, self)
    }

    fn restore(from: &mut Reader) -> Result<Counts> {
        restore_counted(from)
    }
}

impl Keep for Measures {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        keep_counted(to, self)
    }

    fn restore(from: &mut Reader) -> Result<Measures> {
        restore_counted(from)
    }
}

impl Keep for Chosen {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.flip.keep(to)?;
        self.table.keep(to)?;
        self.cuts.keep(to)?;
        self.stars.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Chosen> {
        Ok(Chosen {
            flip: Bits::restore(from)?,
            table: OutArray::restore(from)?,
            cuts: Cuts::restore(from)?,
            stars: Option::restore(from)?,
        })
    }
}

impl Keep for Measured {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.measures.keep(to)?;
        self.meetings.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Measured> {
        Ok(Measured {
            measures: Measures::restore(from)?,
            meetings: Meetings::restore(from)?,
        })
    }
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
        self.counts.keep(to)?;
        self.measures.keep(to)?;
        to.number(self.seam_corners)?;
        to.number(self.local_components)
    }

    fn restore(from: &mut Reader) -> Result<Built> {
        let files = (0..from.number()?)
            .map(|_| OutArray::restore(from))
            .collect::<Result<_>>()?;
        Ok(Built {
            files,
            counts: Counts::restore(from)?,
            measures: Option::restore(from)?,
            seam_corners: from.number()?,
            local_components: from.number()?,
        })
    }
}
