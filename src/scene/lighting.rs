//! Lighting settings, and their resolution to the lights and the ambient term of a frame.

use glam::DVec3;

use super::{
    AreaLightShape, Camera, Environment, LightUnits, PosedAreaLight, PosedLight, PosedScene, Rig,
    SourceFormat, headlight, studio_before, three_point,
};
use blinn_core::geometry::Rgb;

/// A set of lights to render with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum LightSet {
    /// The file's lights, and its surfaces that glow brighter than white.
    File,
    /// A dim light at the camera.
    Headlight,
    /// Key, fill and rim light, fixed to the camera.
    ThreePoint,
}

/// A light given by the user, in world coordinates and the lecture's units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum UserLight {
    /// A point light.
    Point {
        /// Position in world coordinates.
        position: DVec3,
        /// The lecture's I.
        intensity: Rgb,
    },
    /// A directional light.
    Sun {
        /// Direction in which the light travels.
        direction: DVec3,
        /// Irradiance E.
        intensity: Rgb,
    },
    /// A rectangle that emits on one side.
    Area {
        /// Centre in world coordinates.
        position: DVec3,
        /// Direction in which the light travels. The lower edge is horizontal.
        direction: DVec3,
        /// Width and height in metres.
        size: [f32; 2],
        /// Emitted radiance.
        radiance: Rgb,
    },
}

/// The requested lighting of a scene.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Lighting {
    /// Light sets. `None` uses the file's lights, else the user's, else the three-point rig.
    pub sets: Option<Vec<LightSet>>,
    /// True if the file's glowing surfaces are among its lights; `None`: if some are brighter than white.
    pub glowing_surfaces: Option<bool>,
    /// Lights added to the sets.
    pub user_lights: Vec<UserLight>,
    /// Units of the file's lights.
    pub units: LightUnits,
    /// Multiplies the intensities of the file's lights.
    pub scale: f32,
    /// I_a. `None` uses the ambient term of the light sets.
    pub ambient: Option<Rgb>,
    /// Raises the ambient term of the light sets to at least a fifth of their light, so that ambient
    /// occlusion is visible.
    pub boost_ambient: bool,
    /// An environment in place of a constant I_a, also for specular lobes. It also replaces the default three-point rig.
    /// `None` uses the file's with the file's lights, unless there is an I_a; else the studio of the three-point rig is
    /// reflected, else the constant I_a.
    pub environment: Option<Environment>,
    /// True if the file's environment is in use; `None`: with the file's lights, unless there is an I_a or another environment.
    pub file_environment: Option<bool>,
    /// Turns the environment about +Y, in radians: +Z turns towards +X.
    pub environment_rotation: f64,
    /// Multiplies the radiance of the environment.
    pub environment_strength: f32,
    /// Radius of every light: [`PosedLight::radius`]. `None` uses the radii of the file's lights, and 0 for others.
    pub radius: Option<f32>,
}

impl Default for Lighting {
    fn default() -> Self {
        Lighting {
            sets: None,
            glowing_surfaces: None,
            user_lights: Vec::new(),
            units: LightUnits::Auto,
            scale: 1.0,
            ambient: None,
            boost_ambient: false,
            environment: None,
            file_environment: None,
            environment_rotation: 0.0,
            environment_strength: 1.0,
            radius: None,
        }
    }
}

/// The lights and the ambient term of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedLighting {
    /// Lights and ambient term.
    pub rig: Rig,
    /// The light sets in use.
    pub sets: Vec<LightSet>,
    /// True if lights of the file are in use, with the file's intensities.
    pub uses_file_lights: bool,
    /// True if the file's environment is in use.
    pub uses_file_environment: bool,
    /// True if the ambient term is Blender's default world, beside lights from Blender's exporter in an
    /// assumed unit.
    pub assumes_blender_world: bool,
    /// Describes the lights, for the log.
    pub description: String,
}

