//! Lights: as files give them, and as the lecture's formula wants them.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::Source;
use crate::geometry::{Rgb, concentric_disc, coordinate_system};

/// What a light does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Shines to all sides.
    Point,
    /// Shines down its node's −Z within a cone; half angles in radians.
    Spot {
        /// Full strength up to here.
        inner: f32,
        /// Nothing beyond here.
        outer: f32,
    },
    /// Parallel light down its node's −Z.
    Directional,
}

impl LightKind {
    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            LightKind::Point => "point",
            LightKind::Spot { .. } => "spot",
            LightKind::Directional => "directional",
        }
    }

    /// The same at a place, at a node that turns and scales as `node` does. A spot's cone is what `source`
    /// means by it: Blender's scales with its node.
    pub fn pose(self, position: Vec3, node: &DMat3, source: &Source) -> PosedLightKind {
        let direction = (-node.z_axis).normalize_or(DVec3::NEG_Z).as_vec3();
        match self {
            LightKind::Point => PosedLightKind::Point { position },
            LightKind::Spot { inner, outer } if source.is_blender() => {
                let cone = SpotCone::blender(inner, outer);
                PosedLightKind::Spot { position, direction, cone, to_round: to_round(node) }
            }
            LightKind::Spot { inner, outer } => {
                let cone = SpotCone::new(inner, outer);
                PosedLightKind::Spot { position, direction, cone, to_round: None }
            }
            LightKind::Directional => PosedLightKind::Directional { direction },
        }
    }
}

/// A light of the file, at a node. Node scale never changes its strength.
#[derive(Clone, Debug)]
pub struct Light {
    /// Its name.
    pub name: String,
    /// The node that places it.
    pub node: u32,
    /// What it does.
    pub kind: LightKind,
    /// Linear colour.
    pub color: Rgb,
    /// Strength in the file's own unit; see [`LightUnits`].
    pub intensity: f32,
    /// Distance at which it ends; infinite where the file gives none.
    pub range: f32,
}

/// What the numbers in a file's lights mean. The lecture's k_d carries no 1/π, so physical lights
/// enter divided by π: then k_d·(I/r²)·n·l is the radiance ρ/π·E of physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LightUnits {
    /// `Standard` for files by Blender, `Unitless` for others.
    #[default]
    Auto,
    /// Candela and lux: v/(683π).
    Standard,
    /// W/sr and W/m²: v/π.
    Unitless,
    /// Blender's watts: point and spot v/(4π²), sun v/π.
    Raw,
}

impl LightUnits {
    /// What `Auto` stands for in a file from `source`.
    pub fn resolve(self, source: &Source) -> LightUnits {
        match self {
            LightUnits::Auto if source.is_blender() => LightUnits::Standard,
            LightUnits::Auto => LightUnits::Unitless,
            given => given,
        }
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            LightUnits::Auto => "auto",
            LightUnits::Standard => "standard",
            LightUnits::Unitless => "unitless",
            LightUnits::Raw => "raw",
        }
    }

    /// What a file's number is multiplied by to give the lecture's I (or E for a sun).
    pub fn factor(self, kind: LightKind) -> f32 {
        use std::f64::consts::PI;
        let factor = match (self, kind) {
            (LightUnits::Standard, _) => 1.0 / (683.0 * PI),
            (LightUnits::Raw, LightKind::Point | LightKind::Spot { .. }) => 1.0 / (4.0 * PI * PI),
            _ => 1.0 / PI,
        };
        factor as f32
    }
}

/// A spot light's cone, and how its light ends there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCone {
    /// Cosine of the half angle beyond which nothing arrives.
    pub cos_outer: f32,
    /// From how much more of a cosine on everything does.
    pub width: f32,
    /// What arrives from s of that on is s²(from[0] + from[1]·s).
    from: [f32; 2],
}

impl SpotCone {
    /// KHR_lights_punctual's, from half angles in radians: the square of the cosine's way.
    pub fn new(inner: f32, outer: f32) -> SpotCone {
        let cos_outer = libm::cosf(outer);
        SpotCone { cos_outer, width: libm::cosf(inner) - cos_outer, from: [1.0, 0.0] }
    }

    /// Blender's, from the half angles that it writes: `inner` is the part of `outer` that is no blend. The
    /// cosine's way goes over that part of all that there is within the cone, and is smoothed at both ends.
    pub fn blender(inner: f32, outer: f32) -> SpotCone {
        let cos_outer = libm::cosf(outer);
        let blend = if outer > 0.0 { 1.0 - inner / outer } else { 0.0 };
        SpotCone { cos_outer, width: (1.0 - cos_outer) * blend, from: [3.0, -2.0] }
    }

