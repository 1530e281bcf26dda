//! Decodes streams of the reference library in `testdata`, examples worked out by hand, and damaged streams.

use super::reader::{Reader, TRAILING, TRUNCATED};
use super::{Filter, Mode, decode};

const NONE: Filter = Filter::None;

/// A stream and the bytes that it decodes to.
struct Case {
    name: &'static str,
    mode: Mode,
    filter: Filter,
    count: usize,
    stride: usize,
    stream: &'static [u8],
    decoded: &'static [u8],
}

macro_rules! case {
    ($name:literal, $mode:ident, $filter:ident, $count:literal, $stride:literal) => {
        Case {
            name: $name,
            mode: Mode::$mode,
            filter: Filter::$filter,
            count: $count,
            stride: $stride,
            stream: include_bytes!(concat!("testdata/", $name, ".stream")),
            decoded: include_bytes!(concat!("testdata/", $name, ".decoded")),
        }
    };
}

/// Streams of the reference encoder, or random valid streams. The decoded bytes are those of the scalar
/// reference decoder.
const CASES: [Case; 13] = [
    case!("attributes_v1_encoded", Attributes, None, 17, 12),
    case!("attributes_v0_made_up", Attributes, None, 20, 4),
    case!("attributes_v1_every_mode", Attributes, None, 17, 12),
    case!("octahedral_bytes_8_bits_v0", Attributes, Octahedral, 9, 4),
    case!("octahedral_words_12_bits_v1", Attributes, Octahedral, 9, 8),
    case!("quaternion_14_bits_v0", Attributes, Quaternion, 9, 8),
    case!("exponential_15_bits_v1", Attributes, Exponential, 9, 12),
    case!("color_bytes_7_bits_v1", Attributes, Color, 9, 4),
    case!("color_words_16_bits_v1", Attributes, Color, 9, 8),
    case!("triangles_a_grid", Triangles, None, 72, 2),
    case!("triangles_every_code", Triangles, None, 72, 4),
    case!("indices_a_strip", Indices, None, 30, 2),
    case!("indices_numbers_every_length", Indices, None, 30, 4),
];

/// A version 0 stream of one element without deltas, so that the baseline is the element.
fn one_element(element: &[u8]) -> Vec<u8> {
    let mut stream = vec![0xa0];
    stream.resize(1 + element.len() + 32usize.saturating_sub(element.len()), 0);
    stream.resize(stream.len() + element.len(), 0);
    let at = stream.len() - element.len();
    stream[at..].copy_from_slice(element);
    stream
}

fn filtered(element: &[u8], filter: Filter) -> Vec<u8> {
    decode(&one_element(element), 1, element.len(), Mode::Attributes, filter).unwrap()
}

