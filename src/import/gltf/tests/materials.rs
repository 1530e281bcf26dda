//! Materials and textures.

use std::io::Cursor;

use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::super::fixture::Fixture;
use super::super::pointer::{self, PointerTarget};
use crate::{Limits, LoadOptions};
use blinn_scene::{
    AlphaMode, Anisotropy, AnisotropyModel, Material, MaterialProperty, NormalMap, Reflectance, Scene,
    TexelSemantics, TextureChannel, TextureFilter, TextureSlot, Wrap,
};

fn png(color: [u8; 4]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(2, 1, image::Rgba(color))
        .write_to(&mut file, image::ImageFormat::Png)
        .unwrap();
    file.into_inner()
}

/// A textured triangle with its red image in the binary chunk.
pub(super) fn textured(material: Value) -> Fixture {
    textured_with([255, 0, 0, 255], material)
}

/// A triangle with an image of one colour.
pub(super) fn textured_with(texel: [u8; 4], material: Value) -> Fixture {
    let mut fixture = Fixture::triangle();
    let view = fixture.view(&png(texel));
    fixture.push("images", json!({"name": "red", "bufferView": view, "mimeType": "image/jpeg"}));
    fixture.push("textures", json!({"source": 0}));
    let uvs = fixture.vec2(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    fixture.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    fixture.primitive()["material"] = json!(0);
    fixture.push("materials", material);
    fixture
}

fn material(json: Value) -> Material {
    textured(json).load().0.materials[0].clone()
}

#[test]
fn the_default_material_is_gltfs() {
    let (scene, _) = Fixture::triangle().load();
    let Reflectance::MetallicRoughness { metallic, roughness, .. } = scene.materials[0].reflectance else {
        panic!("not metallic-roughness")
    };
    assert_eq!((metallic.factor, roughness.factor), (1.0, 1.0));
    assert_eq!(scene.materials[0].base_color.factor, Vec3::ONE);
    assert!(scene.materials[0].alpha_from_base && !scene.materials[0].double_sided);
}

/// Blender's exporter writes no material for meshes without one, which are diffuse and double-sided in
/// Blender.
#[test]
fn the_default_material_of_blender_files_is_diffuse_and_double_sided() {
    let mut fixture = Fixture::triangle();
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
    let (scene, _) = fixture.load();
    let Reflectance::MetallicRoughness { metallic, roughness, .. } = scene.materials[0].reflectance else {
        panic!("not metallic-roughness")
    };
    assert_eq!((metallic.factor, roughness.factor), (0.0, 1.0));
    assert!(scene.materials[0].base_color.factor == Vec3::ONE && scene.materials[0].double_sided);
}

/// Blender's exporter writes only the name of a Diffuse BSDF.
#[test]
fn materials_without_parameters_in_blender_files_are_diffuse() {
    let metallic = |m: Value, generator: &str| {
        let mut fixture = textured(m);
        fixture.json["asset"]["generator"] = json!(generator);
        let (scene, warnings) = fixture.load();
        let Reflectance::MetallicRoughness { metallic, .. } = scene.materials[0].reflectance else {
            panic!()
        };
        (metallic.factor, warnings.iter().filter(|w| w.contains("'Clay' has no shading parameters")).count())
    };
    let blender = "Khronos glTF Blender I/O v5.0.21";
    let clay = json!({"name": "Clay", "doubleSided": true});
    assert_eq!(metallic(clay.clone(), blender), (0.0, 1));
    assert_eq!(metallic(clay, ""), (1.0, 0));
    // Parameters of a Principled BSDF are kept.
    for material in [
        json!({"name": "Clay", "pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.9, 0.9, 1]}}),
        json!({"name": "Clay", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
        json!({"name": "Clay", "pbrMetallicRoughness": {"roughnessFactor": 0.5}}),
        json!({"name": "Clay", "normalTexture": {"index": 0}}),
        json!({"name": "Clay", "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}}),
    ] {
        assert_eq!(metallic(material.clone(), blender), (1.0, 0), "{material}");
    }
}

#[test]
fn metallic_roughness_materials_and_their_extensions_are_read() {
    let m = material(json!({"name": "m", "doubleSided": true, "alphaMode": "MASK",
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5,
            "roughnessFactor": 0.6, "baseColorTexture": {"index": 0, "texCoord": 2},
            "metallicRoughnessTexture": {"index": 0}},
        "occlusionTexture": {"index": 0, "strength": 0.7}, "normalTexture": {"index": 0, "scale": 0.8},
        "emissiveFactor": [1, 2, 3], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 9},
            "KHR_materials_ior": {"ior": 1.3}, "KHR_materials_transmission": {"transmissionFactor": 0.9},
            "KHR_materials_specular": {"specularFactor": 0.25, "specularColorFactor": [1, 0, 0],
                "specularTexture": {"index": 0}}}}));
    assert_eq!((m.name.as_str(), m.alpha_mode, m.double_sided), ("m", AlphaMode::Mask(0.5), true));
    assert_eq!((m.base_color.factor, m.alpha.factor), (Vec3::new(0.1, 0.2, 0.3), 0.4));
    assert_eq!(m.base_color.texture.unwrap().uv_set, 2);
    assert_eq!((m.occlusion.factor, m.occlusion.texture.unwrap().1), (0.7, TextureChannel::R));
    assert_eq!((m.emission.factor, m.emission_strength), (Vec3::new(1.0, 2.0, 3.0), 9.0));
    assert_eq!((m.normal.unwrap().scale, m.transmission.factor), (0.8, 0.9));
    let Reflectance::MetallicRoughness { metallic, roughness, dielectric } = m.reflectance else { panic!() };
    assert_eq!(
        (metallic.texture.unwrap().1, roughness.texture.unwrap().1),
        (TextureChannel::B, TextureChannel::G)
    );
    assert_eq!((dielectric.ior, dielectric.specular.factor), (1.3, 0.25));
    assert_eq!(dielectric.specular.texture.unwrap().1, TextureChannel::A);
}

#[test]
fn clear_coats_and_volumes_are_read() {
    let coat = json!({"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 0, "texCoord": 1},
        "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": {"index": 0},
        "clearcoatNormalTexture": {"index": 0, "texCoord": 1, "scale": 0.5,
            "extensions": {"KHR_texture_transform": {"texCoord": 0, "scale": [2, 1]}}}});
    let volume = json!({"thicknessFactor": 0.1, "attenuationDistance": 2, "attenuationColor": [0.5, 1, 2]});
    let m =
        material(json!({"extensions": {"KHR_materials_clearcoat": coat, "KHR_materials_volume": volume}}));
    assert_eq!((m.clearcoat.factor.factor, m.clearcoat.roughness.factor), (0.5, 0.25));
    let (texture, channel) = m.clearcoat.factor.texture.unwrap();
    assert_eq!((texture.uv_set, channel), (1, TextureChannel::R));
    assert_eq!(m.clearcoat.roughness.texture.unwrap().1, TextureChannel::G);
    let NormalMap { texture, scale, .. } = m.clearcoat.normal.unwrap();
    assert_eq!((texture.uv_set, texture.transform.apply(Vec2::ONE), scale), (0, Vec2::new(2.0, 1.0), 0.5));
    let volume = m.volume.unwrap();
    assert_eq!((volume.thickness, volume.attenuation_distance), (0.1, 2.0));
    assert_eq!(volume.attenuation_color, Vec3::new(0.5, 1.0, 1.0));
    // A thickness of 0 is a thin wall.
    let thin = json!({"extensions": {"KHR_materials_volume": {"attenuationDistance": 1}}});
    assert_eq!(material(thin).volume, None);
    let clear =
        json!({"extensions": {"KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0}}});
    assert_eq!(material(clear).volume.unwrap().attenuation_distance, f32::INFINITY);
}

#[test]
fn anisotropy_and_sheen_are_read() {
    let anisotropy = json!({"anisotropyStrength": 0.5, "anisotropyRotation": -1.5,
        "anisotropyTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}});
    let sheen = json!({"sheenColorFactor": [0.1, 0.2, 2], "sheenColorTexture": {"index": 0},
        "sheenRoughnessFactor": 0.25, "sheenRoughnessTexture": {"index": 0, "texCoord": 1}});
    let file = textured(json!({"extensions":
        {"KHR_materials_anisotropy": anisotropy, "KHR_materials_sheen": sheen}}));
    let (scene, warnings) = file.load();
    let m = &scene.materials[0];
    let Anisotropy { strength, rotation, texture, model } = m.anisotropy.unwrap();
    assert_eq!((strength, rotation, model), (0.5, -1.5, AnisotropyModel::Gltf));
    assert_eq!(texture.unwrap().transform.apply(Vec2::ONE), Vec2::new(2.0, 3.0));
    assert_eq!((m.sheen.color.factor, m.sheen.roughness.factor), (Vec3::new(0.1, 0.2, 2.0), 0.25));
    assert!(m.sheen.color.texture.is_some());
    let (texture, channel) = m.sheen.roughness.texture.unwrap();
    assert_eq!((texture.uv_set, channel), (1, TextureChannel::A));
    let bright = "materials[0].extensions.KHR_materials_sheen.sheenColorFactor: has the value 2, expected 0 to 1 or bytes";
    assert_eq!(warnings, [bright]);
    // Stretched highlights need tangents, also without a texture.
    assert_eq!(scene.meshes[0].tangents.len(), scene.meshes[0].positions.len());
    let plain = json!({"extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 1}}});
    let (scene, _) = textured(plain).load();
    assert!(scene.materials[0].is_layered() && !scene.meshes[0].tangents.is_empty());
}

#[test]
fn iridescence_is_read() {
    let film = json!({"iridescenceFactor": 0.75, "iridescenceTexture": {"index": 0}, "iridescenceIor": 1.8,
        "iridescenceThicknessMaximum": 600, "iridescenceThicknessTexture":
        {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}});
    let (scene, warnings) = textured(json!({"extensions": {"KHR_materials_iridescence": film}})).load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let m = &scene.materials[0];
    let film = &m.iridescence;
    assert_eq!((film.factor.factor, film.factor.texture.unwrap().1), (0.75, TextureChannel::R));
    assert_eq!((film.ior, film.min_thickness, film.max_thickness), (1.8, 100.0, 600.0));
    let texture = film.thickness_texture.unwrap();
    assert_eq!((texture.uv_set, texture.transform.apply(Vec2::ONE)), (1, Vec2::new(2.0, 3.0)));
    assert!(m.is_layered() && m.textures().count() == 2);
    let bad = json!({"iridescenceFactor": 2, "iridescenceIor": 0.5, "iridescenceThicknessMinimum": -1});
    let (scene, warnings) = textured(json!({"extensions": {"KHR_materials_iridescence": bad}})).load();
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    let film = &scene.materials[0].iridescence;
    assert!(film.factor.factor == 1.0 && film.ior >= 1.0 && film.min_thickness == 0.0, "{film:?}");
}

#[test]
fn diffuse_transmission_is_read() {
    let extension = json!({"diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": {"index": 0},
        "diffuseTransmissionColorFactor": [0.1, 0.2, 0.3],
        "diffuseTransmissionColorTexture": {"index": 0, "texCoord": 1}});
    let name = "KHR_materials_diffuse_transmission";
    let volume = json!({"thicknessFactor": 1});
    let material = json!({"extensions": {name: extension, "KHR_materials_volume": volume}});
    let (scene, warnings) = textured(material).load();
    assert!(warnings.is_empty(), "{warnings:?}");
    let m = &scene.materials[0];
    let transmission = &m.diffuse_transmission;
    assert_eq!(
        (transmission.factor.factor, transmission.factor.texture.unwrap().1),
        (0.5, TextureChannel::A)
    );
    assert_eq!(transmission.color.factor, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!(transmission.color.texture.unwrap().uv_set, 1);
    assert!(m.is_layered() && m.diffuses_inside());
    let (scene, _) = textured(json!({"extensions": {name: {"diffuseTransmissionFactor": 1}}})).load();
    let m = &scene.materials[0];
    assert_eq!(m.diffuse_transmission.color.factor, Vec3::ONE);
    assert!(m.is_layered() && !m.diffuses_inside());
}

#[test]
fn dispersion_is_read() {
    let dispersion = |value: Value| {
        let extension = json!({"KHR_materials_dispersion": {"dispersion": value}});
        let (scene, warnings) = textured(json!({"extensions": extension})).load();
        (scene.materials[0].dispersion, warnings.len())
    };
    assert_eq!(dispersion(json!(0.5)), (0.5, 0));
    assert_eq!(dispersion(json!(-1)), (0.0, 1));
    assert_eq!(dispersion(json!([1])), (0.0, 1));
}

#[test]
fn factors_of_layers_can_be_animated() {
    for (pointer, expected) in [
        ("KHR_materials_anisotropy/anisotropyStrength", MaterialProperty::AnisotropyStrength),
        ("KHR_materials_anisotropy/anisotropyRotation", MaterialProperty::AnisotropyRotation),
        ("KHR_materials_sheen/sheenColorFactor", MaterialProperty::SheenColor),
        ("KHR_materials_sheen/sheenRoughnessFactor", MaterialProperty::SheenRoughness),
        ("KHR_materials_clearcoat/clearcoatNormalTexture/scale", MaterialProperty::ClearcoatNormalScale),
        (
            "KHR_materials_diffuse_transmission/diffuseTransmissionFactor",
            MaterialProperty::DiffuseTransmission,
        ),
        (
            "KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor",
            MaterialProperty::DiffuseTransmissionColor,
        ),
        (
            "KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture/extensions/KHR_texture_transform/offset",
            MaterialProperty::Offset(TextureSlot::DiffuseTransmissionColor),
        ),
        ("KHR_materials_dispersion/dispersion", MaterialProperty::Dispersion),
        ("KHR_materials_iridescence/iridescenceFactor", MaterialProperty::Iridescence),
        ("KHR_materials_iridescence/iridescenceIor", MaterialProperty::IridescenceIor),
        ("KHR_materials_iridescence/iridescenceThicknessMinimum", MaterialProperty::IridescenceMinThickness),
        ("KHR_materials_iridescence/iridescenceThicknessMaximum", MaterialProperty::IridescenceMaxThickness),
        (
            "KHR_materials_iridescence/iridescenceThicknessTexture/extensions/KHR_texture_transform/rotation",
            MaterialProperty::Rotation(TextureSlot::IridescenceThickness),
        ),
        (
            "KHR_materials_anisotropy/anisotropyTexture/extensions/KHR_texture_transform/offset",
            MaterialProperty::Offset(TextureSlot::Anisotropy),
        ),
        (
            "KHR_materials_sheen/sheenColorTexture/extensions/KHR_texture_transform/scale",
            MaterialProperty::Scale(TextureSlot::SheenColor),
        ),
    ] {
        let target = pointer::parse(&format!("/materials/3/extensions/{pointer}"));
        assert_eq!(target, Some(PointerTarget::Material(3, expected)), "{pointer}");
    }
}

#[test]
fn invalid_members_of_clear_coats_are_ignored_one_by_one() {
    let coat = json!({"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": [1], "clearcoatTexture": 3,
        "clearcoatNormalTexture": 7});
    let (scene, warnings) = textured(json!({"extensions": {"KHR_materials_clearcoat": coat}})).load();
    let coat = scene.materials[0].clearcoat;
    assert_eq!((coat.factor.factor, coat.factor.texture, coat.roughness.factor), (0.5, None, 0.0));
    let place = "materials[0].extensions.KHR_materials_clearcoat";
    for expected in [
        format!("{place}.clearcoatRoughnessFactor: ignored invalid value [1]"),
        format!("{place}.clearcoatTexture: ignored invalid value 3"),
        format!("{place}.clearcoatNormalTexture: ignored invalid value 7"),
    ] {
        assert!(warnings.contains(&expected), "{expected}: {warnings:?}");
    }
}

/// Unlit materials, and dielectrics without a specular share, are matte.
#[test]
fn physical_materials_reflect_their_surroundings() {
    let reflects = |json: Value| material(json).reflects();
    assert!(reflects(json!({})) && reflects(json!({"pbrMetallicRoughness": {"metallicFactor": 0}})));
    let matte = json!({"KHR_materials_specular": {"specularFactor": 0}});
    let dielectric = json!({"metallicFactor": 0});
    assert!(!reflects(json!({"pbrMetallicRoughness": dielectric, "extensions": matte})));
    assert!(reflects(json!({"pbrMetallicRoughness": {}, "extensions": matte})));
    assert!(!reflects(json!({"extensions": {"KHR_materials_unlit": {}}})));
}

#[test]
fn specular_glossiness_and_unlit_materials_are_read() {
    let old = json!({"diffuseFactor": [0.1, 0.2, 0.3, 0.4], "specularFactor": [0.5, 0.5, 0.5],
        "glossinessFactor": 0.6, "specularGlossinessTexture": {"index": 0}});
    let m = material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": old}}));
    let Reflectance::SpecularGlossiness { specular, glossiness } = m.reflectance else { panic!() };
    assert_eq!(
        (m.base_color.factor.z, m.alpha.factor, specular.factor.x, glossiness.factor),
        (0.3, 0.4, 0.5, 0.6)
    );
    assert_eq!(glossiness.texture.unwrap().1, TextureChannel::A);
    let m = material(json!({"extensions": {"KHR_materials_unlit": {}}, "alphaMode": "BLEND"}));
    assert_eq!((m.reflectance, m.alpha_mode), (Reflectance::Unlit, AlphaMode::Blend));
}

#[test]
fn texture_transforms_are_read_in_every_texture_info() {
    let slot = json!({"index": 0, "texCoord": 1,
        "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 3], "texCoord": 0}}});
    let m = material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": slot, "metallicRoughnessTexture": slot},
        "normalTexture": slot, "occlusionTexture": slot, "emissiveTexture": slot}));
    let Reflectance::MetallicRoughness { metallic, .. } = m.reflectance else { panic!() };
    let slots = [
        m.base_color.texture,
        metallic.texture.map(|t| t.0),
        m.normal.map(|n| n.texture),
        m.occlusion.texture.map(|t| t.0),
        m.emission.texture,
    ];
    for slot in slots {
        let slot = slot.unwrap();
        assert_eq!((slot.uv_set, slot.transform.apply(Vec2::ONE)), (0, Vec2::new(2.5, 3.0)));
    }
}

pub(super) fn base_texture(scene: &Scene) -> Option<Vec4> {
    let slot = scene.materials[0].base_color.texture?;
    Some(scene.textures[slot.texture as usize].sample(&scene.images, Vec2::splat(0.5), TexelSemantics::Color))
}

const BASE: &str = r#"{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}"#;

pub(super) fn base() -> Value {
    serde_json::from_str(BASE).unwrap()
}

#[test]
fn images_are_read_from_buffers_data_uris_and_extensions() {
    let red = Some(Vec4::new(1.0, 0.0, 0.0, 1.0));
    let fixture = textured(base());
    let (scene, warnings) = fixture.load();
    assert_eq!((base_texture(&scene), warnings.len()), (red, 0));
    assert_eq!(scene.images[0].name, "red");

    let mut data = fixture.clone();
    let bytes: String = png([255, 0, 0, 255]).iter().map(|b| format!("%{b:02x}")).collect();
    data.json["images"][0] = json!({"uri": format!("data:,{bytes}")});
    assert_eq!(base_texture(&data.load().0), red);

    let mut webp = fixture;
    let mut file = Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_pixel(1, 1, image::Rgba([0, 255, 0, 255]));
    pixels.write_to(&mut file, image::ImageFormat::WebP).unwrap();
    let view = webp.view(&file.into_inner());
    webp.push("images", json!({"bufferView": view}));
    webp.json["textures"][0]["extensions"] = json!({"EXT_texture_webp": {"source": 1}});
    assert_eq!(base_texture(&webp.load().0), Some(Vec4::new(0.0, 1.0, 0.0, 1.0)));
}

#[test]
fn an_unreadable_image_is_white_with_a_warning() {
    for image in [
        json!({"uri": "no%20such.png"}),
        json!({"uri": "../outside.png"}),
        json!({"uri": "data:;base64,AAAA"}),
        json!({"bufferView": 0}),
        json!({}),
    ] {
        let mut fixture = textured(base());
        fixture.json["images"][0] = image.clone();
        let (scene, warnings) = fixture.load();
        assert_eq!(base_texture(&scene), None);
        assert!(warnings.len() == 1 && warnings[0].starts_with("images[0]: "), "{image} {warnings:?}");
    }
    let mut fixture = textured(base());
    fixture.json["textures"][0] = json!({"extensions": {"NO_texture": {"source": 0}}});
    let (scene, warnings) = fixture.load();
    assert_eq!(base_texture(&scene), None);
    let expected = [
        "ignored unknown extension NO_texture",
        "textures[0]: has no image except in NO_texture; used white (flat for normal maps)",
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn a_texture_with_an_unreadable_image_uses_the_alternative() {
    for name in ["KHR_texture_basisu", "EXT_texture_webp"] {
        let mut fixture = textured(base());
        fixture.push("images", json!({"uri": "no%20such.ktx2"}));
        fixture.json["textures"][0]["extensions"] = json!({name: {"source": 1}});
        let (scene, warnings) = fixture.load();
        assert_eq!(base_texture(&scene), Some(Vec4::new(1.0, 0.0, 0.0, 1.0)));
        assert!(warnings.len() == 1 && warnings[0].starts_with("images[1]: "), "{warnings:?}");
        assert_eq!(scene.images.len(), 1);
    }
}

#[test]
fn only_used_images_are_decoded_and_each_once() {
    let mut fixture = textured(base());
    fixture.push("images", json!({"uri": "unused.png"}));
    fixture.push("textures", json!({"source": 1}));
    fixture.push("samplers", json!({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}));
    fixture.push("textures", json!({"source": 0, "sampler": 0}));
    fixture.json["materials"][0]["emissiveTexture"] = json!({"index": 2});
    let (scene, warnings) = fixture.load();
    assert_eq!((scene.images.len(), scene.textures.len(), warnings.len()), (1, 2, 0));
    assert_eq!(
        (scene.textures[1].wrap, scene.textures[1].filter),
        ([Wrap::Clamp, Wrap::Mirror], TextureFilter::Nearest)
    );
    assert_eq!(
        (scene.textures[0].wrap, scene.textures[0].filter),
        ([Wrap::Repeat; 2], TextureFilter::Linear)
    );
}

#[test]
fn decoded_texture_bytes_are_limited() {
    let limits = Limits { texture_bytes: 7, ..Limits::default() };
    let options = LoadOptions { limits, ..LoadOptions::default() };
    let error = textured(base()).try_load_with(&options).map(|_| ()).unwrap_err().to_string();
    assert_eq!(error, "bytes of decoded textures: 8 exceeds the limit of 7");
}

#[test]
fn meshes_with_normal_maps_get_tangents() {
    let (scene, _) = textured(json!({"normalTexture": {"index": 0}})).load();
    assert_eq!(scene.meshes[0].tangents.len(), scene.meshes[0].positions.len());
    assert!(textured(json!({})).load().0.meshes[0].tangents.is_empty());
    let coat = json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": 0}});
    let (scene, warnings) = textured(json!({"extensions": {"KHR_materials_clearcoat": coat}})).load();
    assert_eq!(scene.meshes[0].tangents.len(), scene.meshes[0].positions.len());
    assert!(warnings.is_empty() && scene.materials[0].is_layered(), "{warnings:?}");
}

#[test]
fn materials_are_numbered_by_their_first_use() {
    let mut fixture = Fixture::triangle();
    for name in ["unused", "second", "first"] {
        fixture.push("materials", json!({"name": name}));
    }
    let primitive = |material: Value| json!({"attributes": {"POSITION": 0}, "material": material});
    let primitives =
        json!([primitive(json!(2)), primitive(json!(1)), primitive(Value::Null), primitive(json!(2))]);
    fixture.json["meshes"][0]["primitives"] = primitives;
    let (scene, _) = fixture.load();
    let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["first", "second", ""]);
    assert_eq!(scene.meshes.iter().map(|m| m.material).collect::<Vec<_>>(), [0, 1, 2, 0]);
}

/// Assimp writes specular-glossiness without the opacity.
#[test]
fn blended_specular_glossiness_without_alpha_has_that_of_the_base_colour() {
    let alpha = |mode: &str, diffuse: f32| {
        let mut fixture = Fixture::triangle();
        fixture.push(
            "materials",
            json!({"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.75]},
                "extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 1, 1, diffuse]}}}),
        );
        fixture.primitive()["material"] = json!(0);
        fixture.load().0.materials[0].alpha.factor
    };
    assert_eq!([alpha("BLEND", 1.0), alpha("BLEND", 0.5), alpha("MASK", 1.0)], [0.75, 0.5, 1.0]);
}
