//! Materials and textures of OBJ scenes.

use super::{SQUARE, png, read, with_mtl};
use blinn_core::geometry::Rgb;
use blinn_scene::{
    AlphaMode, AnisotropyModel, Material, Reflectance, Reflection, Sheen, SheenModel, TextureChannel,
};

#[test]
fn mtl_statements_become_the_lectures_coefficients() {
    let (m, warnings) =
        with_mtl("newmtl m\nKa .1 .2 .3\nKd .4 .5 .6\nKs .7 .8 .9\nKe 1 0 0\nNs 37\nillum 2\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    let Reflectance::Mtl(mtl) = m.reflectance else { panic!("{m:?}") };
    assert_eq!(mtl.ambient.unwrap().factor, Rgb::new(0.1, 0.2, 0.3));
    assert_eq!(
        (m.base_color.factor, mtl.specular.factor),
        (Rgb::new(0.4, 0.5, 0.6), Rgb::new(0.7, 0.8, 0.9))
    );
    assert_eq!((mtl.shininess, m.emission.factor), (37.0, Rgb::X));
    assert!(m.double_sided);
}

#[test]
fn illum_and_ns_enable_the_specular_term() {
    let specular = |mtl: &str| match with_mtl(&format!("newmtl m\nKs 1 1 1\n{mtl}")).0.reflectance {
        Reflectance::Mtl(mtl) => mtl.specular.factor.x,
        _ => -1.0,
    };
    assert_eq!(specular("Ns 10\n"), 1.0);
    assert_eq!(specular("Ns 10\nillum 1\n"), 0.0);
    assert_eq!((specular("Ns 0\n"), specular("")), (0.0, 0.0));
    assert_eq!(with_mtl("newmtl m\nillum 0\n").0.reflectance, Reflectance::Unlit);
    let ambient = |ka: &str| match with_mtl(&format!("newmtl m\n{ka}")).0.reflectance {
        Reflectance::Mtl(mtl) => mtl.ambient.is_some(),
        _ => panic!(),
    };
    assert!(!ambient("") && !ambient("Ka 1 1 1\n") && ambient("Ka 0 0 0\n"));
}

#[test]
fn blender_and_pbr_materials_use_metallic_roughness() {
    let of = |mtl: &str| match with_mtl(mtl).0.reflectance {
        Reflectance::MetallicRoughness { metallic, roughness, .. } => (metallic.factor, roughness.factor),
        other => panic!("{other:?}"),
    };
    let (metallic, roughness) =
        of("# Blender 5.0.1 MTL File\nnewmtl m\nNs 250\nKa 1 1 1\nKs .5 .5 .5\nillum 3\n");
    assert!(metallic == 1.0 && (roughness - 0.5).abs() < 1e-6);
    assert_eq!(of("# Blender 5.0.1 MTL File\nnewmtl m\nNs 1000\nKa 1 1 1\nillum 2\n"), (0.0, 0.0));
    assert_eq!(of("newmtl m\nPr .25\nPm .75\n"), (0.75, 0.25));
}

/// Blender writes four times the weight of a coat, Pc 0 for most materials, and illum 2 for coated ones.
#[test]
fn pc_and_pcr_are_a_clear_coat() {
    let of = |mtl: &str| with_mtl(&format!("newmtl m\n{mtl}"));
    let coat = |m: &Material| (m.clearcoat.factor.factor, m.clearcoat.roughness.factor);
    let (m, warnings) = of("Pr .75\nPc 2\nPcr .25\nillum 2\n");
    assert!(warnings.is_empty() && m.reflection == Reflection::Fresnel, "{m:?} {warnings:?}");
    assert_eq!(coat(&m), (0.5, 0.25));
    let (m, _) = of("Pc 7\n");
    assert!(matches!(m.reflectance, Reflectance::MetallicRoughness { .. }), "{m:?}");
    assert_eq!(coat(&m), (1.0, 0.0));
    let (m, _) = of("Pc 0\nPcr .03\nillum 2\n");
    assert!(matches!(m.reflectance, Reflectance::Mtl(_)) && !m.reflects(), "{m:?}");
}

#[test]
fn opacity_comes_from_d_or_tr() {
    let alpha = |mtl: &str| {
        let (m, warnings) = with_mtl(&format!("newmtl m\n{mtl}"));
        (m.alpha.factor, m.alpha_mode, warnings.len())
    };
    assert_eq!(alpha("d .25\n"), (0.25, AlphaMode::Blend, 0));
    assert_eq!(alpha("Tr .25\n"), (0.75, AlphaMode::Blend, 0));
    assert_eq!(alpha("d .5\nTr .25\n"), (0.75, AlphaMode::Blend, 1));
    assert_eq!(alpha("d 1\n"), (1.0, AlphaMode::Opaque, 0));
    for opaque in ["Tr 1\n", "Tr 1\nillum 4\n"] {
        assert_eq!(alpha(opaque), (1.0, AlphaMode::Opaque, 0), "{opaque}");
    }
    for transparent in ["d 0\n", "d 0\nillum 9\n"] {
        assert_eq!(alpha(transparent), (1.0, AlphaMode::Opaque, 1), "{transparent}");
    }
    let (by_blender, _) = with_mtl("# Blender 5.0.1 MTL File\nnewmtl m\nd 0\nillum 9\n");
    assert_eq!(by_blender.alpha.factor, 0.0);
}

/// Names from other systems and machines, and names followed by blanks.
#[test]
fn textures_are_found_by_names_in_all_notations() {
    for name in [
        "tex/t 1.png",
        "tex\\t 1.png",
        "tex/t%201.png",
        "./tex/t 1.png",
        "TEX\\T 1.PNG",
        "\"tex/t 1.png\" ",
        "-s 1 1 1 tex/t 1.png",
    ] {
        let (m, warnings) = with_mtl(&format!("newmtl m\nmap_Kd {name}\n"));
        assert!(m.base_color.texture.is_some(), "{name}: {warnings:?}");
        assert_eq!(m.base_color.factor, Rgb::ONE, "a textured material without Kd is white");
    }
    let obj = format!("{SQUARE}mtllib A.MTL\nusemtl m\nf 1/1 2/2 3/3\n");
    for name in ["C:\\work\\Leaf.PNG", "/home/else/leaf.png", "..\\..\\leaf.png", "leaf.PNG"] {
        let mtl = format!("newmtl m\nKd .5 .5 .5\nmap_Kd {name}\n");
        let files: [(&str, &[u8]); 2] = [("a.mtl", mtl.as_bytes()), ("leaf.png", &png([9, 9, 9, 255]))];
        let (scene, warnings) = read(&obj, &files).unwrap();
        assert!(
            scene.materials[0].base_color.texture.is_some() && warnings.is_empty(),
            "{name}: {warnings:?}"
        );
    }
}

#[test]
fn missing_files_cause_a_warning_each_and_the_scene_loads() {
    let (m, warnings) = with_mtl("newmtl m\nKd .5 .5 .5\nmap_Kd nowhere.png\n");
    assert!(
        m.base_color.texture.is_none() && warnings.len() == 1 && warnings[0].contains("nowhere.png"),
        "{warnings:?}"
    );
    let (_, warnings) = with_mtl("newmtl m\nbump nowhere.png\n");
    assert!(warnings.len() == 1 && warnings[0].ends_with("; ignored the map"), "{warnings:?}");
    let obj = format!("{SQUARE}mtllib gone.mtl\nusemtl m\nf 1 2 3\n");
    let (scene, warnings) = read(&obj, &[]).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("gone.mtl"), "{warnings:?}");
    assert_eq!(scene.materials[0].base_color.factor, Rgb::ONE);
    let (scene, warnings) = read(&obj, &[("gone.mtl", b"newmtl other\n")]).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("'m'"), "{warnings:?}");
    assert_eq!(scene.materials.len(), 1);
    let (_, warnings) = read(obj.replace("gone.mtl", "../up.mtl"), &[]).unwrap();
    assert!(warnings[0].contains("allow-outside"), "{warnings:?}");
}

