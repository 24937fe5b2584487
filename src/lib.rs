//! Cornermill.
