//! Points and lines: their layers, animation and instances, sizes and bad input.

use std::f64::consts::PI;
use std::path::Path;

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use crate::common::gltf_fixture::{Fixture, bytes_of};
use crate::common::program::*;
use crate::image_output::{channel, ranks, read_exr, rendered, text};
use crate::layers::{FRONT, SCALE, SIZE, hits, layers};

/// Adds a mesh of one primitive with positions.
fn mesh(fixture: &mut Fixture, mode: u32, positions: &[[f32; 3]]) -> usize {
    let positions = fixture.vec3(positions);
    let primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
    fixture.push("meshes", json!({"primitives": [primitive]}))
}

/// Adds an animation from 0 to 1 s.
fn animate(fixture: &mut Fixture, channels: &[(usize, &str, usize)]) {
    let input = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let samplers: Vec<Value> =
        channels.iter().map(|(_, _, output)| json!({"input": input, "output": output})).collect();
    let channels: Vec<Value> = channels
        .iter()
        .enumerate()
        .map(|(i, (node, path, _))| json!({"sampler": i, "target": {"node": node, "path": path}}))
        .collect();
    fixture.push("animations", json!({"samplers": samplers, "channels": channels}));
}

/// The pixel of [`FRONT`] that shows a point.
fn pixel(x: f64, y: f64) -> usize {
    let at = (DVec2::new(x, -y) + DVec2::new(2.0, 1.5)) * SCALE;
    at.y as usize * SIZE.0 + at.x as usize
}

