//! What is written in a [journal](super::journal): states, and what they are put together from.
//!
//! Memory: none. I/O: none but what is asked for.

use super::journal::{Pen, Reader};
use crate::error::Result;

/// A state that can be written down and gone on with.
pub trait Keep: Sized {
    /// Writes it down.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    fn keep(&self, to: &mut Pen) -> Result<()>;

    /// Reads it back.
    ///
    /// # Errors
    /// [`crate::Error::Input`] when a file is not as it was, [`crate::Error::Budget`], [`crate::Error::Io`].
    fn restore(from: &mut Reader) -> Result<Self>;
}

/// Nothing.
impl Keep for () {
    fn keep(&self, _: &mut Pen) -> Result<()> {
        Ok(())
    }

    fn restore(_: &mut Reader) -> Result<()> {
        Ok(())
    }
}

impl<T: Keep> Keep for Option<T> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(u64::from(self.is_some()))?;
        self.as_ref().map_or(Ok(()), |some| some.keep(to))
    }

    fn restore(from: &mut Reader) -> Result<Option<T>> {
        match from.number()? {
            0 => Ok(None),
            _ => T::restore(from).map(Some),
        }
    }
}

impl<A: Keep, B: Keep> Keep for (A, B) {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.0.keep(to)?;
        self.1.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<(A, B)> {
        Ok((A::restore(from)?, B::restore(from)?))
    }
}
