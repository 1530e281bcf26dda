//! Descriptions of materials that do not depend on the order of a file's textures and images.

use twox_hash::XxHash3_128;

use blinn_scene::{ColorInput, Image, Material, Reflectance, ScalarInput, Scene, Texels, TextureRef};

/// Describes the materials of a scene.
pub struct MaterialDescriber {
    /// A digest of each texture: its image, wrap modes and filter.
    textures: Vec<u32>,
}

impl MaterialDescriber {
    /// Reads the images of a scene.
    pub fn new(scene: &Scene) -> MaterialDescriber {
        let images: Vec<u64> = scene.images.iter().map(image_digest).collect();
        let digest = |texture: &blinn_scene::Texture| {
            let image = images.get(texture.image as usize).copied().unwrap_or_default();
            let mut hasher = XxHash3_128::new();
            let settings = (texture.wrap, texture.filter, texture.decode_last);
            hasher.write(format!("{image} {settings:?}").as_bytes());
            // 32 bits, as an index has, are enough to tell the textures of a file.
            hasher.finish_128() as u32
        };
        MaterialDescriber { textures: scene.textures.iter().map(digest).collect() }
    }

    /// Describes everything about a material. Equal descriptions mean equal materials.
    pub fn describe(&self, material: &Material) -> String {
        let mut material = material.clone();
        for_each_texture(&mut material, &mut |texture| {
            texture.texture = self.textures.get(texture.texture as usize).copied().unwrap_or_default();
        });
        format!("{material:?}")
    }
}

/// A digest of an image's size and texels, without its name.
fn image_digest(image: &Image) -> u64 {
    let mut hasher = XxHash3_128::new();
    hasher.write(format!("{} {} {:?}", image.width, image.height, image.channels).as_bytes());
    match &image.texels {
        Texels::U8(texels) => hasher.write(texels),
        Texels::U16(texels) => hasher.write(bytemuck::cast_slice(texels)),
    }
    hasher.finish_128() as u64
}

fn for_each_texture(material: &mut Material, change: &mut dyn FnMut(&mut TextureRef)) {
    let Material {
        base_color,
        alpha,
        reflectance,
        emission,
        normal,
        occlusion,
        transmission,
        clearcoat,
        anisotropy,
        sheen,
        iridescence,
        diffuse_transmission,
        ..
    } = material;
    let mut colors: Vec<&mut ColorInput> =
        vec![base_color, emission, &mut sheen.color, &mut diffuse_transmission.color];
    let mut scalars: Vec<&mut ScalarInput> = vec![
        alpha,
        occlusion,
        transmission,
        &mut clearcoat.factor,
        &mut clearcoat.roughness,
        &mut sheen.roughness,
        &mut iridescence.factor,
        &mut diffuse_transmission.factor,
    ];
    match reflectance {
        Reflectance::Mtl(mtl) => {
            colors.push(&mut mtl.specular);
            colors.extend(&mut mtl.ambient);
        }
        Reflectance::MetallicRoughness { metallic, roughness, dielectric } => {
            scalars.extend([metallic, roughness, &mut dielectric.specular]);
            colors.push(&mut dielectric.specular_color);
        }
        Reflectance::SpecularGlossiness { specular, glossiness } => {
            colors.push(specular);
            scalars.push(glossiness);
        }
        Reflectance::Unlit | Reflectance::Unshaded => {}
    }
    anisotropy.iter_mut().flat_map(|of| &mut of.texture).for_each(&mut *change);
    iridescence.thickness_texture.iter_mut().for_each(&mut *change);
    colors.into_iter().flat_map(|color| &mut color.texture).for_each(&mut *change);
    scalars.into_iter().flat_map(|scalar| &mut scalar.texture).for_each(|(texture, _)| change(texture));
    normal.iter_mut().chain(&mut clearcoat.normal).for_each(|map| change(&mut map.texture));
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_scene::{Channels, MipMaps, Texture, TextureFilter, UvTransform, Wrap};

    fn image(value: u8) -> Image {
        let (channels, mips) = (Channels::L, MipMaps::default());
        Image { name: "i".into(), width: 1, height: 1, channels, texels: Texels::U8(vec![value]), mips }
    }

    fn material(texture: u32) -> Material {
        let texture = Some(TextureRef { texture, uv_set: 0, transform: UvTransform::IDENTITY });
        Material { base_color: ColorInput { texture, ..Default::default() }, ..Material::default() }
    }

    #[test]
    fn descriptions_follow_the_texels_and_not_the_order() {
        let texture = |image: u32| Texture {
            image,
            wrap: [Wrap::Repeat; 2],
            filter: TextureFilter::Linear,
            decode_last: false,
        };
        let scene = |values: [u8; 2]| Scene {
            images: values.map(image).into(),
            textures: vec![texture(0), texture(1)],
            ..Scene::default()
        };
        let [old, new] = [scene([1, 2]), scene([2, 1])].map(|scene| MaterialDescriber::new(&scene));
        assert_eq!(old.describe(&material(0)), new.describe(&material(1)));
        assert_ne!(old.describe(&material(0)), new.describe(&material(0)));
        let brighter = Material { emission_strength: 2.0, ..material(0) };
        assert_ne!(old.describe(&brighter), old.describe(&material(0)));
    }
}
