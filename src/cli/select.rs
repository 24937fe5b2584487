//! The options that choose components, for every command that takes some of a folder.

use crate::export::{Bbox, Numbers, Selection};
use clap::Args;

/// Which components; all conditions narrow.
#[derive(Debug, Args)]
#[command(next_help_heading = "Selection of components (all conditions narrow)")]
pub struct SelectArgs {
    /// Only these components: numbers and ranges, such as 0,4,7-9
    #[arg(long, value_name = "LIST")]
    component: Option<Numbers>,
    /// Only the K components with the most triangles, of those that meet all else
    #[arg(long, value_name = "K")]
    largest: Option<u64>,
    /// Only components of at least N triangles
    #[arg(long, value_name = "N")]
    min_triangles: Option<u64>,
    /// Only components of at most N triangles
    #[arg(long, value_name = "N")]
    max_triangles: Option<u64>,
    /// Only components of at least this area
    #[arg(long, value_name = "AREA")]
    min_area: Option<f64>,
    /// Only components of at most this area
    #[arg(long, value_name = "AREA")]
    max_area: Option<f64>,
    /// Only components of at least this volume, whatever its sign
    #[arg(long, value_name = "VOLUME")]
    min_volume: Option<f64>,
    /// Only components of at most this volume, whatever its sign
    #[arg(long, value_name = "VOLUME")]
    max_volume: Option<f64>,
    /// Only components in which every corner has an opposite
    #[arg(long, conflicts_with = "open")]
    closed: bool,
    /// Only the others
    #[arg(long)]
    open: bool,
    /// Only watertight components
    #[arg(long, conflicts_with = "not_watertight")]
    watertight: bool,
    /// Only the others
    #[arg(long)]
    not_watertight: bool,
    /// Only orientable components
    #[arg(long, conflicts_with = "not_orientable")]
    orientable: bool,
    /// Only the others
    #[arg(long)]
    not_orientable: bool,
    /// Only components of such a genus: numbers and ranges (of a measured folder)
    #[arg(long, value_name = "LIST")]
    genus: Option<Numbers>,
    /// Only components whose bounding box lies within this box: its smallest, then its largest
    /// coordinates
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    inside: Option<Bbox>,
    /// Only components whose bounding box has a point in common with this box
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    touching: Option<Bbox>,
    /// Take what would be left out, and leave out what would be taken
    #[arg(long)]
    invert: bool,
}

impl SelectArgs {
    /// What the options mean.
    pub fn selection(&self) -> Selection {
        let either = |yes: bool, no: bool| (yes || no).then_some(yes);
        Selection {
            components: self.component.clone(),
            min_triangles: self.min_triangles,
            max_triangles: self.max_triangles,
            min_area: self.min_area,
            max_area: self.max_area,
            min_volume: self.min_volume,
            max_volume: self.max_volume,
            closed: either(self.closed, self.open),
            watertight: either(self.watertight, self.not_watertight),
            orientable: either(self.orientable, self.not_orientable),
            genus: self.genus.clone(),
            inside: self.inside,
            touching: self.touching,
            largest: self.largest,
            invert: self.invert,
        }
    }
}
