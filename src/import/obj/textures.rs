//! Textures of MTL materials: reads and decodes each image once.

use std::collections::{HashMap, HashSet};

use glam::Vec2;
use image::{ImageFormat, guess_format};
use rayon::prelude::*;

use super::super::Limits;
use super::super::error::{LoadError, Warnings};
use super::super::image::{decode, decoded_size};
use super::super::memory::MemoryBudget;
use super::super::normal_maps::looks_like_normals;
use super::mtl::MtlMaterial;
use super::texture_files::find_file;
use super::texture_map::TextureMap;
use crate::files::escape::printable;
use crate::files::scene_folder::SceneFolder;
use blinn_scene::{Channels, Image, MipMaps, Texels, Texture, TextureFilter, TextureRef, UvTransform, Wrap};

/// Returns the name of the first tile of a UDIM texture.
fn first_tile(name: &str) -> Option<String> {
    name.contains("<UDIM>").then(|| name.replace("<UDIM>", "1001"))
}

/// The file of a map: the folder of its MTL, and the name as written.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct MapFile {
    folder: String,
    name: String,
}

impl MapFile {
    fn of(material: &MtlMaterial, map: &TextureMap) -> MapFile {
        MapFile { folder: material.folder.clone(), name: map.file.clone() }
    }
}

/// The files of all maps.
#[derive(Default)]
struct MapFiles {
    /// Each file once.
    files: Vec<MapFile>,
    /// True for files that multiply a factor; false for normal maps.
    multiplies: HashMap<MapFile, bool>,
}

fn collect_map_files(materials: &[&MtlMaterial]) -> MapFiles {
    let mut out = MapFiles::default();
    for material in materials {
        let factors = material.factor_maps().map(|map| (map, true));
        for (map, multiplies) in factors.chain(material.map_normal.iter().map(|map| (map, false))) {
            let file = MapFile::of(material, map);
            *out.multiplies.entry(file.clone()).or_insert_with(|| {
                out.files.push(file);
                false
            }) |= multiplies;
        }
    }
    out
}

/// The images and textures of all materials.
#[derive(Default)]
pub(super) struct TextureLibrary {
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    image_of: HashMap<MapFile, Option<u32>>,
    /// Textures by image and whether it is clamped.
    texture_of: HashMap<(u32, bool), u32>,
    /// Images in formats whose colours Blender never multiplies by alpha.
    straight: HashSet<u32>,
    /// Copies of images with colours multiplied by alpha.
    over_black: HashMap<u32, u32>,
    /// Results of scans over all texels, cached because many materials may share an image.
    has_alpha: HashMap<u32, bool>,
    looks_like_normals: HashMap<u32, bool>,
}

impl TextureLibrary {
    /// Reads and decodes all textures of `materials` in parallel. Warns about missing ones.
    pub fn load(
        materials: &[&MtlMaterial],
        folder: &SceneFolder,
        limits: &Limits,
        budget: &MemoryBudget,
        warnings: &mut Warnings,
    ) -> Result<TextureLibrary, LoadError> {
        let MapFiles { files: map_files, multiplies } = collect_map_files(materials);
        let cancel = &folder.cancel;
        let read = |file: &MapFile| {
            cancel.check()?;
            let name = &first_tile(&file.name).unwrap_or_else(|| file.name.clone());
            match find_file(folder, &file.folder, name, limits.file_bytes) {
                Ok(bytes) => budget.charge(bytes.len() as u64).map(|()| Ok(bytes)),
                Err(e) => {
                    e.limit_error(limits.file_bytes).map_or_else(|| Ok(Err(e.message().to_string())), Err)
                }
            }
        };
        let files: Vec<_> = map_files.par_iter().map(read).collect();
        let files: Vec<Result<Vec<u8>, String>> = files.into_iter().collect::<Result<_, LoadError>>()?;
        // Check the sizes in the headers before decoding anything.
        let sizes = files.iter().flatten().map(|bytes| decoded_size(bytes));
        let total = sizes.fold(0u64, u64::saturating_add);
        LoadError::check_limit("bytes of decoded textures", total, limits.texture_bytes)?;
        budget.charge_images(total)?;
        let decoded: Vec<Result<(Image, bool), String>> = files
            .into_par_iter()
            .zip(&map_files)
            .map(|(bytes, file)| {
                cancel.check().map_err(|cancelled| cancelled.to_string())?;
                let bytes = bytes?;
                Ok((decode(&printable(&file.name), &bytes, limits)?, has_straight_alpha(&bytes)))
            })
            .collect();
        cancel.check()?;
        let mut library = TextureLibrary::default();
        for (file, image) in map_files.into_iter().zip(decoded) {
            let id = match image {
                Ok((image, straight)) => {
                    if first_tile(&file.name).is_some() {
                        let name = printable(&file.name);
                        warnings.add("", format!("texture '{name}': used tile 1001 for all UDIM tiles"));
                    }
                    let id = library.images.len() as u32;
                    library.images.push(image);
                    if straight {
                        library.straight.insert(id);
                    }
                    Some(id)
                }
                Err(why) => {
                    let then = if multiplies[&file] { "used white instead" } else { "ignored the map" };
                    warnings.add("", format!("texture {why}; {then}"));
                    None
                }
            };
            library.image_of.insert(file, id);
        }
        Ok(library)
    }

