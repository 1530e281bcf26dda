//! Images, samplers and what materials make of them.

use std::borrow::Cow;
use std::collections::HashMap;

use ::gltf::json::texture::{MagFilter, WrappingMode};
use ::gltf::json::validation::Checked;
use rayon::prelude::*;

use super::document::Document;
use crate::import::error::{LoadError, Warnings};
use crate::import::image;
use crate::import::uri::printable;
use crate::scene::{Filter, Image, Pixels, Texture, Wrap};

/// An image's name and its encoded bytes.
type File<'d> = (String, Cow<'d, [u8]>);

/// The textures that a scene uses, decoded.
#[derive(Debug, Default)]
pub(super) struct Textures {
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    by_index: HashMap<usize, u32>,
}

impl Textures {
    /// The scene's texture for the file's, unless its image could not be read.
    pub fn get(&self, index: usize) -> Option<u32> {
        self.by_index.get(&index).copied()
    }

    /// Decodes the images of these textures, in parallel, each once.
    pub fn read(
        doc: &Document<'_>,
        wanted: &[usize],
        warnings: &mut Warnings,
    ) -> Result<Textures, LoadError> {
        let mut sources: Vec<usize> = Vec::new();
        let mut image_of: HashMap<usize, usize> = HashMap::new();
        for &texture in wanted {
            if let Some(image) = source(doc, texture, warnings) {
                let slot = sources.iter().position(|&s| s == image).unwrap_or_else(|| {
                    sources.push(image);
                    sources.len() - 1
                });
                image_of.insert(texture, slot);
            }
        }
        let files: Vec<Result<File<'_>, String>> = sources.par_iter().map(|&i| bytes(doc, i)).collect();
        let texels = files.iter().flatten().filter_map(|(_, b)| image::dimensions(b));
        let total = texels.fold(0u64, |sum, (w, h)| sum.saturating_add(u64::from(w) * u64::from(h) * 4));
        LoadError::check("bytes of decoded textures", total, doc.limits.texture_bytes)?;
        let decoded: Vec<Result<Image, String>> = files
            .into_par_iter()
            .map(|file| file.and_then(|(name, bytes)| image::decode(&name, &bytes, doc.limits)))
            .collect();

        let mut out = Textures::default();
        let mut slots: Vec<Option<u32>> = Vec::with_capacity(decoded.len());
        for (image, &source) in decoded.into_iter().zip(&sources) {
            match image {
                Ok(image) => {
                    slots.push(Some(out.images.len() as u32));
                    out.images.push(image);
                }
                Err(why) => {
                    warnings
                        .add(format_args!("images[{source}]"), format_args!("{why}; its textures are white"));
                    slots.push(None);
                }
            }
        }
        let size = |image: &Image| match &image.pixels {
            Pixels::Rgba8(p) => 4 * p.len() as u64,
            Pixels::Rgba16(p) => 8 * p.len() as u64,
        };
        let total = out.images.iter().map(size).sum();
        LoadError::check("bytes of decoded textures", total, doc.limits.texture_bytes)?;
        for &texture in wanted {
            let image = image_of.get(&texture).and_then(|&slot| slots[slot]);
            if let Some(image) = image.filter(|_| !out.by_index.contains_key(&texture)) {
                out.by_index.insert(texture, out.textures.len() as u32);
                out.textures.push(sampled(doc, texture, image));
            }
        }
        Ok(out)
    }
}

/// The image that a texture shows.
fn source(doc: &Document<'_>, texture: usize, warnings: &mut Warnings) -> Option<usize> {
    let json = doc.root().textures.get(texture)?;
    let others = json.extensions.as_ref().map(|e| &e.others);
    let webp = others.and_then(|o| o.get("EXT_texture_webp")).and_then(|e| e.get("source"));
    let webp = webp.and_then(|s| s.as_u64()).map(|s| s as usize);
    let image = webp.unwrap_or(json.source.value());
    if doc.root().images.get(image).is_some() {
        return Some(image);
    }
    let others = others.map(|o| o.keys().cloned().collect::<Vec<_>>().join(", ")).unwrap_or_default();
    let why = if others.is_empty() { String::new() } else { format!(" but in {}", printable(&others)) };
    warnings.add(format_args!("textures[{texture}]"), format_args!("has no image{why}; it is white"));
    None
}

/// The file that holds an image, with a name for it.
fn bytes<'d>(doc: &'d Document<'_>, index: usize) -> Result<File<'d>, String> {
    let json = &doc.root().images[index];
    let is_data = |uri: &str| uri.trim_start().get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:"));
    let file = json.uri.as_deref().filter(|uri| !is_data(uri));
    let name = json.name.as_deref().filter(|n| !n.is_empty()).or(file);
    let name = name.map_or_else(|| format!("images[{index}]"), printable);
    let bytes = match (&json.uri, json.buffer_view) {
        (_, Some(view)) => Cow::Borrowed(doc.view(view.value()).map_err(|e| e.to_string())?.bytes),
        (Some(uri), None) => {
            let read = doc.folder.read_uri(uri, doc.limits.file_bytes);
            Cow::Owned(read.map_err(|e| format!("image '{name}': {}", e.text()))?)
        }
        (None, None) => return Err(format!("image '{name}' has neither uri nor bufferView")),
    };
    Ok((name, bytes))
}

fn sampled(doc: &Document<'_>, texture: usize, image: u32) -> Texture {
    let sampler = doc.root().textures[texture].sampler;
    let sampler = sampler.and_then(|s| doc.root().samplers.get(s.value()));
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    };
    let filter = match sampler.and_then(|s| s.mag_filter) {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Linear,
    };
    let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]);
    Texture { image, wrap, filter }
}
