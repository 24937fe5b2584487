//! The colours: what a sample keeps of its triangle, and what light that becomes.
//!
//! A sample keeps 32 bits: a *tone* (one of 1024 colours of a palette), the shade, whether the
//! front faces the viewer, and whether it is surface or a mark. Colours are chosen in a space
//! where equal steps look equal (Oklab, by Björn Ottosson), at a lightness that stands out from
//! white and from black alike, and are mixed as linear light.
//!
//! Memory: a palette of 12 KiB. I/O: none.

/// What tells triangles apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorBy {
    /// Each component has a hue of its own; neighbours in number are far apart in hue.
    #[default]
    Component,
    /// Fronts are blue, backs are orange.
    Orientation,
    /// By place in the swirl order of its component, from dark blue over green to yellow.
    Swirl,
    /// One colour for all.
    Plain,
}

/// What lies behind the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// A colour, red, green and blue.
    Color([u8; 3]),
    /// Nothing: the picture is transparent there.
    #[default]
    Transparent,
}

impl std::str::FromStr for Background {
    type Err = crate::error::Error;

    /// `white`, `black`, `transparent`, or `#rrggbb`.
    fn from_str(text: &str) -> Result<Background, Self::Err> {
        let hex = |digits: &str| {
            let plain = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
            let value = u32::from_str_radix(digits, 16).ok().filter(|_| plain)?;
            let [_, r, g, b] = value.to_be_bytes();
            Some(Background::Color([r, g, b]))
        };
        match text {
            "white" => Some(Background::Color([255; 3])),
            "black" => Some(Background::Color([0; 3])),
            "transparent" => Some(Background::Transparent),
            _ => text.strip_prefix('#').and_then(hex),
        }
        .ok_or_else(|| {
            crate::error::Error::Usage(format!(
                "background '{text}': expected white, black, transparent or #rrggbb"
            ))
        })
    }
}

/// Colours of a palette.
pub(super) const TONES: usize = 1024;

/// What an edge is marked as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    None,
    Border,
    NonManifold,
}

impl Mark {
    /// From the two bits that [`Mark::bits`] gave.
    pub(super) fn of(bits: u64) -> Mark {
        match bits & 3 {
            0 => Mark::None,
            1 => Mark::Border,
            _ => Mark::NonManifold,
        }
    }

    pub(super) fn bits(self) -> u64 {
        self as u64
    }
}

/// What a sample keeps: tone in bits 0..10, front in bit 10, mark in bits 11..13, shade in
/// bits 16..24.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Paint(pub(super) u32);

impl Paint {
    pub(super) fn surface(tone: u32, front: bool, shade: u32) -> Paint {
        Paint(tone | u32::from(front) << 10 | shade << 16)
    }

    pub(super) fn mark(mark: Mark) -> Paint {
        Paint((mark.bits() as u32) << 11)
    }
}

/// The tone of a component.
///
/// Multiples of the golden ratio fall far from each other on the circle of hues: 8 bits of
/// that choose the hue. Those that come near again are numbers 8 or 13 apart; one of three
/// lightnesses, by the number modulo 3, tells these apart.
#[inline]
pub(super) fn component_tone(component: u64) -> u32 {
    let hue = component.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56;
    (hue | (component % 3) << 8) as u32
}

/// The tone of place `at` in a swirl over `of` triangles.
pub(super) fn swirl_tone(at: u64, of: u64) -> u16 {
    let tone = u128::from(at) * TONES as u128 / u128::from(of.max(1));
    tone.min(TONES as u128 - 1) as u16
}

/// A colour as linear light.
pub(super) type Light = [f32; 3];

/// From what a sample keeps to light.
pub(super) struct Palette {
    fronts: Vec<Light>,
    backs: Vec<Light>,
    shades: [f32; 256],
    marks: [Light; 3],
}

impl Palette {
    pub(super) const BYTES: u64 = 2 * (TONES * size_of::<Light>()) as u64;

