use super::*;

/// Mantissas and exponent of 0.5, 0.25 and 1.
const COLOR: [u8; 4] = [64, 32, 128, 129];

fn read(bytes: &[u8]) -> Result<(Header, Vec<[f32; 3]>), String> {
    let header = Header::read(bytes)?;
    let texels = decode(bytes, &header)?;
    Ok((header, texels))
}

fn file(header: &str, pixels: &[[u8; 4]]) -> Vec<u8> {
    [header.as_bytes(), pixels.as_flattened()].concat()
}

/// A picture whose red counts the pixels in the order of the file.
fn counted(size: &str) -> Vec<[f32; 3]> {
    let pixels: Vec<[u8; 4]> = (0..6).map(|i| [i, 0, 0, 136]).collect();
    read(&file(&format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n"), &pixels)).unwrap().1
}

#[test]
fn first_lines_and_line_ends_of_all_programs_are_read() {
    for header in [
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
        "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
        "#?AUTOPANO\r\nSOFTWARE=x\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 2\r\n",
        "FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
        "#?RGBE\nFORMAT=32-bit_rgbe\n\n-Y 1 +X 2\n",
        "# made by hand\nFORMAT=32-bit_rle_rgbe\n# FORMAT=other\n\n-Y 1 +X 2\n",
        "#?RADIANCE\n\n-Y 1 +X 2\n",
        "#?RADIANCE\nFORMAT = 32-bit_rle_rgbe\nPIXASPECT=1\n\n\n-Y  1  +X  2\n",
        "#?RADIANCE\npfilt -x 2 = y\nVIEW= -vtv -vp 0 0 0\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
    ] {
        let bytes = file(header, &[COLOR; 2]);
        assert!(is_radiance(&bytes) || header == "#?RADIANCE\n\n-Y 1 +X 2\n", "{header}");
        let (found, texels) = read(&bytes).unwrap();
        assert_eq!([found.width, found.height], [2, 1], "{header}");
        assert_eq!(texels, [[0.5, 0.25, 1.0]; 2], "{header}");
    }
    assert!(!is_radiance(b"#include <stdio.h>") && !is_radiance(b""));
}

/// Pixels are numbered in the order of the file.
#[test]
fn all_eight_orientations_are_turned_upright() {
    for (size, upright) in [
        ("-Y 2 +X 3", [0, 1, 2, 3, 4, 5]),
        ("-Y 2 -X 3", [2, 1, 0, 5, 4, 3]),
        ("+Y 2 +X 3", [3, 4, 5, 0, 1, 2]),
        ("+Y 2 -X 3", [5, 4, 3, 2, 1, 0]),
        ("+X 3 -Y 2", [0, 2, 4, 1, 3, 5]),
        ("-X 3 -Y 2", [4, 2, 0, 5, 3, 1]),
        ("+X 3 +Y 2", [1, 3, 5, 0, 2, 4]),
        ("-X 3 +Y 2", [5, 3, 1, 4, 2, 0]),
    ] {
        let found: Vec<u8> = counted(size).iter().map(|texel| texel[0] as u8).collect();
        assert_eq!(found, upright, "{size}");
    }
}

#[test]
fn exposures_and_colour_corrections_divide_pixels() {
    let lines = "EXPOSURE=2\nEXPOSURE= 0.25\nCOLORCORR= 1 2 0.5\nEXPOSURE=x\nEXPOSURE=0\nEXPOSURE=inf\n";
    let bytes = file(&format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{lines}\n-Y 1 +X 1\n"), &[COLOR]);
    assert_eq!(read(&bytes).unwrap().1, [[1.0, 0.25, 4.0]]);
}

/// The white point of Rec. 709, and its green.
#[test]
fn xyze_is_converted_to_rec_709() {
    let close = |pixel: [u8; 4], expected: [f32; 3]| {
        let bytes = file("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", &[pixel]);
        let found = read(&bytes).unwrap().1[0];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.02), "{found:?} {expected:?}");
    };
    close([122, 128, 139, 129], [1.0; 3]);
    close([92, 183, 31, 128], [0.0, 1.0, 0.0]);
}

#[test]
fn scanlines_are_flat_or_compressed_in_either_way() {
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n";
    let texels = |data: &[u8]| read(&[header.as_bytes(), data].concat()).map(|(_, texels)| texels);
    let expected = {
        let mut expected = vec![[0.5, 0.25, 1.0]; 8];
        expected[7] = [1.0, 0.25, 1.0];
        expected
    };
    let last = [128, 32, 128, 129];
    let flat = [[COLOR; 7].as_flattened(), &last].concat();
    // 1 1 1 n repeats.
    let old = [&COLOR[..], &[1, 1, 1, 6], &last].concat();
    // Runs of a channel are 128 plus their length.
    let new = [&[2, 2, 0, 8][..], &[135, 64, 1, 128], &[136, 32], &[3, 128, 128, 128, 133, 128], &[136, 129]]
        .concat();
    for data in [&flat, &old, &new] {
        assert_eq!(texels(data).unwrap(), expected);
        for end in 0..data.len() {
            assert_eq!(texels(&data[..end]).unwrap_err(), TRUNCATED);
        }
    }
    // A run that is too long, an empty one, and one without a pixel before it.
    for data in [&[2, 2, 0, 8, 137, 64, 0, 0][..], &[2, 2, 0, 8, 0, 64, 0, 0], &[1, 1, 1, 8, 0, 0, 0, 0]] {
        assert_eq!(texels(data).unwrap_err(), "a scanline is damaged");
    }
}

/// 300 repetitions need two bytes, the lower one first.
#[test]
fn long_runs_of_the_old_compression_have_several_bytes() {
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 301\n";
    let data = [COLOR, [1, 1, 1, 44], [1, 1, 1, 1]].concat();
    assert_eq!(read(&[header.as_bytes(), &data].concat()).unwrap().1, vec![[0.5, 0.25, 1.0]; 301]);
}

/// The largest and the smallest exponent.
#[test]
fn extreme_exponents_are_exact() {
    let bytes = file("#?RADIANCE\n\n-Y 1 +X 3\n", &[[255, 1, 0, 255], [255, 1, 0, 1], [9, 9, 9, 0]]);
    let texels = read(&bytes).unwrap().1;
    let power = |e: i32| 2f64.powi(e) as f32;
    assert_eq!(texels[0], [255.0 * power(119), power(119), 0.0]);
    assert_eq!(texels[1], [(255.0 * 2f64.powi(-135)) as f32, power(-135), 0.0]);
    assert_eq!(texels[2], [0.0; 3]);
}

#[test]
fn damaged_headers_are_errors_that_name_the_defect() {
    for (header, expected) in [
        ("#?RADIANCE", "the header has no end"),
        ("#?RADIANCE\n\n-Y 1 +Z 2\n", "no size"),
        ("#?RADIANCE\n\n-Y 1 -Y 2\n", "no size"),
        ("#?RADIANCE\n\n-Y -1 +X 2\n", "no size"),
        ("#?RADIANCE\n\n-Y 99999999999 +X 2\n", "no size"),
        ("#?RADIANCE\nFORMAT=32-bit_rle_luv\n\n-Y 1 +X 2\n", "32-bit_rle_luv is unknown"),
    ] {
        let error = Header::read(header.as_bytes()).unwrap_err();
        assert!(error.contains(expected), "{header}: {error}");
    }
}
