//! Textures: decodes their images in parallel and reads their samplers.

use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

use ::gltf::json::texture::{MagFilter, WrappingMode};
use ::gltf::json::validation::Checked;
use rayon::prelude::*;

use super::document::Document;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::image;
use blinn_scene::{Image, Texture, TextureFilter, Wrap};

/// An encoded image with a name for messages.
struct EncodedImage<'d> {
    name: String,
    bytes: Cow<'d, [u8]>,
}

/// The textures that a scene uses, decoded.
#[derive(Debug, Default)]
pub(super) struct Textures {
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    by_index: HashMap<usize, u32>,
}

impl Textures {
    /// The scene's texture for an index of the file; `None` if its image could not be read.
    pub fn get(&self, index: usize) -> Option<u32> {
        self.by_index.get(&index).copied()
    }

    /// Decodes the images of the textures `used`, in parallel, each once. If an image cannot be read, the
    /// texture uses the next of its alternatives.
    pub fn read(doc: &Document<'_>, used: &[usize], warnings: &mut Warnings) -> Result<Textures, LoadError> {
        let mut images = Images::default();
        // Textures without an image yet, and their alternative images.
        let mut pending: Vec<(usize, Vec<usize>)> = Vec::new();
        for &texture in used {
            let sources = image_sources(doc, texture, warnings);
            pending.extend((!sources.is_empty()).then_some((texture, sources)));
        }
        let mut image_of: HashMap<usize, u32> = HashMap::new();
        // Each round finishes a texture or removes one of its alternatives.
        while !pending.is_empty() {
            let first: Vec<usize> = pending.iter().map(|(_, sources)| sources[0]).collect();
            let has_alternatives = pending.iter().any(|(_, sources)| sources.len() > 1);
            images.read(doc, &first, has_alternatives, warnings)?;
            pending.retain_mut(|(texture, sources)| {
                if let Some(image) = images.by_index.get(&sources[0]).copied().flatten() {
                    image_of.insert(*texture, image);
                    return false;
                }
                sources.remove(0);
                !sources.is_empty()
            });
        }
        let mut out = Textures { images: images.decoded, ..Textures::default() };
        for &texture in used {
            if let Some(&image) = image_of.get(&texture)
                && !out.by_index.contains_key(&texture)
            {
                out.by_index.insert(texture, out.textures.len() as u32);
                out.textures.push(with_sampler(doc, texture, image));
            }
        }
        Ok(out)
    }
}

/// The images decoded so far.
#[derive(Debug, Default)]
struct Images {
    decoded: Vec<Image>,
    /// Position among `decoded` of each image of the file; `None` if it could not be read.
    by_index: HashMap<usize, Option<u32>>,
    bytes: u64,
}

impl Images {
    /// Decodes the images that are not decoded yet.
    fn read(
        &mut self,
        doc: &Document<'_>,
        indices: &[usize],
        has_alternatives: bool,
        warnings: &mut Warnings,
    ) -> Result<(), LoadError> {
        let mut new: Vec<usize> = Vec::new();
        for &index in indices {
            if let Entry::Vacant(slot) = self.by_index.entry(index) {
                slot.insert(None);
                new.push(index);
            }
        }
        let cancel = &doc.folder.cancel;
        let read = |&i: &usize| {
            cancel.check()?;
            read_encoded(doc, i)
        };
        let encoded: Vec<_> = new.par_iter().map(read).collect();
        let encoded: Vec<Result<EncodedImage<'_>, String>> =
            encoded.into_iter().collect::<Result<_, LoadError>>()?;
        let sizes = encoded.iter().flatten().map(|image| image::decoded_size(&image.bytes));
        let new_bytes = sizes.fold(0, u64::saturating_add);
        self.bytes = self.bytes.saturating_add(new_bytes);
        LoadError::check_limit("bytes of decoded textures", self.bytes, doc.limits.texture_bytes)?;
        doc.budget.charge_images(new_bytes)?;
        let decode = |image: EncodedImage<'_>| {
            cancel.check().map_err(|cancelled| cancelled.to_string())?;
            image::decode(&image.name, &image.bytes, doc.limits)
        };
        let decoded: Vec<Result<Image, String>> =
            encoded.into_par_iter().map(|image| image.and_then(decode)).collect();
        cancel.check()?;
        for (image, index) in decoded.into_iter().zip(new) {
            match image {
                Ok(image) => {
                    self.by_index.insert(index, Some(self.decoded.len() as u32));
                    self.decoded.push(image);
                }
                Err(error) => {
                    let replacement = if has_alternatives {
                        "used the texture's next image, or white (flat for normal maps)"
                    } else {
                        "used white (flat for normal maps)"
                    };
                    warnings.add(format_args!("images[{index}]"), format_args!("{error}; {replacement}"));
                }
            }
        }
        Ok(())
    }
}

