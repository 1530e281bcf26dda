//! Small generated files with a bit of everything: seeds of mutations, good files for tests to spoil.

use std::io::Cursor;

use serde_json::{Value, json};

use super::gltf_fixture::{Fixture, bytes_of, data_uri};

pub const MTL: &str = "newmtl a\nKa .1 .1 .1\nKd .8 .2 .1\nKs .5 .5 .5\nKe 0 0 0\nNs 100\nd .5\nillum 2\nTf 1 1 1\nNi 1.5\n\
map_Kd -s 2 3 1 -o .5 0 0 -clamp on a.png\nmap_d a.png\nbump -bm 0.5 a.png\nmap_Ks a.png\n\
newmtl b\nPr .3\nPm 1\nmap_Pr a.png\nmap_Pm a.png\nnorm a.png\nTr .25\nmap_Ke \"a.png\"\nrefl a.png\nNs 1D2\n\
newmtl c\nillum 7\nTf xyz .9 .5 .2\nNi 1.4\nKs 1 1 1\nd 1\nnewmtl d\nillum 4\nTf .5\nNi 1\n";

pub const MTL_OF_BLENDER: &str = "# Blender 5.0.1 MTL File: 'None'\n# www.blender.org\n\nnewmtl a\nNs 250.000000\n\
Ka 1.000000 1.000000 1.000000\nKd 0.800000 0.800000 0.800000\nKs 0.500000 0.500000 0.500000\nNi 1.450000\nd 1.0\n\
illum 2\nmap_Kd a.png\nmap_Bump -bm 1.000000 a.png\n\nnewmtl b\nPr 0.5\nPm 0.1\nPs 0\nPc 0.03\nillum 3\n";

/// Name and text.
pub const OBJ: [(&str, &str); 8] = [
    (
        "corners of every kind",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nf 1 2 3\nf 1/1 2/2 3/1\nf 1//1 2//1 4//1\n\
         f 1/1/1 2/2/1 3/1/1 4/2/1\nf -1 -2 -3\nf 1/-1/-1 2/1 3//1\n",
    ),
    (
        "a concave polygon",
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 3 1 0\nv 2 4 0\nv 1 1 0\nv 0 4 0\nf 1 2 3 4 5 6 7\nf 7 6 5 4 3 2 1\n",
    ),
    (
        "groups and materials",
        "# Maker 1.0\nmtllib a.mtl\no one\ng a b\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt .5 .5\ns 1\nusemtl a\nf 1/1 2/1 3/1\n\
         o two\ns off\nusemtl b\nf 3/1 2/1 1/1\nusemtl c\nf 1 2 3\nl 1 2 3\np 1\n",
    ),
    (
        "joined lines and comments",
        "v 0 0 0 # here\nv 1 \\\n0 \\\r\n 0\r\nv 0 1e0 -0.0\n\tf\t1 2 \\\n3\n\n#\n\\\nf 1 2 3 \\",
    ),
    (
        "vertex colours",
        "v 0 0 0 1 0 0\nv 1 0 0 .5 .5 .5\nv 0 1 0\n#MRGB ffff0000ff00ff00ff0000ff\nf 1 2 3\nv 0 0 1 2\nf 1 2 4\n",
    ),
    (
        "numbers",
        "v 1e38 -1e-38 .5\nv +1. 1E2 1e1\nv nan inf 1.#IND\nv 00000000000000000001 1e-400 123456789.123456789\n\
         v 0 0 0\nv 1 0 0\nv 0 1 0\nf 5 6 7\n",
    ),
    (
        "smooth",
        "v 0 0 1\nv 0 0 -1\nv -1 -1 1\nv -1 -1 -1\nv 1 -1 1\nv 1 -1 -1\ns 1\nf 1 2 4 3\nf 2 1 5 6\ns 2\nf 3 4 6 5\n\
         s 0\nf 1 3 5\n",
    ),
    (
        "what is left out",
        "cstype bezier\ndeg 3\nvp .1 .2\ncurv2 1 2\nparm u 0 1\nend\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\nf 1\nf\nf 1 2 3\n\
         fo 3 2 1\ncall x.obj\nlod 1\nshadow_obj a\nmg 1 .5\n",
    ),
];

