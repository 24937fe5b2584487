//! Not built yet.
use super::reader::ByteReader;
use super::{Mesh, Request};
use crate::disk::Workspace;
use crate::error::{Error, Result};

/// Not built yet.
pub fn read(_: &Workspace, _: ByteReader, _: &Request) -> Result<Mesh> {
    Err(Error::Usage("not built yet".into()))
}

/// Not built yet.
pub fn keyword(_: &[u8]) -> Option<()> {
    None
}
