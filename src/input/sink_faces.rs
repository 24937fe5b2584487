//! Faces of any number of corners, cut into fans while they stream past.
//!
//! Why three ids are enough: the fan of corners v0 v1 v2 ... is v0 v1 v2, v0 v2 v3 and so on,
//! so each corner from the third on makes a triangle of the first, the one before, and itself.
//!
//! Memory: those ids. I/O: that of the sink.

use super::MeshSink;
use crate::error::{Error, Result};

/// The face that is being streamed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fan {
    first: u64,
    last: u64,
    corners: u64,
}

impl MeshSink {
    /// Begins a face of any number of corners, to be given one by one.
    #[inline]
    pub fn begin_face(&mut self) {
        self.fan = Fan::default();
    }

    /// The next corner of the face that was begun; from the third on each makes a triangle.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::DiskLimit`].
    #[inline]
    pub fn corner(&mut self, v: u64) -> Result<()> {
        let Fan {
            first,
            last,
            corners,
        } = self.fan;
        self.fan = Fan {
            first: if corners == 0 { v } else { first },
            last: v,
            corners: corners + 1,
        };
        if corners >= 2 {
            self.triangle([first, last, v])?;
        }
        Ok(())
    }

    /// Ends the face and returns its number of corners.
    ///
    /// # Errors
    /// [`Error::Input`] for fewer than three; `at` says where the face is.
    #[inline]
    pub fn end_face(&mut self, at: impl FnOnce() -> String) -> Result<u64> {
        let corners = self.fan.corners;
        if corners < 3 {
            return Err(Error::input(
                &self.path,
                at(),
                "a face of at least 3 corners",
                match corners {
                    1 => "1 corner".into(),
                    n => format!("{n} corners"),
                },
                "remove the face; Cornermill drops none on its own",
            ));
        }
        self.polygons_fanned += u64::from(corners > 3);
        Ok(corners)
    }
}