#[test]
fn layers_know_points_and_lines() {
    let (_dir, at) = folder();
    let mut fixture = Fixture::empty();
    let points = fixture.vec3(&[[-0.5, -0.25, 0.0], [0.5, 0.25, 0.0]]);
    let line = fixture.vec3(&[[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0]]);
    let primitive =
        |mode: u32, positions: usize| json!({"attributes": {"POSITION": positions}, "mode": mode});
    fixture.push("meshes", json!({"primitives": [primitive(0, points), primitive(1, line)]}));
    let node = fixture.node(json!({"name": "cloud", "mesh": 0, "translation": [0, 0, 0]}));
    let shift = fixture.vec3(&[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    animate(&mut fixture, &[(node, "translation", shift)]);
    std::fs::write(at.join("a.glb"), fixture.glb()).unwrap();
    let aovs = "mask,position,nocs,triangle-id,object-id,barycentric,steps,flow-forward,flow-backward";
    let flags = format!("{FRONT} --point-size .5 --line-width .25 --fps 8 --frame 4");
    let all = layers(&at, "a.glb", aovs, &flags);
    let [position, nocs] = ["position", "nocs"].map(|name| all.vectors(name, "XYZ"));
    let (ids, objects) = (all.values("triangle-id.I"), all.values("object-id.I"));
    let weights = all.vectors("barycentric", "UVW");
    let [forward, backward] = ["flow-forward", "flow-backward"].map(|name| all.vectors(name, "XYV"));
    let (nodes, blocks) = (all.values("steps.N"), all.values("steps.B"));
    let mut counts = [0usize; 3];
    for i in hits(&all) {
        // The point of the axis: two points, then a line. Bounds have a diagonal of 1.25 m about (0, 0.125, 0).
        let axis = match ids[i] {
            1.0 => DVec3::new(-0.5, -0.25, 0.0),
            2.0 => DVec3::new(0.5, 0.25, 0.0),
            _ => DVec3::new(position[i].x.clamp(-0.5, 0.5), 0.5, 0.0),
        };
        counts[ids[i] as usize - 1] += 1;
        let radius = if ids[i] == 3.0 { 0.125 } else { 0.25 };
        assert!(((position[i] - axis).length() - radius).abs() < 1e-5, "{} {axis}", position[i]);
        let expected = (axis - DVec3::new(0.0, 0.125, 0.0)) / 1.25 + 0.5;
        assert!(nocs[i].abs_diff_eq(expected, 1e-5), "{} {expected}", nocs[i]);
        let along = if ids[i] == 3.0 { axis.x + 0.5 } else { 0.0 };
        assert!(weights[i].abs_diff_eq(DVec3::new(1.0 - along, along, 0.0), 1e-5), "{}", weights[i]);
        // An eighth of a metre a frame.
        for (flow, step) in [(forward[i], 1.5), (backward[i], -1.5)] {
            assert!(flow.abs_diff_eq(DVec3::new(step, 0.0, 1.0), 1e-4), "{flow}");
        }
        assert_eq!(objects[i], 1.0);
        assert!(nodes[i] >= 1.0 && blocks[i] >= 1.0);
    }
    // Discs of 28 pixels; a line of 36 and its ends of 7.
    assert!(
        counts[0].abs_diff(28) < 5 && counts[1].abs_diff(28) < 5 && counts[2].abs_diff(43) < 8,
        "{counts:?}"
    );
    assert_eq!((ids[0], blocks[0]), (0.0, 0.0));
}

/// Skins, morph targets, instances and visibility are those of triangles.
#[test]
fn points_and_lines_are_posed_like_triangles() {
    let (_dir, at) = folder();
    let mut fixture = Fixture::empty();
    let morphed = mesh(&mut fixture, 0, &[[-1.5, 1.0, 0.0]]);
    let target = fixture.vec3(&[[1.0, 0.0, 0.0]]);
    fixture.json["meshes"][morphed]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    let morphed = fixture.node(json!({"mesh": morphed}));
    let skinned = mesh(&mut fixture, 1, &[[0.0, -1.25, 0.0], [1.0, -1.25, 0.0]]);
    let joints = fixture.accessor(5121, "VEC4", 2, &[0; 8]);
    let weights = fixture.vec4(&[[1.0, 0.0, 0.0, 0.0]; 2]);
    let attributes = &mut fixture.json["meshes"][skinned]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    let joint = fixture.node(json!({"translation": [0, 0, 0]}));
    fixture.push("skins", json!({"joints": [joint]}));
    fixture.node(json!({"mesh": skinned, "skin": 0}));
    let dot = mesh(&mut fixture, 0, &[[0.0, 0.0, 0.0]]);
    let shifts = fixture.vec3(&[[-0.5, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    fixture.node(json!({"mesh": dot, "extensions": {"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": shifts}}}}));
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    fixture.node(json!({"mesh": dot, "translation": [1.5, 1.0, 0.0], "extensions": hidden}));
    let used = ["EXT_mesh_gpu_instancing", "KHR_node_visibility"];
    let weights = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let rise = fixture.vec3(&[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    animate(&mut fixture, &[(morphed, "weights", weights), (joint, "translation", rise)]);
    let fixture = fixture.with(json!({"extensionsUsed": used}));
    std::fs::write(at.join("a.glb"), fixture.glb()).unwrap();
    let flags = format!("{FRONT} --point-size .25 --line-width .25 --fps 4 --frame 2");
    let all = layers(&at, "a.glb", "mask,flow-forward,nocs", &flags);
    let (mask, flow) = (all.values("mask.A"), all.vectors("flow-forward", "XYV"));
    let still = DVec3::Z;
    for (x, y, expected) in [
        // Half way, and a quarter of the way in the next frame.
        (-1.0, 1.0, Some(DVec3::new(3.0, 0.0, 1.0))),
        (-1.5, 1.0, None),
        (0.5, -0.75, Some(DVec3::new(0.0, -3.0, 1.0))),
        (0.5, -1.25, None),
        (-0.5, 0.0, Some(still)),
        (0.0, 0.0, Some(still)),
        (0.5, 0.0, Some(still)),
        (0.25, 0.0, None),
        (1.5, 1.0, None),
    ] {
        let i = pixel(x, y);
        assert_eq!(mask[i] > 0.0, expected.is_some(), "{x} {y}");
        assert!(flow[i].abs_diff_eq(expected.unwrap_or_default(), 1e-4), "{x} {y}: {}", flow[i]);
    }
}

/// Mattes have the areas and names of objects of points and lines.
#[test]
fn mattes_cover_what_points_and_lines_do() {
    let (_dir, at) = folder();
    let mut fixture = Fixture::empty();
    let dot = mesh(&mut fixture, 0, &[[0.0, 0.0, 0.0]]);
    let line = mesh(&mut fixture, 1, &[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    fixture.node(json!({"name": "dot", "mesh": dot, "translation": [0.03, 0.52, 0.0]}));
    fixture.node(json!({"name": "line", "mesh": line, "translation": [0.01, -0.49, 0.0]}));
    std::fs::write(at.join("a.glb"), fixture.glb()).unwrap();
    let flags = format!(
        "{FRONT} --size 48x36 -s 64 --filter box --point-size .5 --line-width 3px --background transparent"
    );
    let image = read_exr(&rendered(&at, "a.glb", "a.exr", &format!("{flags} --aov cryptomatte")));
    let manifest: Value = serde_json::from_str(&text(&image, "cryptomatte/f834d0a/manifest")).unwrap();
    let ranked = ranks(&image, "crypto_object", SIZE.0 * SIZE.1);
    for (name, expected) in [("dot", PI * 9.0), ("line", 36.0 + PI * 2.25)] {
        let id = u32::from_str_radix(manifest[name].as_str().unwrap(), 16).unwrap();
        let area: f64 =
            ranked.iter().flatten().filter(|(rank, _)| *rank == id).map(|(_, share)| f64::from(*share)).sum();
        assert!((area / expected - 1.0).abs() < 0.03, "{name}: {area}, not {expected}");
    }
    let covered: f32 = ranked.iter().flatten().map(|(_, share)| share).sum();
    let alpha: f32 = channel(&image, "A").iter().sum();
    assert!((covered / alpha - 1.0).abs() < 1e-4, "{covered} {alpha}");
}

/// Materials of points: variants, and alpha per vertex in each mode.
#[test]
fn points_have_the_materials_of_triangles() {
    let (_dir, at) = folder();
    let mut fixture = Fixture::empty();
    let dots = mesh(&mut fixture, 0, &[[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    let colors = fixture.vec4(&[[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 0.4], [1.0, 1.0, 1.0, 0.0]]);
    let red = json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}});
    let green = json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1]}});
    let red = fixture.push("materials", red);
    let green = fixture.push("materials", green);
    let primitive = &mut fixture.json["meshes"][dots]["primitives"][0];
    primitive["attributes"]["COLOR_0"] = json!(colors);
    primitive["material"] = json!(red);
    primitive["extensions"] =
        json!({"KHR_materials_variants": {"mappings": [{"material": green, "variants": [0]}]}});
    fixture.node(json!({"mesh": dots}));
    let mut fixture = fixture.with(json!({"extensionsUsed": ["KHR_materials_variants"],
        "extensions": {"KHR_materials_variants": {"variants": [{"name": "grass"}]}}}));
    for (mode, expected) in
        [("OPAQUE", [1.0, 1.0, 1.0]), ("MASK", [1.0, 0.0, 0.0]), ("BLEND", [1.0, 0.4, 0.0])]
    {
        for material in [red, green] {
            fixture.json["materials"][material]["alphaMode"] = json!(mode);
        }
        std::fs::write(at.join("a.glb"), fixture.glb()).unwrap();
        for (variant, rgb) in [("", [1.0, 0.0, 0.0]), ("--variant grass", [0.0, 1.0, 0.0])] {
            let flags =
                format!("{FRONT} --size 48x36 -s 4 --point-size .5 --background transparent {variant}");
            let image = read_exr(&rendered(&at, "a.glb", "a.exr", &flags));
            let rgba = ["R", "G", "B", "A"].map(|name| channel(&image, name));
            for (x, alpha) in [-1.0, 0.0, 1.0].into_iter().zip(expected) {
                let seen = rgba.each_ref().map(|values| values[pixel(x, 0.0)]);
                let wanted = [rgb[0] * alpha, rgb[1] * alpha, rgb[2] * alpha, alpha];
                assert!(
                    seen.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-3),
                    "{mode} {variant} {x}: {seen:?}"
                );
            }
        }
    }
}

/// glTF 2.0, “Point and Line Materials”: without normals, the base colour and the emission; KHR_materials_unlit has no
/// emission.
#[test]
fn points_without_normals_show_their_emission() {
    let (_dir, at) = folder();
    for (extensions, green) in [(json!({}), 0.75), (json!({"KHR_materials_unlit": {}}), 0.25)] {
        let mut fixture = Fixture::empty();
        let dot = mesh(&mut fixture, 0, &[[0.0; 3]]);
        let material = fixture.push(
            "materials",
            json!({"emissiveFactor": [0, 0.5, 0], "extensions": extensions,
                "pbrMetallicRoughness": {"baseColorFactor": [1, 0.25, 0, 1]}}),
        );
        fixture.json["meshes"][dot]["primitives"][0]["material"] = json!(material);
        fixture.node(json!({"mesh": dot}));
        std::fs::write(at.join("a.glb"), fixture.glb()).unwrap();
        let flags = format!("{FRONT} --size 48x36 -s 4 --point-size .5 --background transparent");
        let image = read_exr(&rendered(&at, "a.glb", "a.exr", &flags));
        let seen = ["R", "G", "B"].map(|name| channel(&image, name)[pixel(0.0, 0.0)]);
        assert_eq!(seen, [1.0, green, 0.0]);
    }
}

/// Writes a cloud as binary PLY.
fn write_ply(path: &Path, points: &[[f32; 3]]) {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    points.iter().for_each(|p| bytes.extend(bytes_of(p)));
    std::fs::write(path, bytes).unwrap();
}

/// Repeated points have no spacing, and cost no more than others.
#[test]
fn coincident_points_are_drawn() {
    let (_dir, at) = folder();
    let mut points = vec![[0.0; 3]; 20_000];
    write_ply(&at.join("a.ply"), &points);
    let flags = format!("{FRONT} --background transparent");
    let all = layers(&at, "a.ply", "mask,triangle-id", &flags);
    // As large as a marker: 12 pixels.
    assert!(hits(&all).len().abs_diff(113) < 12);
    assert_eq!(all.values("triangle-id.I")[pixel(0.01, 0.01)], 1.0, "the first of those equally near");
    // One of another place is visible, too.
    points.push([1.0, 0.0, 0.0]);
    write_ply(&at.join("a.ply"), &points);
    let all = layers(&at, "a.ply", "mask,triangle-id", &flags);
    assert_eq!(all.values("triangle-id.I")[pixel(1.01, 0.01)], 20_001.0);
}

#[test]
fn bad_points_and_lines_are_reported() {
    let (_dir, at) = folder();
    let nan = f32::NAN;
    write_ply(&at.join("a.ply"), &[[0.0; 3], [nan, 0.0, 0.0], [1.0, 0.0, 0.0], [f32::INFINITY; 3]]);
    let messages = runs(&at, &format!("render a.ply {FRONT} --size 48x36 -s 1 -o a.png"));
    assert!(
        messages.contains("ignored 2 points and lines with coordinates that are not finite"),
        "{messages}"
    );
    // An OBJ file with lines of no length, and indices that are not there.
    std::fs::write(at.join("a.obj"), "v 0 0 0\nv 1 0 0\nl 1 1\nl 1 2\np 2\n").unwrap();
    let all = layers(&at, "a.obj", "mask,triangle-id", &format!("{FRONT} --point-size .25 --line-width .5"));
    assert!(hits(&all).len() > 60);
    let messages = runs(&at, &format!("render a.obj {FRONT} --size 48x36 -s 1 -o a.png --line-width 3"));
    assert!(
        messages.contains("--line-width is in metres and large for a scene with a radius of 0.500 m"),
        "{messages}"
    );
    let messages = runs(&at, &format!("render a.obj {FRONT} --size 48x36 -s 1 -o a.png --line-width 3px"));
    assert!(!messages.contains("in metres"), "{messages}");
    std::fs::write(at.join("b.obj"), "v 0 0 0\nv 1 0 0\nl 1 3\n").unwrap();
    fails(&at, &["render", "b.obj", "-o", "b.png"], 1, "b.obj");
    let mut fixture = Fixture::empty();
    let line = mesh(&mut fixture, 1, &[[0.0; 3], [1.0, 0.0, 0.0]]);
    let indices = fixture.indices(&[0, 7]);
    fixture.json["meshes"][line]["primitives"][0]["indices"] = json!(indices);
    fixture.node(json!({"mesh": line}));
    std::fs::write(at.join("c.glb"), fixture.glb()).unwrap();
    let message = "meshes[0].primitives[0].indices: element 1 is index 7, but there are only 2 vertices";
    fails(&at, &["render", "c.glb", "-o", "c.png"], 1, message);
}

#[test]
fn sizes_are_checked_and_huge_ones_are_drawn() {
    let (_dir, at) = folder();
    write_ply(&at.join("a.ply"), &[[0.0; 3], [1.0, 0.0, 0.0]]);
    for size in ["0", "-1", "-2px", "1e30", "nan"] {
        refused(
            &at,
            &format!("render a.ply -o a.png --point-size={size}"),
            "must be greater than 0 and at most 1e18",
        );
        refused(
            &at,
            &format!("render a.ply -o a.png --line-width={size}"),
            "must be greater than 0 and at most 1e18",
        );
    }
    // Spheres around the eye are behind it.
    for (size, share) in [("1e18px", 0.0), ("1e18", 0.0), ("4", 1.0), ("off", 0.0)] {
        let (w, h) = SIZE;
        let line =
            format!("render a.ply {FRONT} --size {w}x{h} -s 1 -q -o a.exr --aov mask --point-size {size}");
        runs(&at, &line);
        let mask = channel(&read_exr(&at.join("a.exr")), "mask.A");
        let seen = mask.iter().sum::<f32>() / (w * h) as f32;
        assert!((seen - share).abs() < 0.1, "{size}: {seen}");
    }
}

/// Animations of a material that triangles share with points drive both.
#[test]
fn shared_materials_are_animated() {
    let (_dir, at) = folder();
    let mut fixture = Fixture::empty();
    let dot = mesh(&mut fixture, 0, &[[-1.0, 0.0, 0.0]]);
    let face = mesh(&mut fixture, 4, &[[0.5, -0.5, 0.0], [1.5, -0.5, 0.0], [1.0, 0.5, 0.0]]);
    let material =
        fixture.push("materials", json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}));
    for mesh in [dot, face] {
        fixture.json["meshes"][mesh]["primitives"][0]["material"] = json!(material);
        fixture.node(json!({"mesh": mesh}));
    }
    let input = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let output = fixture.vec4(&[[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]]);
    let pointer = "/materials/0/pbrMetallicRoughness/baseColorFactor";
    let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
    fixture.push(
        "animations",
        json!({"samplers": [{"input": input, "output": output}], "channels": [{"sampler": 0, "target": target}]}),
    );
    let fixture = fixture.with(json!({"extensionsUsed": ["KHR_animation_pointer"]}));
    std::fs::write(at.join("a.glb"), fixture.glb()).unwrap();
    let all = layers(&at, "a.glb", "albedo,mask", &format!("{FRONT} --point-size .5 --fps 4 --frame 3"));
    let albedo = all.vectors("albedo", "RGB");
    for x in [-1.0, 1.0] {
        let color = albedo[pixel(x, 0.0)];
        assert!(color.abs_diff_eq(DVec3::new(0.25, 0.0, 0.75), 1e-3), "{x}: {color}");
    }
}

