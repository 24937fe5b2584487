//! What `data-gen` claims of its meshes, against naive counts.

mod files;
mod kinds;
mod naive;
mod views;
