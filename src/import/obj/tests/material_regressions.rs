//! Regression tests of OBJ materials and textures.

use std::fs;

use super::{SQUARE, png, read, with_mtl};
use crate::{LoadError, LoadOptions, load};
use blinn_core::geometry::Rgb;
use blinn_scene::{AlphaMode, Reflectance, Reflection, ScalarInput, TextureChannel};

#[test]
fn ks_of_blender_is_its_specular_level() {
    let of = |mtl: &str| match with_mtl(&format!("# Blender 5.0.1 MTL File\nnewmtl m\nNs 250\n{mtl}"))
        .0
        .reflectance
    {
        Reflectance::MetallicRoughness { dielectric, .. } => {
            (dielectric.specular.factor, dielectric.specular_color.factor.x, dielectric.ior)
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(of("Ks 0 0 0\nillum 1\nNi 1.45\n"), (0.0, 1.0, 1.45));
    assert_eq!(of("Ks .5 .5 .5\nillum 2\n"), (1.0, 1.0, 1.5));
    assert_eq!(of("Ks 1 1 1\nillum 2\n"), (1.0, 2.0, 1.5));
}

/// Blender 2.93 writes the colour of an input next to its map; a factor of 0.8 darkened every texture.
#[test]
fn maps_of_blender_replace_factors() {
    let of = |head: &str, map: &str| {
        with_mtl(&format!("{head}\nnewmtl m\nNs 225\nKd .8 .8 .8\nKe .1 .1 .1\nmap_Kd {map}\nmap_Ke {map}\n"))
            .0
    };
    for (head, kd, ke) in [
        ("# Blender MTL File: 'x.blend'", 1.0, 1.0),
        ("# Blender 5.0.1 MTL File: 'x.blend'", 1.0, 1.0),
        ("# Other", 0.8, 0.1),
    ] {
        let m = of(head, "tex/t 1.png");
        assert_eq!((m.base_color.factor, m.emission.factor), (Rgb::splat(kd), Rgb::splat(ke)), "{head}");
        assert_eq!(of(head, "gone.png").base_color.factor, Rgb::splat(0.8), "{head}");
    }
}

/// Blender writes roughness, metallic and specular level into these maps by default.
#[test]
fn map_ns_map_refl_and_map_ks_of_blender_are_pbr_maps() {
    let maps = "map_Ns tex/t 1.png\nmap_refl tex/t 1.png\nmap_Ks tex/t 1.png\n";
    let of =
        |head: &str| with_mtl(&format!("{head}\nnewmtl m\nNs 250\nKa 1 1 1\nKs .5 .5 .5\nillum 2\n{maps}"));
    let (m, warnings) = of("# Blender 5.0.1 MTL File");
    let Reflectance::MetallicRoughness { metallic, roughness, dielectric } = m.reflectance else {
        panic!("{m:?}")
    };
    assert!(warnings.is_empty(), "{warnings:?}");
    for input in [metallic, roughness, dielectric.specular] {
        assert!(input.factor == 1.0 && input.texture.is_some(), "{input:?}");
    }
    // A level of 0.5 is the reflectance of the index of refraction.
    assert_eq!(dielectric.specular_color.factor, Rgb::splat(2.0));
    // Other exporters use these keywords differently.
    let (m, warnings) = of("# Other");
    assert!(matches!(m.reflectance, Reflectance::Mtl(_)) && warnings.len() == 2, "{warnings:?}");
}

/// Blender 2.93 writes roughness 0.5 as Ns ((1 − 0.5)·30)².
#[test]
fn roughness_of_old_blender_versions_uses_their_formula() {
    for (head, ns, expected) in [
        ("# Blender MTL File: 'x.blend'", "225", 0.5),
        ("# Blender MTL File: 'x.blend'", "950", 0.0),
        ("# Blender 5.0.1 MTL File: 'x.blend'", "250", 0.5),
    ] {
        let m = with_mtl(&format!("{head}\nnewmtl m\nNs {ns}\n")).0;
        let Reflectance::MetallicRoughness { roughness, .. } = m.reflectance else { panic!("{m:?}") };
        assert!((roughness.factor - expected).abs() < 1e-6, "{head} {ns}: {roughness:?}");
    }
}

#[test]
fn tf_of_pbr_materials_is_their_transmission() {
    let of = |mtl: &str| with_mtl(&format!("newmtl m\n{mtl}"));
    assert!((of("Pr .1\nPm 0\nTf .8 .9 1\n").0.transmission.factor - 0.9).abs() < 1e-6);
    // 3ds Max always writes 1 1 1.
    let (m, warnings) = of("Tf 1 1 1\n");
    assert!(m.transmission.factor == 0.0 && warnings.is_empty());
    let (m, warnings) = of("Tf .5 1 1\n");
    assert!(m.transmission.factor == 0.0 && warnings.len() == 1);
}

#[test]
fn illum_3_and_above_reflect() {
    let of = |mtl: &str| with_mtl(&format!("newmtl m\nKs .5 .5 .5\nNs 100\n{mtl}")).0;
    for mtl in ["", "illum 0\n", "illum 1\n", "illum 2\n", "illum 10\n", "illum 2\nPr 0\nPm 1\n"] {
        assert!(!of(mtl).reflects(), "{mtl}");
    }
    for (mtl, expected) in [
        ("illum 3\n", Reflection::Constant),
        ("illum 5\n", Reflection::Fresnel),
        ("illum 4\nTf 1 1 1\n", Reflection::Constant),
        ("illum 4\nd .25\n", Reflection::Fresnel),
        ("illum 3\nPr 0\nPm 1\n", Reflection::Fresnel),
        // Blender's glass.
        ("illum 2\nPr 0\nTf 1 1 1\n", Reflection::Fresnel),
    ] {
        let m = of(mtl);
        assert!(m.reflects() && m.reflection == expected, "{mtl}: {m:?}");
    }
    assert!(!with_mtl("newmtl m\nillum 3\n").0.reflects());
}

#[test]
fn illum_4_6_and_7_transmit() {
    let of = |mtl: &str| {
        let (m, warnings) = with_mtl(&format!("newmtl m\n{mtl}"));
        assert!(warnings.is_empty(), "{mtl}: {warnings:?}");
        (m.transmission.factor, m.transmission_color, m.alpha_mode, m.ior())
    };
    let white = Some(Rgb::ONE);
    // Maya's opaque default.
    assert_eq!(of("illum 4\nTf 1 1 1\nNi 1\n"), (0.0, None, AlphaMode::Opaque, 1.5));
    assert_eq!(of("illum 4\nd .25\nNi 1.3\n"), (0.75, white, AlphaMode::Opaque, 1.3));
    assert_eq!(of("illum 7\nNi 2.4\n"), (1.0, white, AlphaMode::Opaque, 2.4));
    let tinted = Some(Rgb::new(0.5, 0.75, 1.0));
    assert_eq!(of("illum 6\nd .3\nTf .5 .75 1\n"), (1.0, tinted, AlphaMode::Opaque, 1.5));
    // An opacity map leaves holes: blended as before.
    assert_eq!(of("illum 7\nmap_d tex/t 1.png\n").2, AlphaMode::Blend);
}

#[test]
fn map_ka_is_used_unless_it_equals_map_kd() {
    let ambient = |mtl: &str| match with_mtl(&format!("newmtl m\n{mtl}")).0.reflectance {
        Reflectance::Mtl(mtl) => mtl.ambient.map(|a| a.texture.is_some()),
        _ => panic!(),
    };
    assert_eq!(ambient("map_Ka tex/t 1.png\n"), Some(true));
    assert_eq!(ambient("Ka 1 1 1\nmap_Ka tex/t 1.png\nmap_Kd tex/t 1.png\n"), None);
    assert_eq!(ambient("Ka .5 .5 .5\n"), Some(false));
}

#[test]
fn a_repeated_material_replaces_the_earlier_one() {
    let (m, warnings) = with_mtl("newmtl m\nKd 1 0 0\nd .5\nnewmtl m\nKd 0 1 0\n");
    assert_eq!((m.base_color.factor, m.alpha.factor, warnings.len()), (Rgb::Y, 1.0, 1), "{warnings:?}");
}

#[test]
fn material_names_match_as_exporters_alter_them() {
    let obj = |name: &str| format!("{SQUARE}mtllib a.mtl\nusemtl {name}\nf 1 2 3\n");
    let mtl: &[(&str, &[u8])] = &[("a.mtl", b"newmtl m\nKd 0 1 0\nnewmtl m # 2\nKd 0 0 1\n")];
    for (name, color) in
        [("m", Rgb::Y), ("M", Rgb::Y), ("\"m\"", Rgb::Y), ("m # note", Rgb::Y), ("m # 2", Rgb::Z)]
    {
        let (scene, warnings) = read(obj(name), mtl).unwrap();
        assert!(warnings.is_empty() && scene.materials[0].base_color.factor == color, "{name} {warnings:?}");
    }
}

#[test]
fn a_missing_mtl_is_reported_once() {
    let (_, warnings) = read(format!("{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"), &[]).unwrap();
    assert_eq!(warnings, ["the file names 2 materials and no MTL: used matte white instead"]);
}

/// Blender reads it too, for renamed files and for files without `mtllib`.
#[test]
fn an_mtl_with_the_name_of_the_obj_is_the_fallback() {
    let faces = format!("{SQUARE}usemtl m\nf 1 2 3\nusemtl n\nf 1 3 4\n");
    let green: (&str, &[u8]) = ("scene.mtl", b"newmtl m\nKd 0 1 0\nnewmtl n\nKd 0 1 0\nwhat 1\n");
    for (line, other, expected) in [
        ("mtllib untitled.mtl\n", "", "MTL 'untitled.mtl' cannot be read"),
        ("", "", "the file names no MTL: used 'scene.mtl'"),
        ("mtllib a.mtl\n", "newmtl other\n", "used 'scene.mtl', which has the name of the OBJ"),
        ("mtllib a.mtl\n", "newmtl m\nKd 1 0 0\n", "used 'scene.mtl', which has the name of the OBJ"),
    ] {
        let obj = format!("{line}{faces}");
        let (scene, warnings) = read(&obj, &[("a.mtl", other.as_bytes()), green]).unwrap();
        let first = if other.contains("newmtl m") { Rgb::X } else { Rgb::Y };
        let colors: Vec<Rgb> = scene.materials.iter().map(|m| m.base_color.factor).collect();
        assert_eq!(colors, [first, Rgb::Y], "{warnings:?}");
        assert!(warnings.len() == 2 && warnings.iter().any(|w| w.contains(expected)), "{warnings:?}");
        // It is ignored if it has none of the materials.
        let (_, warnings) = read(&obj, &[("scene.mtl", b"newmtl strange\nwhat 1\n")]).unwrap();
        assert!(warnings.len() == 1 && warnings[0].contains("matte white"), "{warnings:?}");
    }
    // It is not read if nothing is missing.
    let files: [(&str, &[u8]); 2] = [("a.mtl", b"newmtl m\nnewmtl n\n"), green];
    let (scene, warnings) = read(format!("mtllib a.mtl\n{faces}"), &files).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].base_color.factor == Rgb::ONE, "{warnings:?}");
}