/// The seven modes of primitives over the corners of a square, with and without indices.
#[test]
fn all_modes_of_primitives_are_drawn() {
    let (_dir, at) = folder();
    let corners = [[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, 0.5, 0.0], [0.5, 0.5, 0.0]];
    let probes = [
        // Corners, the sides below, above, to the left and to the right, and both diagonals.
        [-0.5, -0.5],
        [0.5, 0.5],
        [0.0, -0.5],
        [0.0, 0.5],
        [-0.5, 0.0],
        [0.5, 0.0],
        [-0.25, 0.25],
        [0.25, 0.25],
        [-0.2, -0.25],
    ];
    let (yes, no) = (true, false);
    for (mode, order, shown) in [
        (0, &[0u16, 1, 2, 3][..], [yes, yes, no, no, no, no, no, no, no]),
        (1, &[0, 1, 2, 3], [yes, yes, yes, yes, no, no, no, no, no]),
        (2, &[0, 1, 2, 3], [yes, yes, yes, yes, no, no, yes, yes, yes]),
        (3, &[0, 1, 2, 3], [yes, yes, yes, yes, no, no, yes, no, no]),
        (4, &[0, 1, 2, 1, 3, 2], [yes; 9]),
        (5, &[0, 1, 2, 3], [yes; 9]),
        (6, &[0, 1, 3, 2], [yes; 9]),
    ] {
        let mut pictures = Vec::new();
        for is_indexed in [false, true] {
            let mut fixture = Fixture::empty();
            let own: Vec<[f32; 3]> = order.iter().map(|&i| corners[usize::from(i)]).collect();
            let mesh = mesh(&mut fixture, mode, if is_indexed { &corners } else { &own });
            if is_indexed {
                let indices = fixture.indices(order);
                fixture.json["meshes"][mesh]["primitives"][0]["indices"] = json!(indices);
            }
            fixture.node(json!({"mesh": mesh}));
            let name = format!("{mode}-{is_indexed}.glb");
            std::fs::write(at.join(&name), fixture.glb()).unwrap();
            let (w, h) = SIZE;
            let flags = format!("{FRONT} --size {w}x{h} -s 1 --point-size .25 --line-width .25 --aov mask");
            let messages = runs(&at, &format!("render {name} -o a.exr {flags}"));
            assert!(!messages.contains("warning"), "{name}: {messages}");
            let mask = channel(&read_exr(&at.join("a.exr")), "mask.A");
            for ([x, y], shown) in probes.into_iter().zip(shown) {
                // The outermost pixels of triangles lie on their border.
                let inward = if mode < 4 { 1.0 } else { 0.9 };
                let is_seen = mask[pixel(x * inward, y * inward)] > 0.0;
                assert_eq!(is_seen, shown, "{name} at {x} {y}");
            }
            pictures.push(mask);
        }
        assert!(pictures[0] == pictures[1], "mode {mode}");
    }
}