/// Reads one image. The inner error is a warning.
///
/// # Errors
/// The file exceeds a limit.
pub(super) fn read_image(doc: &Document<'_>, index: usize) -> Result<Result<Image, String>, LoadError> {
    let image = match read_encoded(doc, index)? {
        Ok(image) => image,
        Err(cause) => return Ok(Err(cause)),
    };
    let bytes = image::decoded_size(&image.bytes);
    LoadError::check_limit("bytes of decoded textures", bytes, doc.limits.texture_bytes)?;
    doc.budget.charge(bytes)?;
    Ok(image::decode(&image.name, &image.bytes, doc.limits))
}

/// Extensions whose images are in formats that are not decoded.
const UNREAD_FORMATS: [&str; 3] = ["EXT_texture_astc", "EXT_texture_avif", "MSFT_texture_dds"];

/// The alternative images of a texture, best first.
fn image_sources(doc: &Document<'_>, texture: usize, warnings: &mut Warnings) -> Vec<usize> {
    let Some(json) = doc.root().textures.get(texture) else { return Vec::new() };
    let others = json.extensions.as_ref().map(|e| &e.others);
    let extension = |name: &str| {
        let source = others.and_then(|o| o.get(name)).and_then(|e| e.get("source"));
        source.and_then(|s| s.as_u64()).map(|s| s as usize)
    };
    let core = json.source.value();
    let best = [extension("KHR_texture_basisu"), extension("EXT_texture_webp"), Some(core)];
    // The decoder's error says what the image is, unless it is one that can be read.
    let sources = best.into_iter().chain(UNREAD_FORMATS.map(extension));
    let exists = |i: &usize| doc.root().images.get(*i).is_some();
    let sources: Vec<usize> = sources.flatten().filter(exists).collect();
    if sources.is_empty() {
        let names = others.map(|o| o.keys().cloned().collect::<Vec<_>>().join(", ")).unwrap_or_default();
        let only = if names.is_empty() { String::new() } else { format!(" except in {}", printable(&names)) };
        let message = format!("has no image{only}; used white (flat for normal maps)");
        warnings.add(format_args!("textures[{texture}]"), message);
    }
    sources
}

/// Reads an image's encoded bytes from its buffer view or URI. The inner error is a warning.
///
/// # Errors
/// The file exceeds a limit.
fn read_encoded<'d>(
    doc: &'d Document<'_>,
    index: usize,
) -> Result<Result<EncodedImage<'d>, String>, LoadError> {
    let json = &doc.root().images[index];
    let is_data = |uri: &str| uri.trim_start().get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:"));
    let file = json.uri.as_deref().filter(|uri| !is_data(uri));
    let name = json.name.as_deref().filter(|n| !n.is_empty()).or(file);
    let name = name.map_or_else(|| format!("images[{index}]"), printable);
    let bytes = match (&json.uri, json.buffer_view) {
        (_, Some(view)) => match doc.buffer_view(view.value()) {
            Ok(view) => Cow::Borrowed(view.bytes),
            Err(e) => return Ok(Err(e.to_string())),
        },
        (Some(uri), None) => match doc.folder.read_uri(uri, doc.limits.file_bytes) {
            Ok(bytes) => {
                doc.budget.charge(bytes.len() as u64)?;
                Cow::Owned(bytes)
            }
            Err(e) => {
                let missing = || Ok(Err(format!("image '{name}': {}", e.message())));
                return e.limit_error(doc.limits.file_bytes).map_or_else(missing, Err);
            }
        },
        (None, None) => return Ok(Err(format!("image '{name}' has neither uri nor bufferView"))),
    };
    Ok(Ok(EncodedImage { name, bytes }))
}

/// The scene's texture with the sampler of the file's. Minification filters do not matter: textures are
/// filtered over the ray footprint.
fn with_sampler(doc: &Document<'_>, texture: usize, image: u32) -> Texture {
    let sampler = doc.root().textures[texture].sampler;
    let sampler = sampler.and_then(|s| doc.root().samplers.get(s.value()));
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    };
    let filter = match sampler.and_then(|s| s.mag_filter) {
        Some(Checked::Valid(MagFilter::Nearest)) => TextureFilter::Nearest,
        _ => TextureFilter::Linear,
    };
    let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]);
    Texture { image, wrap, filter, decode_last: false }
}
