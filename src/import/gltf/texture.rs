//! Images, samplers and what materials make of them.

use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

use ::gltf::json::texture::{MagFilter, WrappingMode};
use ::gltf::json::validation::Checked;
use rayon::prelude::*;

use super::document::Document;
use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;
use crate::import::image;
use crate::scene::{Image, Texture, TextureFilter, Wrap};

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

    /// Decodes the images of these textures, in parallel, each once. A texture whose image cannot
    /// be read takes the next that it offers.
    pub fn read(
        doc: &Document<'_>,
        wanted: &[usize],
        warnings: &mut Warnings,
    ) -> Result<Textures, LoadError> {
        let mut images = Images::default();
        let mut open: Vec<(usize, Vec<usize>)> = Vec::new();
        for &texture in wanted {
            let offers = sources(doc, texture, warnings);
            open.extend((!offers.is_empty()).then_some((texture, offers)));
        }
        let mut image_of: HashMap<usize, u32> = HashMap::new();
        // Each round settles every texture that is left, or shortens what it offers.
        while !open.is_empty() {
            let first: Vec<usize> = open.iter().map(|(_, offers)| offers[0]).collect();
            images.read(doc, &first, open.iter().all(|(_, o)| o.len() == 1), warnings)?;
            open.retain_mut(|(texture, offers)| match images.slots.get(&offers[0]).copied().flatten() {
                Some(image) => {
                    image_of.insert(*texture, image);
                    false
                }
                None => {
                    offers.remove(0);
                    !offers.is_empty()
                }
            });
        }
        let mut out = Textures { images: images.decoded, ..Textures::default() };
        for &texture in wanted {
            if let Some(&image) = image_of.get(&texture)
                && !out.by_index.contains_key(&texture)
            {
                out.by_index.insert(texture, out.textures.len() as u32);
                out.textures.push(sampled(doc, texture, image));
            }
        }
        Ok(out)
    }
}

/// The file's images that have been asked for.
#[derive(Debug, Default)]
struct Images {
    decoded: Vec<Image>,
    /// The place of each among `decoded`; `None` where it could not be read.
    slots: HashMap<usize, Option<u32>>,
    bytes: u64,
}

impl Images {
    /// Decodes those that are new. `last` says that nothing stands in for what fails.
    fn read(
        &mut self,
        doc: &Document<'_>,
        wanted: &[usize],
        last: bool,
        warnings: &mut Warnings,
    ) -> Result<(), LoadError> {
        let mut new: Vec<usize> = Vec::new();
        for &source in wanted {
            if let Entry::Vacant(slot) = self.slots.entry(source) {
                slot.insert(None);
                new.push(source);
            }
        }
        let files: Vec<_> = new.par_iter().map(|&i| bytes(doc, i)).collect();
        let files: Vec<Result<File<'_>, String>> = files.into_iter().collect::<Result<_, LoadError>>()?;
        let sizes = files.iter().flatten().map(|(_, bytes)| image::decoded_size(bytes));
        let new_bytes = sizes.fold(0, u64::saturating_add);
        self.bytes = self.bytes.saturating_add(new_bytes);
        LoadError::check_limit("bytes of decoded textures", self.bytes, doc.limits.texture_bytes)?;
        doc.budget.charge_images(new_bytes)?;
        let decoded: Vec<Result<Image, String>> = files
            .into_par_iter()
            .map(|file| file.and_then(|(name, bytes)| image::decode(&name, &bytes, doc.limits)))
            .collect();
        for (image, source) in decoded.into_iter().zip(new) {
            match image {
                Ok(image) => {
                    self.slots.insert(source, Some(self.decoded.len() as u32));
                    self.decoded.push(image);
                }
                Err(why) => {
                    let then = if last {
                        "its textures are white, or flat as normal maps"
                    } else {
                        "textures take what else they offer, or are white, or flat as normal maps"
                    };
                    warnings.add(format_args!("images[{source}]"), format_args!("{why}; {then}"));
                }
            }
        }
        Ok(())
    }
}

/// The images that a texture offers, best first.
fn sources(doc: &Document<'_>, texture: usize, warnings: &mut Warnings) -> Vec<usize> {
    let Some(json) = doc.root().textures.get(texture) else { return Vec::new() };
    let others = json.extensions.as_ref().map(|e| &e.others);
    let extension = |name: &str| {
        let source = others.and_then(|o| o.get(name)).and_then(|e| e.get("source"));
        source.and_then(|s| s.as_u64()).map(|s| s as usize)
    };
    let own = json.source.value();
    let offers = [extension("KHR_texture_basisu"), extension("EXT_texture_webp"), Some(own)];
    let there = |i: &usize| doc.root().images.get(*i).is_some();
    let offers: Vec<usize> = offers.into_iter().flatten().filter(there).collect();
    if offers.is_empty() {
        let names = others.map(|o| o.keys().cloned().collect::<Vec<_>>().join(", ")).unwrap_or_default();
        let why = if names.is_empty() { String::new() } else { format!(" but in {}", printable(&names)) };
        warnings.add(
            format_args!("textures[{texture}]"),
            format_args!("has no image{why}; it is white, or flat as a normal map"),
        );
    }
    offers
}

/// The file that holds an image, with a name for it, or why there is none.
///
/// # Errors
/// More bytes than are allowed.
fn bytes<'d>(doc: &'d Document<'_>, index: usize) -> Result<Result<File<'d>, String>, LoadError> {
    let json = &doc.root().images[index];
    let is_data = |uri: &str| uri.trim_start().get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:"));
    let file = json.uri.as_deref().filter(|uri| !is_data(uri));
    let name = json.name.as_deref().filter(|n| !n.is_empty()).or(file);
    let name = name.map_or_else(|| format!("images[{index}]"), printable);
    let bytes = match (&json.uri, json.buffer_view) {
        (_, Some(view)) => match doc.view(view.value()) {
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
    Ok(Ok((name, bytes)))
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
        Some(Checked::Valid(MagFilter::Nearest)) => TextureFilter::Nearest,
        _ => TextureFilter::Linear,
    };
    let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]);
    Texture { image, wrap, filter, decode_last: false }
}