    pub(super) fn new(by: ColorBy) -> Palette {
        let front = |tone: usize| match by {
            ColorBy::Component => {
                let (l, c) = [(0.72, 0.11), (0.81, 0.085), (0.62, 0.12)][(tone >> 8).min(2)];
                oklch(l, c, 252.0 + (tone & 255) as f64 * 360.0 / 256.0)
            }
            ColorBy::Orientation => oklch(0.71, 0.10, 248.0),
            ColorBy::Swirl => {
                let at = tone as f64 / (TONES - 1) as f64;
                let chroma = 0.10 + 0.05 * (at * std::f64::consts::PI).sin();
                oklch(0.46 + 0.44 * at, chroma, 285.0 - 190.0 * at)
            }
            ColorBy::Plain => oklch(0.78, 0.022, 240.0),
        };
        // Backs keep their hue, deeper: an open surface shows which side is which.
        let back = |tone: usize| match by {
            ColorBy::Orientation => oklch(0.74, 0.135, 62.0),
            _ => front(tone).map(|x| 0.55 * x),
        };
        let shade = |i: usize| {
            let facing = i as f64 / 255.0;
            (0.12 + 0.88 * facing.powf(1.3)) as f32
        };
        Palette {
            fronts: (0..TONES).map(front).collect(),
            backs: (0..TONES).map(back).collect(),
            shades: std::array::from_fn(shade),
            marks: [[0.0; 3], oklch(0.27, 0.03, 265.0), oklch(0.60, 0.23, 20.0)],
        }
    }

    /// The light of a sample.
    #[inline]
    pub(super) fn light(&self, Paint(bits): Paint) -> Light {
        let mark = bits >> 11 & 3;
        if mark != 0 {
            return self.marks[mark as usize];
        }
        let side = if bits >> 10 & 1 == 1 {
            &self.fronts
        } else {
            &self.backs
        };
        let shade = self.shades[(bits >> 16 & 255) as usize];
        side[bits as usize & (TONES - 1)].map(|x| x * shade)
    }
}

/// Linear light of a colour given as lightness, chroma and hue (degrees) of Oklab.
fn oklch(lightness: f64, chroma: f64, hue: f64) -> Light {
    let hue = hue.to_radians();
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
    .map(|x| x.clamp(0.0, 1.0) as f32)
}

/// The byte that shows a linear light on an sRGB screen.
pub(super) fn srgb(light: f32) -> u8 {
    let x = f64::from(light);
    let shown = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (shown.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The linear light of a byte on an sRGB screen.
pub(super) fn linear(byte: u8) -> f32 {
    let x = f64::from(byte) / 255.0;
    let light = if x <= 0.040_45 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    };
    light as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_linear_light() {
        assert!((0..=255).all(|byte| srgb(linear(byte)) == byte));
    }

    #[test]
    fn the_first_components_look_different() {
        let palette = Palette::new(ColorBy::Component);
        let light = |c: u64| palette.light(Paint::surface(component_tone(c), true, 255));
        for a in 0..12 {
            for b in 0..a {
                let (p, q) = (light(a).map(srgb), light(b).map(srgb));
                let apart: i32 = (0..3)
                    .map(|k| (i32::from(p[k]) - i32::from(q[k])).abs())
                    .sum();
                assert!(apart > 50, "components {a} and {b}: {p:?} {q:?}");
            }
        }
    }

    #[test]
    fn backgrounds_are_read() {
        assert_eq!(
            "#0a10Ff".parse::<Background>().unwrap(),
            Background::Color([10, 16, 255])
        );
        assert_eq!(
            "white".parse::<Background>().unwrap(),
            Background::Color([255; 3])
        );
        for bad in ["#12345", "#+12345", "grey", "#é1234"] {
            assert!(bad.parse::<Background>().is_err(), "{bad}");
        }
    }
}