/// `material_libraries.rs` tests more cases.
#[test]
fn mtllib_with_spaces_is_one_name_first_and_several_then() {
    let obj = format!("{SQUARE}mtllib my lib.mtl\nusemtl a b\nf 1 2 3\n");
    let (scene, warnings) = read(&obj, &[("my lib.mtl", b"newmtl a b\nKd 0 1 0\n")]).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].base_color.factor == Rgb::Y, "{warnings:?}");
    let two: [(&str, &[u8]); 2] = [("my", b"newmtl x\n"), ("lib.mtl", b"newmtl a b\nKd 0 0 1\n")];
    let (scene, warnings) = read(&obj, &two).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].base_color.factor == Rgb::Z, "{warnings:?}");
}

#[test]
fn bump_maps_with_normals_are_used_as_normal_maps() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1/1 2/2/1 3/3/1\n");
    let mtl: (&str, &[u8]) = ("a.mtl", b"newmtl m\nmap_Bump -bm 0.5 n.png\n");
    let (scene, warnings) = read(&obj, &[mtl, ("n.png", &png([128, 128, 255, 255]))]).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].normal.unwrap().scale == 0.5, "{warnings:?}");
    assert_eq!(scene.meshes[0].tangents.len(), scene.meshes[0].positions.len());
}

