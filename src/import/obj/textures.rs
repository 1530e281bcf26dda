//! The images that MTLs name: found, read and decoded once each.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use glam::{DVec4, Vec2, Vec3, Vec4};
use image::{ImageFormat, guess_format};
use percent_encoding::percent_decode_str;
use rayon::prelude::*;

use super::super::Limits;
use super::super::error::{LoadError, Warnings};
use super::super::image::{decode, decoded_size};
use super::super::memory::MemoryBudget;
use super::map::Map;
use super::mtl::Mtl;
use super::text::readings;
use crate::import::files::{
    escape::printable,
    scene_folder::{ReferenceError, SceneFolder},
};
use crate::scene::{Channels, Image, MipMaps, Texels, Texture, TextureFilter, TextureRef, UvTransform, Wrap};

/// Reads a file by a name from another system, another folder, in another case or form of Unicode, with a comment
/// behind it, or as a URI has it.
pub(super) fn find(
    folder: &SceneFolder,
    beside: &str,
    name: &str,
    limit: u64,
) -> Result<Vec<u8>, ReferenceError> {
    let whole = find_named(folder, beside, name, limit);
    // A name is more likely to have a number sign than to be followed by a comment, and a per cent sign than to be
    // a URI.
    let decoded = || percent_decode_str(name).decode_utf8().ok().filter(|decoded| decoded != name);
    let others = || readings(name).skip(1).map(Cow::Borrowed).chain(decoded());
    let found = || others().find_map(|name| find_named(folder, beside, &name, limit).ok());
    whole.or_else(|error| found().ok_or(error))
}

/// Reads a file by its name as written, beside the MTL, beside the OBJ, and by its base name in both.
pub(super) fn find_named(
    folder: &SceneFolder,
    beside: &str,
    name: &str,
    limit: u64,
) -> Result<Vec<u8>, ReferenceError> {
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
            Err(error @ ReferenceError::TooLarge { .. }) => return Err(error),
            Err(_) => {
                if let Some(alike) = folder.find_similar(&candidate)
                    && let Ok(bytes) = folder.read_file(&alike, limit)
                {
                    return Ok(bytes);
                }
            }
        }
        tried.push(candidate);
    }
    // The first attempt says why: refused, or not there.
    folder.read_file(&join(beside, &unified), limit)
}

/// The first tile of a picture that is several, each with its number in the place of `<UDIM>`.
fn first_tile(name: &str) -> Option<String> {
    name.contains("<UDIM>").then(|| name.replace("<UDIM>", "1001"))
}

/// A map's file: beside which MTL, and its name as written.
type Key = (String, String);

/// The files of all maps, each once; and whether a factor is left where one is missing: of normals
/// nothing is.
fn wanted(materials: &[&Mtl]) -> (Vec<Key>, HashMap<Key, bool>) {
    let mut wanted = Vec::new();
    let mut multiplies: HashMap<Key, bool> = HashMap::new();
    for material in materials {
        let factors = material.maps_of_factors().map(|map| (map, true));
        for (map, of_factor) in factors.chain(material.map_normal.iter().map(|map| (map, false))) {
            let key = (material.folder.clone(), map.file.clone());
            *multiplies.entry(key.clone()).or_insert_with(|| {
                wanted.push(key);
                false
            }) |= of_factor;
        }
    }
    (wanted, multiplies)
}

/// Images and textures of all materials.
#[derive(Default)]
pub(super) struct Library {
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    image_of: HashMap<Key, Option<u32>>,
    /// By image, and whether it is clamped.
    texture_of: HashMap<(u32, bool), u32>,
    /// Images whose colours Blender never takes times their alpha.
    straight: HashSet<u32>,
    /// Copies of images whose colours are shown over black.
    over_black: HashMap<u32, u32>,
    /// What looks at all of an image tell: hundreds of materials may share one.
    has_alpha: HashMap<u32, bool>,
    looks_like_normals: HashMap<u32, bool>,
}

