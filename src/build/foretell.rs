//! What a build would take, told before it begins; and what is certain not to fit, refused.
//!
//! Why only what is certain: a refusal of what would fit is worse than a late one.
//!
//! Memory: that of a look at some triangles. I/O: the beginning of the input, and that look.

use super::builder::{Builder, Index};
use super::pipeline::check_width;
use super::plan::Strategy;
use super::predict::{Prediction, Sizes};
use super::room::{Place, check_before, note_tight, room_for};
use super::sample::Nature;
use crate::disk::{Workspace, parent};
use crate::error::Result;
use crate::input;
use std::path::Path;

impl Builder {
    /// Predicts what [`build`](Builder::build) would take for `output`, from the beginning of
    /// the input. Nothing is made, written or kept; `output` may exist.
    ///
    /// A budget that is too small is no error here: [`Prediction::check`] tells.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for contradictory options, standard input and pipes; [`crate::Error::Input`]
    /// for what the first look shows to be no mesh; [`crate::Error::Io`].
    pub fn predict(&self, output: &Path) -> Result<Prediction> {
        self.looked(self.counted(output)?)
    }

    /// Refuses what is certain not to fit where [`build`](Builder::build) would write: the folder
    /// `output` and its scratch files, as far as the counts of the input are certain.
    ///
    /// # Errors
    /// [`crate::Error::Io`] naming the folder that is too full and what is wanted more;
    /// [`crate::Error::DiskLimit`].
    pub fn check_room(&self, told: &Prediction, output: &Path) -> Result<()> {
        let beside = [parent(output).to_owned()];
        let place = Place {
            dirs: if self.tmp.is_empty() {
                &beside
            } else {
                &self.tmp
            },
            used: 0,
            limit: self.max_disk,
        };
        check_before(told, place, parent(output))
    }

    /// What the counts tell.
    fn counted(&self, output: &Path) -> Result<Prediction> {
        let mut request = self.request.clone();
        request.wide = self.index == Index::U8;
        let survey = input::survey(&request)?;
        let [triangles, vertices] = survey.least;
        check_width(self.index == Index::U4, triangles, vertices)?;
        let sizes = Sizes {
            measures: self.measures,
            memory: self.memory,
            threads: self.threads.max(1),
            wide: request.wide,
            chunk: self.chunk,
            buckets: self.buckets,
        };
        Prediction::new(survey, &sizes, output.symlink_metadata().is_ok())
    }

    /// With what some triangles tell, where they are found.
    fn looked(&self, mut told: Prediction) -> Result<Prediction> {
        if let Some(mut look) = input::Look::at(&self.request)? {
            let (vertices, chunk) = (told.shape.vertices, told.plan.chunk);
            let nature = Nature::of(&mut look, vertices, chunk)?;
            if nature.looked > 0 {
                told.expect(nature);
            }
        }
        Ok(told)
    }

    /// Refuses what is certain not to fit in the folder `dir` under construction and in scratch, and
    /// says so when room is tight. What is wrong with the input is told by the build itself.
    pub(super) fn refuse_early(&self, ws: &Workspace, dir: &Path) -> Result<()> {
        let Ok(told) = self.counted(dir) else {
            return Ok(());
        };
        if self.strategy == Strategy::Auto {
            told.check_certain()?;
        }
        check_before(&told, Place::from(&ws.scratch), dir)?;
        // A look is worth its time only where it can tell something.
        let tight = told.most_scratch > room_for(&ws.scratch);
        if tight && let Ok(told) = self.looked(told) {
            note_tight(&told, ws);
        }
        Ok(())
    }
}