pub const CAMERA: &str = "<?xml version=\"1.0\"?>\n<scene><camera type=\"PerspectiveCamera\" name=\"eye\">\n\
<viewPoint>10 4.2 6</viewPoint><viewDir>-5 -2.1 -3</viewDir><viewUp>0 1 0</viewUp>\n\
<projDistance>1.5</projDistance><viewWidth>.6</viewWidth><viewHeight>.6</viewHeight>\n</camera></scene>\n";

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const CORNERS: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// A triangle that shows the picture `name`.
pub fn pictured(name: &str) -> Vec<u8> {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    file.vec2(&CORNERS);
    let primitive = json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0});
    let file = one_mesh(file, primitive).with(json!({
        "images": [{"uri": name}],
        "textures": [{"source": 0}],
        "materials": [{"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "normalTexture": {"index": 0}}],
    }));
    file.gltf()
}

/// A triangle below a light with the photometric profile `name`.
pub fn lit_by(name: &str) -> Vec<u8> {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    let file = one_mesh(file, json!({"attributes": {"POSITION": 0}})).with(json!({
        "extensionsUsed": ["EXT_lights_ies"],
        "extensions": {"EXT_lights_ies": {"lights": [{"uri": name}]}},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"translation": [0.2, 0.3, 1], "extensions": {"EXT_lights_ies": {"light": 0}}}],
    }));
    file.gltf()
}

/// The file with a node that has a mesh of one primitive.
fn one_mesh(file: Fixture, primitive: Value) -> Fixture {
    file.with(
        json!({"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]}),
    )
}

/// A skin, a morph target, animations, a camera, a light and instances.
pub fn rich_gltf() -> Vec<u8> {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    file.vec2(&CORNERS);
    let weights = file.vec4(&[[1.0, 0.0, 0.0, 0.0]; 3]);
    let joints = file.accessor(5123, "VEC4", 3, &bytes_of(&[0u16; 12]));
    let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let translations = file.vec3(&[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]);
    file.with(json!({
        "extensionsUsed": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_materials_ior"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 5,
            "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}]}},
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0, "skin": 0, "weights": [0.5], "children": [3]},
            {"camera": 0, "translation": [0, 0, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"mesh": 1, "rotation": [0, 0.6, 0, 0.8], "scale": [1, 2, -1],
                "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translations}}}},
            {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]},
        ],
        "meshes": [
            {"weights": [0.1], "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "WEIGHTS_0": weights,
                "JOINTS_0": joints}, "targets": [{"POSITION": 0}], "material": 0}]},
            {"primitives": [{"mode": 5, "attributes": {"POSITION": 0}}]},
        ],
        "skins": [{"joints": [3]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1, "zfar": 9}}],
        "materials": [{"alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.2, 0.7], "metallicFactor": 0.2,
                "roughnessFactor": 0.4}, "emissiveFactor": [0.1, 0, 0],
            "extensions": {"KHR_materials_ior": {"ior": 1.4}}}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 3, "path": "translation"}},
            {"sampler": 1, "target": {"node": 0, "path": "weights"}}],
            "samplers": [{"input": times, "output": translations, "interpolation": "STEP"},
                {"input": times, "output": times}]}],
    }))
    .gltf()
}

/// Small files for features that the rich one has no room for.
pub fn small_gltf() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("sparse.gltf", sparse().gltf()),
        ("animated.gltf", animated().gltf()),
        ("shiny.gltf", shiny().gltf()),
        ("glass.gltf", glass().gltf()),
        ("fan.gltf", fan().gltf()),
        ("surrounded.gltf", surrounded().gltf()),
    ]
}

/// A triangle whose accessor of positions has sparse values.
fn sparse() -> Fixture {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    file.indices(&[0, 1, 2]);
    file.json["accessors"][0]["sparse"] = json!({"count": 2,
        "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}});
    one_mesh(file, json!({"attributes": {"POSITION": 0}, "indices": 1}))
}

/// A triangle that turns linearly and grows along a cubic spline.
fn animated() -> Fixture {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let rotations = file.vec4(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.6, 0.0, 0.8]]);
    let scales = file.vec3(&[[0.5; 3]; 6]);
    one_mesh(file, json!({"attributes": {"POSITION": 0}})).with(json!({"animations": [{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}},
            {"sampler": 1, "target": {"node": 0, "path": "scale"}}],
        "samplers": [{"input": times, "output": rotations},
            {"input": times, "output": scales, "interpolation": "CUBICSPLINE"}]}]}))
}

/// A triangle with extensions of materials and an image in a data URI.
fn shiny() -> Fixture {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    file.vec2(&CORNERS);
    one_mesh(file, json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0})).with(json!({
        "samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
        "images": [{"uri": data_uri(&png())}], "textures": [{"source": 0, "sampler": 0}],
        "materials": [{"normalTexture": {"index": 0, "scale": 0.5}, "extensions": {
            "KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 0}, "glossinessFactor": 0.4},
            "KHR_materials_transmission": {"transmissionFactor": 0.5}, "KHR_materials_unlit": {}}}]}))
}