/// Heights of one column of 4 texels, as bytes.
fn columns(heights: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_fn(4, 4, |x, _| image::Luma([heights[x as usize]]))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

#[test]
fn bump_maps_with_heights_become_normal_maps() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1/1 2/2/1 3/3/1\n");
    // The slope along u in the second column, of a material with this statement.
    let slope = |statement: &str, heights: [u8; 4]| {
        let mtl = format!("newmtl m\n{statement} h.png\n");
        let files: [(&str, &[u8]); 2] = [("a.mtl", mtl.as_bytes()), ("h.png", &columns(heights))];
        let (scene, warnings) = read(&obj, &files).unwrap();
        assert!(warnings.is_empty(), "{statement} {warnings:?}");
        let map = scene.materials[0].normal.unwrap();
        assert!(!map.scale_is_strength && !scene.meshes[0].tangents.is_empty());
        let image = &scene.images[scene.textures[map.texture.texture as usize].image as usize];
        let normal = image.stored(1).truncate() * 2.0 - 1.0;
        -normal.x / normal.z * map.scale
    };
    // White is 0.04 texels of this image above black: 51 of 255 in two texels are 0.02 · 0.2.
    let step = 0.02 * 0.2;
    for (statement, heights, expected) in [
        ("map_Bump", [0, 0, 51, 0], step),
        ("bump -bm 20", [0, 0, 51, 0], 20.0 * step),
        ("bump -bm -1", [0, 0, 51, 0], -step),
        ("bump -mm 0.5 2", [0, 0, 51, 0], 2.0 * step),
        // 0.9 + 0.2 is clamped.
        ("bump -mm 0.9 1", [0, 0, 51, 0], 0.5 * step),
        ("bump -imfchan r", [0, 0, 51, 0], step),
        ("bump -clamp on", [0, 0, 51, 0], step),
    ] {
        let found = slope(statement, heights);
        assert!((found - expected).abs() < 4e-4, "{statement}: {found} {expected}");
    }
}

/// Two materials share the normal map of one image; another channel or range is another map.
#[test]
fn heights_are_converted_once() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl c\nf 1 2 3\n");
    let mtl = b"newmtl a\nbump h.png\nnewmtl b\nbump -bm 2 h.png\nnewmtl c\nbump -mm 0 2 h.png\n";
    let (scene, _) = read(&obj, &[("a.mtl", mtl), ("h.png", &columns([0, 9, 9, 9]))]).unwrap();
    let maps: Vec<u32> = scene.materials.iter().map(|m| m.normal.unwrap().texture.texture).collect();
    assert_eq!((maps[0] == maps[1], maps[0] == maps[2], scene.images.len()), (true, false, 3));
}

/// Atlases are baked on black or transparent background. Blender writes no heights.
#[test]
fn normal_maps_are_detected_despite_their_background() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1/1 2/2/1 3/3/1\n");
    let is_used = |head: &str, background: [u8; 4], normal: [u8; 4]| {
        // The map of heights is a copy.
        let mut image = image::RgbaImage::from_pixel(4, 4, image::Rgba(background));
        image.put_pixel(0, 0, image::Rgba(normal));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let mtl = format!("{head}\nnewmtl m\nmap_Bump n.png\n");
        let files: [(&str, &[u8]); 2] = [("a.mtl", mtl.as_bytes()), ("n.png", &bytes.into_inner())];
        read(&obj, &files).unwrap().0.images.len() == 1
    };
    let blue = [128, 128, 255, 255];
    let grey = [128, 128, 128, 255];
    assert!(is_used("# Other", [0, 0, 0, 255], blue) && is_used("# Other", [90, 90, 90, 0], blue));
    // Games store other data in alpha.
    assert!(is_used("# Other", [128, 128, 255, 0], [128, 128, 255, 0]));
    assert!(!is_used("# Other", [0, 0, 0, 255], grey) && !is_used("# Other", [0; 4], [0; 4]));
    assert!(is_used("# Blender 5.0.1 MTL File", [90, 90, 90, 255], blue));
    // Blender's old exporter may have written heights.
    assert!(!is_used("# Blender MTL File: 'x.blend'", [90, 90, 90, 255], grey));
}