fn words(values: [i16; 4]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Decodes a triangle stream of codes and additional data, whose table marks both other corners as new.
fn triangles(codes: &[u8], data: &[u8]) -> Result<Vec<u8>, String> {
    let stream = [&[0xe1], codes, data, &[0; 16]].concat();
    decode(&stream, codes.len() * 3, 2, Mode::Triangles, NONE)
}

fn error(stream: &[u8], count: usize, stride: usize, mode: Mode, filter: Filter) -> String {
    decode(stream, count, stride, mode, filter).unwrap_err()
}

#[test]
fn streams_decode_as_in_the_reference_decoder() {
    for f in CASES {
        let decoded = decode(f.stream, f.count, f.stride, f.mode, f.filter);
        assert_eq!(decoded.as_deref(), Ok(f.decoded), "{}", f.name);
    }
}

#[test]
fn truncated_and_extended_streams_are_errors() {
    for f in CASES {
        for n in 0..f.stream.len() {
            assert!(decode(&f.stream[..n], f.count, f.stride, f.mode, f.filter).is_err(), "{} {n}", f.name);
        }
        let longer = [f.stream, &[0]].concat();
        assert!(decode(&longer, f.count, f.stride, f.mode, f.filter).is_err(), "{}", f.name);
    }
}

#[test]
fn damaged_streams_do_not_panic() {
    for f in CASES {
        for bit in 0..f.stream.len() * 8 {
            let mut bad = f.stream.to_vec();
            bad[bit / 8] ^= 1 << (bit % 8);
            if let Ok(out) = decode(&bad, f.count, f.stride, f.mode, f.filter) {
                assert_eq!(out.len(), f.decoded.len());
            }
        }
    }
}

/// The specification's example of a group of 4-bit deltas.
#[test]
fn the_specifications_example_of_deltas_decodes() {
    let group = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
    let deltas = [-1i8, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    let stream = [&[0xa0, 2], &group[..], &[0; 3], &[0; 32]].concat();
    let mut sum = 0u8;
    let expected = deltas.iter().flat_map(|&d| {
        sum = sum.wrapping_add_signed(d);
        [sum, 0, 0, 0]
    });
    assert_eq!(decode(&stream, 16, 4, Mode::Attributes, NONE), Ok(expected.collect()));
}

/// Control mode 2 stores no deltas: 300 elements are two blocks of one control byte each.
#[test]
fn version_1_blocks_without_deltas_repeat_the_baseline() {
    let stream = [&[0xa1, 0xaa, 0xaa], &[0; 19][..], &[1, 2, 3, 4, 0]].concat();
    assert_eq!(decode(&stream, 300, 4, Mode::Attributes, NONE), Ok([1, 2, 3, 4].repeat(300)));
}

/// Two literal elements, the second with the deltas 1 and 2 in its words.
#[test]
fn version_1_channel_modes_sum_bytes_words_and_bits() {
    let stream =
        |mode| [&[0xa1, 0xff, 0, 1, 0, 0, 0, 2, 0, 0], &[0; 19][..], &[0, 6, 0xff, 8, mode]].concat();
    let second = |mode| decode(&stream(mode), 2, 4, Mode::Attributes, NONE).unwrap().split_off(4);
    assert_eq!(second(0), [0xff, 6, 0, 8]);
    // As words, 0x0600 - 1 and 0x08ff + 1.
    assert_eq!(second(1), [0xff, 5, 0, 9]);
    // As 32 bits, 0x00020001 rotated right by 0, 4 and 15 bits.
    assert_eq!(second(2), [1, 6, 0xfd, 8]);
    assert_eq!(second(0x42), [0, 6 ^ 0x20, 0xff, 8 ^ 0x10]);
    assert_eq!(second(0xf2), [4, 6, 0xfd, 8]);
    for mode in [0x10, 0x31, 3, 4, 15] {
        assert!(error(&stream(mode), 2, 4, Mode::Attributes, NONE).contains("channel mode"));
    }
}

#[test]
fn the_specifications_examples_of_varints_decode() {
    // The specification says 0x1fd005 for the third value, with the highest bits first, which is an erratum.
    for (bytes, value) in [(&[0x7f][..], 0x7f), (&[0x81, 0x04], 0x201), (&[0xff, 0xa0, 0x05], 0x1_507f)] {
        assert_eq!(Reader { bytes }.varint(), Ok(value));
    }
    assert_eq!(Reader { bytes: &[0xff, 0xff, 0xff, 0xff, 0x7f] }.varint(), Ok(u32::MAX));
    assert!(Reader { bytes: &[0x80; 6] }.varint().is_err());
    assert_eq!(Reader { bytes: &[0x80; 3] }.varint(), Err(TRUNCATED));
}

#[test]
fn triangle_streams_made_by_hand_decode() {
    let indices = |codes: &[u8], data: &[u8]| -> Vec<u16> {
        let bytes = triangles(codes, data).unwrap();
        bytes.as_chunks().0.iter().map(|&b| u16::from_le_bytes(b)).collect()
    };
    // Three new corners; the newest edge and a new corner; the newest edge and the third-newest corner.
    assert_eq!(indices(&[0xf0, 0x00, 0x02], &[]), [0, 1, 2, 0, 2, 3, 0, 3, 1]);
    // An explicit corner (zigzag 20 is 10), then its neighbours, each on the newest edge.
    assert_eq!(indices(&[0xf0, 0x0f, 0x0e, 0x0d], &[20]), [0, 1, 2, 0, 2, 10, 0, 10, 11, 0, 11, 10]);
    // Code 0xfe with a zero restarts at index 0; with 0xff only the first corner is explicit.
    assert_eq!(indices(&[0xf0, 0xfe], &[0]), [0, 1, 2, 0, 1, 2]);
    assert_eq!(indices(&[0xf0, 0xff], &[0x0f, 6, 1]), [0, 1, 2, 3, 3, 2]);
    for codes in [&[0x00][..], &[0xf0, 0x30], &[0xf0, 0x04]] {
        assert!(triangles(codes, &[]).unwrap_err().contains("missing edge"));
    }
    assert_eq!(triangles(&[0xf0], &[0]), Err(TRAILING.into()));
    assert_eq!(triangles(&[0xfe], &[]), Err(TRUNCATED.into()));
    for (at, value) in [(15, 1), (3, 0xf0), (3, 0x0f)] {
        let mut stream = [&[0xe1, 0xf0][..], &[0; 16]].concat();
        stream[2 + at] = value;
        assert!(error(&stream, 3, 2, Mode::Triangles, NONE).contains("lookup table"));
    }
}

#[test]
fn an_index_sequence_made_by_hand_decodes() {
    // The lowest bit selects the baseline, the next is the sign.
    let stream = [0xd1, 4 << 2, (3 << 2) | 1, 1 << 2, (1 << 2) | 2 | 1, 0, 0, 0, 0, 0];
    let decoded = decode(&stream, 5, 2, Mode::Indices, NONE).unwrap();
    assert_eq!(decoded, [4, 0, 3, 0, 5, 0, 1, 0, 5, 0]);
}

#[test]
fn filters_decode_examples_made_by_hand() {
    assert_eq!(filtered(&[0, 0, 127, 9], Filter::Octahedral), [0, 0, 127, 9]);
    assert_eq!(filtered(&[7, 0, 7, 200], Filter::Octahedral), [127, 0, 0, 200]);
    // Both components at their maximum: the far side of the octahedron.
    assert_eq!(filtered(&[31, 31, 31, 0], Filter::Octahedral), [0, 0, 0x81, 0]);
    assert_eq!(filtered(&words([0, -511, 511, -5]), Filter::Octahedral), words([0, -32767, 0, -5]));
    for largest in 0..4 {
        let mut expected = [0; 4];
        expected[largest] = 32767;
        assert_eq!(filtered(&words([0, 0, 0, 0x7ffc | largest as i16]), Filter::Quaternion), words(expected));
    }
    // A stored 1.0 means 1/sqrt(2), so the largest component equals it.
    assert_eq!(filtered(&words([2047, 0, 0, 2044]), Filter::Quaternion), words([23170, 23170, 0, 0]));
    let floats =
        [(5, 0, 5.0f32), (-3, -2, -0.75), (1, -100, 2f32.powi(-100)), (-0x80_0000, 100, -(2f32.powi(123)))];
    for (m, e, expected) in floats {
        let stored = ((e << 24) | (m & 0xff_ffff_i32)).to_le_bytes();
        assert_eq!(filtered(&stored, Filter::Exponential), expected.to_le_bytes());
    }
    // White, and pure green in four bits; alpha is 7 of 7 and 0 of 7.
    assert_eq!(filtered(&[15, 0, 0, 15], Filter::Color), [255; 4]);
    assert_eq!(filtered(&[8, 0, 7, 8], Filter::Color), [17, 255, 17, 0]);
    assert_eq!(filtered(&words([15, 0, 0, 15]), Filter::Color), [255; 8]);
}

#[test]
fn invalid_headers_and_layouts_are_errors() {
    use Mode::{Attributes, Indices, Triangles};
    for (mode, good, newer, wrong) in
        [(Attributes, 0xa0, 0xa2, 0xe1), (Triangles, 0xe1, 0xe2, 0xd1), (Indices, 0xd1, 0xd0, 0xa0)]
    {
        let stream = |header: u8| [&[header][..], &[0; 32]].concat();
        assert!(error(&stream(newer), 0, 4, mode, NONE).contains("version"));
        assert!(error(&stream(wrong), 0, 4, mode, NONE).contains("header"));
        assert_eq!(error(&[], 0, 4, mode, NONE), TRUNCATED);
        assert_eq!(error(&[good], 0, 4, mode, NONE), TRUNCATED);
        assert_eq!(error(&stream(good), usize::MAX / 4 / 3 * 3, 4, mode, NONE), TRUNCATED);
        assert!(error(&stream(good), usize::MAX / 3 * 3, 4, mode, NONE).contains("too large"));
    }
    assert_eq!(decode(&one_element(&[]), 0, 4, Attributes, NONE), Ok(vec![]));
    for stride in [0, 2, 6, 260] {
        assert!(error(&[0xa0; 300], 1, stride, Attributes, NONE).contains("stride"));
    }
    assert!(error(&[0xe1; 99], 3, 3, Triangles, NONE).contains("stride"));
    assert!(error(&[0xe1; 99], 4, 2, Triangles, NONE).contains("multiple of 3"));
    assert!(error(&[0xd1; 99], 4, 2, Indices, Filter::Color).contains("filter"));
    for (filter, stride) in [(Filter::Octahedral, 12), (Filter::Color, 12), (Filter::Quaternion, 4)] {
        assert!(error(&[0xa0; 99], 1, stride, Attributes, filter).contains("filter"));
    }
}

/// Blender 5.2 gives rotations the stride of four floats; the filter packs them into the first half.
#[test]
fn quaternions_of_a_stride_of_16_are_packed() {
    let case = CASES.iter().find(|case| case.filter == Filter::Quaternion).unwrap();
    let packed = words([0, 0, 0, -4]);
    let expected = decode(&one_element(&packed), 1, 8, Mode::Attributes, Filter::Quaternion).unwrap();
    let element = [packed, vec![0; 8]].concat();
    let decoded = decode(&one_element(&element), 1, 16, Mode::Attributes, Filter::Quaternion).unwrap();
    assert_eq!(decoded, [expected, vec![0; 8]].concat());
    assert!(decode(case.stream, case.count, 12, case.mode, case.filter).unwrap_err().contains("stride"));
}
