//! Point, spot and directional lights: as files describe them, and as the lecture's formula uses them.
//!
//! glTF's lights are those of KHR_lights_punctual and EXT_lights_ies. [`super::LightUnits`] converts their units.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::{LightProfile, Source, SpotCone};
use blinn_core::geometry::{Rgb, concentric_disc, coordinate_system};

/// The type of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Emits in all directions.
    Point,
    /// Emits along its node's −Z within a cone. Half angles are in radians.
    Spot {
        /// Half angle of full intensity.
        inner: f32,
        /// Half angle beyond which the light is 0.
        outer: f32,
    },
    /// Emits parallel light along its node's −Z.
    Directional,
    /// Emits as a luminaire was measured, aimed along its node's −Z.
    Photometric {
        /// Index in [`super::Scene::light_profiles`].
        profile: u32,
    },
}

impl LightKind {
    /// Returns the name of the type.
    pub fn name(self) -> &'static str {
        match self {
            LightKind::Point => "point",
            LightKind::Spot { .. } => "spot",
            LightKind::Directional => "directional",
            LightKind::Photometric { .. } => "photometric",
        }
    }

    /// Returns the posed light at `position`, for a node with the linear transform `node`. The cone of a
    /// spot light depends on `source`: Blender's cones scale with their node. `profiles` are those of the scene.
    pub fn pose(
        self,
        position: Vec3,
        node: &DMat3,
        source: &Source,
        profiles: &[Arc<LightProfile>],
    ) -> PosedLightKind {
        let direction = (-node.z_axis).normalize_or(DVec3::NEG_Z).as_vec3();
        match self {
            LightKind::Point => PosedLightKind::Point { position },
            LightKind::Spot { inner, outer } if source.is_blender() => {
                let cone = SpotCone::blender(inner, outer);
                PosedLightKind::Spot { position, direction, cone, world_to_cone: world_to_cone(node) }
            }
            LightKind::Spot { inner, outer } => {
                let cone = SpotCone::new(inner, outer);
                PosedLightKind::Spot { position, direction, cone, world_to_cone: None }
            }
            LightKind::Directional => PosedLightKind::Directional { direction },
            LightKind::Photometric { profile } => match profiles.get(profile as usize) {
                Some(profile) => PosedLightKind::Photometric {
                    position,
                    world_to_light: unscaled(node).transpose(),
                    profile: profile.clone(),
                },
                None => PosedLightKind::Point { position },
            },
        }
    }
}

/// A light of the file. The scale of its node does not change its intensity.
#[derive(Clone, Debug)]
pub struct Light {
    /// Name in the file.
    pub name: String,
    /// Node that places it.
    pub node: u32,
    /// Type.
    pub kind: LightKind,
    /// Linear colour.
    pub color: Rgb,
    /// Intensity in the file's unit; see [`super::LightUnits`]. Of photometric lights, the factor of the profile.
    pub intensity: f32,
    /// Distance at which the light ends, in metres; infinite where the file gives none.
    pub range: f32,
    /// Radius of the light, as in [`PosedLight::radius`]; 0 where the file gives none.
    pub radius: f32,
}

/// Returns the rotation of a node, with its mirror image if it has one, without scale and shear.
fn unscaled(node: &DMat3) -> DMat3 {
    let z = node.z_axis.normalize_or(DVec3::Z);
    let (any_x, any_y) = coordinate_system(z);
    let x = node.x_axis.reject_from_normalized(z).normalize_or(any_x);
    let y = node.y_axis.reject_from_normalized(z).reject_from_normalized(x);
    let y = if y == DVec3::ZERO || !y.is_finite() { any_y.reject_from_normalized(x) } else { y };
    DMat3::from_cols(x, y.normalize_or(z.cross(x)), z)
}

/// Returns the inverse of a node's linear transform if it is more than a rotation and a uniform scale.
fn world_to_cone(node: &DMat3) -> Option<DMat3> {
    let squares = node.transpose() * *node;
    let even = DMat3::IDENTITY * squares.x_axis.x;
    // Values in files have a relative precision of about 1e-7.
    let is_even = squares.abs_diff_eq(even, 1e-5 * squares.x_axis.x);
    Some(node.inverse()).filter(|inverse| !is_even && inverse.is_finite())
}