#[test]
fn texture_limits_use_the_size_and_bit_depth_of_headers() {
    let mut deep = std::io::Cursor::new(Vec::new());
    let image = image::ImageBuffer::from_pixel(2, 2, image::Rgba([1u16, 2, 3, u16::MAX]));
    image::DynamicImage::ImageRgba16(image).write_to(&mut deep, image::ImageFormat::Png).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("a.obj"), format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n")).unwrap();
    fs::write(at("a.mtl"), "newmtl m\nmap_Kd t.png\n").unwrap();
    for (bytes, needs) in [(png([1, 2, 3, 255]), 16), (deep.into_inner(), 32)] {
        fs::write(at("t.png"), bytes).unwrap();
        let with = |texture_bytes| {
            let mut options = LoadOptions::default();
            options.limits.texture_bytes = texture_bytes;
            load(&at("a.obj"), &options)
        };
        assert!(with(needs).is_ok());
        assert!(matches!(with(needs - 1), Err(LoadError::Limit { .. })), "{needs}");
    }
}

/// Textures are relative to their MTL.
#[test]
fn folders_in_another_case_are_found() {
    let mtl: &[u8] = b"newmtl m\nmap_Kd TEXTURES\\Wood\\OAK.png\n";
    let obj = format!("{SQUARE}mtllib Lib/A.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let files: [(&str, &[u8]); 2] = [("lib/a.MTL", mtl), ("lib/Textures/wood/oak.PNG", &png([9, 9, 9, 255]))];
    let (scene, warnings) = read(obj, &files).unwrap();
    assert!(scene.materials[0].base_color.texture.is_some() && warnings.is_empty(), "{warnings:?}");
}

/// macOS archives have names in Unicode normal form D.
#[test]
fn file_names_match_in_any_unicode_normal_form() {
    let mtl = "newmtl Ka\u{308}se\nmap_Kd Ku\u{308}che/T\u{fc}r.png\n".as_bytes();
    let obj = format!("{SQUARE}mtllib H\u{f6}lle.mtl\nusemtl K\u{e4}se\nf 1/1 2/2 3/3\n");
    let files: [(&str, &[u8]); 2] =
        [("Ho\u{308}lle.mtl", mtl), ("K\u{fc}che/Tu\u{308}r.png", &png([9, 9, 9, 255]))];
    let (scene, warnings) = read(obj, &files).unwrap();
    assert!(scene.materials[0].base_color.texture.is_some() && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn colours_of_blender_are_multiplied_by_unused_alpha() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let soft = &png([255, 200, 0, 128])[..];
    // 1 × 1 texels of 32 bits, not compressed.
    let mut bmp = b"BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\x20\0".to_vec();
    bmp.resize(54, 0);
    bmp.extend([50, 100, 200, 128]);
    let grey = include_bytes!("../../../../models/tests/images/grey_alpha.png");
    let webp = include_bytes!("../../../../models/tests/images/lossless.webp");
    for (head, map_d, image, expected) in [
        ("# Blender 5.0.1", "", soft, [128u8, 100, 0, 255]),
        ("# Blender 5.0.1", "map_d t.png", soft, [255, 200, 0, 128]),
        ("# Other", "", soft, [255, 200, 0, 128]),
        // Blender ignores alpha in these formats.
        ("# Blender 5.0.1", "", grey, [51; 4]),
        ("# Blender 5.0.1", "", webp, [0, 255, 0, 51]),
        ("# Blender 5.0.1", "", &bmp, [200, 100, 50, 255]),
        // From 5.1 on, it multiplies them.
        ("# Blender 5.1.2 MTL File: 'a.blend'", "", webp, [0, 51, 0, 255]),
        ("# Blender 5.2.3 LTS MTL File: 'a.blend'", "", &bmp, [100, 50, 25, 255]),
        ("# Blender 5.2.3 LTS MTL File: 'a.blend'", "map_d t.png", &bmp, [200, 100, 50, 255]),
        ("# Blender 5.2.3 LTS MTL File: 'a.blend'", "", grey, [51; 4]),
    ] {
        let mtl = format!("{head}\nnewmtl m\nmap_Kd t.png\nmap_Ke t.png\n{map_d}\n");
        let (scene, _) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("t.png", image)]).unwrap();
        let texture = scene.materials[0].base_color.texture.unwrap().texture;
        assert_eq!(scene.materials[0].emission.texture.unwrap().texture, texture);
        let image = &scene.images[scene.textures[texture as usize].image as usize];
        let last = (image.width * image.height) as usize - 1;
        let texel = (image.stored(last) * 255.0).round().to_array();
        assert_eq!(texel, expected.map(f32::from), "{head} {map_d}");
    }
}

