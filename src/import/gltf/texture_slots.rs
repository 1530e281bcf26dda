//! The texture infos of materials: their textures, sets of texture coordinates and transforms.

use ::gltf::json::extensions::texture::TextureTransform;
use ::gltf::json::material::{NormalTexture, OcclusionTexture};
use ::gltf::json::texture::Info;
use glam::Vec3;
use serde_json::{Map, Value};

use blinn_scene::{ColorInput, NormalMap, ScalarInput, TextureChannel, TextureRef, UvTransform};

/// Reads the texture infos of a material.
pub(super) struct TextureSlots<'f> {
    /// Maps a texture's index in the file to the scene's, or to `None` for white.
    resolve: &'f mut dyn FnMut(usize) -> Option<u32>,
}

impl<'f> TextureSlots<'f> {
    pub fn new(resolve: &'f mut dyn FnMut(usize) -> Option<u32>) -> TextureSlots<'f> {
        TextureSlots { resolve }
    }

    pub fn color(&mut self, factor: Vec3, info: Option<&Info>) -> ColorInput {
        ColorInput { factor, texture: self.info(info) }
    }

    pub fn scalar(&mut self, factor: f32, info: Option<&Info>, channel: TextureChannel) -> ScalarInput {
        ScalarInput { factor, texture: self.info(info).map(|t| (t, channel)) }
    }

    pub fn normal(&mut self, map: &NormalTexture) -> Option<NormalMap> {
        let transform = map.extensions.as_ref().and_then(|e| untyped_transform(&e.others));
        let texture = self.texture(map.index.value(), map.tex_coord, transform.as_ref())?;
        Some(NormalMap { texture, scale: map.scale, scale_is_strength: false })
    }

    pub fn occlusion(&mut self, map: &OcclusionTexture) -> ScalarInput {
        let transform = map.extensions.as_ref().and_then(|e| untyped_transform(&e.others));
        let texture = self.texture(map.index.value(), map.tex_coord, transform.as_ref());
        ScalarInput { factor: map.strength.0, texture: texture.map(|t| (t, TextureChannel::R)) }
    }

    pub fn info(&mut self, info: Option<&Info>) -> Option<TextureRef> {
        let info = info?;
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.texture(info.index.value(), info.tex_coord, transform)
    }

    fn texture(
        &mut self,
        index: usize,
        uv_set: u32,
        transform: Option<&TextureTransform>,
    ) -> Option<TextureRef> {
        let texture = (self.resolve)(index)?;
        let matrix =
            |t: &TextureTransform| UvTransform::khr(t.offset.0.into(), t.rotation.0, t.scale.0.into());
        Some(TextureRef {
            texture,
            uv_set: transform.and_then(|t| t.tex_coord).unwrap_or(uv_set),
            transform: transform.map_or(UvTransform::IDENTITY, matrix),
        })
    }
}

/// KHR_texture_transform of a texture info whose extensions are untyped in `gltf::json`.
fn untyped_transform(others: &Map<String, Value>) -> Option<TextureTransform> {
    serde_json::from_value(others.get("KHR_texture_transform")?.clone()).ok()
}
