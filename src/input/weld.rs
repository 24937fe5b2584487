//! Not built yet.
use super::{Mesh, Request};
use crate::disk::Workspace;
use crate::error::{Error, Result};

/// Not built yet.
pub fn weld(_: &Workspace, _: Mesh, _: &Request) -> Result<Mesh> {
    Err(Error::Usage("not built yet".into()))
}