/// Maya writes Kd 0 next to a map_Kd.
#[test]
fn a_factor_of_zero_next_to_a_map_is_ignored() {
    let of = |mtl: &str| with_mtl(&format!("newmtl m\n{mtl}"));
    let (m, warnings) = of("Kd 0 0 0\nmap_Kd tex/t 1.png\nKe 0 0 0\nmap_Ke tex/t 1.png\n");
    assert_eq!(
        (m.base_color.factor, m.emission.factor, warnings.len()),
        (Rgb::ONE, Rgb::ONE, 0),
        "{warnings:?}"
    );
    let (m, warnings) = of("Pm 0\nmap_Pm tex/t 1.png\nPr 0\nmap_Pr tex/t 1.png\n");
    let Reflectance::MetallicRoughness { metallic, roughness, .. } = m.reflectance else { panic!("{m:?}") };
    assert_eq!((metallic.factor, roughness.factor, warnings.len()), (1.0, 1.0, 0), "{warnings:?}");
    // Without the map the factor is used, and it multiplies map_Ks.
    let (m, _) = of("Kd 0 0 0\nmap_Kd gone.png\nKe 0 0 0\nKs 0 0 0\nmap_Ks tex/t 1.png\nNs 9\n");
    let Reflectance::Mtl(mtl) = m.reflectance else { panic!("{m:?}") };
    assert_eq!(
        (m.base_color.factor, m.emission.factor, mtl.specular.factor),
        (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO)
    );
    // Any other factor is used.
    assert_eq!(of("Kd 0 .5 0\nmap_Kd tex/t 1.png\n").0.base_color.factor, Rgb::new(0.0, 0.5, 0.0));
}

