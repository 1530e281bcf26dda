//! EXT_lights_image_based: the environment that lights a scene, as a cube map and harmonics of its irradiance.

use ::gltf::json::Root;
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use serde_json::Value;

use super::document::Document;
use super::texture::read_image;
use crate::error::{LoadError, Warnings};
use blinn_scene::UpAxis;
use blinn_scene::{CubeMap, Environment, FileEnvironment, Image, SkyIrradiance, unit_quaternion};

pub(super) const NAME: &str = "EXT_lights_image_based";

/// Texels on a side of a face, at most.
const MAX_SIDE: u32 = 4096;
/// Bytes for each texel of the faces while the environment is made: three floats, and the mip levels.
const TEXEL_BYTES: u64 = 64;

/// Reads the environment of a scene. What is wrong with it is a warning, and the scene is shown without it.
///
/// # Errors
/// The file exceeds a limit.
pub(super) fn read(
    doc: &Document<'_>,
    scene: Option<usize>,
    up: UpAxis,
    warnings: &mut Warnings,
) -> Result<Option<FileEnvironment>, LoadError> {
    let Some(index) = scene.and_then(|scene| light_of(doc.root(), scene)) else { return Ok(None) };
    let place = format!("extensions.{NAME}.lights[{index}]");
    let lights = doc.root().extensions.as_ref().and_then(|e| e.others.get(NAME)?.get("lights"));
    let Some(light) = lights.and_then(|lights| lights.get(index as usize)) else {
        warnings.add(place, "the light does not exist; the environment light is missing");
        return Ok(None);
    };
    let cube = match read_cube(doc, light)? {
        Ok(cube) => cube,
        Err(cause) => {
            warnings.add(place, format_args!("{cause}; the environment light is missing"));
            return Ok(None);
        }
    };
    let irradiance = irradiance(light);
    if irradiance.is_none() {
        let message = "irradianceCoefficients are not 9 × 3 numbers; computed them from the images";
        warnings.add(&place, message);
    }
    let number = |v: &Value| v.as_f64().map(|v| v as f32).filter(|v| v.is_finite());
    let intensity = light.get("intensity").map_or(Some(1.0), number).filter(|v| *v >= 0.0);
    if intensity.is_none() {
        warnings.add(&place, "the intensity is not a positive number; used 1");
    }
    let quaternion = light.get("rotation").map(floats::<4>).unwrap_or(Some([0.0, 0.0, 0.0, 1.0]));
    if quaternion.is_none() {
        warnings.add(&place, "the rotation is no quaternion; used none");
    }
    Ok(Some(FileEnvironment {
        map: Environment::from_cube_map(&cube, irradiance),
        intensity: intensity.unwrap_or(1.0),
        rotation: quaternion.map_or(DQuat::IDENTITY, |q| unit_quaternion(q.map(|v| v as f32))),
        axes: up.rotation(),
    }))
}

/// Returns the index of the light that a scene uses.
pub(super) fn light_of(root: &Root, scene: usize) -> Option<u64> {
    root.scenes.get(scene)?.extensions.as_ref()?.others.get(NAME)?.get("light")?.as_u64()
}

/// Exactly `N` finite numbers.
fn floats<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers = value.as_array()?.iter().map(|v| v.as_f64().filter(|v| (*v as f32).is_finite()));
    numbers.collect::<Option<Vec<f64>>>()?.try_into().ok()
}

fn irradiance(light: &Value) -> Option<SkyIrradiance> {
    let rows =
        light.get("irradianceCoefficients")?.as_array()?.iter().map(|row| floats::<3>(row).map(DVec3::from));
    let rows: [DVec3; 9] = rows.collect::<Option<Vec<DVec3>>>()?.try_into().ok()?;
    Some(SkyIrradiance::from_irradiance(rows))
}

/// Reads the faces of the first, unblurred level; blurred levels are made from it. The inner error is a warning.
fn read_cube(doc: &Document<'_>, light: &Value) -> Result<Result<CubeMap, String>, LoadError> {
    let indices = light.pointer("/specularImages/0").and_then(Value::as_array);
    let indices = indices.and_then(|list| list.iter().map(Value::as_u64).collect::<Option<Vec<u64>>>());
    let Some(indices): Option<[u64; 6]> = indices.and_then(|list| list.try_into().ok()) else {
        return Ok(Err("specularImages does not begin with six images".into()));
    };
    let mut images: Vec<Image> = Vec::with_capacity(6);
    for index in indices {
        let Some(index) = usize::try_from(index).ok().filter(|&i| i < doc.root().images.len()) else {
            return Ok(Err(format!("there is no image {index}")));
        };
        match read_image(doc, index)? {
            Ok(image) => images.push(image),
            Err(cause) => return Ok(Err(cause)),
        }
        let side = images[0].width;
        let Image { width, height, name, .. } = &images[images.len() - 1];
        if [*width, *height] != [side; 2] || side > MAX_SIDE {
            return Ok(Err(format!(
                "image '{name}' has {width}x{height} pixels; the faces must be squares of one size, at most {MAX_SIDE}"
            )));
        }
        doc.budget.charge(u64::from(side) * u64::from(side) * TEXEL_BYTES)?;
    }
    let side = images[0].width;
    let faces: Vec<Vec<[f32; 3]>> = images.par_iter().map(radiance).collect();
    let faces = <[_; 6]>::try_from(faces).ok();
    Ok(faces.and_then(|faces| CubeMap::new(side, faces)).ok_or_else(|| "the images are empty".into()))
}

/// Radiance of an image: of pictures with alpha, which are in RGBD, the colour divided by alpha.
fn radiance(image: &Image) -> Vec<[f32; 3]> {
    let texel = |i: usize| {
        let [r, g, b, a] = image.decoded(i).to_array();
        let divisor = a.max(1.0 / 255.0);
        [r, g, b].map(|v| v / divisor)
    };
    (0..image.width as usize * image.height as usize).map(texel).collect()
}
