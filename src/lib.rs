//! Cornermill turns a triangle mesh that is larger than memory into a verified *corner
//! table* on disk: for every corner its vertex (V) and its opposite corner (O), every
//! triangle consistently oriented and labelled with its component.
//!
//! # The model
//! ```text
//!            c.v                   corner c = 3t + k is corner k of triangle t
//!            /\
//!           /c \                   c.n, c.p   next and previous corner of the triangle
//!    c.l   /    \   c.r            c.o        opposite: faces the edge {c.n.v, c.p.v}
//!         / t    \                            from the other side
//!   c.n  /________\  c.p           c.l, c.r   left and right neighbour: c.p.o, c.n.o
//!        \        /                c.s        swing: next corner around c.v: c.n.o.n
//!         \ c.o  /
//!          \    /                 Seen from outside; n goes round counterclockwise.
//! ```
//!
//! An edge with two incident corners in the whole mesh is *regular*: they are opposite. With one
//! it is a *border*; with three or more *non-manifold*: the surface is cut there, its corners
//! have no opposite, and it is listed. Triangles that hang together over regular edges are one
//! *component*. Nothing is repaired: what is wrong with a mesh is counted, and named by id.
//!
//! # Conventions
//! | what | convention |
//! |---|---|
//! | ids | from 0, in the order of the input; components by their first triangle |
//! | NONE | the all-ones value of the id's type |
//! | agreement | two triangles agree across an edge when `c.n.v == c.o.p.v` |
//! | flip | exchanges corners 3t + 1 and 3t + 2: V, O and all references to them |
//! | outward | counterclockwise seen from outside: the sum of (PA x PB).PC is positive |
//! | degenerate | a triangle with a repeated vertex: in V, without opposites, without component |
//!
//! # The folder
//! Little-endian `.npy` files, data from byte 4096; T triangles, N vertices ([`folder`]).
//!
//! | file | shape | what |
//! |---|---|---|
//! | `V.npy`, `O.npy` | (T,3) | vertex and opposite of each corner |
//! | `G.npy` | (N,3) | coordinates |
//! | `component.npy` | (T,) | component of each triangle |
//! | `flipped.npy` | bits | triangles whose orientation differs from the input |
//! | `components.npy` | table | counts, verdicts, volume, area, box, loops and genus of each component |
//! | `nonmanifold_edges.npy`, `nonmanifold_corners.npy`, `nonmanifold_vertices.npy`, `degenerate.npy`, `duplicate.npy` | lists | the culprits |
//! | `manifest.json` | | counts, types, options, digest, checksums; written last |
//!
//! The bytes depend on the input and on the options that shape the output, and on nothing else:
//! not on memory, threads or scratch folders.
//!
//! # Memory
//! Whatever grows with the mesh is drawn from a [`disk::Budget`] before it is allocated, mapped
//! windows included; what does not fit is refused with the least that would do. Peak resident
//! memory stays below the budget and 64 MiB. Only a [`CornerTable`] maps whole arrays, whose
//! pages are the system's to keep or drop.
//!
//! # Example
//! ```
//! use cornermill::{CornerTable, build::Builder};
//!
//! let dir = tempfile::tempdir()?;
//! let (mesh, folder) = (dir.path().join("square.obj"), dir.path().join("square.ct"));
//! // Two triangles, of which the second is turned over.
//! std::fs::write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n")?;
//!
//! let report = Builder::new(&mesh).memory(64 << 20).build(&folder)?;
//! let counts = &report.manifest.counts;
//! assert_eq!((counts.components, counts.border_edges), (1, 4));
//! assert_eq!((counts.inconsistent_edges, counts.flipped_triangles), (1, 1));
//!
//! let table = CornerTable::open(&folder)?;
//! let c = table.corner(0).expect("the table has a corner");
//! let o = table.o(c).expect("it faces the edge in the middle");
//! assert_eq!((table.v(c).id(), table.v(o).id()), (0, 3));
//! assert_eq!(table.v(table.n(c)), table.v(table.p(o))); // they agree now
//! assert_eq!(table.l(c), None); // a border
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Where to begin: [`build::Builder`], [`CornerTable`], [`verify`](mod@verify) and
//! [`export`](mod@export). The modules and their order are in ARCHITECTURE.md.

pub mod build;
pub mod chunk;
pub mod cli;
pub mod codec;
pub mod corner;
pub mod disk;
mod error;
pub mod export;
pub mod folder;
pub mod input;
pub mod measure;
pub mod report;
pub mod shuffle;
pub mod table;
pub mod verify;
pub mod walk;

pub use error::{BadInput, Error, Result};
pub use table::CornerTable;
