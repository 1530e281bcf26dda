//! Materials of formats that name images but no materials: matte and white, as those that no library defines.

use glam::Vec2;

use super::material::{build_material, undefined_material};
use super::mtl::MtlMaterial;
use super::texture_map::{TexelRange, TextureMap};
use super::textures::TextureLibrary;
use crate::Limits;
use crate::error::{LoadError, Warnings};
use crate::files::scene_folder::SceneFolder;
use crate::memory::MemoryBudget;
use blinn_scene::{Image, Material, Texture};

/// Materials with their images.
pub(crate) struct TexturedMaterials {
    pub materials: Vec<Material>,
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
}

/// Returns a material for each image in `files`, or one without image if there is none.
pub(crate) fn textured_materials(
    files: &[String],
    folder: &SceneFolder,
    limits: &Limits,
    budget: &MemoryBudget,
    warnings: &mut Warnings,
) -> Result<TexturedMaterials, LoadError> {
    if files.is_empty() {
        let materials = vec![undefined_material("", None)];
        return Ok(TexturedMaterials { materials, images: Vec::new(), textures: Vec::new() });
    }
    let with_map = |file: &String| {
        let map = TextureMap {
            file: file.clone(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            bump: 1.0,
            channel: None,
            range: TexelRange::FULL,
        };
        MtlMaterial { map_kd: Some(map), ..MtlMaterial::default() }
    };
    let mtls: Vec<MtlMaterial> = files.iter().map(with_map).collect();
    let used: Vec<&MtlMaterial> = mtls.iter().collect();
    let mut library = TextureLibrary::load(&used, folder, limits, budget, warnings)?;
    let materials = mtls.iter().map(|mtl| build_material(mtl, &mut library, warnings)).collect();
    Ok(TexturedMaterials { materials, images: library.images, textures: library.textures })
}
