//! Edges that glTF files describe (EXT_mesh_primitive_edge_visibility): which are drawn, and their colours.

use std::fs;
use std::path::Path;

use image::RgbaImage;
use serde_json::{Value, json};

use crate::common::gltf_fixture::{Fixture, bytes_of};
use crate::common::program::*;
use crate::edges::coverage;

const NAME: &str = "EXT_mesh_primitive_edge_visibility";
/// A camera that sees from −2 to 2 in 64 pixels.
const FRONT: &str = "--view-point 0,0,8 --look-at 0,0,0 --projection orthographic --view-rect -2,2,-2,2 --size 64x64 \
                     --edges-only -s 64";
/// The length in pixels of a side of the square, and of its diagonal.
const SIDE: f64 = 32.0;
const DIAGONAL: f64 = 32.0 * std::f64::consts::SQRT_2;

/// A square from −1 to 1 of two triangles, whose left and right sides are hard and whose diagonal is a silhouette, as in the
/// text of the extension: its vertices are counted from the upper left one, against the clock.
fn square() -> Fixture {
    let mut file = Fixture::empty();
    let positions = file.vec3(&[[-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]);
    let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
    let visibility = file.accessor(5121, "SCALAR", 2, &[18, 2]);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices,
        "extensions": {NAME: {"visibility": visibility}}});
    file.push("meshes", json!({"primitives": [primitive]}));
    file.node(json!({"mesh": 0}));
    file.json["extensionsUsed"] = json!([NAME]);
    for color in [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.25]] {
        let mode = if color[3] < 1.0 { "BLEND" } else { "OPAQUE" };
        file.push(
            "materials",
            json!({"pbrMetallicRoughness": {"baseColorFactor": color}, "alphaMode": mode}),
        );
    }
    file
}

fn extension(file: &mut Fixture) -> &mut Value {
    &mut file.primitive()["extensions"][NAME]
}

/// Renders a file, which must give this warning or none.
#[track_caller]
fn drawn(folder: &Path, file: &Fixture, options: &str, warning: &str) -> RgbaImage {
    fs::write(folder.join("a.glb"), file.glb()).unwrap();
    let messages = runs(folder, &format!("render a.glb -o a.png {FRONT} {options}"));
    let expected =
        if warning.is_empty() { !messages.contains("ignored") } else { messages.contains(warning) };
    assert!(expected, "{messages}");
    image::open(folder.join("a.png")).unwrap().into_rgba8()
}

#[track_caller]
fn assert_length(picture: &RgbaImage, expected: f64) {
    let length = coverage(picture);
    assert!((length - expected).abs() < 0.04 * expected, "{length}, not {expected}");
}

/// The most opaque pixel near a point of the picture.
fn color(picture: &RgbaImage, x: u32, y: u32) -> [u8; 4] {
    let near = (x - 2..=x + 1).flat_map(|x| (y - 2..=y + 1).map(move |y| (x, y)));
    near.map(|(x, y)| picture.get_pixel(x, y).0).max_by_key(|pixel| pixel[3]).unwrap()
}

#[test]
fn visibility_of_edges_decides() {
    let (_guard, folder) = folder();
    let file = square();
    assert_length(&drawn(&folder, &file, "--edges feature", ""), 2.0 * SIDE);
    // The border is part of the outline; the flat diagonal is not.
    assert_length(&drawn(&folder, &file, "--edges silhouette", ""), 2.0 * SIDE);
    assert_length(&drawn(&folder, &file, "--edges all", ""), 2.0 * SIDE + DIAGONAL);
}

