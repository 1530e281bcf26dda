//! Remarks about pictures that are dark although lights exist.

use glam::{DMat3, DVec3, Vec3};

use crate::exposure::ResolvedExposure;
use crate::light_advice::LightAdvice;
use crate::notice::{EnclosedLight, Notice};
use blinn_accel::{Accel, RayBatch};
use blinn_render::Pixels;
use blinn_render::integrator::{Frame, MaterialHitFilter};
use blinn_scene::{LightKind, LightSet, Lighting, Material, PosedScene, Reflectance};

/// Linear light below which a pixel is dark.
const DARK: f32 = 0.005;
/// Share of the covered pixels that are dark in a dark picture.
const DARK_SHARE: f64 = 0.95;
/// Distance to a surface that encloses a light like a bulb, relative to the radius of the scene.
const BULB_SIZE: f64 = 0.1;

/// How an image is lit.
pub struct ImageLight<'a> {
    /// Describes the light sources.
    pub sources: &'a str,
    /// The exposure.
    pub exposure: &'a ResolvedExposure,
    /// The resolved lights.
    pub lighting: &'a Lighting,
}

impl ImageLight<'_> {
    /// Remarks on a light that cannot be seen, and on a dark image.
    pub fn remarks(&self, frame: &Frame, pixels: &Pixels) -> Vec<Notice> {
        let mut remarks = Vec::new();
        let has_file_lights = self.lighting.sets.as_ref().is_some_and(|sets| sets.contains(&LightSet::File));
        if frame.shadows && has_file_lights {
            remarks.extend(enclosed_light(frame.posed, frame.accel).map(Notice::EnclosedLight));
        }
        // A metered image without any light has had its warning.
        let ResolvedExposure { ev, is_metered, .. } = *self.exposure;
        let is_lit = pixels.colors.iter().any(|color| color.truncate() != Vec3::ZERO);
        if is_dark(pixels, ev) && (is_lit || !is_metered) {
            let advice = LightAdvice::of_picture(frame, is_lit, is_metered);
            let lost_lights = frame.posed.scene.lost_light_names();
            remarks.push(Notice::DarkImage { sources: self.sources.to_string(), lost_lights, advice });
        }
        remarks
    }
}

/// Returns true if nearly all that a picture shows of the scene is black at an exposure of `ev` stops.
fn is_dark(pixels: &Pixels, ev: f64) -> bool {
    let scale = libm::exp2(ev) as f32;
    let covered = pixels.colors.iter().filter(|color| color.w > 0.0);
    let dark = covered.clone().filter(|color| color.truncate().max_element() * scale < DARK).count();
    let covered = covered.count();
    covered > 0 && dark as f64 >= DARK_SHARE * covered as f64
}

/// Returns true if surfaces of the material show mainly their surroundings: metal or glass.
pub fn shows_surroundings(material: &Material) -> bool {
    let is_metal = match &material.reflectance {
        Reflectance::MetallicRoughness { metallic, .. } => metallic.factor > 0.5,
        _ => false,
    };
    material.reflects() && (is_metal || material.transmits() && material.transmission.factor > 0.5)
}

/// Finds the first point or spot light of the file inside a small closed object that lets no light through, and emits none:
/// the glass of a bulb, without transmission.
fn enclosed_light(posed: &PosedScene, accel: &Accel) -> Option<EnclosedLight> {
    let scene = posed.scene;
    let mut lights = scene.lights.iter().filter(|light| light.kind != LightKind::Directional);
    lights.find_map(|light| {
        let position = (posed.node_to_world(light.node).translation - posed.centre).as_vec3();
        let object = enclosing_object(posed, accel, position)?;
        let name = scene.objects.get((object as usize).checked_sub(1)?)?.clone();
        Some(EnclosedLight { light: scene.nodes[light.node as usize].name.clone(), object: name })
    })
}

/// The object whose opaque surface is near `position` in all of fourteen directions.
fn enclosing_object(posed: &PosedScene, accel: &Accel, position: Vec3) -> Option<u32> {
    let directions = fourteen_directions();
    let rays = RayBatch {
        origins: vec![position; directions.len()],
        directions,
        t_max: (BULB_SIZE * posed.bounding_sphere().radius) as f32,
        ..RayBatch::default()
    };
    let mut hits = Vec::new();
    accel.intersect(&rays, &MaterialHitFilter(posed), &mut hits);
    let mut enclosing = None;
    for hit in &hits {
        if hit.is_miss() {
            return None;
        }
        let material: &Material = &posed.materials[posed.mesh(hit.id.instance).material as usize];
        let object = posed.scene.instances[hit.id.instance as usize].object;
        let shines_through = material.is_translucent() || material.diffuse_transmission.factor.factor > 0.0;
        if shines_through || material.emits_light() || *enclosing.get_or_insert(object) != object {
            return None;
        }
    }
    enclosing
}

/// The directions to the faces and the corners of a cube.
fn fourteen_directions() -> Vec<Vec3> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    let signs = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
    // Slightly turned, so that no ray runs along an edge of a modelled box or sphere.
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, 0.5, 0.81).normalize(), 0.3);
    axes.chain((0..8).map(signs)).map(|d| (turn * d.normalize()).as_vec3()).collect()
}
