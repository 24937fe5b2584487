//! The public read view: the operators of the corner table over a mesh folder.
//!
//! V, O, the component labels and G are mapped read-only, whole, and never copied, so a table
//! is open at once and the system keeps the pages that are in use. Contents are trusted as
//! they are: opening reads headers only, [`CornerTable::check_bounds`] or `cornermill verify`
//! read everything.
//!
//! Memory: O(1) of its own. The mapped pages that the operators touch are resident while the
//! system has room for them and are the system's to drop; they draw on no [`Budget`].
//! [`Swirl`] says what a walk over a component takes. I/O: pages, as they are touched; the
//! counters take a mapped array as read once.
//!
//! Source: J. Rossignac, A. Safonova, A. Szymczak, "3D compression made simple: Edgebreaker
//! with ZipAndWrap on a corner table", Shape Modeling International 2001.
//!
//! [`Budget`]: crate::disk::Budget

pub(crate) mod array;
mod fan;
mod swirl;

pub use fan::Fan;
pub use swirl::Swirl;

use crate::corner::{Corner, Triangle, Vertex};
use crate::disk::{Counters, Window};
use crate::error::{Error, Result};
use crate::folder::{self, Folder, npy};
use array::{Coords, Width};
use std::path::Path;
use std::sync::Arc;

/// A mesh folder, opened for reading: the operators of the corner table.
///
/// ```text
///             c.v
///             /\                 c.n, c.p   next and previous corner of the triangle
///            /c \                c.o        opposite: faces the same edge from the other side
///    c.l    /    \    c.r        c.l, c.r   left and right neighbour: c.p.o and c.n.o;
///          /      \                         each faces an edge at c.v
///    c.n  /________\  c.p        c.s        swing: next corner around c.v: c.n.o.n
///         \        /
///          \ c.o  /              Seen from outside; n goes round counterclockwise.
/// ```
///
/// Where no opposite is (a border, a non-manifold edge where the surface is cut, a degenerate
/// triangle) `o`, `l`, `r` and `s` give `None`.
///
/// # Ids
/// [`corner`](CornerTable::corner), [`vertex`](CornerTable::vertex) and
/// [`triangle`](CornerTable::triangle) turn numbers from outside into ids, checked. The
/// operators take ids of this table at the price of one comparison.
///
/// # Panics
/// Every operator panics, as a slice does, on an id beyond the table. The operators of a
/// healthy folder never give such an id; a damaged one may, and
/// [`check_bounds`](CornerTable::check_bounds) tells without panic.
///
/// # Example
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # by_hand::tetrahedron().write(&folder);
/// use cornermill::CornerTable;
///
/// let table = CornerTable::open(&folder)?; // a tetrahedron
/// let c = table.corner(0).expect("the table has a corner");
/// let o = table.o(c).expect("a tetrahedron has no border");
/// assert_eq!(table.o(o), Some(c));
/// assert_eq!(table.v(table.n(c)), table.v(table.p(o)));
/// assert_eq!(table.s(c), Some(table.n(table.r(c).unwrap())));
/// assert_eq!(table.fan(c).count(), 3);
/// assert_eq!(table.swirl(c).count(), 4);
/// # Ok::<(), cornermill::Error>(())
/// ```
#[derive(Debug)]
pub struct CornerTable {
    width: Width,
    v: Window,
    o: Window,
    component: Window,
    g: Option<(Coords, Window)>,
    triangles: u64,
    vertices: u64,
    components: u64,
}

impl CornerTable {
    /// Opens a finished mesh folder in O(1): manifest and headers are read, arrays mapped.
    ///
    /// The files must not be changed or shortened while the table lives.
    ///
    /// # Errors
    /// [`Error::Input`] when the folder is unfinished, damaged or of another version;
    /// [`Error::Io`] when it cannot be read or mapped.
    pub fn open(folder: impl AsRef<Path>) -> Result<CornerTable> {
        let io = Arc::new(Counters::default());
        CornerTable::from_folder(&Folder::open(folder.as_ref(), &io)?)
    }

