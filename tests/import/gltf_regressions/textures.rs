//! Known pitfalls of textures, of their coordinates and of normal maps.

use blinn::integrator::Aov;
use serde_json::{Value, json};

use super::{corner, png, set_uvs, triangle};
use crate::common::gltf_fixture::Fixture;

#[test]
fn textures_without_coordinates_give_a_warning() {
    let warnings_of = |set: u32, variant: &[&str]| {
        let mut file = textured(json!({"mimeType": "image/png"}), &png([255, 0, 0, 255]));
        file.json["materials"][0]["name"] = json!("wood");
        let texture = json!({"index": 0, "texCoord": set});
        file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = texture;
        variant
            .iter()
            .for_each(|name| file.json["materials"][0][*name] = json!({"index": 0, "texCoord": set}));
        file.load().1.into_iter().map(|w| w.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(warnings_of(0, &["normalTexture"]), [""; 0]);
    for others in [&[][..], &["normalTexture", "emissiveTexture"]] {
        let warnings = warnings_of(1, others);
        let [one] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(one.contains("'wood'") && one.contains("(set 1)"), "{one}");
    }
    // Names are shortened, and control characters escaped.
    let mut file = textured(json!({"mimeType": "image/png"}), &png([255, 0, 0, 255]));
    file.json["materials"][0]["name"] = json!(format!("\u{202e}{}", "wood".repeat(2500)));
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(1);
    let one = file.load().1[0].to_string();
    assert!(one.len() < 500 && one.contains("\\u{202e}wood"), "{one}");
}

/// The triangle with an image as base colour.
fn textured(image: Value, bytes: &[u8]) -> Fixture {
    let mut file = triangle();
    set_uvs(&mut file, 0, [[0.0, 0.0]; 3]);
    let view = file.view(bytes);
    let mut image = image;
    if image["uri"].is_null() {
        image["bufferView"] = json!(view);
    }
    file.push("images", image);
    file.push("textures", json!({"source": 0}));
    file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    file
}

#[test]
fn p05_image_formats_are_detected_from_the_bytes() {
    for image in [json!({}), json!({"mimeType": "image/jpeg"}), json!({"mimeType": "text/plain"})] {
        let (scene, warnings) = textured(image, &png([255, 0, 0, 255])).load();
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(corner(&scene, Aov::Albedo), [1.0, 0.0, 0.0]);
    }
}

#[test]
fn p06_missing_and_broken_images_are_skipped_with_a_warning() {
    let whole = png([255, 0, 0, 255]);
    for (image, bytes) in [(json!({"uri": "gone.png"}), &whole[..]), (json!({}), &whole[..20])] {
        let mut file = textured(image, bytes);
        file.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.25, 1, 1]);
        let (scene, warnings) = file.load();
        assert!(warnings.len() == 1 && warnings[0].starts_with("images[0]: "), "{warnings:?}");
        assert_eq!(corner(&scene, Aov::Albedo), [0.5, 0.25, 1.0]);
    }
}

#[test]
fn p10_textures_use_their_set_of_coordinates() {
    let mut file = textured(json!({}), &{
        let mut out = std::io::Cursor::new(Vec::new());
        let halves = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb([255 * x as u8, 0, 0]));
        halves.write_to(&mut out, image::ImageFormat::Png).unwrap();
        out.into_inner()
    });
    set_uvs(&mut file, 0, [[0.25, 0.5]; 3]);
    set_uvs(&mut file, 1, [[0.75, 0.5]; 3]);
    assert_eq!(corner(&file.load().0, Aov::Albedo)[0], 0.0);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(1);
    assert_eq!(corner(&file.load().0, Aov::Albedo)[0], 1.0);
    // KHR_texture_transform may override the set.
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"texCoord": 0}});
    assert_eq!(corner(&file.load().0, Aov::Albedo)[0], 0.0);
}

#[test]
fn p11_texture_transforms_apply_to_every_slot() {
    let mut file = triangle();
    set_uvs(&mut file, 0, [[0.0, 0.0]; 3]);
    let view = file.view(&png([255; 4]));
    file.push("images", json!({"bufferView": view}));
    file.push("textures", json!({"source": 0}));
    let slot =
        json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 2]}}});
    file.material(json!({"normalTexture": slot, "occlusionTexture": slot, "emissiveTexture": slot,
        "pbrMetallicRoughness": {"baseColorTexture": slot, "metallicRoughnessTexture": slot},
        "extensions": {"KHR_materials_specular": {"specularTexture": slot, "specularColorTexture": slot},
            "KHR_materials_transmission": {"transmissionTexture": slot, "transmissionFactor": 0.5}}}));
    let text = format!("{:?}", file.load().0.materials[0]);
    // Metallic and roughness share one texture.
    assert_eq!(text.matches("offset: Vec2(0.5, 0.0)").count(), 9, "{text}");
}

#[test]
fn p12_normal_maps_get_tangents_also_with_mirrored_coordinates() {
    let mut file = textured(json!({}), &png([255, 128, 128, 255]));
    let slot = json!({"index": 0});
    file.json["materials"][0] = json!({"normalTexture": slot});
    set_uvs(&mut file, 0, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    // The map's x axis is +x, or −x with mirrored coordinates.
    let straight = corner(&file.load().0, Aov::Normal);
    set_uvs(&mut file, 0, [[1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]);
    let mirrored = corner(&file.load().0, Aov::Normal);
    assert!(straight[0] > 0.9 && mirrored[0] < -0.9, "{straight:?} {mirrored:?}");
}

/// Normal maps apply before scaling: their normals are transformed by the inverse transpose, as others are.
#[test]
fn p12_normal_maps_are_scaled_with_their_surface() {
    // A normal of (.5, 0, .866).
    let mut file = textured(json!({}), &png([191, 128, 238, 255]));
    file.json["materials"][0] = json!({"normalTexture": {"index": 0}});
    set_uvs(&mut file, 0, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    let slope = |scale: Value| {
        file.json["nodes"][0]["scale"] = scale;
        let n = corner(&file.load().0, Aov::Normal);
        n[0] / n[2]
    };
    let mut slope = slope;
    let plain = slope(json!([1, 1, 1]));
    assert!((plain - 0.5 / 0.866).abs() < 0.01, "{plain}");
    for (scale, expected) in [(json!([2, 1, 1]), 0.5), (json!([1, 1, 0.5]), 0.5), (json!([2, 2, 2]), 1.0)] {
        let scaled = slope(scale.clone());
        assert!((scaled / plain - expected).abs() < 1e-4, "{scale}: {scaled}");
    }
}

/// `normalTexture.scale` scales x and y. In Blender's files it is the strength, and z approaches 1 below a
/// scale of 1.
#[test]
fn p12_the_scale_of_normal_maps_depends_on_the_generator() {
    let mut file = textured(json!({}), &png([219, 128, 219, 255]));
    file.json["materials"][0] = json!({"normalTexture": {"index": 0, "scale": 0.5}});
    set_uvs(&mut file, 0, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    // The map's normal is at 45 degrees.
    for (generator, degrees) in [("other", 26.565), ("Khronos glTF Blender I/O v5.0.21", 22.5)] {
        file.json["asset"]["generator"] = json!(generator);
        let n = corner(&file.load().0, Aov::Normal);
        let found = n[0].atan2(n[2]).to_degrees();
        assert!((found - degrees).abs() < 0.3, "{generator}: {found}");
    }
}