/// With `d 0` or `Tr 1` the surface would be invisible.
#[test]
fn an_opacity_of_zero_next_to_a_map_is_ignored() {
    let of = |mtl: &str| {
        let (m, warnings) = with_mtl(mtl);
        (m.alpha.factor, m.alpha.texture.is_some(), m.alpha_mode, warnings.len())
    };
    let blender = "# Blender 5.0.1\nnewmtl m\nillum 9\n";
    for mtl in ["newmtl m\nd 0\n", "newmtl m\nTr 1\n", "newmtl m\nillum 4\nd 0\n", &format!("{blender}d 0\n")]
    {
        let with_map = of(&format!("{mtl}map_d tex/t 1.png\n"));
        assert_eq!(with_map, (1.0, true, AlphaMode::Blend, 0), "{mtl}");
    }
    // Any other value is used. Without the map the material is opaque, with two warnings.
    assert_eq!(of("newmtl m\nd .5\nmap_d tex/t 1.png\n"), (0.5, true, AlphaMode::Blend, 0));
    assert_eq!(of("newmtl m\nd 0\nmap_d gone.png\n"), (1.0, false, AlphaMode::Opaque, 2));
    // Blender writes 0 for an invisible material.
    assert_eq!(of(&format!("{blender}d 0\n")), (0.0, false, AlphaMode::Blend, 0));
}

