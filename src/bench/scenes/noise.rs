//! Random numbers by hashing, and smooth noise over space. In f64, by additions, products and
//! integer hashes alone.

/// Mixes 64 bits (the finaliser of splitmix64).
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A sequence of random numbers.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(mix(seed ^ 0x5bf0_3635_dcb7_6a2d))
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// In 0…1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Between `low` and `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// A number in −1…1 that belongs to a corner of the lattice.
fn corner(x: i64, y: i64, z: i64, seed: u64) -> f64 {
    let key = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ (z as u64).wrapping_mul(0x1656_67b1_9e37_79f9)
        ^ seed.wrapping_mul(0xd6e8_feb8_6659_fd93);
    (mix(key) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Value noise: smooth to the second derivative, about −1…1, features of the size of one unit.
pub fn noise(p: [f64; 3], seed: u64) -> f64 {
    let cell = p.map(f64::floor);
    let f = [0, 1, 2].map(|a| {
        let t = p[a] - cell[a];
        t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
    });
    let [x, y, z] = cell.map(|c| c as i64);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let line = |y, z| mix(corner(x, y, z, seed), corner(x + 1, y, z, seed), f[0]);
    let plane = |z| mix(line(y, z), line(y + 1, z), f[1]);
    mix(plane(z), plane(z + 1), f[2])
}

/// `octaves` of noise from frequency `frequency` on, each twice as fine and `gain` as strong.
pub fn fractal(p: [f64; 3], frequency: f64, octaves: u32, gain: f64, seed: u64) -> f64 {
    let (mut f, mut strength, mut sum) = (frequency, 1.0, 0.0);
    for octave in 0..octaves {
        // Octaves are shifted, so that their lattices do not coincide at the origin.
        let shift = 17.31 * f64::from(octave + 1);
        sum += strength * noise(p.map(|x| x * f + shift), seed + u64::from(octave));
        f *= 2.0;
        strength *= gain;
    }
    sum
}
