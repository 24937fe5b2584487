//! Strong ids: a corner, a vertex and a triangle cannot be taken for one another.
//!
//! An id is 8 bytes whatever the width on disk. Making one checks nothing; a table checks it
//! against its own bounds ([`crate::table::CornerTable::corner`] and its sisters).

use super::{next, prev};
use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(u64);

        impl $name {
            /// The id with this number, counted from 0.
            #[inline]
            pub const fn new(id: u64) -> Self {
                Self(id)
            }

            /// The number.
            #[inline]
            pub const fn id(self) -> u64 {
                self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

id! {
    /// A corner: `c = 3t + k` is the corner k of triangle t, and faces the edge opposite to it.
    ///
    /// ```
    /// use cornermill::corner::{Corner, Triangle};
    /// let c = Corner::new(7);
    /// assert_eq!((c.t(), c.k()), (Triangle::new(2), 1));
    /// assert_eq!((c.n().id(), c.p().id()), (8, 6));
    /// ```
    Corner
}

id! {
    /// A vertex: a row of G.
    Vertex
}

id! {
    /// A triangle: a row of V and O, with the corners `3t`, `3t + 1` and `3t + 2`.
    Triangle
}

impl Corner {
    /// Its triangle: `c / 3`.
    #[inline]
    pub const fn t(self) -> Triangle {
        Triangle(self.0 / 3)
    }

    /// Its place in the triangle: `c % 3`.
    #[inline]
    pub const fn k(self) -> usize {
        (self.0 % 3) as usize
    }

    /// Next corner of the same triangle: `3t + (c + 1) % 3`.
    #[inline]
    pub const fn n(self) -> Corner {
        Corner(next(self.0))
    }

    /// Previous corner of the same triangle: `3t + (c + 2) % 3`.
    #[inline]
    pub const fn p(self) -> Corner {
        Corner(prev(self.0))
    }
}

impl Triangle {
    /// Its three corners, in order.
    ///
    /// ```
    /// use cornermill::corner::Triangle;
    /// assert_eq!(Triangle::new(4).corners().map(|c| c.id()), [12, 13, 14]);
    /// ```
    #[inline]
    pub const fn corners(self) -> [Corner; 3] {
        let first = 3 * self.0;
        [Corner(first), Corner(first + 1), Corner(first + 2)]
    }
}
