//! Remarks about pictures that are dark although lights exist, or white.

use glam::Vec3;
use rayon::prelude::*;

use crate::exposure::ResolvedExposure;
use crate::light_advice::LightAdvice;
use crate::notice::{EnclosedLight, LackOfLight, Notice};
use crate::surroundings::{is_enclosed, surroundings};
use blinn_accel::Accel;
use blinn_core::geometry::Rgba;
use blinn_render::Pixels;
use blinn_render::display::ViewTransform;
use blinn_render::integrator::Frame;
use blinn_scene::{LightKind, LightSet, Lighting, Material, PosedScene, Reflectance};

/// Linear light below which a pixel is dark.
const DARK: f32 = 0.005;
/// Share of the covered pixels that are dark in a dark picture.
const DARK_SHARE: f64 = 0.95;
/// Share of the covered pixels that are white in a white picture.
const WHITE_SHARE: f64 = 0.5;
/// Pixels that are counted in a task.
const TASK_PIXELS: usize = 1 << 16;
/// Distance to a surface that encloses a light like a bulb, relative to the radius of the scene.
const BULB_SIZE: f64 = 0.1;

/// How an image is lit.
pub struct ImageLight<'a> {
    /// Describes the light sources.
    pub sources: &'a str,
    /// The advice about dark pictures, as far as the lights decide it.
    pub advice: &'a LightAdvice,
    /// The exposure.
    pub exposure: &'a ResolvedExposure,
    /// The resolved lights.
    pub lighting: &'a Lighting,
    /// The view transform.
    pub view: ViewTransform,
}

impl ImageLight<'_> {
    /// Remarks on a light that cannot be seen, and on a dark or white image.
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
            let eye = (frame.camera.view_point - frame.posed.centre).as_vec3();
            let advice = LightAdvice {
                is_lit,
                is_metered,
                is_indirect: frame.indirect > 0,
                is_enclosed: is_enclosed(frame.posed, frame.accel, eye),
                ..*self.advice
            };
            let lost_lights = frame.posed.scene.lost_light_names();
            remarks.push(Notice::DarkImage(LackOfLight {
                sources: self.sources.to_string(),
                lost_lights,
                advice,
            }));
        }
        let is_shaded =
            |material: &Material| !matches!(material.reflectance, Reflectance::Unlit | Reflectance::Unshaded);
        // Exposure does not change what shows its own colour.
        let shows_light = frame.posed.materials.iter().any(is_shaded);
        if self.view == ViewTransform::Standard && !is_metered && shows_light && is_white(pixels, ev) {
            remarks.push(Notice::WhiteImage);
        }
        remarks
    }
}

/// Returns true if nearly all that a picture shows of the scene is black at an exposure of `ev` stops.
fn is_dark(pixels: &Pixels, ev: f64) -> bool {
    let scale = libm::exp2(ev) as f32;
    holds_for(DARK_SHARE, pixels, |color| color.truncate().max_element() * scale < DARK)
}

/// Returns true if most that a picture shows of the scene is white at an exposure of `ev` stops.
fn is_white(pixels: &Pixels, ev: f64) -> bool {
    let scale = libm::exp2(ev) as f32;
    holds_for(WHITE_SHARE, pixels, |color| color.truncate().min_element() * scale >= color.w)
}

/// Returns true if `is` holds for at least this share of the pixels that show the scene, and some do.
fn holds_for(share: f64, pixels: &Pixels, is: impl Fn(&Rgba) -> bool + Sync) -> bool {
    let count = |colors: &[Rgba]| {
        let covered = colors.iter().filter(|color| color.w > 0.0);
        (covered.clone().filter(|color| is(color)).count(), covered.count())
    };
    let counts = pixels.colors.par_chunks(TASK_PIXELS).map(count);
    let (found, covered) = counts.reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    covered > 0 && found as f64 >= share * covered as f64
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
    let mut enclosing = None;
    let size = (BULB_SIZE * posed.bounding_sphere().radius) as f32;
    for hit in &surroundings(posed, accel, position, size) {
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
