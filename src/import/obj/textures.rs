//! The images that MTLs name: found, read and decoded once each.

use std::collections::HashMap;

use glam::{DVec4, Vec2};
use rayon::prelude::*;

use super::super::Limits;
use super::super::error::{LoadError, Warnings};
use super::super::image::decode;
use super::super::uri::{Folder, printable};
use super::mtl::{Map, Mtl};
use crate::scene::{Channels, Filter, Image, Texture, TextureRef, UvTransform, Wrap};

/// Reads a file by a name from another system, another folder, or in another case: as written,
/// beside the MTL, beside the OBJ, and by its base name in both.
pub(super) fn find(folder: &Folder, beside: &str, name: &str, limit: u64) -> Result<Vec<u8>, String> {
    let unified = name.replace('\\', "/");
    let base = unified.rsplit('/').next().unwrap_or(&unified).to_string();
    let join = |folder: &str, name: &str| {
        if folder.is_empty() { name.to_string() } else { format!("{folder}/{name}") }
    };
    let mut tried = Vec::new();
    for candidate in [join(beside, &unified), unified.clone(), join(beside, &base), base] {
        if tried.contains(&candidate) {
            continue;
        }
        match folder.read_file(&candidate, limit) {
            Ok(bytes) => return Ok(bytes),
            Err(_) => {
                if let Some(other_case) = folder.in_other_case(&candidate)
                    && let Ok(bytes) = folder.read_file(&other_case, limit)
                {
                    return Ok(bytes);
                }
            }
        }
        tried.push(candidate);
    }
    // The first attempt says why: refused, or not there.
    let why = folder.read_file(&join(beside, &unified), limit).err();
    Err(why.map_or_else(|| format!("'{}' cannot be read", printable(name)), |e| e.text().to_string()))
}

/// Images and textures of all materials.
#[derive(Default)]
pub(super) struct Library {
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    image_of: HashMap<(String, String), Option<u32>>,
}

impl Library {
    /// Reads and decodes whatever `materials` name, in parallel. What is missing costs a warning.
    pub fn load(
        materials: &[&Mtl],
        folder: &Folder,
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Library, LoadError> {
        let mut wanted: Vec<(String, String)> = Vec::new();
        for material in materials {
            for map in material.maps() {
                let key = (material.folder.clone(), map.file.clone());
                if !wanted.contains(&key) {
                    wanted.push(key);
                }
            }
        }
        let read = |(beside, name): &(String, String)| -> Result<Image, String> {
            let bytes = find(folder, beside, name, limits.file_bytes)?;
            decode(name, &bytes, limits)
        };
        let decoded: Vec<Result<Image, String>> = wanted.par_iter().map(read).collect();
        let mut library = Library::default();
        let mut bytes = 0;
        for (key, image) in wanted.into_iter().zip(decoded) {
            let id = match image {
                Ok(image) => {
                    bytes += u64::from(image.width) * u64::from(image.height) * 4;
                    LoadError::check("bytes of textures", bytes, limits.texture_bytes)?;
                    library.images.push(image);
                    Some(library.images.len() as u32 - 1)
                }
                Err(why) => {
                    warnings.add("", format!("texture {why}; shown as if white"));
                    None
                }
            };
            library.image_of.insert(key, id);
        }
        Ok(library)
    }

    /// The image behind a map, where there is one.
    pub fn image(&self, material: &Mtl, map: &Map) -> Option<u32> {
        *self.image_of.get(&(material.folder.clone(), map.file.clone()))?
    }

    /// A map as a texture reference.
    pub fn texture(&mut self, material: &Mtl, map: Option<&Map>) -> Option<TextureRef> {
        let map = map?;
        let image = self.image(material, map)?;
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        let texture = Texture { image, wrap: [wrap; 2], filter: Filter::Linear, decode_last: false };
        let id = self.textures.iter().position(|t| *t == texture).unwrap_or_else(|| {
            self.textures.push(texture);
            self.textures.len() - 1
        });
        // OBJ's v' = s·v + o, with v = 1 − (the scene's v) on both sides.
        let offset = Vec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y);
        let transform = UvTransform::khr(offset, 0.0, map.scale);
        Some(TextureRef { texture: id as u32, uv_set: 0, transform })
    }
}

impl Mtl {
    fn maps(&self) -> impl Iterator<Item = &Map> {
        let all = [
            &self.map_ka,
            &self.map_kd,
            &self.map_ks,
            &self.map_ke,
            &self.map_d,
            &self.map_roughness,
            &self.map_metallic,
            &self.map_normal,
        ];
        all.into_iter().flatten()
    }
}

/// Whether an image holds tangent-space normals: mostly blue, red and green about the middle.
pub(super) fn looks_like_normals(image: &Image) -> bool {
    let count = image.width as usize * image.height as usize;
    let sum: DVec4 = (0..count).map(|i| image.stored(i).as_dvec4()).sum();
    let [r, g, b, _] = (sum / count as f64).to_array();
    (0.3..0.7).contains(&r) && (0.3..0.7).contains(&g) && b > 0.65 && b > r + 0.1
}

/// Whether any texel is not opaque.
pub(super) fn has_alpha(image: &Image) -> bool {
    let has_channel = matches!(image.channels, Channels::La | Channels::Rgba);
    let count = image.width as usize * image.height as usize;
    has_channel && (0..count).any(|i| image.stored(i).w != 1.0)
}