    /// As [`open`](CornerTable::open), for a folder that is open already.
    ///
    /// # Errors
    /// As [`open`](CornerTable::open).
    pub fn from_folder(folder: &Folder) -> Result<CornerTable> {
        let width = Width::of(folder)?;
        let counts = &folder.manifest().counts;
        let (t, n) = (counts.triangles, counts.vertices);
        let id = width.descr();
        let g = match Coords::of(folder)? {
            Some(kind) => Some((kind, map(folder, folder::G, kind.descr(), &[n, 3])?)),
            None => None,
        };
        Ok(CornerTable {
            width,
            v: map(folder, folder::V, id, &[t, 3])?,
            o: map(folder, folder::O, id, &[t, 3])?,
            component: map(folder, folder::COMPONENT, id, &[t])?,
            g,
            triangles: t,
            vertices: n,
            components: counts.components,
        })
    }

    /// Reads V, O and the labels once, and holds every id to its bounds. After it no operator
    /// on an id of this table panics. Relations between ids are what `verify` is for.
    ///
    /// # Errors
    /// [`Error::Input`] naming the array and the first entry beyond its bounds.
    pub fn check_bounds(&self, folder: &Path) -> Result<()> {
        let corners = 3 * self.triangles;
        let arrays = [
            (folder::V, &self.v, corners, self.vertices, "vertex"),
            (folder::O, &self.o, corners, corners, "corner"),
            (
                folder::COMPONENT,
                &self.component,
                self.triangles,
                self.components,
                "component",
            ),
        ];
        for (name, window, items, limit, what) in arrays {
            let none_allowed = name != folder::V;
            for i in 0..items {
                let id = self.width.get(window.bytes(), i as usize);
                if id >= limit && !(none_allowed && id == u64::MAX) {
                    let at = format!("entry {i} (triangle {})", i / (items / self.triangles));
                    return Err(Error::input(
                        &folder.join(name),
                        at,
                        format!("a {what} below {limit}"),
                        id.to_string(),
                        "the folder is damaged; build it again",
                    ));
                }
            }
        }
        Ok(())
    }

    /// Number of triangles, T.
    pub fn triangle_count(&self) -> u64 {
        self.triangles
    }

    /// Number of vertices, N, those that no triangle names included.
    pub fn vertex_count(&self) -> u64 {
        self.vertices
    }

    /// Number of components.
    pub fn component_count(&self) -> u64 {
        self.components
    }

    /// True when the folder has coordinates.
    pub fn has_positions(&self) -> bool {
        self.g.is_some()
    }

    /// The corner with this number, if the table has it.
    pub fn corner(&self, id: u64) -> Option<Corner> {
        (id < 3 * self.triangles).then_some(Corner::new(id))
    }

    /// The vertex with this number, if the table has it.
    pub fn vertex(&self, id: u64) -> Option<Vertex> {
        (id < self.vertices).then_some(Vertex::new(id))
    }

    /// The triangle with this number, if the table has it.
    pub fn triangle(&self, id: u64) -> Option<Triangle> {
        (id < self.triangles).then_some(Triangle::new(id))
    }

    /// All triangles, ascending.
    pub fn triangles(&self) -> impl DoubleEndedIterator<Item = Triangle> + use<> {
        (0..self.triangles).map(Triangle::new)
    }

    /// All vertices, ascending, those that no triangle names included.
    pub fn vertices(&self) -> impl DoubleEndedIterator<Item = Vertex> + use<> {
        (0..self.vertices).map(Vertex::new)
    }

    /// The corner k (0, 1 or 2) of triangle t: `3t + k`.
    ///
    /// # Panics
    /// When k is beyond 2.
    #[inline]
    pub fn corner_of(&self, t: Triangle, k: usize) -> Corner {
        t.corners()[k]
    }

    /// Triangle of c: `c / 3`.
    #[inline]
    pub fn t(&self, c: Corner) -> Triangle {
        c.t()
    }

    /// Next corner of the same triangle: `3t + (c + 1) % 3`.
    #[inline]
    pub fn n(&self, c: Corner) -> Corner {
        c.n()
    }

