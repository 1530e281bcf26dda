//! TexelSemantics accessors of every component type, stride and sparse layout.

use serde_json::json;

use super::super::accessor::{Accessor, Elements};
use super::super::fixture::{Fixture, bytes_of};
use crate::error::Warnings;

/// Reads accessor 0 of a fixture as flat floats.
fn read(fixture: &Fixture) -> Result<Vec<f32>, String> {
    fixture.with_document(|doc| {
        Accessor::open(doc, 0, &mut Warnings::default()).map(|a| a.flat_floats()).map_err(|e| e.to_string())
    })
}

#[test]
fn every_component_type_is_read_raw_and_normalized() {
    type Case = (u32, Vec<u8>, [f32; 2], [f32; 2]);
    let cases: [Case; 6] = [
        (5120, vec![0x80, 127], [-128.0, 127.0], [-1.0, 1.0]),
        (5121, vec![51, 255], [51.0, 255.0], [0.2, 1.0]),
        (5122, bytes_of(&[-32768i16, 32767]), [-32768.0, 32767.0], [-1.0, 1.0]),
        (5123, bytes_of(&[13107u16, 65535]), [13107.0, 65535.0], [0.2, 1.0]),
        (5125, bytes_of(&[0u32, u32::MAX]), [0.0, 4294967295.0], [0.0, 1.0]),
        (5126, bytes_of(&[-0.25f32, 7.0]), [-0.25, 7.0], [-0.25, 7.0]),
    ];
    for (component, bytes, raw, normalized) in cases {
        for (flag, expected) in [(false, raw), (true, normalized)] {
            let mut fixture = Fixture::empty();
            fixture.accessor(component, "VEC2", 1, &bytes);
            fixture.json["accessors"][0]["normalized"] = json!(flag);
            assert_eq!(read(&fixture).unwrap(), expected, "{component} {flag}");
        }
    }
}

#[test]
fn strides_and_offsets_are_applied() {
    let mut fixture = Fixture::empty();
    fixture.accessor(5126, "VEC2", 2, &bytes_of(&[9.0f32, 1.0, 2.0, 9.0, 3.0, 4.0]));
    fixture.json["bufferViews"][0]["byteStride"] = json!(12);
    fixture.json["accessors"][0]["byteOffset"] = json!(4);
    assert_eq!(read(&fixture).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    // One more element exceeds the buffer view.
    fixture.json["accessors"][0]["count"] = json!(3);
    let error = read(&fixture).unwrap_err();
    assert!(
        error.starts_with("accessors[0]: 3 elements of 8 bytes at stride 12 from byte 4 exceed"),
        "{error}"
    );
    // A stride below the element size is replaced by tightly packed elements.
    fixture.json["accessors"][0]["count"] = json!(2);
    fixture.json["bufferViews"][0]["byteStride"] = json!(4);
    assert_eq!(read(&fixture).unwrap(), [1.0, 2.0, 9.0, 3.0]);
}

#[test]
fn sparse_elements_replace_the_base_or_zeros() {
    let mut fixture = Fixture::empty();
    fixture.accessor(5126, "SCALAR", 4, &bytes_of(&[1.0f32, 2.0, 3.0, 4.0]));
    let indices = fixture.view(&[1, 3]);
    let values = fixture.view(&bytes_of(&[-1.0f32, -2.0]));
    fixture.json["accessors"][0]["sparse"] = json!({"count": 2,
        "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    assert_eq!(read(&fixture).unwrap(), [1.0, -1.0, 3.0, -2.0]);
    let picked = fixture.with_document(|doc| {
        let accessor = Accessor::open(doc, 0, &mut Warnings::default()).unwrap();
        accessor.floats::<1, [f32; 1]>(Elements::At(&[3, 0]))
    });
    assert_eq!(picked, [[-2.0], [1.0]]);
    fixture.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(read(&fixture).unwrap(), [0.0, -1.0, 0.0, -2.0]);
    fixture.json["accessors"][0]["count"] = json!(3);
    let error = read(&fixture).unwrap_err();
    assert_eq!(error, "accessors[0].sparse.indices: element 1 is 3, but the accessor has 3 elements");
    fixture.json["accessors"][0]["sparse"]["count"] = json!(3);
    assert!(read(&fixture).unwrap_err().contains("3 elements exceed"));
}

#[test]
fn sizes_beyond_the_buffer_are_errors() {
    let mut fixture = Fixture::empty();
    fixture.accessor(5126, "VEC3", 1, &[0; 12]);
    for count in [2u64, 1 << 31, 1 << 40, u64::MAX] {
        fixture.json["accessors"][0]["count"] = json!(count);
        assert!(read(&fixture).is_err(), "{count}");
    }
    fixture.json["accessors"][0]["count"] = json!(1);
    for (key, value) in [("byteOffset", u64::MAX), ("byteLength", u64::MAX), ("byteOffset", 1)] {
        let mut broken = fixture.clone();
        broken.json["bufferViews"][0][key] = json!(value);
        assert!(read(&broken).unwrap_err().starts_with("bufferViews[0]: "), "{key}");
    }
    fixture.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    fixture.json["accessors"][0]["count"] = json!(4_000_000_000u64);
    assert!(read(&fixture).unwrap_err().contains("exceeds the limit"));
}

/// Blender 5.2 compresses rotations with the stride of four floats; the filter packs them into half of it.
#[test]
fn rotations_of_a_meshopt_stride_of_16_are_packed() {
    // Two elements without deltas: the last 16 bytes are the baseline.
    let element = [[0, 0, 0, 0, 0, 0, 0xfc, 0xff].as_slice(), &[0; 8]].concat();
    let stream = [&[0xa0][..], &[0; 32], &element].concat();
    let mut fixture = Fixture::empty();
    let view = fixture.view(&stream);
    let packed = json!({"buffer": 0, "byteLength": stream.len(), "byteStride": 16, "count": 2,
        "mode": "ATTRIBUTES", "filter": "QUATERNION"});
    fixture.json["bufferViews"][view]["extensions"] = json!({"EXT_meshopt_compression": packed});
    fixture.json["bufferViews"][view]["byteLength"] = json!(32);
    let accessor =
        json!({"bufferView": view, "componentType": 5122, "normalized": true, "type": "VEC4", "count": 2});
    fixture.push("accessors", accessor);
    let stride = fixture.with_document(|doc| doc.buffer_view(view).unwrap().stride);
    assert_eq!(stride, Some(8));
}
