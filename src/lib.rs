//! Cornermill turns a triangle mesh that is larger than memory into a verified *corner
//! table* on disk: for every corner its vertex (V) and its opposite corner (O), every
//! triangle consistently oriented and labelled with its component.

pub mod build;
pub mod chunk;
pub mod cli;
pub mod corner;
pub mod disk;
mod error;
pub mod export;
pub mod folder;
pub mod input;
pub mod report;
pub mod shuffle;
pub mod table;
pub mod verify;

pub use error::{BadInput, Error, Result};
pub use table::CornerTable;