impl Library {
    /// Reads and decodes whatever `materials` name, in parallel. What is missing costs a warning.
    pub fn load(
        materials: &[&Mtl],
        folder: &SceneFolder,
        limits: &Limits,
        budget: &MemoryBudget,
        warnings: &mut Warnings,
    ) -> Result<Library, LoadError> {
        let (wanted, multiplies) = wanted(materials);
        let read = |(beside, name): &Key| {
            let name = &first_tile(name).unwrap_or_else(|| name.clone());
            match find(folder, beside, name, limits.file_bytes) {
                Ok(bytes) => budget.charge(bytes.len() as u64).map(|()| Ok(bytes)),
                Err(e) => {
                    e.limit_error(limits.file_bytes).map_or_else(|| Ok(Err(e.message().to_string())), Err)
                }
            }
        };
        let files: Vec<_> = wanted.par_iter().map(read).collect();
        let files: Vec<Result<Vec<u8>, String>> = files.into_iter().collect::<Result<_, LoadError>>()?;
        // By their headers first: what is too much is not decoded at all.
        let sizes = files.iter().flatten().map(|bytes| decoded_size(bytes));
        let total = sizes.fold(0u64, u64::saturating_add);
        LoadError::check_limit("bytes of decoded textures", total, limits.texture_bytes)?;
        budget.charge_images(total)?;
        let decoded: Vec<Result<(Image, bool), String>> = files
            .into_par_iter()
            .zip(&wanted)
            .map(|(bytes, (_, name))| {
                let bytes = bytes?;
                Ok((decode(&printable(name), &bytes, limits)?, is_straight(&bytes)))
            })
            .collect();
        let mut library = Library::default();
        for (key, image) in wanted.into_iter().zip(decoded) {
            let id = match image {
                Ok((image, straight)) => {
                    if first_tile(&key.1).is_some() {
                        let name = printable(&key.1);
                        warnings.add("", format!("texture '{name}': of its tiles, 1001 is shown everywhere"));
                    }
                    let id = library.images.len() as u32;
                    library.images.push(image);
                    if straight {
                        library.straight.insert(id);
                    }
                    Some(id)
                }
                Err(why) => {
                    let then = if multiplies[&key] { "shown as if white" } else { "shown without it" };
                    warnings.add("", format!("texture {why}; {then}"));
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

    /// The map of a colour. Where a material of Blender's does not use the alpha of its texture,
    /// Blender shows the texture's colour over black; but not that of every kind of image.
    pub fn color(&mut self, material: &Mtl, map: Option<&Map>) -> Option<TextureRef> {
        let image = self.image(material, map?)?;
        let hidden = material.by_blender && material.map_d.is_none() && !self.straight.contains(&image);
        if !hidden || self.images[image as usize].channels != Channels::Rgba || !self.has_alpha(image) {
            return self.texture(material, map);
        }
        let copy = *self.over_black.entry(image).or_insert_with(|| {
            self.images.push(over_black(&self.images[image as usize]));
            self.images.len() as u32 - 1
        });
        Some(self.reference(copy, map?))
    }

    /// Whether any texel of an image is not opaque.
    pub fn has_alpha(&mut self, image: u32) -> bool {
        *self.has_alpha.entry(image).or_insert_with(|| has_alpha(&self.images[image as usize]))
    }

    /// Whether an image holds tangent-space normals.
    pub fn looks_like_normals(&mut self, image: u32) -> bool {
        *self
            .looks_like_normals
            .entry(image)
            .or_insert_with(|| looks_like_normals(&self.images[image as usize]))
    }

    /// A map as a texture reference.
    pub fn texture(&mut self, material: &Mtl, map: Option<&Map>) -> Option<TextureRef> {
        let map = map?;
        let image = self.image(material, map)?;
        Some(self.reference(image, map))
    }

    fn reference(&mut self, image: u32, map: &Map) -> TextureRef {
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        let texture = Texture { image, wrap: [wrap; 2], filter: TextureFilter::Linear, decode_last: false };
        let id = *self.texture_of.entry((image, map.clamp)).or_insert_with(|| {
            self.textures.push(texture);
            self.textures.len() as u32 - 1
        });
        // OBJ's v' = s·v + o, with v = 1 − (the scene's v) on both sides.
        let offset = Vec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y);
        let transform = UvTransform::khr(offset, 0.0, map.scale);
        TextureRef { texture: id, uv_set: 0, transform }
    }
}

impl Mtl {
    fn maps_of_factors(&self) -> impl Iterator<Item = &Map> {
        let all = [
            &self.map_ka,
            &self.map_kd,
            &self.map_ks,
            &self.map_ke,
            &self.map_d,
            &self.map_roughness,
            &self.map_metallic,
        ];
        all.into_iter().flatten()
    }
}

/// Whether an image holds tangent-space normals. What is black is around them, where nothing was
/// baked, and so is what has no alpha, unless alpha is something else.
fn looks_like_normals(image: &Image) -> bool {
    let count = image.width as usize * image.height as usize;
    let texels = || (0..count).map(|i| image.stored(i)).filter(|v| v.truncate() != Vec3::ZERO);
    are_normals(texels().filter(|v| v.w > 0.0)) || are_normals(texels())
}

/// Mostly blue, red and green about the middle.
fn are_normals(texels: impl Iterator<Item = Vec4>) -> bool {
    // The last counts them.
    let sum: DVec4 = texels.map(|v| v.truncate().as_dvec3().extend(1.0)).sum();
    let [r, g, b, _] = (sum / sum.w).to_array();
    (0.3..0.7).contains(&r) && (0.3..0.7).contains(&g) && b > 0.65 && b > r + 0.1
}

/// The image with its colours times its alpha, as they are stored and rounded down, and opaque.
fn over_black(image: &Image) -> Image {
    fn times<T: Copy>(texels: &[T], product: impl Fn(T, T) -> T) -> Vec<T> {
        let texels = texels.as_chunks::<4>().0.iter();
        texels.flat_map(|&[r, g, b, a]| [r, g, b].map(|c| product(c, a))).collect()
    }
    let texels = match &image.texels {
        Texels::U8(t) => Texels::U8(times(t, |c, a| (u16::from(c) * u16::from(a) / 0xff) as u8)),
        Texels::U16(t) => Texels::U16(times(t, |c, a| (u32::from(c) * u32::from(a) / 0xffff) as u16)),
    };
    let Image { name, width, height, .. } = image;
    let (width, height) = (*width, *height);
    Image { name: name.clone(), width, height, channels: Channels::Rgb, texels, mips: MipMaps::default() }
}

/// Whether an image is in a format of which Blender leaves the colours as they are, whatever their alpha.
fn is_straight(bytes: &[u8]) -> bool {
    matches!(guess_format(bytes), Ok(ImageFormat::WebP | ImageFormat::Bmp))
}

/// Whether any texel is not opaque.
fn has_alpha(image: &Image) -> bool {
    let has_channel = matches!(image.channels, Channels::La | Channels::Rgba);
    let count = image.width as usize * image.height as usize;
    has_channel && (0..count).any(|i| image.stored(i).w != 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of an atlas that hundreds of materials share, this was nearly all of the time to load them.
    #[test]
    fn an_image_is_looked_at_once_however_many_materials_share_it() {
        let image = |texel: [u8; 4]| Image {
            name: String::new(),
            width: 1,
            height: 1,
            channels: Channels::Rgba,
            texels: Texels::U8(texel.to_vec()),
            mips: MipMaps::default(),
        };
        let mut library = Library { images: vec![image([128, 128, 255, 255])], ..Library::default() };
        assert!(!library.has_alpha(0) && library.looks_like_normals(0));
        library.images = vec![image([255, 0, 0, 0])];
        assert!(!library.has_alpha(0) && library.looks_like_normals(0));
        library.images.push(image([255, 0, 0, 0]));
        assert!(library.has_alpha(1) && !library.looks_like_normals(1));
    }
}