    /// Previous corner of the same triangle: `3t + (c + 2) % 3`.
    #[inline]
    pub fn p(&self, c: Corner) -> Corner {
        c.p()
    }

    /// Vertex of c: `V[c]`.
    #[inline]
    pub fn v(&self, c: Corner) -> Vertex {
        Vertex::new(self.width.get(self.v.bytes(), self.row(c)))
    }

    /// Opposite of c, the corner that faces the edge `{c.n.v, c.p.v}` from the other side:
    /// `O[c]`; `None` where it is NONE.
    #[inline]
    pub fn o(&self, c: Corner) -> Option<Corner> {
        let o = self.width.get(self.o.bytes(), self.row(c));
        (o != u64::MAX).then_some(Corner::new(o))
    }

    /// Left neighbour: `c.p.o`.
    #[inline]
    pub fn l(&self, c: Corner) -> Option<Corner> {
        self.o(c.p())
    }

    /// Right neighbour: `c.n.o`.
    #[inline]
    pub fn r(&self, c: Corner) -> Option<Corner> {
        self.o(c.n())
    }

    /// Swing: `c.n.o.n`, the next corner around `c.v`; `None` at a border.
    ///
    /// That it is a corner of `c.v` again needs the two triangles to agree in orientation,
    /// which the folder grants in every orientable component unless it was built with
    /// `--orient keep`. [`fan`](CornerTable::fan) stays at the vertex in all cases.
    #[inline]
    pub fn s(&self, c: Corner) -> Option<Corner> {
        self.o(c.n()).map(Corner::n)
    }

    /// Component of t; `None` for a degenerate triangle.
    ///
    /// # Panics
    /// When t is beyond the table.
    #[inline]
    pub fn component(&self, t: Triangle) -> Option<u64> {
        assert!(
            t.id() < self.triangles,
            "triangle {t} of a table with {} triangles",
            self.triangles
        );
        let label = self.width.get(self.component.bytes(), t.id() as usize);
        (label != u64::MAX).then_some(label)
    }

    /// Coordinates of v in input units, f4 widened exactly; `None` for a mesh without G.
    ///
    /// # Panics
    /// When v is beyond the table, and the mesh has G.
    #[inline]
    pub fn position(&self, v: Vertex) -> Option<[f64; 3]> {
        let (kind, window) = self.g.as_ref()?;
        assert!(
            v.id() < self.vertices,
            "vertex {v} of a table with {} vertices",
            self.vertices
        );
        Some(kind.row(window.bytes(), v.id() as usize))
    }

    /// Whether all that was read so far was in the files. A file that another process cuts short
    /// while the table maps it reads as zeros behind its new end: ask before you believe what you
    /// found.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a file that was cut short, [`crate::Error::Io`] for one that could not be read.
    pub fn intact(&self) -> Result<()> {
        let g = self.g.as_ref().map(|(_, window)| window);
        let windows = [&self.v, &self.o, &self.component].into_iter().chain(g);
        windows.into_iter().try_for_each(Window::check)
    }

    /// The corners around `c.v` that edges join to c, each once; see [`Fan`].
    pub fn fan(&self, c: Corner) -> Fan<'_> {
        Fan::new(self, c)
    }

    /// The triangles of the component of `c.t`, in swirl order from c; see [`Swirl`].
    pub fn swirl(&self, c: Corner) -> Swirl<'_> {
        Swirl::new(self, c)
    }

    #[inline]
    fn row(&self, c: Corner) -> usize {
        assert!(
            c.id() < 3 * self.triangles,
            "corner {c} of a table with {} triangles",
            self.triangles
        );
        c.id() as usize
    }
}

/// Maps the whole data of an array.
fn map(folder: &Folder, name: &str, descr: &str, shape: &[u64]) -> Result<Window> {
    let file = array::open(folder, name, descr, shape)?;
    let bytes = file.len()?.saturating_sub(npy::DATA_START);
    let len = usize::try_from(bytes).map_err(|_| {
        Error::input(
            file.path(),
            "",
            "an array that this machine can map",
            format!("{bytes} bytes"),
            "use a 64-bit machine",
        )
    })?;
    Window::new(&file, npy::DATA_START, len)
}
