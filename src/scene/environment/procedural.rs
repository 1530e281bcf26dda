//! Environments without a file: a studio and a clear sky.

use std::sync::OnceLock;

use glam::Vec3;

use super::Environment;
use blinn_core::geometry::Rgb;

/// Texels on a side of the studio's finest mip level: three over the edge of a soft box.
const STUDIO_SIDE: usize = 256;
/// Texels on a side of the sky's finest mip level.
const SKY_SIDE: usize = 512;

/// A soft box at infinity: a rectangle on a plane whose distance is 1.
struct SoftBox {
    /// Direction to the centre, not normalised.
    centre: Vec3,
    /// Half of the width and of the height, as tangents.
    half_size: [f32; 2],
    radiance: f32,
}

/// Soft boxes of the studio: key on the left, fill on the right, rim behind, strip above. +Z faces the viewer.
const SOFT_BOXES: [SoftBox; 4] = [
    SoftBox { centre: Vec3::new(-0.80, 0.65, 0.60), half_size: [0.45, 0.60], radiance: 2.0 },
    SoftBox { centre: Vec3::new(1.00, 0.25, 0.45), half_size: [0.30, 0.70], radiance: 0.9 },
    SoftBox { centre: Vec3::new(0.55, 0.55, -0.90), half_size: [0.60, 0.25], radiance: 1.6 },
    SoftBox { centre: Vec3::new(0.0, 1.0, -0.05), half_size: [0.80, 0.35], radiance: 1.2 },
];
/// Radiance of the studio's walls at the horizon.
const WALL: f32 = 0.10;
/// Radiance of the studio's floor straight down.
const FLOOR: f32 = 0.04;
/// Radiance of the studio's ceiling straight up.
const CEILING: f32 = 0.06;
/// Width of the soft edge of a box, as a tangent.
const EDGE: f32 = 0.04;

/// A soft box with the axes of its plane.
struct PlacedBox {
    u: Vec3,
    v: Vec3,
    w: Vec3,
    half_size: [f32; 2],
    radiance: f32,
}

impl PlacedBox {
    fn new(soft_box: &SoftBox) -> PlacedBox {
        let w = soft_box.centre.normalize();
        // A box straight above has its width along X.
        let up = if w.y.abs() > 0.9 { Vec3::NEG_Z } else { Vec3::Y };
        let u = up.cross(w).normalize();
        PlacedBox { u, v: w.cross(u), w, half_size: soft_box.half_size, radiance: soft_box.radiance }
    }

    /// The share of the box in the direction `d`: 1 inside, 0 outside, smooth between.
    fn coverage(&self, d: Vec3) -> f32 {
        let distance = d.dot(self.w);
        if distance <= 0.0 {
            return 0.0;
        }
        let inside = |p: f32, half: f32| smoothstep((half - (p / distance).abs()) / EDGE + 0.5);
        inside(d.dot(self.u), self.half_size[0]) * inside(d.dot(self.v), self.half_size[1])
    }
}

/// Returns 3t² − 2t³ with t limited to 0…1.
fn smoothstep(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Radiance of the studio: walls that grow darker upwards and downwards, and soft boxes before them.
fn studio_radiance(soft_boxes: &[PlacedBox], d: Vec3) -> Rgb {
    let end = if d.y < 0.0 { FLOOR } else { CEILING };
    let room = WALL + (end - WALL) * smoothstep(d.y.abs());
    let light = soft_boxes.iter().fold(room, |light, soft_box| {
        let coverage = soft_box.coverage(d);
        light + (soft_box.radiance - light) * coverage
    });
    Rgb::splat(light)
}

/// Radiance of the sky: from pale at the horizon to blue above, with a soft glow around the sun, over a grey-brown ground.
fn sky_radiance(d: Vec3) -> Rgb {
    const ZENITH: Rgb = Rgb::new(0.16, 0.32, 0.75);
    const HORIZON: Rgb = Rgb::new(0.75, 0.85, 0.95);
    const GROUND: Rgb = Rgb::new(0.16, 0.145, 0.125);
    const SUN: Rgb = Rgb::new(6.0, 5.0, 3.6);
    let to_sun = Vec3::new(0.55, 0.55, 0.63).normalize();
    // The optical depth of the air falls quickly above the horizon: (1 − y)⁴.
    let a = 1.0 - d.y.max(0.0);
    let air = a * a * (a * a);
    let cos = d.dot(to_sun).max(0.0);
    // cos^64, by squaring: a glow of about 8° around the sun.
    let glow = (0..6).fold(cos, |v, _| v * v);
    let sky = ZENITH + (HORIZON - ZENITH) * air + SUN * glow;
    let ground = GROUND * (1.0 + 0.5 * (1.0 + d.y.min(0.0)));
    // The horizon is a degree wide.
    let above = smoothstep(d.y / 0.02 + 0.5);
    ground + (sky - ground) * above
}

impl Environment {
    /// Returns the studio: four soft boxes in a dark grey room. +Z faces the viewer: the key box is on the left.
    pub fn studio() -> Environment {
        static STUDIO: OnceLock<Environment> = OnceLock::new();
        let make = || {
            let soft_boxes = SOFT_BOXES.each_ref().map(PlacedBox::new);
            Environment::from_function(STUDIO_SIDE, 1, |d| studio_radiance(&soft_boxes, d))
        };
        made_once(&STUDIO, make)
    }

    /// Returns a clear sky with a hazy sun in the direction (0.55, 0.55, 0.63), over a grey ground.
    pub fn sky() -> Environment {
        static SKY: OnceLock<Environment> = OnceLock::new();
        made_once(&SKY, || Environment::from_function(SKY_SIDE, 2, sky_radiance))
    }
}

/// Returns the content of `cell`, after making it if it is empty. It is made outside of the cell's lock: a thread that
/// waits for parts of it may work on another scene meanwhile, which needs it, too.
fn made_once(cell: &OnceLock<Environment>, make: impl FnOnce() -> Environment) -> Environment {
    if let Some(environment) = cell.get() {
        return environment.clone();
    }
    let made = make();
    cell.get_or_init(|| made).clone()
}