/// Occlusion, roughness and metallic share an image.
#[test]
fn imfchan_selects_the_channel_of_a_map() {
    let image = png([255, 51, 204, 255]);
    let of = |mtl: &str| {
        let mtl = format!("newmtl m\n{mtl}");
        let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
        let (mut scene, warnings) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("orm.png", &image)]).unwrap();
        (scene.materials.remove(0), warnings)
    };
    let (m, warnings) = of("map_Pr -imfchan g orm.png\nmap_Pm -imfchan b orm.png\n");
    let Reflectance::MetallicRoughness { metallic, roughness, .. } = m.reflectance else { panic!("{m:?}") };
    let channel = |of: ScalarInput| of.texture.unwrap().1;
    assert_eq!((channel(roughness), channel(metallic)), (TextureChannel::G, TextureChannel::B));
    assert!(warnings.is_empty(), "{warnings:?}");
    let (m, warnings) = of("map_Kd -imfchan r orm.png\n");
    assert!(m.base_color.texture.is_some());
    assert_eq!(warnings, ["a.mtl, line 2: map_Kd: ignored the options -imfchan of the texture"]);
    let (m, warnings) = of("d nan\nmap_d orm.png\n");
    assert_eq!((m.alpha.factor, warnings.len()), (1.0, 1), "{warnings:?}");
}

/// Leaf textures hold colour and alpha. Texels with alpha 0 do not affect the colour.
#[test]
fn map_kd_and_map_d_of_one_image_are_combined() {
    let image = png([255, 200, 0, 128]);
    for (map_d, own) in
        [("map_d t.png", true), ("map_d -imfchan r t.png", false), ("map_d -s 2 2 t.png", false)]
    {
        let mtl = format!("newmtl m\nmap_Kd t.png\n{map_d}\n");
        let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
        let (scene, _) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("t.png", &image)]).unwrap();
        let m = &scene.materials[0];
        assert_eq!((m.alpha_from_base, m.alpha.texture.is_none()), (own, own), "{map_d}");
        assert_eq!(m.alpha_mode, AlphaMode::Blend);
    }
}

