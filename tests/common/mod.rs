//! What the integration tests share: a way to run the program, a reader of its folder, meshes, and
//! a naive oracle.
//!
//! Nothing here imports the crate. A test that used the program's own reader or its own idea of an
//! edge would agree with its mistakes; these modules know only the conventions that the
//! documentation states.

// Each test binary compiles its own copy of this module and uses a part of it.
#![allow(dead_code)]

pub mod bench;
pub mod compare;
pub mod folder;
pub mod formats;
pub mod mesh;
pub mod naive;
pub mod npy;
pub mod random;
pub mod readers;
pub mod run;
pub mod schema;
pub mod space;
pub mod stars;
pub mod surfaces;
pub mod tables;
pub mod zoo;
