//! The kinds of mesh by name, and their sizes.

use clap::ValueEnum;

use crate::Error;
use crate::blobs::Blobs;
use crate::grid::{Grid, Shape};
use crate::loose::{Form, Loose};
use crate::mesh::Mesh;
use crate::sphere::Sphere;
use crate::turned::Turned;

/// The kinds of mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A displaced sphere of 8 n^2 triangles (--size N).
    Sphere,
    /// A displaced torus (--size AxB: around the tube x around the ring).
    Torus,
    /// Heights over a grid, with a border (--size AxB).
    Terrain,
    /// Disjoint displaced spheres of power-law sizes (--blobs).
    Blobs,
    /// A Moebius strip (--size AxB: across x around).
    Moebius,
    /// A Klein bottle, which meets itself in space (--size AxB).
    Klein,
    /// Triangles that do not touch.
    Soup,
    /// All triangles around vertex 0, an open cone.
    Fan,
    /// Around vertex 0 and, for the base, vertex 1: closed.
    Cone,
    /// All triangles on one edge.
    Book,
    /// The same triangle again and again.
    Stack,
}

/// A size in a kind's own terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// The first number.
    pub a: u64,
    /// The second number, if one was given.
    pub b: Option<u64>,
}

impl Size {
    /// Reads `N` or `AxB`.
    pub fn parse(text: &str) -> Result<Size, String> {
        // Beyond this, numbers of corners and bytes would leave 64 bits.
        const MOST: u64 = 1 << 50;
        let part = |s: &str| {
            let number = s.parse().ok().filter(|n| (1..=MOST).contains(n));
            number.ok_or("expected N or AxB, such as 100 or 200x50")
        };
        let Some((a, b)) = text.split_once('x') else {
            return Ok(Size {
                a: part(text)?,
                b: None,
            });
        };
        let (a, b) = (part(a)?, part(b)?);
        if a.checked_mul(b).is_none_or(|quads| quads > MOST) {
            return Err(format!("{a} x {b} is more than this program can count"));
        }
        Ok(Size { a, b: Some(b) })
    }
}

impl Kind {
    /// Makes the mesh: of this size, or else of about so many triangles. Of a sphere this share of
    /// the diagonals is turned.
    pub fn mesh(
        self,
        size: Option<Size>,
        triangles: u64,
        blobs: Option<u64>,
        diagonals: f64,
        seed: u64,
    ) -> Result<Box<dyn Mesh>, Error> {
        if blobs.is_some() && self != Kind::Blobs {
            return Err(Error::Usage("--blobs goes with the kind blobs only".into()));
        }
        if diagonals != 0.0 && self != Kind::Sphere {
            return Err(Error::Usage(
                "--diagonals goes with the kind sphere only".into(),
            ));
        }
        let grid = |shape| self.grid(shape, size, triangles, seed);
        let loose = |form| -> Result<Box<dyn Mesh>, Error> {
            let count = self.one(size)?.unwrap_or(triangles);
            Ok(Box::new(Loose::new(form, count, seed)))
        };
        match self {
            Kind::Sphere => {
                let nearest = (triangles as f64 / 8.0).sqrt().round() as u64;
                let n = self.one(size)?.unwrap_or(nearest).max(1);
                if n > 1 << 25 {
                    return Err(Error::Usage(format!(
                        "--size {n}: at most {} here",
                        1 << 25
                    )));
                }
                if diagonals != 0.0 {
                    return Ok(Box::new(Turned::new(n, diagonals, seed)?));
                }
                Ok(Box::new(Sphere::new(n, seed)))
            }
            Kind::Blobs if size.is_some() => Err(Error::Usage(
                "blobs have no --size: use --triangles and --blobs".into(),
            )),
            Kind::Blobs => {
                let blobs = blobs.unwrap_or(triangles.div_ceil(1000));
                Ok(Box::new(Blobs::new(blobs, triangles, seed)?))
            }
            Kind::Torus => grid(Shape::Torus),
            Kind::Terrain => grid(Shape::Terrain),
            Kind::Moebius => grid(Shape::Moebius),
            Kind::Klein => grid(Shape::Klein),
            Kind::Soup => loose(Form::Soup),
            Kind::Fan => loose(Form::Fan),
            Kind::Cone => loose(Form::Cone),
            Kind::Book => loose(Form::Book),
            Kind::Stack => loose(Form::Stack),
        }
    }

    fn grid(
        self,
        shape: Shape,
        size: Option<Size>,
        triangles: u64,
        seed: u64,
    ) -> Result<Box<dyn Mesh>, Error> {
        let (columns, rows) = match size {
            Some(Size { a, b: Some(b) }) => (a, b),
            Some(_) => return Err(Error::Usage("this kind's --size is AxB".into())),
            None => Grid::fit(shape, triangles),
        };
        let least = Grid::least(shape);
        if columns < least.0 || rows < least.1 {
            let text = format!(
                "--size {columns}x{rows}: at least {}x{} is needed, or edges would coincide",
                least.0, least.1
            );
            return Err(Error::Usage(text));
        }
        Ok(Box::new(Grid::new(shape, columns, rows, seed)))
    }

    fn one(self, size: Option<Size>) -> Result<Option<u64>, Error> {
        match size {
            Some(Size { b: Some(_), .. }) => {
                Err(Error::Usage("this kind's --size is one number".into()))
            }
            size => Ok(size.map(|s| s.a)),
        }
    }
}