/// Pixels at the border of a line have as many samples as edges have, and a crop has the same ones.
#[test]
fn lines_of_a_pixel_are_smooth_at_few_samples() {
    let (_dir, at) = folder();
    std::fs::write(at.join("a.obj"), "v -1.7 -1.3 0\nv 1.7 0.9 0\nv -1.5 1 0\nl 1 2\nl 3 1\np 3\n").unwrap();
    let picture = |options: &str| {
        runs(
            &at,
            &format!("render a.obj {FRONT} --size 96x72 --background transparent {options} -q -o a.png"),
        );
        image::open(at.join("a.png")).unwrap().into_rgba8()
    };
    let [four, sixteen, exact] = [4, 16, 256].map(|samples| picture(&format!("-s {samples}")));
    let error = |picture: &image::RgbaImage| {
        let square =
            |(a, b): (&image::Rgba<u8>, &image::Rgba<u8>)| (f64::from(a[3]) - f64::from(b[3])).powi(2);
        picture.pixels().zip(exact.pixels()).map(square).sum::<f64>().sqrt()
    };
    assert!(error(&four) < 1.1 * error(&sixteen), "{} {}", error(&four), error(&sixteen));
    let crop = picture("-s 4 --crop 13,21,50,37");
    assert!(crop == image::imageops::crop_imm(&four, 13, 21, 50, 37).to_image());
}