#[test]
fn an_empty_material_name_is_looked_up() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl \nf 1 2 3\n");
    let (scene, warnings) = read(&obj, &[("a.mtl", b"newmtl \nKd 0 1 0\n")]).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].base_color.factor == Rgb::Y, "{warnings:?}");
    let (scene, warnings) = read(&obj, &[("a.mtl", b"newmtl b\nKd 0 1 0\n")]).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].base_color.factor == Rgb::ONE, "{warnings:?}");
}

/// Segmentation needs the parts of files without an MTL.
#[test]
fn undefined_materials_keep_their_names() {
    let faces = "usemtl red\nf 1 2 3\nusemtl blue\nf 1 2 3\nusemtl\nf 1 2 3\nusemtl red\nf 2 3 1\n";
    for (mtllib, mtl) in [("", ""), ("mtllib a.mtl\n", "newmtl other\n"), ("mtllib b.mtl\n", "")] {
        let obj = format!("{SQUARE}f 1 2 3\n{mtllib}{faces}");
        let (scene, warnings) = read(obj, &[("a.mtl", mtl.as_bytes())]).unwrap();
        let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
        assert_eq!((names, warnings.is_empty()), (vec!["", "red", "blue"], false), "{mtllib}");
        assert!(scene.materials.iter().all(|m| m.base_color.factor == Rgb::ONE));
    }
    let (scene, _) =
        read(format!("{SQUARE}mtllib a.mtl\n{faces}"), &[("a.mtl", b"newmtl red\nKd 1 0 0\n")]).unwrap();
    let colors: Vec<_> = scene.materials.iter().map(|m| (m.name.as_str(), m.base_color.factor)).collect();
    assert_eq!(colors, [("red", Rgb::X), ("blue", Rgb::ONE), ("", Rgb::ONE)]);
}

#[test]
fn css_names_are_colours_in_files_of_jscad() {
    let faces = "usemtl coral\nf 1 2 3\nusemtl default\nf 1 2 3\n";
    let of = |head: &str| {
        let (scene, warnings) = read(format!("{head}{SQUARE}{faces}"), &[]).unwrap();
        let green: Vec<f32> = scene.materials.iter().map(|m| m.base_color.factor.y).collect();
        (green, scene.source.generator, warnings.len())
    };
    let (green, generator, warnings) = of("# Wavefront OBJ file generated by JSCAD\n");
    assert!((green[0] - 0.2122).abs() < 1e-3 && green[1] == 1.0, "{green:?}");
    assert_eq!((generator.as_str(), warnings), ("Wavefront OBJ file generated by JSCAD", 0));
    let (green, _, warnings) = of("# by hand\n");
    assert_eq!((green, warnings), (vec![1.0, 1.0], 1));
}

/// The OBJ names the program of an MTL without a head.
#[test]
fn generators_between_lines_of_number_signs_are_found() {
    for (head, expected) in [
        ("####\n#\n# OBJ File Generated by Meshlab\n#\n####\n", "OBJ File Generated by Meshlab"),
        ("\u{feff}\n\n## Made by hand ##\n", "Made by hand"),
        ("#\nv 0 0 0\n# no head\n", ""),
    ] {
        let obj = format!("{head}{SQUARE}mtllib a.mtl\nusemtl m\nf 1 2 3\n");
        let (scene, _) = read(obj, &[("a.mtl", b"newmtl m\nKd .5 .5 .5\n")]).unwrap();
        assert_eq!(scene.source.generator, expected);
        let is_decoded = scene.materials[0].base_color.factor.x < 0.3;
        assert_eq!(is_decoded, expected.contains("Meshlab"), "{head}");
    }
}

