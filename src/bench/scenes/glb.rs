//! Writes generated scenes as binary glTF. The header, which precedes the buffer, holds its length in advance.

use std::fs::File;
use std::io::{BufWriter, Error, ErrorKind, Result, Write};
use std::path::Path;

use serde_json::{Value, json};

use super::mesh::GeneratedMesh;
use super::noise::fractal_noise;
use super::scene::{GeneratedInstance, GeneratedScene};
use super::vector::{cross, sub, unit};

/// Component types of accessors.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// Texels per side of the texture.
const TEXTURE_SIDE: u32 = 1024;

/// Writes a scene as GLB, with its camera, a point light and a sun.
///
/// # Errors
/// Errors of the file system, and scenes of 4 GiB and more, which exceed the format.
pub fn write_glb(scene: &GeneratedScene, path: &Path) -> Result<()> {
    let texture = if scene.textured { texture_png()? } else { Vec::new() };
    let (json, length) = json_and_buffer_length(scene, texture.len());
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 28 + text.len() + length;
    let word = |n: usize| match u32::try_from(n) {
        Ok(n) => Ok(n.to_le_bytes()),
        Err(_) => Err(Error::new(ErrorKind::FileTooLarge, format!("{n} bytes are too many for a GLB"))),
    };
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    out.write_all(b"glTF\x02\0\0\0")?;
    out.write_all(&word(total)?)?;
    out.write_all(&word(text.len())?)?;
    out.write_all(b"JSON")?;
    out.write_all(&text)?;
    out.write_all(&word(length)?)?;
    out.write_all(b"BIN\0")?;
    for mesh in &scene.meshes {
        for p in mesh.positions.iter().chain(&mesh.normals) {
            p.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        }
        if scene.textured {
            for p in &mesh.positions {
                uv(*p).iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
            }
        }
        for v in mesh.triangles.iter().flatten() {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    out.write_all(&texture)?;
    out.write_all(&[0; 3][..texture.len().next_multiple_of(4) - texture.len()])?;
    out.flush()
}

/// The JSON chunk, and the length of the buffer that it describes. `texture` is the length of the PNG.
fn json_and_buffer_length(scene: &GeneratedScene, texture: usize) -> (Value, usize) {
    let mut views = vec![];
    let mut accessors = vec![];
    let mut meshes = vec![];
    let mut materials = vec![];
    let mut length = 0;
    let mut view = |bytes: usize| {
        views.push(json!({"buffer": 0, "byteOffset": length, "byteLength": bytes}));
        length += bytes.next_multiple_of(4);
        views.len() - 1
    };
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let n = mesh.positions.len();
        let mut accessor = |bytes: usize, kind: u32, shape: &str, count: usize| {
            let view = view(bytes);
            accessors.push(json!({"bufferView": view, "componentType": kind, "type": shape, "count": count}));
            accessors.len() - 1
        };
        let position = accessor(n * 12, FLOAT, "VEC3", n);
        let mut attributes = json!({ "POSITION": position });
        if !mesh.normals.is_empty() {
            attributes["NORMAL"] = accessor(n * 12, FLOAT, "VEC3", n).into();
        }
        if scene.textured {
            attributes["TEXCOORD_0"] = accessor(n * 8, FLOAT, "VEC2", n).into();
        }
        let indices = accessor(mesh.triangles.len() * 12, UNSIGNED_INT, "SCALAR", mesh.triangles.len() * 3);
        let (low, high) = bounds(mesh);
        accessors[position]["min"] = json!(low);
        accessors[position]["max"] = json!(high);
        let primitive = json!({"attributes": attributes, "indices": indices, "material": i});
        meshes.push(json!({"name": mesh.name, "primitives": [primitive]}));
        materials.push(material(mesh, scene.textured));
    }
    let mut root = json!({
        "asset": {"version": "2.0", "generator": "blinn-scenes"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "scene": 0,
        "scenes": [],
        "nodes": [],
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "cameras": [{"type": "perspective", "perspective": {
            "yfov": scene.yfov.to_radians(), "aspectRatio": 16.0 / 9.0, "znear": 0.01}}],
        "extensions": {"KHR_lights_punctual": {"lights": lights(scene)}},
    });
    if scene.textured {
        let image = view(texture);
        root["images"] = json!([{"bufferView": image, "mimeType": "image/png"}]);
        root["textures"] = json!([{"source": 0}]);
    }
    let nodes = nodes(scene);
    root["scenes"] = json!([{"nodes": (0..nodes.len()).collect::<Vec<_>>()}]);
    root["nodes"] = nodes.into();
    root["bufferViews"] = views.into();
    root["buffers"] = json!([{ "byteLength": length }]);
    (root, length)
}

fn bounds(mesh: &GeneratedMesh) -> ([f32; 3], [f32; 3]) {
    mesh.positions.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(low, high), p| {
        ([0, 1, 2].map(|a| low[a].min(p[a])), [0, 1, 2].map(|a| high[a].max(p[a])))
    })
}

fn material(mesh: &GeneratedMesh, textured: bool) -> Value {
    let [r, g, b] = mesh.color;
    let mut surface =
        json!({"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6});
    if textured {
        surface["baseColorTexture"] = json!({"index": 0});
    }
    json!({"pbrMetallicRoughness": surface, "doubleSided": true})
}

/// A point light that lights the target about as brightly as the sun.
fn lights(scene: &GeneratedScene) -> Value {
    let to_light = sub(scene.light, scene.target);
    let squared_distance: f32 = to_light.iter().map(|x| x * x).sum();
    json!([
        {"type": "point", "intensity": 3.0 * squared_distance, "color": [1.0, 0.95, 0.85]},
        {"type": "directional", "intensity": 1.5, "color": [0.85, 0.92, 1.0]},
    ])
}

fn nodes(scene: &GeneratedScene) -> Vec<Value> {
    let matrix = |columns: [[f32; 3]; 4]| {
        let [x, y, z, o] = columns;
        json!([x[0], x[1], x[2], 0, y[0], y[1], y[2], 0, z[0], z[1], z[2], 0, o[0], o[1], o[2], 1])
    };
    // The matrix of a node at `from` whose −Z axis points along `d`.
    let look_along = |d: [f32; 3], from: [f32; 3]| {
        let z = unit(d.map(|x| -x));
        let x = unit(cross([0.0, 1.0, 0.0], z));
        matrix([x, cross(z, x), z, from])
    };
    let mut nodes: Vec<Value> = scene
        .instances
        .iter()
        .map(|i| {
            let is_identity = *i == GeneratedInstance::identity(i.mesh);
            if is_identity {
                json!({"mesh": i.mesh})
            } else {
                json!({"mesh": i.mesh, "matrix": matrix(i.columns)})
            }
        })
        .collect();
    nodes.push(
        json!({"name": "Camera", "camera": 0, "matrix": look_along(sub(scene.target, scene.eye), scene.eye)}),
    );
    let light = |i: usize, matrix: Value| json!({"matrix": matrix, "extensions": {"KHR_lights_punctual": {"light": i}}});
    nodes.push(light(0, look_along([0.0, 0.0, -1.0], scene.light)));
    nodes.push(light(1, look_along(scene.sun_direction, scene.light)));
    nodes
}

/// Texture coordinates of an oblique projection, which has no seams.
fn uv(p: [f32; 3]) -> [f32; 2] {
    [0.5 + 0.4 * p[0] + 0.15 * p[2], 0.5 - 0.4 * p[1] + 0.15 * p[2]]
}

/// A mottled texture with fine grain.
fn texture_png() -> Result<Vec<u8>> {
    let mut texels = Vec::with_capacity((TEXTURE_SIDE * TEXTURE_SIDE * 3) as usize);
    for y in 0..TEXTURE_SIDE {
        for x in 0..TEXTURE_SIDE {
            let p = [f64::from(x) / f64::from(TEXTURE_SIDE), f64::from(y) / f64::from(TEXTURE_SIDE), 0.0];
            for channel in 0..3 {
                let shade = 0.7 + 0.18 * fractal_noise(p, 8.0, 6, 0.6, 60 + channel);
                texels.push((255.0 * shade.clamp(0.0, 1.0)) as u8);
            }
        }
    }
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, TEXTURE_SIDE, TEXTURE_SIDE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header()?.write_image_data(&texels)?;
    Ok(out)
}
