//! Numbers in text, with correct rounding.
//!
//! A word gives the nearest value of the type asked for, from the digits as they stand (an f4
//! is never rounded by way of f8). `nan` and `inf` are values, with a sign and in any letter
//! case; a finite number beyond the type is an error, and so is anything else, such as the
//! `1.#IND` that a C library of the past printed for a NaN.
//!
//! Memory and I/O: none.

/// Why a word is no number of the type asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadNumber {
    /// It does not read as a number.
    Garbage,
    /// It is finite, but its nearest value is not.
    Large,
}

macro_rules! parse_float {
    ($name:ident, $t:ty) => {
        /// The nearest value to the decimal number in `word`.
        ///
        /// # Errors
        /// [`BadNumber`].
        #[inline]
        pub fn $name(word: &[u8]) -> Result<$t, BadNumber> {
            let text = std::str::from_utf8(word).map_err(|_| BadNumber::Garbage)?;
            match text.parse::<$t>() {
                Ok(value) if value.is_infinite() && !says_infinity(text) => Err(BadNumber::Large),
                Ok(value) => Ok(value),
                Err(_) => Err(BadNumber::Garbage),
            }
        }
    };
}
parse_float!(parse_f4, f32);
parse_float!(parse_f8, f64);

fn says_infinity(text: &str) -> bool {
    let text = text.trim_start_matches(['+', '-']);
    text.starts_with(['i', 'I'])
}

/// The integer in `word`; `None` when it is none, or needs more than 8 bytes.
#[inline]
pub fn parse_integer(word: &[u8]) -> Option<i64> {
    if (1..=18).contains(&word.len()) && word.iter().all(u8::is_ascii_digit) {
        let digits = word.iter().map(|b| i64::from(b - b'0'));
        return Some(digits.fold(0, |n, d| n * 10 + d));
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_are_rounded_once() {
        // Half an f4 step above 1, and a little: by way of f8 it would become the tie, and 1.
        let word = b"1.00000005960464477540";
        assert_eq!(parse_f4(word), Ok(1.0f32.next_up()));
        assert_eq!(parse_f8(word).map(|v| v as f32), Ok(1.0));
        assert_eq!(parse_f4(b"-0").map(f32::to_bits), Ok(0x8000_0000));
        for word in ["1e5", ".5", "5.", "+1", "-Inf", "infinity", "1E-5", "007"] {
            assert_eq!(parse_f8(word.as_bytes()), Ok(word.parse().unwrap()));
        }
        assert_eq!(parse_f4(b"1e39"), Err(BadNumber::Large));
        assert_eq!(parse_f8(b"-1e309"), Err(BadNumber::Large));
        for word in [
            "", "-", ".", "1.#IND", "nan(ind)", "1,5", "0x1", "1e", "nan(", "\u{1}",
        ] {
            assert_eq!(parse_f4(word.as_bytes()), Err(BadNumber::Garbage), "{word}");
        }
        assert!(parse_f4(b"-NaN").is_ok_and(|v| v.is_nan() && v.is_sign_negative()));
        assert_eq!(parse_f8(b"\xff"), Err(BadNumber::Garbage));
    }

    #[test]
    fn integers_of_any_length() {
        assert_eq!(parse_integer(b"000000000000000000000007"), Some(7));
        assert_eq!(parse_integer(b"+7"), Some(7));
        assert_eq!(parse_integer(b"-7"), Some(-7));
        assert_eq!(
            parse_integer(b"999999999999999999"),
            Some(999_999_999_999_999_999)
        );
        assert_eq!(parse_integer(b"9223372036854775807"), Some(i64::MAX));
        for word in [
            &b""[..],
            b"9223372036854775808",
            b"1.0",
            b"1 ",
            b"-",
            b"x",
            b"\xff",
        ] {
            assert_eq!(parse_integer(word), None);
        }
    }
}
