//! Lights for scenes that bring none, fixed to the camera.

use glam::DVec3;

use super::{Camera, LightUnits, PosedLight, PosedScene, SkyIrradiance, SourceFormat};
use crate::geometry::Rgb;

/// Lights with the ambient colour that goes with them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// The lights.
    pub lights: Vec<PosedLight>,
    /// I_a.
    pub ambient: Rgb,
    /// An I_a for every direction, in place of the even one.
    pub sky: Option<SkyIrradiance>,
}

/// A key light from the upper left, a fill from the right, a rim from behind: all suns, so that
/// the picture does not depend on the scene's size. A white Lambertian stays below 1.
pub fn three_point(camera: &Camera) -> Rig {
    let basis = camera.basis;
    let sun = |to_light: DVec3, e: f32| {
        let l = basis.u * to_light.x + basis.v * to_light.y + basis.w * to_light.z;
        PosedLight::sun(-l, Rgb::splat(e))
    };
    Rig {
        lights: vec![
            sun(DVec3::new(-0.55, 0.75, 0.85), 0.68),
            sun(DVec3::new(0.9, 0.15, 0.7), 0.2),
            sun(DVec3::new(0.45, 0.7, -0.9), 0.3),
        ],
        ambient: Rgb::splat(0.1),
        sky: None,
    }
}

/// The lecture's "dim light at camera": a sun along the view.
pub fn headlight(camera: &Camera) -> Rig {
    Rig {
        lights: vec![PosedLight::sun(-camera.basis.w, Rgb::splat(0.8))],
        ambient: Rgb::splat(0.05),
        sky: None,
    }
}

/// A place that light may come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSet {
    /// The file's lights.
    File,
    /// A dim light at the camera.
    Headlight,
    /// Key, fill and rim, fixed to the camera.
    ThreePoint,
}

/// A light in world coordinates with the lecture's own strength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UserLight {
    /// A point light.
    Point {
        /// Where, in world coordinates.
        position: DVec3,
        /// The lecture's I.
        intensity: Rgb,
    },
    /// A directional light.
    Sun {
        /// The way its light travels.
        direction: DVec3,
        /// What arrives, E.
        intensity: Rgb,
    },
}

/// How a scene is lit, as asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting {
    /// Where light comes from; `None`: the file, else what was given, else the three-point rig.
    pub sets: Option<Vec<LightSet>>,
    /// Lights added to those.
    pub user_lights: Vec<UserLight>,
    /// What the file's numbers mean.
    pub units: LightUnits,
    /// Multiplies the file's lights.
    pub scale: f32,
    /// I_a; `None`: what suits the sources.
    pub ambient: Option<Rgb>,
    /// True: an I_a that suits the sources is at least a fifth of their light, so that its
    /// occlusion is seen.
    pub boost_ambient: bool,
    /// Light from all around in place of an even I_a, and of the three-point rig by default.
    pub sky: Option<SkyIrradiance>,
    /// How wide every light is: [`PosedLight::radius`].
    pub radius: f32,
}

impl Default for Lighting {
    fn default() -> Self {
        Lighting {
            sets: None,
            user_lights: Vec::new(),
            units: LightUnits::Auto,
            scale: 1.0,
            ambient: None,
            boost_ambient: false,
            sky: None,
            radius: 0.0,
        }
    }
}

/// The share of the lights that an ambient light to be seen is.
const SHARE: f32 = 0.2;

impl Rig {
    /// A fifth of what the lights send to the middle of the scene, each taken to stand outside it;
    /// white without lights.
    fn share(&self, posed: &PosedScene) -> Rgb {
        let sphere = posed.bounding_sphere();
        let middle = sphere.centre - posed.centre;
        let sent = |light: &PosedLight| match light.position() {
            Some(p) => {
                let r = p.as_dvec3().distance(middle).max(sphere.radius);
                light.intensity * (1.0 / (r * r)) as f32
            }
            None => light.intensity,
        };
        let all: Rgb = self.lights.iter().map(sent).sum();
        if all.is_finite() && all != Rgb::ZERO { all * SHARE } else { Rgb::ONE }
    }
}

/// Blender's default world seen as an ambient colour, for files whose lights are Blender's.
const BLENDER_AMBIENT: f32 = 0.05;

/// How a scene is lit, resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedLighting {
    /// Lights and ambient.
    pub rig: Rig,
    /// Where its lights come from.
    pub sets: Vec<LightSet>,
    /// True where lights of the file take part, in the file's strengths.
    pub uses_file_lights: bool,
    /// True where the ambient colour is Blender's world, beside lights that Blender's exporter wrote
    /// in a unit that is only taken for granted.
    pub assumes_blender_world: bool,
    /// What was used, in words.
    pub description: String,
}

impl Lighting {
    /// The lights for `posed` seen from `camera`.
    pub fn resolve(&self, posed: &PosedScene, camera: &Camera) -> ResolvedLighting {
        let file = posed.lights(self.units, self.scale);
        let mut assumes_blender_world = false;
        let sources = self.sets.clone().unwrap_or_else(|| {
            if !file.is_empty() {
                vec![LightSet::File]
            } else if self.user_lights.is_empty() && self.sky.is_none() {
                vec![LightSet::ThreePoint]
            } else {
                Vec::new()
            }
        });
        let mut rig = Rig::default();
        let mut words = Vec::new();
        let mut uses_file_lights = false;
        for &source in &sources {
            let (added, what) = match source {
                LightSet::File => {
                    uses_file_lights = !file.is_empty();
                    let source = &posed.scene.source;
                    let blender =
                        uses_file_lights && source.format == SourceFormat::Gltf && source.is_blender();
                    let ambient = Rgb::splat(if blender { BLENDER_AMBIENT } else { 0.0 });
                    assumes_blender_world = blender && self.units == LightUnits::Auto;
                    let units = self.units.resolve(source).name();
                    (
                        Rig { lights: file.clone(), ambient, sky: None },
                        format!("{} of the file ({units})", file.len()),
                    )
                }
                LightSet::Headlight => (headlight(camera), "a headlight".to_string()),
                LightSet::ThreePoint => (three_point(camera), "the three-point rig".to_string()),
            };
            rig.lights.extend(added.lights);
            rig.ambient = rig.ambient.max(added.ambient);
            words.push(what);
        }
        for given in &self.user_lights {
            rig.lights.push(match *given {
                UserLight::Point { position, intensity } => {
                    PosedLight::point((position - posed.centre).as_vec3(), intensity)
                }
                UserLight::Sun { direction, intensity } => PosedLight::sun(direction, intensity),
            });
        }
        if !self.user_lights.is_empty() {
            words.push(format!("{} given", self.user_lights.len()));
        }
        let world = Rgb::splat(BLENDER_AMBIENT);
        assumes_blender_world &= self.ambient.is_none() && words.len() == 1 && rig.ambient == world;
        if self.boost_ambient {
            rig.ambient = rig.ambient.max(rig.share(posed));
        }
        rig.ambient = self.ambient.unwrap_or(rig.ambient);
        rig.sky = self.sky;
        for light in &mut rig.lights {
            light.radius = self.radius;
        }
        let mut description = if words.is_empty() { "none".to_string() } else { words.join(", ") };
        if rig.sky.is_some() {
            description += "; ambient by a picture";
        } else if rig.ambient != Rgb::ZERO {
            let [r, g, b] = rig.ambient.to_array();
            description += &format!("; ambient {r:.3},{g:.3},{b:.3}");
        }
        ResolvedLighting { rig, sets: sources, uses_file_lights, assumes_blender_world, description }
    }
}
