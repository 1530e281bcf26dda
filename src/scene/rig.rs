//! Lights for scenes that bring none, fixed to the camera.

use glam::DVec3;

use super::{Camera, Format, LightUnits, PosedLight, PosedScene, Sky};
use crate::geometry::Rgb;

/// Lights with the ambient colour that goes with them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// The lights.
    pub lights: Vec<PosedLight>,
    /// I_a.
    pub ambient: Rgb,
    /// An I_a for every direction, in place of the even one.
    pub sky: Option<Sky>,
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
pub enum LightSource {
    /// The file's lights.
    File,
    /// A dim light at the camera.
    Headlight,
    /// Key, fill and rim, fixed to the camera.
    ThreePoint,
}

/// A light in world coordinates with the lecture's own strength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GivenLight {
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
    pub sources: Option<Vec<LightSource>>,
    /// Lights added to those.
    pub given: Vec<GivenLight>,
    /// What the file's numbers mean.
    pub units: LightUnits,
    /// Multiplies the file's lights.
    pub scale: f32,
    /// I_a; `None`: what suits the sources.
    pub ambient: Option<Rgb>,
    /// True: an I_a that suits the sources is at least a fifth of their light, so that its
    /// occlusion is seen.
    pub plain_ambient: bool,
    /// Light from all around in place of an even I_a, and of the three-point rig by default.
    pub sky: Option<Sky>,
    /// How wide every light is: [`PosedLight::radius`].
    pub radius: f32,
}

impl Default for Lighting {
    fn default() -> Self {
        Lighting {
            sources: None,
            given: Vec::new(),
            units: LightUnits::Auto,
            scale: 1.0,
            ambient: None,
            plain_ambient: false,
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
pub struct Lit {
    /// Lights and ambient.
    pub rig: Rig,
    /// Where its lights come from.
    pub sources: Vec<LightSource>,
    /// True where lights of the file take part, in the file's strengths.
    pub by_file: bool,
    /// True where the ambient colour is Blender's world, beside lights that Blender's exporter wrote
    /// in a unit that is only taken for granted.
    pub assumed: bool,
    /// What was used, in words.
    pub note: String,
}

impl Lighting {
    /// The lights for `posed` seen from `camera`.
    pub fn resolve(&self, posed: &PosedScene, camera: &Camera) -> Lit {
        let file = posed.lights(self.units, self.scale);
        let mut assumed = false;
        let sources = self.sources.clone().unwrap_or_else(|| {
            if !file.is_empty() {
                vec![LightSource::File]
            } else if self.given.is_empty() && self.sky.is_none() {
                vec![LightSource::ThreePoint]
            } else {
                Vec::new()
            }
        });
        let mut rig = Rig::default();
        let mut words = Vec::new();
        let mut by_file = false;
        for &source in &sources {
            let (added, what) = match source {
                LightSource::File => {
                    by_file = !file.is_empty();
                    let source = &posed.scene.source;
                    let blender = by_file && source.format == Format::Gltf && source.is_blender();
                    let ambient = Rgb::splat(if blender { BLENDER_AMBIENT } else { 0.0 });
                    assumed = blender && self.units == LightUnits::Auto;
                    let units = self.units.resolve(source).name();
                    (
                        Rig { lights: file.clone(), ambient, sky: None },
                        format!("{} of the file ({units})", file.len()),
                    )
                }
                LightSource::Headlight => (headlight(camera), "a headlight".to_string()),
                LightSource::ThreePoint => (three_point(camera), "the three-point rig".to_string()),
            };
            rig.lights.extend(added.lights);
            rig.ambient = rig.ambient.max(added.ambient);
            words.push(what);
        }
        for given in &self.given {
            rig.lights.push(match *given {
                GivenLight::Point { position, intensity } => {
                    PosedLight::point((position - posed.centre).as_vec3(), intensity)
                }
                GivenLight::Sun { direction, intensity } => PosedLight::sun(direction, intensity),
            });
        }
        if !self.given.is_empty() {
            words.push(format!("{} given", self.given.len()));
        }
        let world = Rgb::splat(BLENDER_AMBIENT);
        assumed &= self.ambient.is_none() && words.len() == 1 && rig.ambient == world;
        if self.plain_ambient {
            rig.ambient = rig.ambient.max(rig.share(posed));
        }
        rig.ambient = self.ambient.unwrap_or(rig.ambient);
        rig.sky = self.sky;
        for light in &mut rig.lights {
            light.radius = self.radius;
        }
        let mut note = if words.is_empty() { "none".to_string() } else { words.join(", ") };
        if rig.sky.is_some() {
            note += "; ambient by a picture";
        } else if rig.ambient != Rgb::ZERO {
            let [r, g, b] = rig.ambient.to_array();
            note += &format!("; ambient {r:.3},{g:.3},{b:.3}");
        }
        Lit { rig, sources, by_file, assumed, note }
    }
}
