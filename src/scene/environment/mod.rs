//! The light that arrives from infinitely far away: radiance by direction, and the irradiance of matte surfaces.

mod blur;
mod cube_map;
mod diffuse;
mod irradiance;
mod kernel;
mod light_sources;
mod octahedral;
mod panorama;
mod prefiltered;
mod procedural;
mod pyramid;

use std::fmt;
use std::sync::{Arc, OnceLock};

use glam::{DMat3, Mat3, Vec2, Vec3};
use twox_hash::XxHash3_128;

use blinn_core::geometry::Rgb;

pub use cube_map::CubeMap;
use diffuse::DiffuseTable;
pub use irradiance::SkyIrradiance;
pub use light_sources::SourceDirection;
use light_sources::{LightSources, SourceIrradiance};
use octahedral::to_square;
pub use panorama::Panorama;
use pyramid::{Level, Pyramid};

/// Panoramas that are wider are halved.
const MAX_PANORAMA_WIDTH: u32 = 8192;
/// Maximum number of texels on a side of the finest mip level.
const MAX_PYRAMID_SIDE: usize = 1024;
/// The same without light sources, of which only wide lookups are made.
const MAX_AMBIENT_SIDE: usize = 256;
/// Mip level from which on the panorama itself is looked up.
const SHARP_LEVEL: f32 = -1.0;
/// Bytes of the tables that lookups compute on first use: irradiance, and averages over reflected lobes.
const LOOKUP_TABLES: usize = 256 << 10;
/// Number of maps that are averaged over reflected lobes.
const PREFILTERED_MAPS: usize = 5;

/// The light that arrives from infinitely far away. Radiance is linear RGB (Rec. 709). A clone shares the picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Environment {
    /// `None` for a uniform environment.
    map: Option<Arc<EnvironmentMap>>,
    /// The radiance of a uniform environment, else a factor.
    radiance: Rgb,
    /// From the world to the map.
    to_map: Mat3,
    /// Irradiance of the map, before the factor and the rotation.
    irradiance: SkyIrradiance,
    /// The inverse of the rotation, in double precision.
    to_map_f64: DMat3,
}

/// Radiance by direction, in the environment's own frame.
#[derive(Clone)]
struct EnvironmentMap {
    /// The picture itself, for lookups that are sharper than the mip levels.
    panorama: Option<Panorama>,
    pyramid: Pyramid,
    /// Irradiance over π by normal, computed on first use.
    diffuse: OnceLock<DiffuseTable>,
    /// Averages over reflected lobes by α, each computed on first use.
    prefiltered: [OnceLock<Level>; PREFILTERED_MAPS],
    /// The light sources in the map and the rest, if there are sources.
    split: Option<SplitMap>,
    /// The first blurred map that was requested.
    blurred: OnceLock<BlurredMap>,
    /// Hash of the texels.
    digest: u128,
}

/// A map as the sum of its light sources and of the rest.
#[derive(Clone)]
struct SplitMap {
    sources: LightSources,
    /// The rest.
    ambient: Arc<EnvironmentMap>,
    /// Irradiance of the rest.
    irradiance: SkyIrradiance,
    /// Irradiance of the sources, computed on first use.
    source_irradiance: OnceLock<SourceIrradiance>,
}

/// A map blurred by a width in radians.
#[derive(Clone)]
struct BlurredMap {
    width: f64,
    map: Arc<EnvironmentMap>,
}

impl PartialEq for EnvironmentMap {
    fn eq(&self, other: &EnvironmentMap) -> bool {
        self.digest == other.digest && self.panorama.is_some() == other.panorama.is_some()
    }
}

/// Formats the hash of the texels in place of millions of numbers.
impl fmt::Debug for EnvironmentMap {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "EnvironmentMap({:032x})", self.digest)
    }
}

/// Serialises the hash of the texels.
impl serde::Serialize for EnvironmentMap {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u128(self.digest)
    }
}

impl Environment {
    /// Makes an environment of the same radiance in all directions.
    pub fn uniform(radiance: Rgb) -> Environment {
        Environment::new(None, radiance, SkyIrradiance::uniform(Rgb::ONE))
    }

