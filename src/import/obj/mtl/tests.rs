use super::*;
use blinn_scene::TextureChannel;
use glam::Vec2;

fn one(text: &str) -> (MtlMaterial, Vec<String>) {
    let mut warnings = Warnings::default();
    let all = parse(text, "a.mtl", "", MtlContext::default(), &mut warnings);
    (all.into_iter().next().unwrap(), warnings.into_vec().iter().map(ToString::to_string).collect())
}

/// A colour of one number is grey.
#[test]
fn an_invalid_line_is_ignored_and_the_rest_is_read() {
    let (m, warnings) = one("newmtl red #2\nKd 1, 0.5,0\nKs x\nKa .2\nNs 1D2\nd 0.5\nTr 0.25\nwhat 1\n");
    assert_eq!(
        (m.name.as_str(), m.kd, m.ka, m.ns),
        ("red #2", Some(Rgb::new(1.0, 0.5, 0.0)), Some(Rgb::splat(0.2)), Some(100.0))
    );
    assert_eq!((m.ks, m.d), (None, Some(0.75)));
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    assert!(warnings[0].contains("line 3") && warnings[1].contains("what") && warnings[2].contains("line 7"));
}

#[test]
fn colours_that_are_not_rgb_set_no_opacity() {
    for (kd, expected) in [("xyz .2 .3 .5", None), ("x .2 .3 .5", None), (".2 .3 .4 .5", Some(0.5))] {
        let (m, warnings) = one(&format!("newmtl a\nKd {kd}\n"));
        assert_eq!((m.d, m.kd.is_some()), (expected, expected.is_some()), "{kd}");
        assert_eq!(warnings.len(), usize::from(expected.is_none()), "{warnings:?}");
    }
}

#[test]
fn map_options_may_precede_or_follow_a_name_with_spaces() {
    for text in [
        "-s 2 3 1 -o .5 -clamp on -bm 0.5 -imfchan g my  tex 2.png",
        "my  tex 2.png -s 2 3 1 -o .5 -clamp on -bm 0.5 -imfchan g",
        "-clamp on -imfchan g -s 2 3 \"my  tex 2.png\" -o .5 -bm 0.5",
    ] {
        let (m, warnings) = one(&format!("newmtl a\nmap_Pr {text} \t\n"));
        let map = m.map_roughness.unwrap();
        assert_eq!(map.file, "my  tex 2.png", "{text}");
        assert_eq!((map.scale, map.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0)));
        assert_eq!((map.clamp, map.bump, map.channel), (true, 0.5, Some(TextureChannel::G)));
        assert!(warnings.is_empty());
    }
    let (m, warnings) = one("newmtl a\nMap_Kd -clamp ON -colorspace sRGB tex#1.png\n");
    let map = m.map_kd.unwrap();
    assert!(map.file == "tex#1.png" && map.clamp && warnings.is_empty(), "{map:?} {warnings:?}");
}

/// Blender writes folder names unquoted.
#[test]
fn options_inside_a_name_are_part_of_it() {
    for (text, scale) in [
        ("t/s11 -s 2 dir/a -bm 1 b.png", 1.0),
        ("-s 4 4 4 t/s11 -s 2 dir/a -bm 1 b.png", 4.0),
        ("t/s11 -s 2 dir/a -bm 1 b.png -s 4 4 4", 4.0),
        ("t/s11 -s 2 dir/a -bm 1 b.png -s 4 4 4 # comment", 4.0),
    ] {
        let (m, warnings) = one(&format!("newmtl a\nmap_Kd {text}\n"));
        let map = m.map_kd.unwrap();
        assert_eq!((map.file.as_str(), map.bump), ("t/s11 -s 2 dir/a -bm 1 b.png", 1.0), "{text}");
        assert!(map.scale.x == scale && warnings.is_empty(), "{text}: {map:?} {warnings:?}");
    }
}

