//! Textures of MTL materials: reads and decodes each image once.

use std::collections::{HashMap, HashSet};

use glam::Vec2;
use image::{ImageFormat, guess_format};
use rayon::prelude::*;

use super::super::Limits;
use super::super::error::{LoadError, Warnings};
use super::super::heights::{self, BYTES_PER_TEXEL};
use super::super::image::cicp::ColorSpace;
use super::super::image::{bmp, decode, decoded_size};
use super::super::memory::MemoryBudget;
use super::super::normal_maps::looks_like_normals;
use super::mtl::MtlMaterial;
use super::texture_files::find_file;
use super::texture_map::{TexelRange, TextureMap};
use crate::files::escape::printable;
use crate::files::scene_folder::SceneFolder;
use blinn_scene::{
    BlenderVersion, Channels, Image, MipMaps, Texels, Texture, TextureChannel, TextureFilter, TextureRef,
    UvTransform, Wrap, linear_to_srgb,
};

/// Version of Blender from which on images of all formats are multiplied by alpha.
const MULTIPLIES_ALL_FORMATS: BlenderVersion = BlenderVersion::new(5, 1);

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
    /// Files of bump maps, which may hold heights.
    bumps: HashSet<MapFile>,
}

fn collect_map_files(materials: &[&MtlMaterial]) -> MapFiles {
    let mut out = MapFiles::default();
    for material in materials {
        let bump = material.map_normal.as_ref().filter(|_| material.normal_is_bump);
        out.bumps.extend(bump.map(|map| MapFile::of(material, map)));
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

/// Options of a normal map that is made of an image of heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct HeightsOf {
    image: u32,
    /// The [`TextureChannel`], as a number.
    channel: u8,
    /// Bits of base and gain.
    range: [u32; 2],
    clamped: bool,
}

/// The images and textures of all materials.
#[derive(Default)]
pub(super) struct TextureLibrary {
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    image_of: HashMap<MapFile, Option<u32>>,
    /// Textures by image and whether it is clamped.
    texture_of: HashMap<(u32, bool), u32>,
    /// Images in formats whose colours Blender before 5.1 does not multiply by alpha.
    straight: HashSet<u32>,
    /// Alpha that the decoder ignores: of BMP files with 32 bits.
    ignored_alpha: HashMap<u32, Vec<u8>>,
    /// Colour spaces of the images that are not in sRGB.
    color_spaces: HashMap<u32, ColorSpace>,
    /// Copies of these images in sRGB.
    in_srgb: HashMap<u32, u32>,
    /// Copies of images with `-mm`, by the bits of base and gain.
    ranged: HashMap<(u32, [u32; 2]), u32>,
    /// Copies of images whose values are encoded, to be read as colours.
    encoded: HashMap<u32, u32>,
    /// Copies of images with colours multiplied by alpha.
    over_black: HashMap<u32, u32>,
    /// Normal maps of images of heights.
    of_heights: HashMap<HeightsOf, u32>,
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
        let MapFiles { files: map_files, multiplies, bumps } = collect_map_files(materials);
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
        let decoded: Vec<Result<DecodedFile, String>> = files
            .into_par_iter()
            .zip(&map_files)
            .map(|(bytes, file)| {
                cancel.check().map_err(|cancelled| cancelled.to_string())?;
                DecodedFile::new(&printable(&file.name), &bytes?, limits)
            })
            .collect();
        cancel.check()?;
        let mut library = TextureLibrary::default();
        for (file, image) in map_files.into_iter().zip(decoded) {
            let id = match image {
                Ok(DecodedFile { image, straight, ignored_alpha, color_space }) => {
                    if first_tile(&file.name).is_some() {
                        let name = printable(&file.name);
                        warnings.add("", format!("texture '{name}': used tile 1001 for all UDIM tiles"));
                    }
                    let id = library.images.len() as u32;
                    let texels = u64::from(image.width) * u64::from(image.height);
                    library.images.push(image);
                    if bumps.contains(&file) && !library.looks_like_normals(id) {
                        budget.charge(texels.saturating_mul(BYTES_PER_TEXEL))?;
                    }
                    if straight {
                        library.straight.insert(id);
                    }
                    library.ignored_alpha.extend(ignored_alpha.map(|alpha| (id, alpha)));
                    library.color_spaces.extend(color_space.map(|space| (id, space)));
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
    /// Blender multiplies the colour by alpha; before version 5.1 except for some image formats.
    pub fn color(&mut self, material: &MtlMaterial, map: Option<&TextureMap>) -> Option<TextureRef> {
        let file = self.image(material, map?)?;
        let image = self.in_srgb(file);
        let multiplies_all = material.writer.blender_version() >= Some(MULTIPLIES_ALL_FORMATS);
        let multiplied = material.writer.is_blender()
            && material.map_d.is_none()
            && (multiplies_all || !self.straight.contains(&file));
        let image = if multiplied { self.over_black(file, image) } else { image };
        let image = self.ranged(image, map?.range);
        Some(self.reference(image, map?))
    }

    /// Returns an image as a colour in sRGB.
    fn in_srgb(&mut self, image: u32) -> u32 {
        let Some(space) = self.color_spaces.get(&image) else { return image };
        *self.in_srgb.entry(image).or_insert_with(|| {
            self.images.push(space.to_srgb(&self.images[image as usize]));
            self.images.len() as u32 - 1
        })
    }

    /// Returns the image of a `file` with its colours multiplied by alpha. `image` is the file's image in sRGB.
    fn over_black(&mut self, file: u32, image: u32) -> u32 {
        if let Some(copy) = self.over_black.get(&file) {
            return *copy;
        }
        let has_alpha = self.images[image as usize].channels == Channels::Rgba && self.has_alpha(file);
        let product = match self.ignored_alpha.get(&file) {
            Some(alpha) => over_black(&with_alpha(&self.images[image as usize], alpha)),
            None if has_alpha => over_black(&self.images[image as usize]),
            None => return image,
        };
        self.images.push(product);
        let copy = self.images.len() as u32 - 1;
        self.over_black.insert(file, copy);
        copy
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
        let image = self.ranged(image, map.range);
        Some(self.reference(image, map))
    }

    /// Returns a bump map of heights as a normal map, with its base and gain applied.
    pub fn normals_of_heights(&mut self, material: &MtlMaterial, map: &TextureMap) -> Option<TextureRef> {
        let image = self.image(material, map)?;
        let channel = map.channel.unwrap_or(TextureChannel::Mean);
        let TexelRange { base, gain } = map.range;
        let range = [base, gain].map(f32::to_bits);
        let key = HeightsOf { image, channel: channel as u8, range, clamped: map.clamp };
        let normals = match self.of_heights.get(&key) {
            Some(&normals) => normals,
            None => {
                let heights = &self.images[image as usize];
                let height = |texel: usize| map.range.apply(channel.of(heights.stored(texel)));
                self.images.push(heights::normal_map(heights, map.clamp, height));
                self.images.len() as u32 - 1
            }
        };
        self.of_heights.insert(key, normals);
        Some(self.reference(normals, map))
    }

    /// Returns a map of numbers as a texture of a colour, which decodes them.
    pub fn scalar_as_color(
        &mut self,
        material: &MtlMaterial,
        map: Option<&TextureMap>,
    ) -> Option<TextureRef> {
        let map = map?;
        let image = self.image(material, map)?;
        let image = self.ranged(image, map.range);
        let encoded = match self.encoded.get(&image) {
            Some(&copy) => copy,
            None => self.push_copy(image, linear_to_srgb),
        };
        self.encoded.insert(image, encoded);
        Some(self.reference(encoded, map))
    }

    /// Returns an image with base and gain applied to its colours.
    fn ranged(&mut self, image: u32, range: TexelRange) -> u32 {
        if range == TexelRange::FULL {
            return image;
        }
        let key = (image, [range.base, range.gain].map(f32::to_bits));
        let copy = match self.ranged.get(&key) {
            Some(&copy) => copy,
            None => self.push_copy(image, |value| range.apply(value)),
        };
        self.ranged.insert(key, copy);
        copy
    }

    /// Adds a copy of an image with other values of its colours.
    fn push_copy(&mut self, image: u32, value: impl Fn(f32) -> f32) -> u32 {
        self.images.push(with_values(&self.images[image as usize], value));
        self.images.len() as u32 - 1
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
            &self.map_coat,
            &self.map_coat_roughness,
            &self.map_sheen,
        ];
        all.into_iter().flatten()
    }
}

/// Returns a copy of an image with other values of its colours. Alpha stays.
fn with_values(image: &Image, value: impl Fn(f32) -> f32) -> Image {
    let channels = image.channels as usize;
    let is_alpha =
        |i: usize| matches!(image.channels, Channels::La | Channels::Rgba) && i % channels == channels - 1;
    let texels = match &image.texels {
        Texels::U8(texels) => {
            let table: Vec<u8> =
                (0..=255u8).map(|v| (value(f32::from(v) / 255.0) * 255.0 + 0.5) as u8).collect();
            let new = |(i, &v): (usize, &u8)| if is_alpha(i) { v } else { table[usize::from(v)] };
            Texels::U8(texels.iter().enumerate().map(new).collect())
        }
        Texels::U16(texels) => {
            let new = |(i, &v): (usize, &u16)| {
                if is_alpha(i) { v } else { (value(f32::from(v) / 65535.0) * 65535.0 + 0.5) as u16 }
            };
            Texels::U16(texels.iter().enumerate().map(new).collect())
        }
    };
    let Image { name, width, height, channels, .. } = image;
    let (width, height, channels) = (*width, *height, *channels);
    Image { name: name.clone(), width, height, channels, texels, mips: MipMaps::default() }
}

/// Returns an image of bytes with another alpha.
fn with_alpha(image: &Image, alpha: &[u8]) -> Image {
    let rgb = |i: usize| image.stored(i).truncate().to_array().map(|v| (v * 255.0 + 0.5) as u8);
    let texels = alpha.iter().enumerate().flat_map(|(i, &a)| {
        let [r, g, b] = rgb(i);
        [r, g, b, a]
    });
    let Image { name, width, height, .. } = image;
    let (width, height) = (*width, *height);
    let texels = Texels::U8(texels.collect());
    Image { name: name.clone(), width, height, channels: Channels::Rgba, texels, mips: MipMaps::default() }
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

/// The image of a file, and what decides on its colours.
struct DecodedFile {
    image: Image,
    /// See [`has_straight_alpha`].
    straight: bool,
    ignored_alpha: Option<Vec<u8>>,
    color_space: Option<ColorSpace>,
}

impl DecodedFile {
    fn new(name: &str, bytes: &[u8], limits: &Limits) -> Result<DecodedFile, String> {
        let image = decode(name, bytes, limits)?;
        let texels = image.width as usize * image.height as usize;
        let is_translucent = |alpha: &Vec<u8>| alpha.len() == texels && alpha.iter().any(|&a| a != 0xff);
        Ok(DecodedFile {
            ignored_alpha: bmp::fourth_bytes(bytes)
                .filter(|alpha| image.channels == Channels::Rgb && is_translucent(alpha)),
            image,
            straight: has_straight_alpha(bytes),
            color_space: ColorSpace::of_png(bytes),
        })
    }
}

/// Returns true for image formats whose colours Blender before 5.1 does not multiply by alpha.
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