    /// Makes an environment from an equirectangular picture. Of pictures wider than 8192 texels, the nine harmonics of
    /// [`Environment::irradiance`] keep all texels, and lookups a reduced picture.
    pub fn from_panorama(panorama: Panorama) -> Environment {
        let irradiance = SkyIrradiance::from_panorama(&panorama);
        let mut panorama = panorama;
        while panorama.width() > MAX_PANORAMA_WIDTH {
            panorama = panorama.halved();
        }
        let map = EnvironmentMap::from_panorama(panorama);
        Environment::new(Some(map), Rgb::ONE, irradiance)
    }

    /// Makes an environment from a function of the unit direction, sampled at `side`² directions, a power of two, with
    /// `samples`² samples each.
    pub fn from_function(side: usize, samples: usize, radiance: impl Fn(Vec3) -> Rgb + Sync) -> Environment {
        let pyramid = Pyramid::new(side, samples, radiance);
        let irradiance = SkyIrradiance::from_pyramid(&pyramid);
        Environment::new(Some(EnvironmentMap::new(None, pyramid)), Rgb::ONE, irradiance)
    }

    fn new(map: Option<EnvironmentMap>, radiance: Rgb, irradiance: SkyIrradiance) -> Environment {
        Environment {
            map: map.map(Arc::new),
            radiance,
            to_map: Mat3::IDENTITY,
            irradiance,
            to_map_f64: DMat3::IDENTITY,
        }
    }

    /// Returns the environment with its radiance multiplied by `strength`.
    pub fn scaled(mut self, strength: Rgb) -> Environment {
        self.radiance *= strength;
        self
    }

    /// Returns the environment turned about +Y by `angle` radians: +Z turns towards +X.
    pub fn rotated_about_y(self, angle: f64) -> Environment {
        if angle == 0.0 {
            return self;
        }
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        self.rotated(DMat3::from_cols_array(&[cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos]))
    }

    /// Returns the environment turned by a rotation: the light from `d` arrives from `rotation * d` afterwards.
    pub fn rotated(mut self, rotation: DMat3) -> Environment {
        self.to_map_f64 *= rotation.transpose();
        self.to_map = self.to_map_f64.as_mat3();
        self
    }

    /// Returns the radiance from the unit world direction `d`, averaged over about `solid_angle` steradians; 0 is sharp.
    /// It is continuous in both, and the same on every processor.
    #[inline]
    pub fn radiance(&self, d: Vec3, solid_angle: f32) -> Rgb {
        match &self.map {
            None => self.radiance,
            Some(map) => map.radiance(self.to_map * d, solid_angle) * self.radiance,
        }
    }

    /// [`Environment::radiance`] of many directions, in structure of arrays.
    #[inline(always)]
    pub fn radiance_of_lanes<const N: usize>(&self, d: &[[f32; N]; 3], solid_angle: &[f32; N]) -> [Rgb; N] {
        let Some(map) = &self.map else { return [self.radiance; N] };
        let mut directions = [[0.0; N]; 3];
        let mut p = [[0.0; N]; 2];
        let mut level = [0.0; N];
        for i in 0..N {
            let d = self.to_map * Vec3::new(d[0][i], d[1][i], d[2][i]);
            [directions[0][i], directions[1][i], directions[2][i]] = d.to_array();
            [p[0][i], p[1][i]] = to_square(d).to_array();
            level[i] = map.level(solid_angle[i]);
        }
        let mut radiance = map.pyramid.radiance_of_lanes(&p, &level);
        if map.panorama.is_some() {
            for i in (0..N).filter(|&i| level[i] < 0.0) {
                let d = Vec3::from_array(directions.map(|axis| axis[i]));
                radiance[i] = map.look_up(&MipLookup { d, p: Vec2::new(p[0][i], p[1][i]), level: level[i] });
            }
        }
        for radiance in &mut radiance {
            *radiance *= self.radiance;
        }
        radiance
    }