/// Normals in all their encodings decide about silhouettes, and turn with the node.
#[test]
fn silhouettes_follow_the_normals_of_the_file() {
    let (_guard, folder) = folder();
    let silhouettes = |file: &Fixture, warning: &str| drawn(&folder, file, "--edges silhouette", warning);
    for (normals, is_drawn) in [([[0i8, 0, 127], [0, 0, -127]], true), ([[0, 0, 127], [90, 0, 90]], false)] {
        let floats = normals.map(|n| n.map(|n| f32::from(n) / 127.0));
        // The middle of the octahedron's square is up, and its corners are down.
        let packed: [u16; 2] = [0x8080, if is_drawn { 0xffff } else { 0x80bf }];
        let mut file = square();
        let accessors = [
            file.vec3(&floats),
            file.accessor(5120, "VEC3", 2, &bytes_of(normals.as_flattened())),
            file.accessor(5123, "SCALAR", 2, &bytes_of(&packed)),
        ];
        for accessor in accessors {
            extension(&mut file)["silhouetteNormals"] = json!(accessor);
            let diagonal = if is_drawn { DIAGONAL } else { 0.0 };
            assert_length(&silhouettes(&file, ""), 2.0 * SIDE + diagonal);
        }
    }
    let mut file = square();
    let normals = file.vec3(&[[0.0, 0.0, 1.0], [1.0, 0.0, 0.1]]);
    extension(&mut file)["silhouetteNormals"] = json!(normals);
    assert_length(&silhouettes(&file, ""), 2.0 * SIDE);
    // 30° about y: (sin 15°, 0, cos 15°). The sides stay as long, and the diagonal becomes shorter.
    let (sin, cos) = (15f64.to_radians().sin(), 15f64.to_radians().cos());
    file.json["nodes"][0]["rotation"] = json!([0.0, sin, 0.0, cos]);
    let shorter = SIDE * (1.0 + 30f64.to_radians().cos().powi(2)).sqrt();
    assert_length(&silhouettes(&file, ""), 2.0 * SIDE + shorter);
    let too_few = file.vec3(&[[0.0, 0.0, 1.0]]);
    extension(&mut file)["silhouetteNormals"] = json!(too_few);
    assert_length(&silhouettes(&file, "expected 2 normals for each of 1 silhouettes"), 2.0 * SIDE);
}

/// Line strings have materials of their own, or that of the other edges; `--edge-color` takes precedence.
#[test]
fn edges_have_the_colours_of_their_materials() {
    let (_guard, folder) = folder();
    let mut file = square();
    // The bottom in green; the top without material, with a vertex of its own where a normal would split it.
    let positions =
        file.vec3(&[[-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    file.primitive()["attributes"]["POSITION"] = json!(positions);
    let bottom = file.accessor(5121, "SCALAR", 2, &[1, 2]);
    let top = file.accessor(5121, "SCALAR", 2, &[4, 0]);
    let strings = json!([{"indices": bottom, "material": 1}, {"indices": top}]);
    extension(&mut file)["lineStrings"] = strings;
    extension(&mut file)["material"] = json!(0);
    let colors =
        |picture: &RgbaImage| [(16, 32), (48, 32), (32, 48), (32, 16)].map(|(x, y)| color(picture, x, y));
    let [red, green] = [[255, 0, 0, 255], [0, 255, 0, 255]];
    let picture = drawn(&folder, &file, "--edges feature --edge-width 4px", "");
    assert_eq!(colors(&picture), [red, red, green, red]);
    let picture = drawn(&folder, &file, "--edges feature --edge-width 4px --edge-color #00f", "");
    assert_eq!(colors(&picture), [[0, 0, 255, 255]; 4]);
    // A quarter of the opacity.
    extension(&mut file)["material"] = json!(2);
    let picture = drawn(&folder, &file, "--edges feature --edge-width 4px", "");
    assert_eq!(colors(&picture), [[0, 0, 255, 64], [0, 0, 255, 64], green, [0, 0, 255, 64]]);
    // Without a material of their own edges are black.
    extension(&mut file).as_object_mut().unwrap().remove("material");
    let picture = drawn(&folder, &file, "--edges feature --edge-width 4px", "");
    assert_eq!(colors(&picture), [[0, 0, 0, 255], [0, 0, 0, 255], green, [0, 0, 0, 255]]);
}

#[test]
fn wrong_members_give_warnings_and_lose_nothing_else() {
    let (_guard, folder) = folder();
    let mut file = square();
    extension(&mut file)["material"] = json!(7);
    assert_length(&drawn(&folder, &file, "--edges feature", "there is no such material"), 2.0 * SIDE);
    let mut file = square();
    // The other diagonal is no edge, 9 no vertex, and a line from a vertex to itself nothing.
    let indices = file.accessor(5121, "SCALAR", 9, &[1, 3, 255, 2, 9, 255, 1, 1, 2]);
    extension(&mut file)["lineStrings"] = json!([{"indices": indices}]);
    let lines = "ignored 2 lines that are no edges of triangles";
    assert_length(&drawn(&folder, &file, "--edges feature", lines), 3.0 * SIDE);
    let indices = file.accessor(5121, "SCALAR", 19, &[0; 19]);
    extension(&mut file)["lineStrings"] = json!([{"indices": indices}, {"indices": 99}]);
    let lists = "expected an accessor of indices";
    assert_length(&drawn(&folder, &file, "--edges feature", lists), 2.0 * SIDE);
}