/// A triangle with extensions of materials that reflect and refract.
fn glass() -> Fixture {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    file.vec2(&CORNERS);
    let texture = json!({"index": 0});
    one_mesh(file, json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0})).with(json!({
        "images": [{"uri": data_uri(&png())}], "textures": [{"source": 0}],
        "materials": [{"doubleSided": true, "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": texture},
            "KHR_materials_ior": {"ior": 1.4},
            "KHR_materials_volume": {"thicknessFactor": 0.2, "thicknessTexture": texture, "attenuationDistance": 0.5,
                "attenuationColor": [0.9, 0.4, 0.2]},
            "KHR_materials_specular": {"specularFactor": 0.7, "specularTexture": texture,
                "specularColorFactor": [0.9, 0.8, 0.7], "specularColorTexture": texture},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatTexture": texture,
                "clearcoatRoughnessFactor": 0.1, "clearcoatRoughnessTexture": texture},
            "KHR_materials_emissive_strength": {"emissiveStrength": 2.0}}}]}))
}

/// A triangle lit by an environment.
fn surrounded() -> Fixture {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    let light = json!({"rotation": [0, 0.6, 0, 0.8], "intensity": 1.5, "specularImageSize": 2,
        "specularImages": [[0, 0, 0, 0, 0, 0]], "irradianceCoefficients": vec![vec![0.3; 3]; 9]});
    one_mesh(file, json!({"attributes": {"POSITION": 0}})).with(json!({
        "images": [{"uri": data_uri(&png())}],
        "extensions": {"EXT_lights_image_based": {"lights": [light]}},
        "scenes": [{"nodes": [0], "extensions": {"EXT_lights_image_based": {"light": 0}}}]}))
}

/// A triangle fan.
fn fan() -> Fixture {
    let mut file = Fixture::empty();
    file.vec3(&TRIANGLE);
    one_mesh(file, json!({"attributes": {"POSITION": 0}, "mode": 6}))
}

fn png() -> Vec<u8> {
    let image = image::RgbaImage::from_pixel(2, 2, image::Rgba([128, 128, 255, 200]));
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

/// A flat Radiance picture of another orientation and other units.
fn turned() -> Vec<u8> {
    let header = "#?RGBE\r\nEXPOSURE=2\r\nCOLORCORR= 1 2 1\r\nFORMAT=32-bit_rle_xyze\r\n\r\n+X 8 -Y 4\r\n";
    let pixels = (0..8 * 4).flat_map(|i| [i, 128, 255 - i, 120 + i / 4]);
    header.bytes().chain(pixels).collect()
}

/// Environment maps in both formats.
pub fn skies() -> Vec<(&'static str, Vec<u8>)> {
    let image = image::Rgb32FImage::from_fn(16, 8, |x, y| image::Rgb([x as f32, 0.5, y as f32]));
    let image = image::DynamicImage::from(image);
    let save = |format| {
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, format).unwrap();
        out.into_inner()
    };
    let [hdr, exr] = [image::ImageFormat::Hdr, image::ImageFormat::OpenExr].map(save);
    vec![("sky.hdr", hdr), ("sky.exr", exr), ("turned.hdr", turned())]
}

/// PLY and STL files with every attribute: a name, and the bytes.
pub fn polygon_files() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 5\nproperty float x\n\
        property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\nproperty float s\n\
        property float t\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        property int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement edge 1\n\
        property int vertex1\nproperty int vertex2\nend_header\n\
        0 0 0 0 0 1 255 0 0 255 0 0\n1 0 0 0 0 1 0 255 0 255 1 0\n1 1 0 0 0 0 0 0 255 9 1 1\n0 1 0 0 0 1 9 9 9 255 0 1\n\
        .5 2 0 0 0 1 9 9 9 255 .5 2\n5 0 1 2 4 3 10 0 0 1 0 1 1 .5 2 0 1 0 9 9 9\n3 0 2 3 6 0 0 1 1 0 1 0 255 0 0\n0 1\n";
    let mut strips =
        b"ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty double x\nproperty short y\n\
        property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
            .to_vec();
    for (x, y) in [(0.0f64, 0i16), (1.0, 0), (0.0, 1), (1.0, 1)] {
        strips.extend(x.to_be_bytes());
        strips.extend(y.to_be_bytes());
        strips.extend(0.5f32.to_be_bytes());
    }
    [6i32, 0, 1, 2, 3, -1, 0].iter().for_each(|index| strips.extend(index.to_be_bytes()));
    let text = "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid a b\nsolid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 1e-3\nvertex 1 0 -1e30\n\
        vertex 5e5 1 0\nendloop\nendfacet\nendsolid\n";
    let mut binary = b"a test COLOR=\xff\x80\x00\xff".to_vec();
    binary.resize(80, b' ');
    binary.extend(2u32.to_le_bytes());
    for attribute in [1u16 << 15, 31 << 5] {
        for number in [0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, f32::from(attribute & 1), 0.0, 1.0, 0.0] {
            binary.extend(number.to_le_bytes());
        }
        binary.extend(attribute.to_le_bytes());
    }
    vec![
        ("text.ply", "a.ply", ply.into()),
        ("strips.ply", "a.ply", strips),
        ("text.stl", "a.stl", text.into()),
        ("binary.stl", "a.stl", binary),
    ]
}