    /// All around.
    const NONE: SpotCone = SpotCone { cos_outer: -2.0, width: 0.0, from: [1.0, 0.0] };

    /// How much arrives at an angle of that cosine from the axis. Equal angles are a step, as Blender
    /// writes them.
    #[inline(always)]
    pub fn falloff(&self, cos_angle: f32) -> f32 {
        let step = if cos_angle >= self.cos_outer { 1.0 } else { 0.0 };
        let s = ((cos_angle - self.cos_outer) / self.width).clamp(0.0, 1.0);
        if self.width <= 0.0 { step } else { s * s * (self.from[0] + self.from[1] * s) }
    }
}

/// The inverse of what a node does, where that is more than to turn and to scale evenly.
fn to_round(node: &DMat3) -> Option<DMat3> {
    let squares = node.transpose() * *node;
    let even = DMat3::IDENTITY * squares.x_axis.x;
    // Numbers of a file are right to some 1e-7.
    let is_even = squares.abs_diff_eq(even, 1e-5 * squares.x_axis.x);
    Some(node.inverse()).filter(|inverse| !is_even && inverse.is_finite())
}

/// Where a posed light is. Positions are relative to the posed scene's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PosedLightKind {
    /// At a position.
    Point {
        /// Where it is.
        position: Vec3,
    },
    /// At a position, within a cone.
    Spot {
        /// Where it is.
        position: Vec3,
        /// The way its light travels, unit length.
        direction: Vec3,
        /// Its cone.
        cone: SpotCone,
        /// Takes directions of the world to where the cone is round about −Z. `None` where it is in the world.
        to_round: Option<DMat3>,
    },
    /// Far away.
    Directional {
        /// The way its light travels, unit length.
        direction: Vec3,
    },
}

/// A light as the lecture uses it: I over r², or E without falloff.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedLight {
    /// Where it is.
    pub kind: PosedLightKind,
    /// The lecture's I, coloured; E for directional lights.
    pub intensity: Rgb,
    /// Distance at which it ends; infinite for none.
    pub range: f32,
    /// How wide it is: metres for lights at a position, the tangent of half the angle it is seen
    /// under for a sun. 0 is a point, whose shadows are sharp.
    pub radius: f32,
}

/// A light seen from a point, if nothing blocks it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction to the light. In f64, because narrow highlights magnify rounding errors.
    pub l: DVec3,
    /// Factor of [`PosedLight::intensity`]: 1/r² with cone and range; 1 for directional lights.
    pub attenuation: f32,
}

impl PosedLight {
    /// A point light of the lecture's intensity I.
    pub fn point(position: Vec3, intensity: Rgb) -> PosedLight {
        PosedLight { kind: PosedLightKind::Point { position }, intensity, range: f32::INFINITY, radius: 0.0 }
    }

    /// A sun whose light travels along `direction` and arrives with E.
    pub fn sun(direction: DVec3, intensity: Rgb) -> PosedLight {
        let direction = direction.normalize_or(DVec3::NEG_Y).as_vec3();
        PosedLight {
            kind: PosedLightKind::Directional { direction },
            intensity,
            range: f32::INFINITY,
            radius: 0.0,
        }
    }

    /// The light's position; `None` for directional lights.
    pub fn position(&self) -> Option<Vec3> {
        match self.kind {
            PosedLightKind::Point { position } | PosedLightKind::Spot { position, .. } => Some(position),
            PosedLightKind::Directional { .. } => None,
        }
    }

    /// This light, in a scene with that centre, moved by a rotation and a shift.
    pub fn transformed(&self, motion: &DAffine3, centre: DVec3) -> PosedLight {
        let place = |p: Vec3| (motion.transform_point3(p.as_dvec3() + centre) - centre).as_vec3();
        let way = |d: Vec3| (motion.matrix3 * d.as_dvec3()).as_vec3();
        let kind = match self.kind {
            PosedLightKind::Point { position } => PosedLightKind::Point { position: place(position) },
            PosedLightKind::Spot { position, direction, cone, to_round } => {
                let to_round = to_round.map(|to_round| to_round * motion.matrix3.transpose());
                PosedLightKind::Spot { position: place(position), direction: way(direction), cone, to_round }
            }
            PosedLightKind::Directional { direction } => {
                PosedLightKind::Directional { direction: way(direction) }
            }
        };
        PosedLight { kind, ..*self }
    }