/// Blender writes the weights of sheen and anisotropy, and the rotation in turns.
#[test]
fn ps_aniso_and_anisor_are_sheen_and_anisotropy() {
    let of = |mtl: &str| {
        let (m, warnings) = with_mtl(&format!("# Blender 5.0.1 MTL File\nnewmtl m\n{mtl}"));
        assert!(warnings.is_empty(), "{mtl}: {warnings:?}");
        m
    };
    let m = of("Pr .4\nPm 1\nPs .25\nPc 0\nPcr .03\naniso .75\nanisor .25\nillum 2\n");
    assert_eq!((m.sheen.color.factor, m.sheen.roughness.factor), (Rgb::splat(0.25), 0.5));
    assert_eq!(m.sheen.model, SheenModel::Microfibres);
    let anisotropy = m.anisotropy.unwrap();
    assert_eq!((anisotropy.strength, anisotropy.model), (0.75, AnisotropyModel::Principled));
    assert!((anisotropy.rotation - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    assert_eq!(m.reflection, Reflection::Fresnel);
    let plain = of("Pr .4\nPs 0\naniso 0\nanisor .5\nillum 2\n");
    assert_eq!((plain.sheen, plain.anisotropy), (Sheen::default(), None));
    // Out of range.
    let m = of("Pr .4\nPs 3\naniso 2\n");
    assert_eq!((m.sheen.color.factor, m.anisotropy.unwrap().strength), (Rgb::ONE, 1.0));
}

/// Sheen and anisotropy alone make a material physical, whatever program wrote it.
#[test]
fn layers_make_a_material_physical() {
    for (mtl, is_physical) in [("Ps .5\n", true), ("aniso .5\n", true), ("Ps 0\naniso 0\n", false)] {
        let (m, _) = with_mtl(&format!("newmtl m\nKd .5 .5 .5\n{mtl}"));
        assert_eq!(matches!(m.reflectance, Reflectance::MetallicRoughness { .. }), is_physical, "{mtl}");
    }
}

#[test]
fn map_ps_map_pc_and_map_pcr_are_read() {
    let (m, warnings) = with_mtl(
        "newmtl m\nPr .5\nPc 2\nmap_Ps tex/t 1.png\nmap_Pc tex/t 1.png\nmap_Pcr -imfchan g tex/t 1.png\n",
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(
        (m.clearcoat.factor.factor, m.clearcoat.roughness.factor, m.sheen.color.factor),
        (0.5, 1.0, Rgb::ONE)
    );
    assert_eq!(m.clearcoat.factor.texture.unwrap().1, TextureChannel::Mean);
    assert_eq!(m.clearcoat.roughness.texture.unwrap().1, TextureChannel::G);
    assert_eq!(m.sheen.model, SheenModel::Charlie);
    // Weights are numbers, while colours are decoded.
    assert_ne!(m.sheen.color.texture.unwrap().texture, m.clearcoat.factor.texture.unwrap().0.texture);
    let (m, _) = with_mtl("newmtl m\nPr .5\nmap_Pc tex/t 1.png\n");
    assert_eq!(m.clearcoat.factor.factor, 1.0);
}

/// `-mm base gain`: base + gain · value, from 0 to 1.
#[test]
fn base_and_gain_change_the_texels_of_a_map() {
    let texel = |options: &str| {
        let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
        let mtl = format!("newmtl m\nKd 1 1 1\nmap_Kd {options} t.png\nmap_d t.png\n");
        let png = png([0, 51, 255, 128]);
        let (scene, warnings) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("t.png", &png)]).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        let texture = scene.materials[0].base_color.texture.unwrap().texture;
        let image = &scene.images[scene.textures[texture as usize].image as usize];
        (image.stored(0).to_array().map(|v| (v * 255.0).round() as u8), scene.images.len())
    };
    assert_eq!(texel(""), ([0, 51, 255, 128], 1));
    assert_eq!(texel("-mm 0 1"), ([0, 51, 255, 128], 1));
    assert_eq!(texel("-mm .2 .5"), ([51, 77, 179, 128], 2));
    assert_eq!(texel("-mm 1 -1"), ([255, 204, 0, 128], 2));
    assert_eq!(texel("-mm -.5 9"), ([0, 255, 255, 128], 2));
}
