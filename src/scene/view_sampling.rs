//! Positions of dataset cameras around a scene, evenly distributed or random.
//!
//! Random numbers are a hash of the seed, the number of the view and the quantity that they decide: a view depends on no
//! other view. Positions of [`ViewLayout::Random`] do not depend on the number of views either.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::{Camera, Orbit};
use blinn_core::geometry::Basis;

/// How camera positions are distributed on a sphere around the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ViewLayout {
    /// Evenly over the sphere, from the top down (Fibonacci).
    #[default]
    Sphere,
    /// Evenly over the upper half of the sphere.
    Hemisphere,
    /// Evenly around the vertical.
    Ring,
    /// At the vertices of an icosahedron whose triangles are split into four once or more often.
    Icosphere,
    /// At random, with equal density everywhere.
    Random,
    /// Pairs of parallel cameras, left then right, evenly over the sphere.
    Stereo {
        /// Distance between the two in metres. `None` is a thirtieth of the distance from the scene.
        baseline: Option<f64>,
    },
}

/// A range of distances from the point that cameras look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DistanceRange {
    /// In metres.
    Metres(f64, f64),
    /// In multiples of the distance that frames the scene.
    Framed(f64, f64),
}

/// How the cameras of a dataset are chosen. Angles are radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewSampling {
    /// The distribution of positions.
    pub layout: ViewLayout,
    /// Lowest and highest elevation above the horizon. `None` is all that the layout has.
    pub elevation: Option<(f64, f64)>,
    /// `None` frames the scene.
    pub distance: Option<DistanceRange>,
    /// Largest rotation about the view direction, either way.
    pub roll: f64,
    /// Radius of the ball around the centre in which the points to look at lie, in radii of the scene's bounding sphere.
    pub look_at_jitter: f64,
    /// Turns the light sources about the vertical through the centre of the scene, in each view by another angle.
    pub random_lights: bool,
    /// Turns the environment about the vertical, in each view by another angle.
    pub random_environment: bool,
    /// Selects the random numbers.
    pub seed: u32,
}

/// The camera and the light of one view.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SampledView {
    /// The position; its distance is `None`.
    pub orbit: Orbit,
    /// The distance.
    pub distance: Option<SampledDistance>,
    /// Rotation about the view direction in radians: the camera turns counterclockwise, what it shows clockwise.
    pub roll: f64,
    /// Offset of the point to look at from the centre, in radii of the scene's bounding sphere.
    pub look_at_offset: DVec3,
    /// The side of a stereo pair.
    pub stereo: Option<StereoEye>,
    /// Rotation of the light.
    pub light: LightRotation,
}

/// Rotation of the light of a view about the vertical, in degrees from +Z towards +X, so that files hold it exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LightRotation {
    /// Rotation of the light sources.
    pub sources: f64,
    /// Rotation of the environment.
    pub environment: f64,
}

/// A distance from the point to look at.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum SampledDistance {
    /// In metres.
    Metres(f64),
    /// In multiples of the distance that frames the scene.
    Framed(f64),
}

/// One camera of a stereo pair.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StereoEye {
    /// −1 for the left camera, 1 for the right one.
    pub side: f64,
    /// Distance between the two in metres. `None` is a thirtieth of the distance from the scene.
    pub baseline: Option<f64>,
}

/// Default baseline of stereo pairs, as a fraction of the distance.
pub const DEFAULT_BASELINE: f64 = 1.0 / 30.0;
/// Elevation of a ring without a range, in radians: 22°.
const RING_ELEVATION: f64 = 22.0 * PI / 180.0;
/// Largest number of subdivisions of an icosphere; 655,362 vertices.
const MAX_SUBDIVISIONS: u32 = 8;

/// The use of a random number.
#[derive(Clone, Copy)]
enum Quantity {
    Azimuth,
    Height,
    Distance,
    Roll,
    JitterHeight,
    JitterAzimuth,
    JitterRadius,
    Lights,
    Environment,
}

impl ViewLayout {
    /// Returns an error if the layout has no such number of views, or no choice of elevation.
    ///
    /// # Errors
    /// A message for users, without the name of a flag.
    pub fn check(&self, count: u32, has_elevation: bool) -> Result<(), String> {
        match self {
            ViewLayout::Stereo { .. } if !count.is_multiple_of(2) => {
                Err(format!("stereo views are pairs, but {count} is odd"))
            }
            ViewLayout::Icosphere if has_elevation => {
                Err("the views of an icosphere have fixed elevations; use another layout".into())
            }
            ViewLayout::Icosphere if icosphere_subdivisions(count).is_none() => {
                let counts: Vec<String> =
                    (0..=MAX_SUBDIVISIONS).map(|k| icosphere_count(k).to_string()).collect();
                Err(format!("an icosphere has {} views, not {count}", counts.join(", ")))
            }
            _ => Ok(()),
        }
    }
}

