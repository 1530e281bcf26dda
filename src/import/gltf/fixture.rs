//! A builder of glTF files in memory. Unit tests and the tests of `tests/`, which include this file, share
//! it; each adds its own ways to load a file.

use serde_json::{Value, json};

/// A glTF under construction.
#[derive(Clone)]
pub struct Fixture {
    pub json: Value,
    pub bin: Vec<u8>,
}

/// Numbers as little-endian bytes.
pub trait Bytes {
    fn push(&self, out: &mut Vec<u8>);
}

macro_rules! bytes {
    ($($t:ty)*) => {$(impl Bytes for $t {
        fn push(&self, out: &mut Vec<u8>) {
            out.extend(self.to_le_bytes());
        }
    })*};
}
bytes!(u8 i8 u16 i16 u32 f32);

pub fn bytes_of<T: Bytes>(values: &[T]) -> Vec<u8> {
    let mut out = Vec::new();
    values.iter().for_each(|v| v.push(&mut out));
    out
}

impl Fixture {
    /// One empty scene.
    pub fn empty() -> Fixture {
        let json = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]});
        Fixture { json, bin: Vec::new() }
    }

    /// One triangle in the plane z = 0, with normals, at one node.
    pub fn triangle() -> Fixture {
        let mut fixture = Fixture::empty();
        let positions = fixture.vec3(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let normals = fixture.vec3(&[[0.0, 0.0, 1.0]; 3]);
        let attributes = json!({"POSITION": positions, "NORMAL": normals});
        fixture.push("meshes", json!({"name": "mesh", "primitives": [{"attributes": attributes}]}));
        fixture.node(json!({"name": "node", "mesh": 0}));
        fixture
    }

    /// Appends to a top-level array.
    pub fn push(&mut self, array: &str, value: Value) -> usize {
        if self.json[array].is_null() {
            self.json[array] = json!([]);
        }
        let list = self.json[array].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Adds a node to the scene's roots.
    pub fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(index));
        index
    }

    /// A buffer view of these bytes, at a multiple of four.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    pub fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        self.push("accessors", accessor)
    }

    pub fn floats(&mut self, kind: &str, width: usize, values: &[f32]) -> usize {
        self.accessor(5126, kind, values.len() / width, &bytes_of(values))
    }

    pub fn vec2(&mut self, values: &[[f32; 2]]) -> usize {
        self.floats("VEC2", 2, values.as_flattened())
    }

    pub fn vec3(&mut self, values: &[[f32; 3]]) -> usize {
        self.floats("VEC3", 3, values.as_flattened())
    }

    pub fn vec4(&mut self, values: &[[f32; 4]]) -> usize {
        self.floats("VEC4", 4, values.as_flattened())
    }

    pub fn indices(&mut self, values: &[u16]) -> usize {
        self.accessor(5123, "SCALAR", values.len(), &bytes_of(values))
    }

    /// The first primitive of the first mesh.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The file as GLB, its chunks padded to multiples of four bytes.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = json!(self.bin.len());
        self.glb_of(&json.to_string())
    }

    /// The file as GLB with another JSON text.
    pub fn glb_of(&self, json: &str) -> Vec<u8> {
        let mut text = json.as_bytes().to_vec();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 12 + 8 + text.len() + 8 + bin.len();
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((length as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bin)] {
            out.extend((chunk.len() as u32).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }
}