    /// From the light's middle to a place on it: of the disc that it is to whoever sees it sample
    /// `l`, the point at `u`. For a sun, what is added to `l`.
    pub fn disc_offset(&self, l: DVec3, u: [f32; 2]) -> DVec3 {
        let at = concentric_disc(u) * f64::from(self.radius);
        let (a, b) = coordinate_system(l);
        a * at.x + b * at.y
    }

    /// How its light travels.
    pub fn light_eval(&self) -> LightEval {
        let lamp = |position: Vec3, axis: Vec3, cone| LocalLight {
            position: position.as_dvec3(),
            axis: axis.as_dvec3(),
            cone,
            per_range: 1.0 / f64::from(self.range),
        };
        match self.kind {
            PosedLightKind::Directional { direction } => {
                LightEval::Directional(-direction.as_dvec3().normalize())
            }
            PosedLightKind::Point { position } => {
                LightEval::Local(lamp(position, Vec3::ZERO, SpotCone::NONE))
            }
            PosedLightKind::Spot { position, direction, cone, to_round } => {
                let lamp = lamp(position, direction, cone);
                to_round.map_or(LightEval::Local(lamp), |to_round| LightEval::ScaledSpot(lamp, to_round))
            }
        }
    }

    /// The light as seen from `p`. For many points, prepare [`PosedLight::light_eval`] once.
    pub fn sample(&self, p: Vec3) -> LightSample {
        let mut result = LightSample { l: DVec3::ZERO, attenuation: 0.0 };
        self.light_eval().sample(1, |_| p, |_, sample| result = sample);
        result
    }
}

/// How a light's light travels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightEval {
    /// Along one direction: the way to the light, unit length. All of it arrives.
    Directional(DVec3),
    /// From one place.
    Local(LocalLight),
    /// From one place, within a cone that is round where the matrix takes directions to.
    ScaledSpot(LocalLight, DMat3),
}

impl LightEval {
    /// Evaluates the light at `count` points: passes the light seen from the position `p(i)` to `store(i, sample)`. Each type
    /// of light has a loop of its own without branches, so that the compiler vectorises it.
    #[inline(always)]
    pub fn sample(&self, count: usize, p: impl Fn(usize) -> Vec3, mut store: impl FnMut(usize, LightSample)) {
        match *self {
            LightEval::Directional(l) => {
                (0..count).for_each(|i| store(i, LightSample { l, attenuation: 1.0 }))
            }
            LightEval::Local(light) => (0..count).for_each(|i| store(i, light.sample(p(i)))),
            LightEval::ScaledSpot(light, to_round) => {
                (0..count).for_each(|i| store(i, light.sample_in_cone_frame(p(i), &to_round)));
            }
        }
    }
}

/// A light at a position, prepared for many points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalLight {
    position: DVec3,
    axis: DVec3,
    cone: SpotCone,
    per_range: f64,
}

impl LocalLight {
    /// The way to it from `p`, unit length, and what its intensity is multiplied by there: 1/r²,
    /// cone and range. 0 at the very place, where there is no way.
    ///
    /// Nothing branches here, so that many points can be asked for at once.
    #[inline(always)]
    fn sample(&self, p: Vec3) -> LightSample {
        self.through(p, |l| -l.dot(self.axis))
    }

    /// The same within a cone that is round where `to_round` takes directions to.
    #[inline(always)]
    fn sample_in_cone_frame(&self, p: Vec3, to_round: &DMat3) -> LightSample {
        self.through(p, |l| {
            let l = *to_round * l;
            l.z / l.length()
        })
    }