/// Ambient term of Blender's default world, for files with Blender's lights.
const BLENDER_AMBIENT: f32 = 0.05;
/// Share of the lights that a boosted ambient term has.
const BOOSTED_AMBIENT_SHARE: f32 = 0.2;

impl Rig {
    /// Returns the boosted ambient term: a fifth of the light that arrives at the centre of the scene,
    /// with every light outside the bounding sphere; white without lights.
    fn boosted_ambient(&self, posed: &PosedScene) -> Rgb {
        let sphere = posed.bounding_sphere();
        let centre = sphere.centre - posed.centre;
        let irradiance = |light: &PosedLight| match light.position() {
            Some(p) => {
                let r = p.as_dvec3().distance(centre).max(sphere.radius);
                light.intensity * (1.0 / (r * r)) as f32
            }
            None => light.intensity,
        };
        // A surface of radiance L and area A has the intensity L·A/π along its normal.
        let area_irradiance = |light: &PosedAreaLight| {
            let r = light.centre.as_dvec3().distance(centre).max(sphere.radius);
            light.radiance * (f64::from(light.area()) / (std::f64::consts::PI * r * r)) as f32
        };
        let glow = if self.glowing_surfaces { posed.glowing_irradiance() as f32 } else { 0.0 };
        let sum: Rgb = self.lights.iter().map(irradiance).sum::<Rgb>()
            + self.area_lights.iter().map(area_irradiance).sum::<Rgb>()
            + Rgb::splat(glow);
        if sum.is_finite() && sum != Rgb::ZERO { sum * BOOSTED_AMBIENT_SHARE } else { Rgb::ONE }
    }
}

impl Lighting {
    /// Returns true if a rotation or a strength of the environment is requested.
    pub fn adjusts_environment(&self) -> bool {
        self.environment_rotation != 0.0 || self.environment_strength != 1.0
    }