    /// Returns the image of a map, unless it is missing.
    pub fn image(&self, material: &MtlMaterial, map: &TextureMap) -> Option<u32> {
        *self.image_of.get(&MapFile::of(material, map))?
    }

    /// Returns a colour map as a texture reference. If a Blender material does not use the alpha of its texture,
    /// Blender multiplies the colour by alpha, except for some image formats.
    pub fn color(&mut self, material: &MtlMaterial, map: Option<&TextureMap>) -> Option<TextureRef> {
        let image = self.image(material, map?)?;
        let multiplied = material.by_blender && material.map_d.is_none() && !self.straight.contains(&image);
        if !multiplied || self.images[image as usize].channels != Channels::Rgba || !self.has_alpha(image) {
            return self.texture(material, map);
        }
        let copy = *self.over_black.entry(image).or_insert_with(|| {
            self.images.push(over_black(&self.images[image as usize]));
            self.images.len() as u32 - 1
        });
        Some(self.reference(copy, map?))
    }

    /// Returns true if any texel of an image is not opaque.
    pub fn has_alpha(&mut self, image: u32) -> bool {
        *self.has_alpha.entry(image).or_insert_with(|| has_alpha(&self.images[image as usize]))
    }

    /// Returns true if an image holds tangent-space normals.
    pub fn looks_like_normals(&mut self, image: u32) -> bool {
        *self
            .looks_like_normals
            .entry(image)
            .or_insert_with(|| looks_like_normals(&self.images[image as usize]))
    }

    /// Returns a map as a texture reference.
    pub fn texture(&mut self, material: &MtlMaterial, map: Option<&TextureMap>) -> Option<TextureRef> {
        let map = map?;
        let image = self.image(material, map)?;
        Some(self.reference(image, map))
    }

    fn reference(&mut self, image: u32, map: &TextureMap) -> TextureRef {
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

impl MtlMaterial {
    /// Returns the maps that multiply a factor.
    fn factor_maps(&self) -> impl Iterator<Item = &TextureMap> {
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

/// Returns an opaque image with stored colours multiplied by alpha, rounded down.
fn over_black(image: &Image) -> Image {
    fn premultiply<T: Copy>(texels: &[T], product: impl Fn(T, T) -> T) -> Vec<T> {
        let texels = texels.as_chunks::<4>().0.iter();
        texels.flat_map(|&[r, g, b, a]| [r, g, b].map(|c| product(c, a))).collect()
    }
    let texels = match &image.texels {
        Texels::U8(t) => Texels::U8(premultiply(t, |c, a| (u16::from(c) * u16::from(a) / 0xff) as u8)),
        Texels::U16(t) => Texels::U16(premultiply(t, |c, a| (u32::from(c) * u32::from(a) / 0xffff) as u16)),
    };
    let Image { name, width, height, .. } = image;
    let (width, height) = (*width, *height);
    Image { name: name.clone(), width, height, channels: Channels::Rgb, texels, mips: MipMaps::default() }
}

/// Returns true for image formats whose colours Blender does not multiply by alpha.
fn has_straight_alpha(bytes: &[u8]) -> bool {
    matches!(guess_format(bytes), Ok(ImageFormat::WebP | ImageFormat::Bmp))
}

/// Returns true if any texel is not opaque.
fn has_alpha(image: &Image) -> bool {
    let has_channel = matches!(image.channels, Channels::La | Channels::Rgba);
    let count = image.width as usize * image.height as usize;
    has_channel && (0..count).any(|i| image.stored(i).w != 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without the cache, an atlas that hundreds of materials share is scanned once per material.
    #[test]
    fn an_image_is_scanned_once_for_all_its_materials() {
        let image = |texel: [u8; 4]| Image {
            name: String::new(),
            width: 1,
            height: 1,
            channels: Channels::Rgba,
            texels: Texels::U8(texel.to_vec()),
            mips: MipMaps::default(),
        };
        let images = vec![image([128, 128, 255, 255])];
        let mut library = TextureLibrary { images, ..TextureLibrary::default() };
        assert!(!library.has_alpha(0) && library.looks_like_normals(0));
        library.images = vec![image([255, 0, 0, 0])];
        assert!(!library.has_alpha(0) && library.looks_like_normals(0));
        library.images.push(image([255, 0, 0, 0]));
        assert!(library.has_alpha(1) && !library.looks_like_normals(1));
    }
}
