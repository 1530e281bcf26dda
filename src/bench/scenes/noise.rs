//! Random numbers from hashes, and value noise in f64: only additions, products and integer hashes.

/// Hashes 64 bits (the finaliser of SplitMix64).
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A random number generator.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(mix(seed ^ 0x5bf0_3635_dcb7_6a2d))
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// A number in 0…1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// A number between `low` and `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// The random value of a lattice point, in −1…1.
fn lattice_value(x: i64, y: i64, z: i64, seed: u64) -> f64 {
    let key = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ (z as u64).wrapping_mul(0x1656_67b1_9e37_79f9)
        ^ seed.wrapping_mul(0xd6e8_feb8_6659_fd93);
    (mix(key) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Value noise on the unit lattice, about −1…1, with continuous second derivatives.
pub fn noise(p: [f64; 3], seed: u64) -> f64 {
    let cell = p.map(f64::floor);
    let f = [0, 1, 2].map(|a| {
        let t = p[a] - cell[a];
        t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
    });
    let [x, y, z] = cell.map(|c| c as i64);
    let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let line = |y, z| lerp(lattice_value(x, y, z, seed), lattice_value(x + 1, y, z, seed), f[0]);
    let plane = |z| lerp(line(y, z), line(y + 1, z), f[1]);
    lerp(plane(z), plane(z + 1), f[2])
}

/// Fractal noise: `octaves` of value noise from `frequency` on, each of twice the frequency and `gain` times the
/// amplitude.
pub fn fractal_noise(p: [f64; 3], frequency: f64, octaves: u32, gain: f64, seed: u64) -> f64 {
    let mut f = frequency;
    let mut amplitude = 1.0;
    let mut sum = 0.0;
    for octave in 0..octaves {
        // The lattices of the octaves must not coincide at the origin.
        let shift = 17.31 * f64::from(octave + 1);
        sum += amplitude * noise(p.map(|x| x * f + shift), seed + u64::from(octave));
        f *= 2.0;
        amplitude *= gain;
    }
    sum
}
