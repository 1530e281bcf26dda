//! Files written under a locale with decimal commas.

use super::{SQUARE, error, read, with_mtl};
use blinn_core::geometry::Rgb;
use blinn_scene::{AlphaMode, Reflectance, Scene};
use glam::{Vec2, Vec3, Vec4};

/// The warning about an MTL file.
fn mtl_warning(line: usize) -> String {
    format!("a.mtl, line {line}: numbers have decimal commas: read as decimal points")
}

#[test]
fn mtl_colours_may_have_decimal_commas() {
    for (kd, expected) in [
        ("0,588 0,2 0,1", Rgb::new(0.588, 0.2, 0.1)),
        ("0,8 0,8 0,8", Rgb::splat(0.8)),
        ("1 0,5 0", Rgb::new(1.0, 0.5, 0.0)),
        ("0,588, 0,2, 0,1", Rgb::new(0.588, 0.2, 0.1)),
        ("0,588; 0,2; 0,1", Rgb::new(0.588, 0.2, 0.1)),
        ("0,5e0 2,5E-1 0", Rgb::new(0.5, 0.25, 0.0)),
        ("0,25", Rgb::splat(0.25)),
        ("0,1 0,2 0,3 1,0", Rgb::new(0.1, 0.2, 0.3)),
    ] {
        let (material, warnings) = with_mtl(&format!("newmtl m\nKd {kd}\n"));
        assert_eq!(material.base_color.factor, expected, "{kd}");
        assert_eq!(warnings, [mtl_warning(2)], "{kd}");
    }
}

#[test]
fn all_mtl_numbers_may_have_decimal_commas() {
    let (material, warnings) = with_mtl(
        "newmtl m\nNs 96,078\nNi 1,5\nd 0,25\nillum 2,0\nKa 0,2 0,2 0,2\nKs 0,5 0,5 0,5\nKe 0,1 0 0\nTf 1,0 1,0 1,0\nPs 0,0\n",
    );
    assert_eq!(warnings, [mtl_warning(2)]);
    let Reflectance::Mtl(mtl) = &material.reflectance else { panic!("{:?}", material.reflectance) };
    assert_eq!((mtl.shininess, mtl.specular.factor), (96.078, Rgb::splat(0.5)));
    assert_eq!(mtl.ambient.as_ref().map(|ambient| ambient.factor), Some(Rgb::splat(0.2)));
    assert_eq!((material.alpha.factor, material.alpha_mode), (0.25, AlphaMode::Blend));
    assert_eq!(material.emission.factor, Rgb::new(0.1, 0.0, 0.0));
    for (statement, alpha) in [("Tr 0,25", 0.75), ("d -halo 0,5", 0.5)] {
        let (material, warnings) = with_mtl(&format!("newmtl m\n{statement}\n"));
        assert_eq!((material.alpha.factor, warnings), (alpha, vec![mtl_warning(2)]), "{statement}");
    }
    let (material, _) = with_mtl("newmtl m\nPr 0,25\nPm 0,5\n");
    let Reflectance::MetallicRoughness { metallic, roughness, .. } = material.reflectance else {
        panic!("Pr and Pm make a physically based material");
    };
    assert_eq!((metallic.factor, roughness.factor), (0.5, 0.25));
}

#[test]
fn map_options_may_have_decimal_commas() {
    for (options, scale, offset) in [
        ("-s 1,5 2,5 1,0 -o 0,5 0,25 0,0 tex/t 1.png", Vec2::new(1.5, 2.5), Vec2::new(0.5, 0.25)),
        ("tex/t 1.png -s 1,5 2 -o 0 0,25", Vec2::new(1.5, 2.0), Vec2::new(0.0, 0.25)),
        ("-mm 0,0 1,0 -bm 0,5 -s 0,5 0,5 tex/t 1.png", Vec2::splat(0.5), Vec2::ZERO),
        ("-s 2,3,1 tex/t 1.png", Vec2::new(2.0, 3.0), Vec2::ZERO),
    ] {
        let (material, warnings) = with_mtl(&format!("newmtl m\nmap_Kd {options}\n"));
        let map = material.base_color.texture.unwrap_or_else(|| panic!("{options}: {warnings:?}"));
        let uv = map.transform.apply(Vec2::new(0.25, 1.0 - 0.75));
        let expected = scale * Vec2::new(0.25, 0.75) + offset;
        assert!((Vec2::new(uv.x, 1.0 - uv.y) - expected).length() < 1e-6, "{options}: {uv}");
        let commas = usize::from(!options.contains("2,3,1"));
        assert_eq!(warnings.len(), commas, "{options}: {warnings:?}");
    }
}