/// The type of a posed light. Positions are relative to the posed scene's centre.
#[derive(Clone, Debug, PartialEq)]
pub enum PosedLightKind {
    /// A point light.
    Point {
        /// Position.
        position: Vec3,
    },
    /// A spot light.
    Spot {
        /// Position.
        position: Vec3,
        /// Direction in which the light travels, unit length.
        direction: Vec3,
        /// Falloff with the angle.
        cone: SpotCone,
        /// Maps world directions to the space where the cone is round about −Z. `None` if that is
        /// world space.
        world_to_cone: Option<DMat3>,
    },
    /// A light at infinity.
    Directional {
        /// Direction in which the light travels, unit length.
        direction: Vec3,
    },
    /// A light with the intensities of a measured luminaire.
    Photometric {
        /// Position.
        position: Vec3,
        /// Maps world directions to the space of the profile, orthogonal.
        world_to_light: DMat3,
        /// Intensities by direction; the light's intensity is their peak.
        profile: Arc<LightProfile>,
    },
}

/// A light in the lecture's terms: I/r², or a constant irradiance E for directional lights.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedLight {
    /// Type and position.
    pub kind: PosedLightKind,
    /// The lecture's I with colour; E for directional lights.
    pub intensity: Rgb,
    /// Distance at which the light ends; infinite for no limit.
    pub range: f32,
    /// Radius of the light: in metres, or for directional lights the tangent of half the angle that it
    /// subtends. 0 is a point light with hard shadows.
    pub radius: f32,
}

/// A light seen from a point, without occlusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction to the light. f64, because narrow highlights magnify its rounding error.
    pub l: DVec3,
    /// Factor of [`PosedLight::intensity`]: 1/r² with cone and range; 1 for directional lights.
    pub attenuation: f32,
}

impl PosedLight {
    /// Returns a point light with the lecture's intensity I.
    pub fn point(position: Vec3, intensity: Rgb) -> PosedLight {
        PosedLight { kind: PosedLightKind::Point { position }, intensity, range: f32::INFINITY, radius: 0.0 }
    }

    /// Returns a directional light that travels along `direction`, with irradiance E.
    pub fn sun(direction: DVec3, intensity: Rgb) -> PosedLight {
        let direction = direction.normalize_or(DVec3::NEG_Y).as_vec3();
        PosedLight {
            kind: PosedLightKind::Directional { direction },
            intensity,
            range: f32::INFINITY,
            radius: 0.0,
        }
    }

    /// Returns the light's position; `None` for directional lights.
    pub fn position(&self) -> Option<Vec3> {
        match self.kind {
            PosedLightKind::Point { position }
            | PosedLightKind::Spot { position, .. }
            | PosedLightKind::Photometric { position, .. } => Some(position),
            PosedLightKind::Directional { .. } => None,
        }
    }

    /// Returns this light moved by a rigid motion, in a scene with that centre.
    pub fn transformed(&self, motion: &DAffine3, centre: DVec3) -> PosedLight {
        let moved_point = |p: Vec3| (motion.transform_point3(p.as_dvec3() + centre) - centre).as_vec3();
        let moved_dir = |d: Vec3| (motion.matrix3 * d.as_dvec3()).as_vec3();
        let kind = match self.kind {
            PosedLightKind::Point { position } => PosedLightKind::Point { position: moved_point(position) },
            PosedLightKind::Photometric { position, world_to_light, ref profile } => {
                PosedLightKind::Photometric {
                    position: moved_point(position),
                    world_to_light: world_to_light * motion.matrix3.transpose(),
                    profile: profile.clone(),
                }
            }
            PosedLightKind::Spot { position, direction, cone, world_to_cone } => {
                let world_to_cone =
                    world_to_cone.map(|world_to_cone| world_to_cone * motion.matrix3.transpose());
                PosedLightKind::Spot {
                    position: moved_point(position),
                    direction: moved_dir(direction),
                    cone,
                    world_to_cone,
                }
            }
            PosedLightKind::Directional { direction } => {
                PosedLightKind::Directional { direction: moved_dir(direction) }
            }
        };
        PosedLight { kind, ..*self }
    }