    /// Returns the lights for `posed` seen from `camera`.
    pub fn resolve(&self, posed: &PosedScene, camera: &Camera) -> ResolvedLighting {
        let file_lights = posed.lights(self.units, self.scale);
        let file_area_lights = posed.area_lights(self.units, self.scale);
        let has_visible_lights = !(file_lights.is_empty() && file_area_lights.is_empty());
        let uses_file = has_visible_lights || posed.switches_lights();
        let has_file_environment = posed.environment.is_some();
        let sets = self.sets.clone().unwrap_or_else(|| {
            self.default_sets(uses_file || has_file_environment || posed.is_lit_by_glowing_surfaces())
        });
        let glows = sets.contains(&LightSet::File)
            && self.glowing_surfaces.unwrap_or_else(|| posed.has_glowing_lights());
        let source = &posed.scene.source;
        let blender = (uses_file || glows) && source.format == SourceFormat::Gltf && source.is_blender();
        let mut rig = Rig::default();
        let mut parts = Vec::new();
        let mut uses_file_lights = false;
        let mut assumes_blender_world = false;
        for &set in &sets {
            let (added, part) = match set {
                LightSet::File => {
                    uses_file_lights = uses_file;
                    assumes_blender_world = uses_file
                        && blender
                        && self.units == LightUnits::Auto
                        && source.light_units.is_none();
                    let ambient = Rgb::splat(if blender { BLENDER_AMBIENT } else { 0.0 });
                    let units = self.units.resolve(source).name();
                    let count = file_lights.len() + file_area_lights.len();
                    let part = match (count, glows) {
                        (0, true) => "glowing surfaces of the file".to_string(),
                        (_, true) => format!("{count} from the file ({units}) and its glowing surfaces"),
                        (_, false) => format!("{count} from the file ({units})"),
                    };
                    let (lights, area_lights) = (file_lights.clone(), file_area_lights.clone());
                    (Rig { lights, area_lights, glowing_surfaces: glows, ambient, ..Rig::default() }, part)
                }
                LightSet::Headlight => (headlight(camera), "a headlight".to_string()),
                LightSet::ThreePoint => (three_point(camera), "the three-point rig".to_string()),
            };
            rig.lights.extend(added.lights);
            rig.area_lights.extend(added.area_lights);
            rig.glowing_surfaces |= added.glowing_surfaces;
            rig.ambient = rig.ambient.max(added.ambient);
            parts.push(part);
        }
        for light in &self.user_lights {
            light.add_to(&mut rig, posed.centre);
        }
        if !self.user_lights.is_empty() {
            parts.push(format!("{} given", self.user_lights.len()));
        }
        let blender_world = Rgb::splat(BLENDER_AMBIENT);
        assumes_blender_world &= self.ambient.is_none() && parts.len() == 1 && rig.ambient == blender_world;
        if self.boost_ambient {
            rig.ambient = rig.ambient.max(rig.boosted_ambient(posed));
        }
        rig.ambient = self.ambient.unwrap_or(rig.ambient);
        let is_unset = self.environment.is_none() && self.ambient.is_none() && sets.contains(&LightSet::File);
        let uses_file_environment = has_file_environment && self.file_environment.unwrap_or(is_unset);
        let source = if uses_file_environment { &posed.environment } else { &self.environment };
        let environment = source.clone().map(|environment| self.adjust(environment));
        rig.sky = environment.as_ref().map(Environment::ambient_irradiance);
        rig.environment = if environment.is_some() {
            environment
        } else if sets.contains(&LightSet::ThreePoint) {
            // Matte scenes need none, and the studio takes longer to make than a small picture.
            posed.has_reflecting_materials.then(|| studio_before(camera))
        } else {
            (rig.ambient != Rgb::ZERO).then(|| Environment::uniform(rig.ambient))
        };
        if let Some(radius) = self.radius {
            rig.lights.iter_mut().for_each(|light| light.radius = radius);
        }
        let description = describe(&parts, &rig);
        ResolvedLighting {
            rig,
            sets,
            uses_file_lights,
            uses_file_environment,
            assumes_blender_world,
            description,
        }
    }

    /// Returns the environment with the requested rotation and strength.
    fn adjust(&self, environment: Environment) -> Environment {
        let strength = Rgb::splat(self.environment_strength);
        environment.scaled(strength).rotated_about_y(self.environment_rotation)
    }

    /// Returns the light sets where none are requested.
    fn default_sets(&self, file_has_light: bool) -> Vec<LightSet> {
        if file_has_light {
            vec![LightSet::File]
        } else if self.user_lights.is_empty() && self.environment.is_none() {
            vec![LightSet::ThreePoint]
        } else {
            Vec::new()
        }
    }
}

impl UserLight {
    /// Adds the light to a rig, in a scene with that centre.
    fn add_to(&self, rig: &mut Rig, centre: DVec3) {
        match *self {
            UserLight::Point { position, intensity } => {
                rig.lights.push(PosedLight::point((position - centre).as_vec3(), intensity));
            }
            UserLight::Sun { direction, intensity } => {
                rig.lights.push(PosedLight::sun(direction, intensity));
            }
            UserLight::Area { position, direction, size, radiance } => {
                let (shape, position) = (AreaLightShape::Rect, position - centre);
                rig.area_lights.extend(PosedAreaLight::facing(shape, size, position, direction, radiance));
            }
        }
    }
}

/// Describes lights and ambient term, for the log.
fn describe(parts: &[String], rig: &Rig) -> String {
    let mut text = if parts.is_empty() { "none".to_string() } else { parts.join(", ") };
    if rig.sky.is_some() {
        text += "; ambient light from an environment";
    } else if rig.ambient != Rgb::ZERO {
        let [r, g, b] = rig.ambient.to_array();
        text += &format!("; ambient {r:.3},{g:.3},{b:.3}");
    }
    text
}