/// Names may contain `#`.
#[test]
fn comments_after_names_are_ignored() {
    let image = png([9, 9, 9, 255]);
    for (given, asked) in [("m # c", "m"), ("m", "m # c"), ("m # c", "m # c"), ("m #1 # c", "m #1")] {
        let mtl = format!("newmtl {given}\nmap_Kd t.png # c\nnewmtl other\n");
        let obj = format!("{SQUARE}mtllib a.mtl # c\nusemtl {asked}\nf 1/1 2/2 3/3\n");
        let (scene, warnings) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("t.png", &image)]).unwrap();
        assert!(warnings.is_empty(), "{given} {asked}: {warnings:?}");
        assert!(scene.materials[0].base_color.texture.is_some());
    }
}

#[test]
fn the_first_udim_tile_is_used() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let mtl: (&str, &[u8]) = ("a.mtl", b"newmtl m\nmap_Kd wood.<UDIM>.png\n");
    let (scene, warnings) = read(&obj, &[mtl, ("wood.1001.png", &png([9, 9, 9, 255]))]).unwrap();
    assert!(scene.materials[0].base_color.texture.is_some());
    assert_eq!(warnings, ["texture 'wood.<UDIM>.png': used tile 1001 for all UDIM tiles"]);
    let (_, warnings) = read(&obj, &[mtl]).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("'wood.1001.png'"), "{warnings:?}");
}

#[test]
fn each_material_has_its_own_textures() {
    let obj = format!(
        "{SQUARE}mtllib a.mtl\nmtllib b.mtl\nusemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\nusemtl c\nf 1/1 2/2 4/4\n"
    );
    let files: [(&str, &[u8]); 4] = [
        ("a.mtl", b"newmtl a\nmap_Kd a.png\nnewmtl b\nKd 1 0 0\n"),
        ("b.mtl", b"newmtl c\nmap_Kd c.png\n"),
        ("a.png", &png([9, 9, 9, 255])),
        ("c.png", &png([8, 8, 8, 255])),
    ];
    let (scene, warnings) = read(obj, &files).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let names: Vec<_> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    let textures: Vec<_> = scene.materials.iter().map(|m| m.base_color.texture.map(|t| t.texture)).collect();
    assert_eq!((names, textures), (vec!["a", "b", "c"], vec![Some(0), None, Some(1)]));
    assert_eq!(scene.images.len(), 2);
}

#[test]
fn warnings_about_paths_outside_the_folder_name_the_flag() {
    let (_, warnings) = with_mtl("newmtl m\nmap_Kd ../../else/where.png\n");
    assert!(warnings.len() == 1 && warnings[0].contains("allow-outside"), "{warnings:?}");
    let (_, warnings) = with_mtl("newmtl m\nmap_Kd /home/else/where.png\n");
    assert!(warnings.len() == 1 && warnings[0].contains("allow-outside"), "{warnings:?}");
}

/// Blender shows colours in the space that a PNG names in its cICP chunk, but not other values.
#[test]
fn colours_of_a_png_in_another_space_become_srgb() {
    let plain = png([200, 100, 50, 128]);
    // Display P3, after the IHDR chunk.
    let cicp = [0, 0, 0, 4, b'c', b'I', b'C', b'P', 12, 13, 0, 1, 0x6e, 0x03, 0xe3, 0xef];
    let p3 = [&plain[..33], &cicp, &plain[33..]].concat();
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let mtl = "# Blender 5.2.3 LTS MTL File: 'a.blend'\nnewmtl m\nNs 250\nmap_Kd t.png\nmap_d t.png\nmap_Ns t.png\n";
    for (file, expected) in [(&plain, [0.5776, 0.1274, 0.0319]), (&p3, [0.6788, 0.1085, 0.0137])] {
        let (scene, warnings) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("t.png", file)]).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        let material = &scene.materials[0];
        let image = |texture: u32| &scene.images[scene.textures[texture as usize].image as usize];
        let color = image(material.base_color.texture.unwrap().texture).decoded(0).truncate();
        assert!(color.abs_diff_eq(expected.into(), 3e-4), "{color}");
        let Reflectance::MetallicRoughness { roughness, .. } = &material.reflectance else { panic!() };
        let texel = (image(roughness.texture.unwrap().0.texture).stored(0) * 255.0).round();
        assert_eq!(texel.to_array(), [200.0, 100.0, 50.0, 128.0]);
    }
}