    /// Returns the offset from the light's centre to point `u` of the disc that it shows towards the
    /// direction `l`. For a directional light, the offset is added to `l`.
    #[inline(always)]
    pub fn disc_offset(&self, l: DVec3, u: [f32; 2]) -> DVec3 {
        let at = concentric_disc(u) * f64::from(self.radius);
        let (a, b) = coordinate_system(l);
        a * at.x + b * at.y
    }

    /// Returns the light prepared for evaluation at many points.
    #[inline]
    pub fn light_eval(&self) -> LightEval<'_> {
        let local = |position: Vec3, axis: Vec3, cone| LocalLight {
            position: position.as_dvec3(),
            axis: axis.as_dvec3(),
            cone,
            inv_range: 1.0 / f64::from(self.range),
        };
        match self.kind {
            PosedLightKind::Directional { direction } => {
                LightEval::Directional(-direction.as_dvec3().normalize())
            }
            PosedLightKind::Point { position } => {
                LightEval::Local(local(position, Vec3::ZERO, SpotCone::NONE))
            }
            PosedLightKind::Photometric { position, world_to_light, ref profile } => {
                let light = local(position, Vec3::ZERO, SpotCone::NONE);
                LightEval::Photometric(light, world_to_light, profile)
            }
            PosedLightKind::Spot { position, direction, cone, world_to_cone } => {
                let spot = local(position, direction, cone);
                world_to_cone.map_or(LightEval::Local(spot), |world_to_cone| {
                    LightEval::ScaledSpot(spot, world_to_cone)
                })
            }
        }
    }

    /// Returns the light seen from `p`. For many points, prepare [`PosedLight::light_eval`] once.
    pub fn sample(&self, p: Vec3) -> LightSample {
        self.light_eval().sample(p)
    }
}

/// A light prepared for evaluation at many points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightEval<'a> {
    /// A directional light, by the unit vector towards it. It has no falloff.
    Directional(DVec3),
    /// A point light, or a spot light with a round cone.
    Local(LocalLight),
    /// A spot light whose cone is scaled by its node, with the matrix from world to cone space.
    ScaledSpot(LocalLight, DMat3),
    /// A photometric light, with the matrix from world to the profile's space.
    Photometric(LocalLight, DMat3, &'a LightProfile),
}

impl LightEval<'_> {
    /// Returns the light seen from `p`.
    fn sample(&self, p: Vec3) -> LightSample {
        match *self {
            LightEval::Directional(l) => LightSample { l, attenuation: 1.0 },
            LightEval::Local(light) => light.sample(p),
            LightEval::ScaledSpot(light, world_to_cone) => light.sample_in_cone_frame(p, &world_to_cone),
            LightEval::Photometric(light, world_to_light, profile) => {
                light.sample_profile(p, &world_to_light, profile)
            }
        }
    }
}

/// A light at a position, prepared for evaluation at many points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalLight {
    position: DVec3,
    axis: DVec3,
    cone: SpotCone,
    inv_range: f64,
}

impl LocalLight {
    /// Returns the unit vector from `p` to the light, and the attenuation there: 1/r², cone and range. The
    /// attenuation is 0 at the position of the light, where the direction is undefined.
    ///
    /// Branch-free, so that loops over points vectorise.
    #[inline(always)]
    pub fn sample(&self, p: Vec3) -> LightSample {
        self.attenuate(p, |l| self.cone.falloff(-l.dot(self.axis) as f32))
    }

    /// Samples the light like [`LocalLight::sample`], with the cone in the space of `world_to_cone`.
    #[inline(always)]
    pub fn sample_in_cone_frame(&self, p: Vec3, world_to_cone: &DMat3) -> LightSample {
        self.attenuate(p, |l| {
            let l = *world_to_cone * l;
            self.cone.falloff((l.z / l.length()) as f32)
        })
    }