    /// Returns the radiance, if it is the same in all directions.
    pub fn as_uniform(&self) -> Option<Rgb> {
        self.map.is_none().then_some(self.radiance)
    }

    /// Returns the mean radiance over all directions.
    pub fn mean(&self) -> Rgb {
        self.map.as_ref().map_or(Rgb::ONE, |map| map.pyramid.mean()) * self.radiance
    }

    /// Returns the irradiance over π of a surface with unit normal `n`: the radiance that white matte surfaces reflect. Unlike
    /// [`Environment::irradiance`] it has no error of harmonics.
    pub fn diffuse(&self, n: Vec3) -> Rgb {
        match &self.map {
            None => self.radiance,
            Some(map) => {
                // Not in parallel: threads would wait for each other inside of other work.
                let diffuse = map.diffuse.get_or_init(|| DiffuseTable::new(&map.pyramid));
                diffuse.irradiance(self.to_map * n) * self.radiance
            }
        }
    }

    /// Returns true if some directions are much brighter than the rest: light sources, such as the sun or windows.
    pub fn has_light_sources(&self) -> bool {
        self.split().is_some()
    }

    /// Returns the direction to a light source for a point of the unit square: in proportion to the brightness of the sources.
    /// `None` if there are none.
    pub fn sample_light_sources(&self, u: [f32; 2]) -> Option<SourceDirection> {
        let SourceDirection { direction, radiance, density } = self.split()?.sources.sample(u);
        let direction = self.to_map.transpose() * direction;
        Some(SourceDirection { direction, radiance: radiance * self.radiance, density })
    }

    /// Returns the irradiance over π that the light sources give to a surface with unit normal `n`; black without sources.
    pub fn diffuse_of_light_sources(&self, n: Vec3) -> Rgb {
        let Some(split) = self.split() else { return Rgb::ZERO };
        // Not in parallel: threads would wait for each other inside of other work.
        let irradiance = split.source_irradiance.get_or_init(|| SourceIrradiance::new(&split.sources));
        irradiance.at(self.to_map * n) * self.radiance
    }

    /// Returns the environment without its light sources.
    pub fn ambient_part(&self) -> Environment {
        let Some(split) = self.split() else { return self.clone() };
        Environment { map: Some(split.ambient.clone()), irradiance: split.irradiance, ..self.clone() }
    }

    /// Returns the irradiance of surfaces by their normal, without that of light sources.
    pub fn ambient_irradiance(&self) -> SkyIrradiance {
        let irradiance = self.split().map_or(self.irradiance, |split| split.irradiance);
        irradiance.scaled(self.radiance).rotated(self.to_map_f64)
    }

    /// Returns the bytes of the map, with what lookups compute on first use.
    pub fn memory_size(&self) -> u64 {
        self.map.as_ref().map_or(0, |map| map.memory_size() as u64)
    }

    fn split(&self) -> Option<&SplitMap> {
        self.map.as_ref()?.split.as_ref()
    }

    /// Returns the irradiance of surfaces by their normal.
    pub fn irradiance(&self) -> SkyIrradiance {
        self.irradiance.scaled(self.radiance).rotated(self.to_map_f64)
    }
}

impl SplitMap {
    fn new((sources, ambient): (LightSources, Panorama)) -> SplitMap {
        let irradiance = SkyIrradiance::from_panorama(&ambient);
        let side = pyramid_side(&ambient, MAX_AMBIENT_SIDE);
        let pyramid = Pyramid::new(side, 3, |d| ambient.radiance(d));
        let ambient = Arc::new(EnvironmentMap::new(None, pyramid));
        SplitMap { sources, ambient, irradiance, source_irradiance: OnceLock::new() }
    }
}

/// Number of texels on a side of the finest mip level of a panorama, up to `max`: texels are about twice as wide as the
/// picture's.
fn pyramid_side(panorama: &Panorama, max: usize) -> usize {
    let side = (panorama.width() as usize / 4).clamp(16, max);
    1 << side.ilog2()
}