#[test]
fn ambiguous_mtl_colours_are_reported_and_ignored() {
    for kd in ["0,5,0,2", "0,5 0,2", "0,1,0,2,0"] {
        let (material, warnings) = with_mtl(&format!("newmtl m\nKd {kd}\n"));
        assert_eq!(material.base_color.factor, Rgb::ONE, "{kd}");
        let [warning] = &warnings[..] else { panic!("{kd}: {warnings:?}") };
        assert!(
            warning.starts_with(&format!("a.mtl, line 2: Kd: '{kd}' has commas that may be")),
            "{warning}"
        );
    }
    let (material, warnings) = with_mtl("newmtl m\nKd 1,0.5,0\n");
    assert_eq!((material.base_color.factor, warnings.len()), (Rgb::new(1.0, 0.5, 0.0), 0));
}

fn square_with_commas(more: &str) -> (Scene, Vec<String>) {
    let text = SQUARE.replace("0 0 0", "0,5 0,0 -1,25e0").replace("vt 1 1", "vt 0,75 0,5");
    read(format!("{text}{more}f 1/3/1 2/2/1 3/3/1\n"), &[]).unwrap()
}

#[test]
fn obj_numbers_may_have_decimal_commas() {
    let (scene, warnings) = square_with_commas("vn 0,6 0,8 0\n");
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions[0], Vec3::new(0.5, 0.0, -1.25));
    assert_eq!(mesh.uvs[0][0], Vec2::new(0.75, 0.5));
    let warning =
        "line 1, column 3, at '0,5 0,0 -1,25e0': numbers have decimal commas: read as decimal points";
    assert_eq!(warnings, [warning]);
    for (vertex, position) in [
        ("0,5 1 2,5", Vec3::new(0.5, 1.0, 2.5)),
        ("0,5 1,0 2,5 1,0", Vec3::new(0.5, 1.0, 2.5)),
        ("0.5, 1, 2.5", Vec3::new(0.5, 1.0, 2.5)),
        ("0.5,1,2.5", Vec3::new(0.5, 1.0, 2.5)),
        ("0;1;2", Vec3::new(0.0, 1.0, 2.0)),
    ] {
        let (scene, warnings) = read(format!("{SQUARE}v {vertex}\nf 5 1 2\n"), &[]).unwrap();
        assert_eq!(scene.meshes[0].positions[0], position, "{vertex}");
        assert_eq!(warnings.len(), usize::from(vertex.contains(',')), "{vertex}: {warnings:?}");
    }
    let (scene, _) = read("v 0 0 0 1,0 0,0 0,0\nv 1 0 0 0,0 1,0 0,0\nv 0 1 0 1 1 1\nf 1 2 3\n", &[]).unwrap();
    assert_eq!(
        scene.meshes[0].colors,
        [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::ONE]
    );
}

/// Far from the origin positions are parsed in f64.
#[test]
fn decimal_commas_keep_the_precision_of_distant_geometry() {
    let text = "v 500000,125 5300000,001 7\nv 500001,25 5300000 7,5\nv 500001 5300000,75 8\nf 1 2 3\n";
    let (with_commas, _) = read(text, &[]).unwrap();
    let (with_points, _) = read(text.replace(',', "."), &[]).unwrap();
    assert_eq!(with_commas.meshes[0].positions, with_points.meshes[0].positions);
    assert_eq!(with_commas.nodes[0].local.affine(), with_points.nodes[0].local.affine());
}

#[test]
fn ambiguous_obj_numbers_are_errors() {
    for vertex in ["0,5,1,0,2,5", "0,5 1,0", "1.234,5 2.000,5 3,5"] {
        let message = error(&format!("v {vertex}\nf 1 1 1\n"));
        let expected = format!("line 1, column 3, at '{vertex}': v has commas that may be decimal");
        assert!(message.starts_with(&expected), "{message}");
    }
}