    /// `cos_angle` is that from the cone's axis, by the way to the light.
    #[inline(always)]
    fn through(&self, p: Vec3, cos_angle: impl Fn(DVec3) -> f64) -> LightSample {
        let to_light = self.position - p.as_dvec3();
        let r2 = to_light.length_squared();
        let r = r2.sqrt();
        // Quotients and roots are most of what this takes.
        let per_r = 1.0 / r;
        let l = to_light * per_r;
        let q = r * self.per_range;
        let q2 = q * q;
        let within = (1.0 - q2 * q2).clamp(0.0, 1.0) as f32;
        let strength = self.cone.falloff(cos_angle(l) as f32) * within;
        let share = (f64::from(strength) * per_r * per_r) as f32;
        LightSample { l, attenuation: if r2 > 0.0 { share } else { 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Red irradiance, I/r², at a point.
    fn irradiance(light: &PosedLight, p: Vec3) -> f32 {
        light.intensity.x * light.sample(p).attenuation
    }

    #[test]
    fn spots_fall_off_between_their_cones_and_step_where_the_cones_are_equal() {
        let cone = SpotCone::new(0.5, 1.0);
        assert_eq!(cone.falloff(0.999), 1.0);
        assert_eq!(cone.falloff(0.5), 0.0);
        let middle = cone.cos_outer + 0.5 * cone.width;
        assert!((cone.falloff(middle) - 0.25).abs() < 1e-6);
        let step = SpotCone::new(0.7, 0.7);
        assert_eq!((step.falloff(0.9), step.falloff(0.5)), (1.0, 0.0));
    }

    /// Blender 5.0's: smoothstep((cos − cos_outer) / ((1 − cos_outer)·blend)).
    #[test]
    fn blenders_spots_fall_off_as_in_blender() {
        let (outer, blend) = (0.5f32, 0.4);
        let cone = SpotCone::blender(outer * (1.0 - blend), outer);
        for degrees in 0..40 {
            let cos = libm::cosf((degrees as f32).to_radians());
            let s = ((cos - libm::cosf(outer)) / ((1.0 - libm::cosf(outer)) * blend)).clamp(0.0, 1.0);
            assert!((cone.falloff(cos) - s * s * (3.0 - 2.0 * s)).abs() < 1e-5, "{degrees}");
        }
        let step = SpotCone::blender(0.7, 0.7);
        assert_eq!((step.falloff(0.9), step.falloff(0.5)), (1.0, 0.0));
    }

    /// Cycles': the cosine is taken where the light's own transform is undone, sheared or not.
    #[test]
    fn blenders_cones_are_stretched_with_their_nodes() {
        let blender = Source { generator: "Khronos glTF Blender I/O v5.0.21".into(), ..Source::default() };
        let turn = DMat3::from_rotation_x(0.3);
        let spot = LightKind::Spot { inner: 0.3, outer: 0.5 };
        let places = || (0..400).map(|i| Vec3::new((i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5, -9.0));
        for (scale, stretched) in
            [(DVec3::new(1.0, 2.0, 0.7), true), (DVec3::new(2.0, -2.0, 2.0), false), (DVec3::X, false)]
        {
            for node in [turn * DMat3::from_diagonal(scale), DMat3::from_diagonal(scale) * turn] {
                let light = |source| PosedLight {
                    kind: spot.pose(Vec3::ZERO, &node, source),
                    ..PosedLight::point(Vec3::ZERO, Vec3::ONE)
                };
                let (light, round) = (light(&blender), light(&Source::default()));
                let is_stretched =
                    |light: &PosedLight| matches!(light.light_eval(), LightEval::ScaledSpot(..));
                assert!(is_stretched(&light) == stretched && !is_stretched(&round), "{scale}");
                let motion = DAffine3::from_rotation_y(0.8);
                let lit = places().filter(|&p| irradiance(&light, p) > 0.0).count();
                assert!((10..390).contains(&lit) || !stretched, "{node}: {lit}");
                for p in places().filter(|_| stretched) {
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
    fn light_ends_at_its_range() {
        let mut light = PosedLight::point(Vec3::ZERO, Vec3::ONE);
        light.range = 2.0;
        let at = |x| irradiance(&light, Vec3::new(x, 0.0, 0.0));
        assert_eq!(at(1.0), 1.0 - 1.0 / 16.0);
        assert_eq!((at(2.0), at(3.0)), (0.0, 0.0));
    }

    #[test]
    fn units_make_blenders_watts_into_radiance() {
        // A 1,000 W lamp: 54,351 cd by Standard, 1,000 by Raw, 1,000/4π by Unitless; all the same I.
        let by = |units: LightUnits, v: f64| v as f32 * units.factor(LightKind::Point);
        let expected = (1000.0 / (4.0 * std::f64::consts::PI.powi(2))) as f32;
        let standard = 1000.0 * 683.0 / (4.0 * std::f64::consts::PI);
        for (units, v) in [
            (LightUnits::Standard, standard),
            (LightUnits::Raw, 1000.0),
            (LightUnits::Unitless, standard / 683.0),
        ] {
            assert!((by(units, v) / expected - 1.0).abs() < 1e-5, "{units:?}");
        }
    }
}