impl EnvironmentMap {
    fn from_panorama(panorama: Panorama) -> EnvironmentMap {
        let side = pyramid_side(&panorama, MAX_PYRAMID_SIDE);
        // The picture is filtered first to texels as wide as the samples are apart.
        let mut filtered = if panorama.width() >= 64 { panorama.halved() } else { panorama.clone() };
        filtered.blur_poles();
        let pyramid = Pyramid::new(side, 3, |d| filtered.radiance(d));
        drop(filtered);
        let split = LightSources::find(&panorama).map(SplitMap::new);
        EnvironmentMap { split, ..EnvironmentMap::new(Some(panorama), pyramid) }
    }

    fn memory_size(&self) -> usize {
        let panorama = self.panorama.as_ref().map_or(0, |panorama| panorama.bytes().len());
        let split =
            self.split.as_ref().map_or(0, |split| split.sources.memory_size() + split.ambient.memory_size());
        panorama + self.pyramid.memory_size() + split + LOOKUP_TABLES
    }

    fn new(panorama: Option<Panorama>, pyramid: Pyramid) -> EnvironmentMap {
        let texels = panorama.as_ref().map_or_else(|| pyramid.bytes(), Panorama::bytes);
        EnvironmentMap {
            digest: XxHash3_128::oneshot(texels),
            panorama,
            pyramid,
            diffuse: OnceLock::new(),
            prefiltered: Default::default(),
            split: None,
            blurred: OnceLock::new(),
        }
    }

    #[inline]
    fn radiance(&self, d: Vec3, solid_angle: f32) -> Rgb {
        let level = self.level(solid_angle);
        match &self.panorama {
            // Backgrounds need no point of the pyramid.
            Some(panorama) if level <= SHARP_LEVEL => panorama.radiance(d),
            _ => self.look_up(&MipLookup { d, p: to_square(d), level }),
        }
    }

    /// [`EnvironmentMap::radiance`] of many directions, in structure of arrays.
    #[inline(always)]
    fn radiance_of_lanes<const N: usize>(&self, d: &[[f32; N]; 3], solid_angle: f32) -> [Rgb; N] {
        let level = self.level(solid_angle);
        let mut p = [[0.0; N]; 2];
        for i in 0..N {
            [p[0][i], p[1][i]] = to_square(Vec3::new(d[0][i], d[1][i], d[2][i])).to_array();
        }
        if self.panorama.is_none() || level >= 0.0 {
            return self.pyramid.radiance_at_level(&p, level);
        }
        let mut radiance = [Rgb::ZERO; N];
        for i in 0..N {
            let d = Vec3::new(d[0][i], d[1][i], d[2][i]);
            radiance[i] = self.look_up(&MipLookup { d, p: Vec2::new(p[0][i], p[1][i]), level });
        }
        radiance
    }

    /// The mip level whose texels have a solid angle; negative for levels that are finer than the pyramid.
    #[inline(always)]
    fn level(&self, solid_angle: f32) -> f32 {
        0.5 * log2(solid_angle / self.pyramid.texel_solid_angle())
    }

    #[inline(always)]
    fn look_up(&self, lookup: &MipLookup) -> Rgb {
        let &MipLookup { d, p, level } = lookup;
        match &self.panorama {
            Some(panorama) if level < 0.0 => {
                let sharp = panorama.radiance(d);
                let t = level - SHARP_LEVEL;
                if t <= 0.0 { sharp } else { sharp.lerp(self.pyramid.radiance(p, 0.0), t) }
            }
            _ => self.pyramid.radiance(p, level),
        }
    }
}

/// A lookup of the mip levels.
#[derive(Clone, Copy)]
struct MipLookup {
    /// Unit direction in the frame of the map.
    d: Vec3,
    /// The point of the direction in the unit square.
    p: Vec2,
    level: f32,
}

/// Returns the binary logarithm with an error below 0.01: continuous, increasing, and the same on every processor. That
/// of 0 is −127.
#[inline(always)]
fn log2(x: f32) -> f32 {
    let bits = x.max(0.0).to_bits();
    let exponent = (bits >> 23) as f32 - 127.0;
    let f = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0;
    exponent + f + 0.346_607 * f * (1.0 - f)
}

#[cfg(test)]
mod tests;