/// Number of vertices of an icosahedron that was subdivided `subdivisions` times.
fn icosphere_count(subdivisions: u32) -> u32 {
    10 * (1 << (2 * subdivisions)) + 2
}

fn icosphere_subdivisions(count: u32) -> Option<u32> {
    (0..=MAX_SUBDIVISIONS).find(|&k| icosphere_count(k) == count)
}

/// All camera positions of an icosphere as unit vectors, from the top down.
pub fn icosphere(count: u32) -> Vec<DVec3> {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices: Vec<DVec3> = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        vertices.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    vertices.iter_mut().for_each(|v| *v = v.normalize());
    // The edges of an icosahedron join its nearest vertices.
    let near = |a: DVec3, b: DVec3| a.dot(b) > 0.4 && a.dot(b) < 0.9;
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|index| vertices[index]);
                if near(a, b) && near(b, c) && near(a, c) {
                    faces.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    for _ in 0..icosphere_subdivisions(count).unwrap_or(0) {
        let mut middles = std::collections::HashMap::new();
        let mut split = Vec::with_capacity(4 * faces.len());
        for [a, b, c] in faces {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    vertices.push((vertices[i as usize] + vertices[j as usize]).normalize());
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        faces = split;
    }
    let order = |v: &DVec3| [-v.y, v.x, v.z].map(|x| (x * 1e9).round() as i64);
    vertices.sort_by_key(order);
    vertices
}

impl Orbit {
    /// The position in a direction from the centre.
    fn towards(direction: DVec3) -> Orbit {
        let DVec3 { x, y, z } = direction;
        let turn = libm::atan2(x, z);
        let azimuth = if turn < 0.0 { turn + TAU } else { turn };
        Orbit { azimuth, elevation: libm::asin(y.clamp(-1.0, 1.0)), distance: None }
    }
}

impl ViewSampling {
    /// Returns true if views depend on the seed.
    pub fn is_random(&self) -> bool {
        let is_range = |range: Option<(f64, f64)>| range.is_some_and(|(low, high)| low != high);
        let distance = self.distance.map(|range| match range {
            DistanceRange::Metres(low, high) | DistanceRange::Framed(low, high) => (low, high),
        });
        let has_random_positions = match self.layout {
            ViewLayout::Random => true,
            ViewLayout::Ring => is_range(self.elevation),
            _ => false,
        };
        has_random_positions
            || is_range(distance)
            || self.roll > 0.0
            || self.look_at_jitter > 0.0
            || self.random_lights
            || self.random_environment
    }

    /// View `i` of `n`, from 0. `icosphere` are the positions of that layout.
    pub fn view(&self, i: u32, n: u32, icosphere: &[DVec3]) -> SampledView {
        let distance = self.distance.map(|range| {
            let between =
                |(low, high): (f64, f64)| self.between(self.place(i), Quantity::Distance, low, high);
            match range {
                DistanceRange::Metres(low, high) => SampledDistance::Metres(between((low, high))),
                DistanceRange::Framed(low, high) => SampledDistance::Framed(between((low, high))),
            }
        });
        let turn = |is_random: bool, quantity| if is_random { 360.0 * self.unit(i, quantity) } else { 0.0 };
        SampledView {
            orbit: self.orbit(i, n, icosphere),
            distance,
            roll: if self.roll > 0.0 {
                self.between(self.place(i), Quantity::Roll, -self.roll, self.roll)
            } else {
                0.0
            },
            look_at_offset: self.look_at_offset(self.place(i)),
            stereo: match self.layout {
                ViewLayout::Stereo { baseline } => {
                    Some(StereoEye { side: if i.is_multiple_of(2) { -1.0 } else { 1.0 }, baseline })
                }
                _ => None,
            },
            light: LightRotation {
                sources: turn(self.random_lights, Quantity::Lights),
                environment: turn(self.random_environment, Quantity::Environment),
            },
        }
    }

    /// The place of a view: both cameras of a stereo pair share one.
    fn place(&self, i: u32) -> u32 {
        if matches!(self.layout, ViewLayout::Stereo { .. }) { i / 2 } else { i }
    }

    fn orbit(&self, i: u32, n: u32, icosphere: &[DVec3]) -> Orbit {
        let (low, high) = self.elevation.unwrap_or((-FRAC_PI_2, FRAC_PI_2));
        match self.layout {
            ViewLayout::Sphere => fibonacci(i, n, self.elevation),
            ViewLayout::Stereo { .. } => fibonacci(i / 2, n.div_ceil(2), self.elevation),
            ViewLayout::Hemisphere => fibonacci(i, n, Some((low.max(0.0), high.max(0.0)))),
            ViewLayout::Ring => {
                let (low, high) = self.elevation.unwrap_or((RING_ELEVATION, RING_ELEVATION));
                let azimuth = TAU * f64::from(i) / f64::from(n.max(1));
                Orbit { azimuth, elevation: self.between(i, Quantity::Height, low, high), distance: None }
            }
            ViewLayout::Icosphere => Orbit::towards(icosphere.get(i as usize).copied().unwrap_or(DVec3::Y)),
            ViewLayout::Random => {
                // Bands of equal height on a sphere have equal areas (Archimedes).
                let height = self.between(i, Quantity::Height, libm::sin(low), libm::sin(high));
                let azimuth = TAU * self.unit(i, Quantity::Azimuth);
                Orbit { azimuth, elevation: libm::asin(height.clamp(-1.0, 1.0)), distance: None }
            }
        }
    }

    /// A point in a ball, with equal density everywhere.
    fn look_at_offset(&self, i: u32) -> DVec3 {
        if self.look_at_jitter <= 0.0 {
            return DVec3::ZERO;
        }
        let height = self.between(i, Quantity::JitterHeight, -1.0, 1.0);
        let turn = TAU * self.unit(i, Quantity::JitterAzimuth);
        let across = (1.0 - height * height).max(0.0).sqrt();
        let direction = DVec3::new(across * libm::sin(turn), height, across * libm::cos(turn));
        direction * self.look_at_jitter * libm::cbrt(self.unit(i, Quantity::JitterRadius))
    }

    fn between(&self, i: u32, quantity: Quantity, low: f64, high: f64) -> f64 {
        if low == high { low } else { low + (high - low) * self.unit(i, quantity) }
    }

    /// A random number in [0, 1) for a quantity of view `i`.
    fn unit(&self, i: u32, quantity: Quantity) -> f64 {
        let counter = u64::from(i) << 8 | quantity as u64;
        let bits = mix(mix(u64::from(self.seed)).wrapping_add(counter));
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The mixing function of SplitMix64 (Steele, Lea and Flood 2014).
fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// Position `i` of `n` on a Fibonacci sphere, between two elevations.
fn fibonacci(i: u32, n: u32, elevation: Option<(f64, f64)>) -> Orbit {
    let orbit = Orbit::fibonacci_sphere(i, n);
    let Some((low, high)) = elevation else { return orbit };
    let (low, high) = (libm::sin(low), libm::sin(high));
    let height = high - (high - low) * (2.0 * f64::from(i) + 1.0) / (2.0 * f64::from(n.max(1)));
    Orbit { elevation: libm::asin(height.clamp(-1.0, 1.0)), ..orbit }
}

impl SampledView {
    /// A view at a position, with nothing else.
    pub fn at(orbit: Orbit) -> SampledView {
        SampledView {
            orbit,
            distance: None,
            roll: 0.0,
            look_at_offset: DVec3::ZERO,
            stereo: None,
            light: LightRotation::default(),
        }
    }

    /// Returns true if the camera is not the one that frames the scene from the position.
    pub fn moves_camera(&self) -> bool {
        let SampledView { distance, roll, look_at_offset, stereo, .. } = *self;
        distance.is_some() || roll != 0.0 || look_at_offset != DVec3::ZERO || stereo.is_some()
    }

    /// Converts lengths from units to metres.
    pub fn in_metres(mut self, metres_per_unit: f64) -> SampledView {
        if let Some(SampledDistance::Metres(distance)) = &mut self.distance {
            *distance *= metres_per_unit;
        }
        if let Some(StereoEye { baseline: Some(baseline), .. }) = &mut self.stereo {
            *baseline *= metres_per_unit;
        }
        self
    }

    /// Moves a camera that frames the scene from this position. `centre` is what it looks at, `radius` that of the scene's
    /// bounding sphere.
    pub fn place(&self, camera: &mut Camera, centre: DVec3, radius: f64) {
        let framed = camera.view_point.distance(centre);
        let distance = match self.distance {
            None => framed,
            Some(SampledDistance::Metres(metres)) => metres,
            Some(SampledDistance::Framed(factor)) => factor * framed,
        };
        if self.distance.is_some() {
            camera.view_point = centre + camera.basis.w * distance;
        }
        if self.look_at_offset != DVec3::ZERO {
            let direction = centre + self.look_at_offset * radius - camera.view_point;
            let turned = Basis::from_view_with_fallback_up(direction, camera.basis.v);
            camera.basis = turned.unwrap_or(camera.basis);
        }
        if self.roll != 0.0 {
            let (sin, cos) = (libm::sin(self.roll), libm::cos(self.roll));
            let Basis { u, v, w } = camera.basis;
            camera.basis = Basis { u: u * cos + v * sin, v: v * cos - u * sin, w };
        }
        if let Some(StereoEye { side, baseline }) = self.stereo {
            let baseline = baseline.unwrap_or(DEFAULT_BASELINE * distance);
            camera.view_point += camera.basis.u * (0.5 * side * baseline);
        }
    }
}

#[cfg(test)]
mod tests;