#[test]
fn unsupported_map_options_are_reported_and_the_map_is_used() {
    let (m, warnings) = one("newmtl a\nmap_Kd -boost 2 -t .5 -blendu off -cc off a.png\n");
    assert_eq!(m.map_kd.unwrap().file, "a.png");
    assert!(
        warnings.len() == 1 && warnings[0].contains("ignored the options -boost -t -blendu of"),
        "{warnings:?}"
    );
    for options in ["-colorspace linear", "-imfchan r", "-s nan 1", "-o 1 inf", "-bm nan"] {
        let (m, warnings) = one(&format!("newmtl a\nmap_Kd {options} a.png\n"));
        assert_eq!(warnings.len(), 1, "{options}: {warnings:?}");
        let map = m.map_kd.unwrap();
        assert_eq!((map.scale, map.offset, map.bump), (Vec2::ONE, Vec2::ZERO, 1.0), "{options}");
    }
    let (_, warnings) = one("newmtl a\nmap_Kd -imfchan r -t .5 a.png\n");
    assert!(
        warnings.len() == 1 && warnings[0].contains("ignored the options -t -imfchan of"),
        "{warnings:?}"
    );
    let (_, warnings) = one("newmtl a\nmap_Kd -mm 0 1 -t 0 0 0 -blendu on -texres 512 a.png\n");
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn unsupported_keywords_are_reported_once_per_file() {
    let (_, warnings) = one("newmtl a\nao .5\nPx .5\nmap_ao a.png\nnewmtl b\nao .2\n");
    let expected = ["ao", "Px", "map_ao"].map(|key| format!("a.mtl: ignored '{key}': not supported"));
    assert_eq!(warnings, expected);
}

#[test]
fn negative_colours_become_zero() {
    let (m, warnings) = one("newmtl a\nKd -1 .5 -.25\nKs -0 0 0\n");
    assert_eq!((m.kd, m.ks), (Some(Rgb::new(0.0, 0.5, 0.0)), Some(Rgb::ZERO)));
    assert_eq!(warnings, ["a.mtl, line 2: Kd: used 0 instead of a negative value"]);
}

#[test]
fn integer_colours_above_one_are_bytes() {
    let (m, warnings) = one("newmtl a\nKd 255 51 0\nKs 255 255 255\nKe 20 0 0\nnewmtl b\nKd 0 255 1\n");
    assert_eq!((m.kd, m.ks), (Some(Rgb::new(1.0, 0.2, 0.0)), Some(Rgb::ONE)));
    assert_eq!(m.ke, Some(Rgb::new(20.0, 0.0, 0.0)));
    let message = |key| format!("a.mtl: {key} exceeds 1: read as bytes from 0 to 255");
    assert_eq!(warnings, [message("Kd"), message("Ks")]);
    // A plausible reflectance, and values that are neither.
    let (m, warnings) = one("newmtl a\nKd 2 2 2\n");
    assert!(m.kd == Some(Rgb::splat(2.0)) && warnings.is_empty(), "{warnings:?}");
    for (kd, max) in [("300 0 0", "300"), ("20.5 0 0", "20.5")] {
        let (_, warnings) = one(&format!("newmtl a\nKd {kd}\n"));
        let message = format!("a.mtl, line 2: Kd has the value {max}, expected 0 to 1 or bytes");
        assert_eq!(warnings, [message]);
    }
}

/// Blender's default cube, 3ds Max's d and Tr, and Model I/O's list of all features.
#[test]
fn default_values_cause_no_warning() {
    for text in [
        "Ps 0\nPc 0\nPcr .03\naniso 0\nanisor .5\n",
        "d 1\nTr 0\n",
        "d .7\nTr .3\n",
        "ao 0 0 0\nsubsurface 0 0 0\nsheenTint 0.0\n",
    ] {
        let (_, warnings) = one(&format!("newmtl a\n{text}"));
        assert!(warnings.is_empty(), "{text}: {warnings:?}");
    }
    for text in ["ao .5\nanisor .03\n", "d 1\nTr .5\n", "ao 0 .5 0\n", "ao\n"] {
        let (_, warnings) = one(&format!("newmtl a\n{text}"));
        assert_eq!(warnings.len(), 1, "{text}: {warnings:?}");
    }
}

#[test]
fn tr_of_vtk_is_opacity() {
    let vtk = "# wavefront mtl file written by the visualization toolkit\r\n\n";
    for (tr, d) in [("Tr 1", 1.0), ("Tr 0.9", 0.9), ("d 0.5\nTr 0.5", 0.5)] {
        let (m, warnings) = one(&format!("{vtk}newmtl a\n{tr}\n"));
        assert!(m.d == Some(d) && warnings.is_empty(), "{tr}: {:?} {warnings:?}", m.d);
    }
    assert_eq!(one("# another\nnewmtl a\nTr 0.75\n").0.d, Some(0.25));
}

#[test]
fn defaults_of_trimesh_and_vtk_do_not_count() {
    let grey = "Ka .4 .4 .4\nKd .4 .4 .4\nKs .4 .4 .4\nNs 1\n";
    let trimesh = "# https://github.com/mikedh/trimesh\n";
    let colors = |text: &str| {
        let (m, _) = one(text);
        (m.ka, m.kd, m.ks)
    };
    let all = Some(Rgb::splat(0.4));
    assert_eq!(colors(&format!("{trimesh}newmtl a\n{grey}map_Kd a.png\n")), (None, None, None));
    assert_eq!(colors(&format!("{trimesh}newmtl a\n{grey}")), (None, all, None));
    assert_eq!(colors(&format!("newmtl a\n{grey}map_Kd a.png\n")), (all, all, all));
    let vtk = "# wavefront mtl file written by the visualization toolkit\n";
    assert_eq!(one(&format!("{vtk}newmtl a\nillum 3\n")).0.illum, Some(2));
    assert_eq!(one("newmtl a\nillum 3\n").0.illum, Some(3));
}

#[test]
fn colours_of_programs_that_write_displayed_values_are_decoded() {
    let kd = |text: &str, colors| {
        let context = MtlContext { generator: "", colors };
        parse(text, "a.mtl", "", context, &mut Warnings::default())[0].kd.unwrap().x
    };
    let jmol = "# Created by Jmol 14\nnewmtl a\nKd .5 1 0\n";
    let blender = "# Blender 5.0.1 MTL File\nnewmtl a\nKd .5 1 0\n";
    let unknown = "newmtl a\nKd .5 1 0\n";
    let decoded = srgb_to_linear(0.5);
    for (text, auto) in [(jmol, decoded), (blender, 0.5), (unknown, 0.5)] {
        assert_eq!(kd(text, MtlColors::Auto), auto, "{text}");
        assert_eq!((kd(text, MtlColors::Srgb), kd(text, MtlColors::Linear)), (decoded, 0.5), "{text}");
    }
    // Beyond what a display shows.
    assert_eq!(kd("newmtl a\nKd .5 2 0\n", MtlColors::Srgb), 0.5);
}

#[test]
fn norm_takes_precedence_over_bump() {
    for text in ["newmtl a\nnorm n.png\nbump b.png\n", "newmtl a\nbump b.png\nnorm n.png\n"] {
        let (m, _) = one(text);
        assert_eq!((m.map_normal.unwrap().file.as_str(), m.normal_is_bump), ("n.png", false));
    }
}

#[test]
fn truncated_text_does_not_panic() {
    let text = "# Blender\nnewmtl é\nKd 1 1 1\nmap_Kd -s 1 1 a.png\nbump -bm\nd\nillum 1e300\nNs nan\n";
    for end in (0..text.len()).filter(|&i| text.is_char_boundary(i)) {
        parse(&text[..end], "", "", MtlContext::default(), &mut Warnings::default());
    }
}

/// The opacities of all materials, and the number of warnings.
fn opacities(text: &str) -> (Vec<Option<f32>>, usize) {
    let mut warnings = Warnings::default();
    let materials = parse(text, "a.mtl", "", MtlContext::default(), &mut warnings);
    (materials.iter().map(|m| m.d).collect(), warnings.into_vec().len())
}

#[test]
fn statements_of_a_file_are_judged_together() {
    let meshlab = "#\n# Converted by Meshlab Group\n#\n";
    let jmol = "# Created by Jmol 14.32.83\n";
    for (text, expected) in [
        // `Tr 1` would hide what is opaque.
        ("newmtl a\nTr .25\nnewmtl b\nTr 1\n", vec![Some(0.25), Some(1.0)]),
        (&format!("{meshlab}newmtl a\nTr .25\nnewmtl b\nTr 1\n"), vec![Some(0.25), Some(1.0)]),
        (&format!("{meshlab}newmtl a\nTr .25\nnewmtl b\nTr 0\n"), vec![Some(0.75), Some(1.0)]),
        (&format!("{meshlab}newmtl a\nTr .25\n"), vec![Some(0.75)]),
        (&format!("{jmol}newmtl a\nTr .25\n"), vec![Some(0.25)]),
        // With `d`, the file says what `Tr` is.
        ("newmtl a\nd .25\nTr .25\nnewmtl b\nTr .1\n", vec![Some(0.25), Some(0.1)]),
        ("newmtl a\nd .25\nTr .75\nnewmtl b\nTr .1\n", vec![Some(0.25), Some(0.9)]),
        ("newmtl a\nd 1\nTr 1\n", vec![Some(1.0)]),
        // A constant beside `d` says nothing.
        ("newmtl a\nd .6\nTr 0\nnewmtl b\nTr 0\nd .3\n", vec![Some(0.6), Some(0.3)]),
        // The fourth number of Kd, unless another statement gives the opacity, or it is always 0.
        ("newmtl a\nKd 1 1 1 .4\nnewmtl b\nKd 1 1 1 .4\nd .5\n", vec![Some(0.4), Some(0.5)]),
        ("newmtl a\nKd 1 1 1 .4\nnewmtl b\nKd 1 1 1 0\n", vec![Some(0.4), Some(0.0)]),
        ("newmtl a\nKd 1 1 1 0\nnewmtl b\nKd 1 0 1\n", vec![None, None]),
        ("newmtl a\nKd 1 1 1 2\nnewmtl b\nKd 1 1 1 x\n", vec![None, None]),
    ] {
        assert_eq!(opacities(text).0, expected, "{text}");
    }
    assert_eq!(opacities("newmtl a\nd .5\nTr .25\n"), (vec![Some(0.75)], 1));
    assert_eq!(opacities("newmtl a\nTr .25\nd .5\n"), (vec![Some(0.5)], 1));
}
