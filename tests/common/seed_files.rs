//! Seeds that are made here: a bit of everything in as few bytes as can be.

use std::io::Cursor;

use base64::Engine;
use serde_json::{Value, json};

pub const MTL: &str = "newmtl a\nKa .1 .1 .1\nKd .8 .2 .1\nKs .5 .5 .5\nKe 0 0 0\nNs 100\nd .5\nillum 2\nTf 1 1 1\nNi 1.5\n\
map_Kd -s 2 3 1 -o .5 0 0 -clamp on a.png\nmap_d a.png\nbump -bm 0.5 a.png\nmap_Ks a.png\n\
newmtl b\nPr .3\nPm 1\nmap_Pr a.png\nmap_Pm a.png\nnorm a.png\nTr .25\nmap_Ke \"a.png\"\nrefl a.png\nNs 1D2\n";

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

/// Numbers as little-endian bytes.
fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// A glTF of one buffer, whose accessors are (type, component, numbers of an element, bytes).
fn gltf(accessors: &[(&str, u32, usize, Vec<u8>)], mut rest: Value) -> Vec<u8> {
    let (mut bin, mut views, mut list) = (Vec::new(), Vec::new(), Vec::new());
    for (kind, component, size, bytes) in accessors {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()}));
        let one = size * if *component == 5126 { 4 } else { 2 };
        list.push(json!({"bufferView": views.len() - 1, "componentType": component, "type": kind,
            "count": bytes.len() / one}));
        bin.extend(bytes);
    }
    rest["asset"] = json!({"version": "2.0"});
    rest["scene"] = json!(0);
    rest["buffers"] = json!([{"byteLength": bin.len(), "uri": data_uri(&bin)}]);
    rest["bufferViews"] = json!(views);
    rest["accessors"] = json!(list);
    serde_json::to_vec(&rest).unwrap()
}

fn triangle() -> (&'static str, u32, usize, Vec<u8>) {
    ("VEC3", 5126, 3, floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]))
}

fn corners() -> (&'static str, u32, usize, Vec<u8>) {
    ("VEC2", 5126, 2, floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]))
}

/// A triangle that shows the picture `name`.
pub fn pictured(name: &str) -> Vec<u8> {
    gltf(
        &[triangle(), corners()],
        json!({"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
            "images": [{"uri": name}], "textures": [{"source": 0}], "materials": [{"alphaMode": "BLEND",
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 0}}]}),
    )
}

/// A skin, morph targets, animations, a camera, a light, instances, a sparse accessor, a variant.
pub fn rich_gltf() -> Vec<u8> {
    let weights = ("VEC4", 5126, 4, floats(&[1.0, 0.0, 0.0, 0.0].repeat(3)));
    let joints = ("VEC4", 5123, 4, [0u16; 12].iter().flat_map(|v| v.to_le_bytes()).collect());
    let times = ("SCALAR", 5126, 1, floats(&[0.0, 1.0]));
    let moved = ("VEC3", 5126, 3, floats(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]));
    gltf(
        &[triangle(), corners(), weights, joints, times, moved],
        json!({
            "extensionsUsed": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_materials_ior"],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 5,
                "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}]}},
            "scenes": [{"nodes": [0, 1, 2]}],
            "nodes": [
                {"mesh": 0, "skin": 0, "weights": [0.5], "children": [3]},
                {"camera": 0, "translation": [0, 0, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
                {"mesh": 1, "rotation": [0, 0.6, 0, 0.8], "scale": [1, 2, -1],
                    "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 5}}}},
                {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]},
            ],
            "meshes": [
                {"weights": [0.1], "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "WEIGHTS_0": 2,
                    "JOINTS_0": 3}, "targets": [{"POSITION": 0}], "material": 0}]},
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
                "samplers": [{"input": 4, "output": 5, "interpolation": "STEP"}, {"input": 4, "output": 4}]}],
        }),
    )
}

/// Small ones for what the rich one has no room for.
pub fn small_gltf() -> Vec<(&'static str, Vec<u8>)> {
    let one = |primitive: Value, more: Value| {
        let mut rest = json!({"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}]});
        for (key, value) in more.as_object().unwrap() {
            rest[key] = value.clone();
        }
        rest
    };
    let indices = ("SCALAR", 5123, 1, vec![0, 0, 1, 0, 2, 0]);
    let mut sparse: Value = serde_json::from_slice(&gltf(
        &[triangle(), indices],
        one(json!({"attributes": {"POSITION": 0}, "indices": 1}), json!({})),
    ))
    .unwrap();
    sparse["accessors"][0]["sparse"] = json!({"count": 2, "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 0}});
    let animated = gltf(
        &[
            triangle(),
            ("SCALAR", 5126, 1, floats(&[0.0, 1.0])),
            ("VEC4", 5126, 4, floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8])),
            ("VEC3", 5126, 3, floats(&[0.5; 18])),
        ],
        one(
            json!({"attributes": {"POSITION": 0}}),
            json!({"animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}},
                {"sampler": 1, "target": {"node": 0, "path": "scale"}}], "samplers": [{"input": 1, "output": 2},
                {"input": 1, "output": 3, "interpolation": "CUBICSPLINE"}]}]}),
        ),
    );
    let shiny = gltf(
        &[triangle(), corners()],
        one(
            json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}),
            json!({"samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
            "images": [{"uri": data_uri(&png())}], "textures": [{"source": 0, "sampler": 0}],
            "materials": [{"normalTexture": {"index": 0, "scale": 0.5}, "extensions": {
                "KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 0}, "glossinessFactor": 0.4},
                "KHR_materials_transmission": {"transmissionFactor": 0.5}, "KHR_materials_unlit": {}}}]}),
        ),
    );
    let flat = gltf(&[triangle()], one(json!({"attributes": {"POSITION": 0}, "mode": 6}), json!({})));
    vec![
        ("sparse.gltf", serde_json::to_vec(&sparse).unwrap()),
        ("animated.gltf", animated),
        ("shiny.gltf", shiny),
        ("fan.gltf", flat),
    ]
}

fn png() -> Vec<u8> {
    let image = image::RgbaImage::from_pixel(2, 2, image::Rgba([128, 128, 255, 200]));
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

/// Pictures of light in both formats.
pub fn skies() -> Vec<(&'static str, Vec<u8>)> {
    let image = image::Rgb32FImage::from_fn(16, 8, |x, y| image::Rgb([x as f32, 0.5, y as f32]));
    let image = image::DynamicImage::from(image);
    let save = |format| {
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, format).unwrap();
        out.into_inner()
    };
    vec![("sky.hdr", save(image::ImageFormat::Hdr)), ("sky.exr", save(image::ImageFormat::OpenExr))]
}
