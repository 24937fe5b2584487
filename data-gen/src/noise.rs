//! Fractal noise as a sum of plane waves: random directions and phases, each octave of twice the
//! frequency and a bit more than half the amplitude. Smooth, seeded, and a few nanoseconds a point.

use crate::hash::{mix, unit};

/// Three waves in each of five octaves, and one for company: a round number for the vector unit.
const WAVES: usize = 16;

/// A smooth function of space with values in -1..=1.
#[derive(Clone, Debug)]
pub struct Noise {
    direction: [[f32; WAVES]; 3],
    phase: [f32; WAVES],
    amplitude: [f32; WAVES],
}

impl Noise {
    /// The noise of this seed; its longest waves are about 1.6 units long, its shortest a tenth.
    pub fn new(seed: u64) -> Noise {
        let mut noise = Noise {
            direction: [[0.0; WAVES]; 3],
            phase: [0.0; WAVES],
            amplitude: [0.0; WAVES],
        };
        for w in 0..WAVES {
            let octave = (w / 3).min(4) as i32;
            let random = |k: u64| unit(mix(seed ^ 0x6E6F_6973, 4 * w as u64 + k));
            // A direction uniform on the sphere: z and the longitude are uniform.
            let (z, around) = (2.0 * random(0) - 1.0, random(1) * std::f64::consts::TAU);
            let (flat, frequency) = ((1.0 - z * z).sqrt(), 0.625 * f64::from(1 << octave));
            noise.direction[0][w] = (frequency * flat * around.cos()) as f32;
            noise.direction[1][w] = (frequency * flat * around.sin()) as f32;
            noise.direction[2][w] = (frequency * z) as f32;
            noise.phase[w] = random(2) as f32;
            noise.amplitude[w] = 0.55f32.powi(octave);
        }
        let total: f32 = noise.amplitude.iter().sum();
        noise.amplitude = noise.amplitude.map(|a| a / total);
        noise
    }

    /// The value at a point. Single precision: seven digits near the origin, less further out, which
    /// only roughens the noise.
    pub fn at(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [x, y, z] = [x as f32, y as f32, z as f32];
        let [dx, dy, dz] = &self.direction;
        let mut sum = [0.0; WAVES];
        for w in 0..WAVES {
            let turns = dx[w] * x + dy[w] * y + dz[w] * z + self.phase[w];
            sum[w] = self.amplitude[w] * wave(turns);
        }
        f64::from(sum.iter().sum::<f32>())
    }
}

/// A sine made of two parabolas, of period 1: as smooth as noise needs, and without a library call.
fn wave(turns: f32) -> f32 {
    // Adding and taking away 1.5 * 2^23 rounds to the nearest integer.
    const ROUND: f32 = 12_582_912.0;
    let u = turns - ((turns + ROUND) - ROUND);
    u * (8.0 - 16.0 * u.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_in_range_and_moves() {
        let noise = Noise::new(5);
        let values: Vec<f64> = (0..10_000)
            .map(|i| {
                noise.at([
                    f64::from(i) * 0.01,
                    f64::from(i % 97),
                    -f64::from(i) * 0.003,
                ])
            })
            .collect();
        assert!(values.iter().all(|v| v.abs() <= 1.0 + 1e-6));
        assert!(values.iter().any(|v| *v > 0.3) && values.iter().any(|v| *v < -0.3));
        assert_ne!(noise.at([0.1, 0.2, 0.3]), Noise::new(6).at([0.1, 0.2, 0.3]));
    }
}
