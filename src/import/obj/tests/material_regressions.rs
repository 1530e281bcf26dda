//! Materials and textures of OBJ scenes: one test for each defect that was fixed.

use std::fs;

use super::{SQUARE, png, read, with_mtl};
use crate::geometry::Rgb;
use crate::import::{LoadError, LoadOptions, load};
use crate::scene::{AlphaMode, Reflectance, ScalarInput, TextureChannel};

#[test]
fn blenders_specular_level_is_its_ks() {
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

/// Blender 2.93 wrote the colour of an input that its map has taken: .8 darkened every texture.
#[test]
fn blenders_maps_take_the_places_of_factors() {
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

/// So Blender writes its maps by default: roughness, metallic and specular level.
#[test]
fn blenders_maps_by_lecture_words_are_physical() {
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
    // A level of .5 is what the index says.
    assert_eq!(dielectric.specular_color.factor, Rgb::splat(2.0));
    // Others' are something else.
    let (m, warnings) = of("# Other");
    assert!(matches!(m.reflectance, Reflectance::Mtl(_)) && warnings.len() == 2, "{warnings:?}");
}

/// Roughness .5 of Blender 2.93 is Ns ((1 − .5)·30)².
#[test]
fn roughness_of_old_blenders_is_by_their_law() {
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
fn the_filter_of_physical_glass_is_its_transmission() {
    let of = |mtl: &str| with_mtl(&format!("newmtl m\n{mtl}"));
    assert!((of("Pr .1\nPm 0\nTf .8 .9 1\n").0.transmission.factor - 0.9).abs() < 1e-6);
    // 3ds Max writes ones on everything.
    let (m, warnings) = of("Tf 1 1 1\n");
    assert!(m.transmission.factor == 0.0 && warnings.is_empty());
    let (m, warnings) = of("Tf .5 1 1\n");
    assert!(m.transmission.factor == 0.0 && warnings.len() == 1);
}

#[test]
fn an_ambient_map_counts_unless_it_repeats_the_diffuse_one() {
    let ambient = |mtl: &str| match with_mtl(&format!("newmtl m\n{mtl}")).0.reflectance {
        Reflectance::Mtl(mtl) => mtl.ambient.map(|a| a.texture.is_some()),
        _ => panic!(),
    };
    assert_eq!(ambient("map_Ka tex/t 1.png\n"), Some(true));
    assert_eq!(ambient("Ka 1 1 1\nmap_Ka tex/t 1.png\nmap_Kd tex/t 1.png\n"), None);
    assert_eq!(ambient("Ka .5 .5 .5\n"), Some(false));
}

#[test]
fn a_material_given_again_counts_as_given_last() {
    let (m, warnings) = with_mtl("newmtl m\nKd 1 0 0\nd .5\nnewmtl m\nKd 0 1 0\n");
    assert_eq!((m.base_color.factor, m.alpha.factor, warnings.len()), (Rgb::Y, 1.0, 1), "{warnings:?}");
}

/// Pitfall 32: `#` in names.
#[test]
fn names_of_materials_are_found_as_exporters_alter_them() {
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
fn materials_without_any_mtl_are_told_once() {
    let (_, warnings) = read(format!("{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"), &[]).unwrap();
    assert_eq!(warnings, ["the file names 2 materials and no MTL: they are shown matte white"]);
}

/// Files that were renamed together, and files that name none: Blender asks the namesake, too.
#[test]
fn an_mtl_named_as_the_obj_has_what_others_lack() {
    let faces = format!("{SQUARE}usemtl m\nf 1 2 3\nusemtl n\nf 1 3 4\n");
    let green: (&str, &[u8]) = ("scene.mtl", b"newmtl m\nKd 0 1 0\nnewmtl n\nKd 0 1 0\nwhat 1\n");
    for (line, other, told) in [
        ("mtllib untitled.mtl\n", "", "MTL 'untitled.mtl' cannot be read"),
        ("", "", "the file names no MTL: 'scene.mtl'"),
        ("mtllib a.mtl\n", "newmtl other\n", "'scene.mtl', which is named as the OBJ, is read"),
        ("mtllib a.mtl\n", "newmtl m\nKd 1 0 0\n", "'scene.mtl', which is named as the OBJ, is read"),
    ] {
        let obj = format!("{line}{faces}");
        let (scene, warnings) = read(&obj, &[("a.mtl", other.as_bytes()), green]).unwrap();
        let first = if other.contains("newmtl m") { Rgb::X } else { Rgb::Y };
        let colors: Vec<Rgb> = scene.materials.iter().map(|m| m.base_color.factor).collect();
        assert_eq!(colors, [first, Rgb::Y], "{warnings:?}");
        assert!(warnings.len() == 2 && warnings.iter().any(|w| w.contains(told)), "{warnings:?}");
        // One that has none of them is not asked further.
        let (_, warnings) = read(&obj, &[("scene.mtl", b"newmtl strange\nwhat 1\n")]).unwrap();
        assert!(warnings.len() == 1 && warnings[0].ends_with("matte white"), "{warnings:?}");
    }
    // Where nothing is lacking, it has no say, nor a word.
    let files: [(&str, &[u8]); 2] = [("a.mtl", b"newmtl m\nnewmtl n\n"), green];
    let (scene, warnings) = read(format!("mtllib a.mtl\n{faces}"), &files).unwrap();
    assert!(warnings.is_empty() && scene.materials[0].base_color.factor == Rgb::ONE, "{warnings:?}");
}

#[test]
fn decoded_textures_are_limited_by_their_headers_and_their_depth() {
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

/// Pitfall 26 too: textures are relative to their MTL.
#[test]
fn folders_in_another_case_are_found() {
    let mtl: &[u8] = b"newmtl m\nmap_Kd TEXTURES\\Wood\\OAK.png\n";
    let obj = format!("{SQUARE}mtllib Lib/A.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let files: [(&str, &[u8]); 2] = [("lib/a.MTL", mtl), ("lib/Textures/wood/oak.PNG", &png([9, 9, 9, 255]))];
    let (scene, warnings) = read(obj, &files).unwrap();
    assert!(scene.materials[0].base_color.texture.is_some() && warnings.is_empty(), "{warnings:?}");
}

/// Of an MTL and its texture with their accents apart, as a Mac's archives have them.
#[test]
fn names_in_another_normal_form_are_found() {
    let mtl = "newmtl Ka\u{308}se\nmap_Kd Ku\u{308}che/T\u{fc}r.png\n".as_bytes();
    let obj = format!("{SQUARE}mtllib H\u{f6}lle.mtl\nusemtl K\u{e4}se\nf 1/1 2/2 3/3\n");
    let files: [(&str, &[u8]); 2] =
        [("Ho\u{308}lle.mtl", mtl), ("K\u{fc}che/Tu\u{308}r.png", &png([9, 9, 9, 255]))];
    let (scene, warnings) = read(obj, &files).unwrap();
    assert!(scene.materials[0].base_color.texture.is_some() && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn blender_shows_colours_over_black_where_alpha_is_not_used() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let soft = &png([255, 200, 0, 128])[..];
    let grey = include_bytes!("../../../../models/tests/images/grey_alpha.png");
    let webp = include_bytes!("../../../../models/tests/images/lossless.webp");
    for (head, map_d, image, expected) in [
        ("# Blender 5.0.1", "", soft, [128u8, 100, 0, 255]),
        ("# Blender 5.0.1", "map_d t.png", soft, [255, 200, 0, 128]),
        ("# Other", "", soft, [255, 200, 0, 128]),
        // Of these it takes no notice of alpha.
        ("# Blender 5.0.1", "", grey, [51; 4]),
        ("# Blender 5.0.1", "", webp, [0, 255, 0, 51]),
    ] {
        let mtl = format!("{head}\nnewmtl m\nmap_Kd t.png\n{map_d}\n");
        let (scene, _) = read(&obj, &[("a.mtl", mtl.as_bytes()), ("t.png", image)]).unwrap();
        let texture = scene.materials[0].base_color.texture.unwrap().texture;
        let image = &scene.images[scene.textures[texture as usize].image as usize];
        let last = (image.width * image.height) as usize - 1;
        let texel = (image.stored(last) * 255.0).round().to_array();
        assert_eq!(texel, expected.map(f32::from), "{head} {map_d}");
    }
}

/// Maya writes Kd 0 beside a map_Kd, others the like: it hides no map that is there.
#[test]
fn a_factor_of_0_beside_a_map_that_was_read_is_none() {
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
    // Without the map it is black, and so is the lecture's product of Ks and its map.
    let (m, _) = of("Kd 0 0 0\nmap_Kd gone.png\nKe 0 0 0\nKs 0 0 0\nmap_Ks tex/t 1.png\nNs 9\n");
    let Reflectance::Mtl(mtl) = m.reflectance else { panic!("{m:?}") };
    assert_eq!(
        (m.base_color.factor, m.emission.factor, mtl.specular.factor),
        (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO)
    );
    // Any other factor counts.
    assert_eq!(of("Kd 0 .5 0\nmap_Kd tex/t 1.png\n").0.base_color.factor, Rgb::new(0.0, 0.5, 0.0));
}

/// Nor does a `d 0`, or a `Tr 1`, beside a map_d: nothing would be left to see.
#[test]
fn a_density_of_0_beside_a_map_that_was_read_is_none() {
    let of = |mtl: &str| {
        let (m, warnings) = with_mtl(mtl);
        (m.alpha.factor, m.alpha.texture.is_some(), m.alpha_mode, warnings.len())
    };
    let blender = "# Blender 5.0.1\nnewmtl m\nillum 9\n";
    for mtl in ["newmtl m\nd 0\n", "newmtl m\nTr 1\n", "newmtl m\nillum 4\nd 0\n", &format!("{blender}d 0\n")]
    {
        let beside = of(&format!("{mtl}map_d tex/t 1.png\n"));
        assert_eq!(beside, (1.0, true, AlphaMode::Blend, 0), "{mtl}");
    }
    // Any other counts. Without the map it is opaque, and said to be, as is that the map is missing.
    assert_eq!(of("newmtl m\nd .5\nmap_d tex/t 1.png\n"), (0.5, true, AlphaMode::Blend, 0));
    assert_eq!(of("newmtl m\nd 0\nmap_d gone.png\n"), (1.0, false, AlphaMode::Opaque, 2));
    // Unless Blender means it.
    assert_eq!(of(&format!("{blender}d 0\n")), (0.0, false, AlphaMode::Blend, 0));
}

/// Occlusion, roughness and metal in one picture; a channel of no map is told.
#[test]
fn a_map_s_channel_is_the_one_that_counts() {
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
    assert_eq!(warnings, ["a.mtl, line 2: map_Kd: -imfchan left out, the texture is used without"]);
    let (m, warnings) = of("d nan\nmap_d orm.png\n");
    assert_eq!((m.alpha.factor, warnings.len()), (1.0, 1), "{warnings:?}");
}

/// Leaves: one picture with colours and alpha. Where alpha is 0, its colours have no say.
#[test]
fn a_picture_that_is_its_own_alpha_is_read_as_one() {
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

/// Names may be followed by comments, or have number signs.
#[test]
fn comments_behind_names_are_none_of_them() {
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
fn the_first_of_a_pictures_tiles_is_shown() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n");
    let mtl: (&str, &[u8]) = ("a.mtl", b"newmtl m\nmap_Kd wood.<UDIM>.png\n");
    let (scene, warnings) = read(&obj, &[mtl, ("wood.1001.png", &png([9, 9, 9, 255]))]).unwrap();
    assert!(scene.materials[0].base_color.texture.is_some());
    assert_eq!(warnings, ["texture 'wood.<UDIM>.png': of its tiles, 1001 is shown everywhere"]);
    let (_, warnings) = read(&obj, &[mtl]).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("'wood.1001.png'"), "{warnings:?}");
}

/// Pitfall 31.
#[test]
fn several_materials_have_their_own_textures_and_some_none() {
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
fn paths_of_another_machine_fall_back_and_paths_outside_name_the_flag() {
    let (_, warnings) = with_mtl("newmtl m\nmap_Kd ../../else/where.png\n");
    assert!(warnings.len() == 1 && warnings[0].contains("--allow-outside"), "{warnings:?}");
    let (_, warnings) = with_mtl("newmtl m\nmap_Kd /home/else/where.png\n");
    assert!(warnings.len() == 1 && warnings[0].contains("--allow-outside"), "{warnings:?}");
}
