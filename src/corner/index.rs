//! The two widths of an id on disk.

use bytemuck::Pod;

/// An id as a mesh folder stores it: `u32` (4 bytes) or `u64` (8 bytes), little-endian.
///
/// The all-ones value is NONE, so an id must stay below it.
pub trait Index: Pod + Copy + Ord + Eq + Send + Sync + std::fmt::Debug + 'static {
    /// The all-ones value: no opposite, no component.
    const NONE: Self;
    /// Bytes on disk.
    const BYTES: usize;
    /// NumPy's name of the type.
    const DESCR: &'static str;
    /// Widens; NONE becomes `u64::MAX`, whatever the width.
    fn wide(self) -> u64;
    /// Narrows; `u64::MAX` becomes NONE. `None` when the id does not fit below NONE.
    fn narrow(id: u64) -> Option<Self>;
    /// Narrows an id that the caller knows to fit (checked in debug builds).
    fn of(id: u64) -> Self;
}

macro_rules! index {
    ($t:ty, $bytes:expr, $descr:expr) => {
        impl Index for $t {
            const NONE: Self = <$t>::MAX;
            const BYTES: usize = $bytes;
            const DESCR: &'static str = $descr;
            #[inline]
            fn wide(self) -> u64 {
                if self == Self::NONE {
                    u64::MAX
                } else {
                    u64::from(self)
                }
            }
            #[inline]
            fn narrow(id: u64) -> Option<Self> {
                if id == u64::MAX {
                    return Some(Self::NONE);
                }
                <$t>::try_from(id).ok().filter(|&v| v != Self::NONE)
            }
            #[inline]
            fn of(id: u64) -> Self {
                debug_assert!(Self::narrow(id).is_some(), "id {id} does not fit");
                id as $t
            }
        }
    };
}

index!(u32, 4, "<u4");
index!(u64, 8, "<u8");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn none_is_all_ones_at_both_widths() {
        assert_eq!(u32::NONE.wide(), u64::MAX);
        assert_eq!(u32::narrow(u64::MAX), Some(u32::NONE));
        assert_eq!(u32::narrow(u64::from(u32::MAX)), None);
        assert_eq!(u32::narrow(u64::from(u32::MAX) - 1), Some(u32::MAX - 1));
        assert_eq!(u64::narrow(7), Some(7));
        assert_eq!(u32::of(u64::MAX), u32::NONE);
    }
}
