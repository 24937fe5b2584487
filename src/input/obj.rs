//! Not built yet.
use super::reader::ByteReader;
use super::{Mesh, Request};
use crate::disk::Workspace;
use crate::error::{Error, Result};

/// Not built yet.
pub fn read(_: &Workspace, _: ByteReader, _: &Request) -> Result<Mesh> {
    Err(Error::Usage("not built yet".into()))
}

/// First words of statements.
pub const KEYWORDS: [&[u8]; 1] = [b"v"];