    /// Samples the light like [`LocalLight::sample`], with the intensities of `profile` in the space of
    /// `world_to_light`.
    #[inline(always)]
    pub fn sample_profile(&self, p: Vec3, world_to_light: &DMat3, profile: &LightProfile) -> LightSample {
        self.attenuate(p, |l| profile.relative_intensity(*world_to_light * -l))
    }

    /// Attenuates by distance, range and `strength`, the relative intensity by the direction to the light.
    #[inline(always)]
    fn attenuate(&self, p: Vec3, strength: impl Fn(DVec3) -> f32) -> LightSample {
        let to_light = self.position - p.as_dvec3();
        let r2 = to_light.length_squared();
        let r = r2.sqrt();
        // Divisions and square roots dominate the cost.
        let inv_r = 1.0 / r;
        let l = to_light * inv_r;
        let q = r * self.inv_range;
        let q2 = q * q;
        let window = (1.0 - q2 * q2).clamp(0.0, 1.0) as f32;
        let strength = strength(l) * window;
        let attenuation = (f64::from(strength) * inv_r * inv_r) as f32;
        LightSample { l, attenuation: if r2 > 0.0 { attenuation } else { 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Red irradiance, I/r², at a point.
    fn irradiance(light: &PosedLight, p: Vec3) -> f32 {
        light.intensity.x * light.sample(p).attenuation
    }

    /// Cycles evaluates the cone in the light's local space, sheared or not.
    #[test]
    fn cones_of_blender_scale_with_their_nodes() {
        let blender = Source { generator: "Khronos glTF Blender I/O v5.0.21".into(), ..Source::default() };
        let turn = DMat3::from_rotation_x(0.3);
        let spot = LightKind::Spot { inner: 0.3, outer: 0.5 };
        let points = || (0..400).map(|i| Vec3::new((i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5, -9.0));
        for (scale, scaled) in
            [(DVec3::new(1.0, 2.0, 0.7), true), (DVec3::new(2.0, -2.0, 2.0), false), (DVec3::X, false)]
        {
            for node in [turn * DMat3::from_diagonal(scale), DMat3::from_diagonal(scale) * turn] {
                let light = |source| PosedLight {
                    kind: spot.pose(Vec3::ZERO, &node, source, &[]),
                    ..PosedLight::point(Vec3::ZERO, Vec3::ONE)
                };
                let (light, round) = (light(&blender), light(&Source::default()));
                let is_scaled = |light: &PosedLight| matches!(light.light_eval(), LightEval::ScaledSpot(..));
                assert!(is_scaled(&light) == scaled && !is_scaled(&round), "{scale}");
                let motion = DAffine3::from_rotation_y(0.8);
                let lit = points().filter(|&p| irradiance(&light, p) > 0.0).count();
                assert!((10..390).contains(&lit) || !scaled, "{node}: {lit}");
                for p in points().filter(|_| scaled) {
                    let local = (node.inverse() * p.as_dvec3()).normalize();
                    let cone = SpotCone::blender(0.3, 0.5);
                    let expected = cone.falloff(-local.z as f32) / p.length_squared();
                    assert!((irradiance(&light, p) - expected).abs() < 1e-6, "{node} {p}");
                    let moved = motion.transform_point3(p.as_dvec3()).as_vec3();
                    assert!(
                        (irradiance(&light.transformed(&motion, DVec3::ZERO), moved) - expected).abs() < 1e-6,
                        "{node} {p}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_light_ends_at_its_range() {
        let mut light = PosedLight::point(Vec3::ZERO, Vec3::ONE);
        light.range = 2.0;
        let at = |x| irradiance(&light, Vec3::new(x, 0.0, 0.0));
        assert_eq!(at(1.0), 1.0 - 1.0 / 16.0);
        assert_eq!((at(2.0), at(3.0)), (0.0, 0.0));
    }
}
