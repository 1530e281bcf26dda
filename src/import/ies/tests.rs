use glam::DVec3;

use super::*;

/// A file of 2002 with one plane: 100 cd along the aim, 50 cd at 45 degrees, 0 beyond 90.
const AXIAL: &str = "IESNA:LM-63-2002\n[TEST] none\n[MORE] 1 2 3\nTILT=NONE\n\
    1 1000 2 3 1 1 2 0 0 0\n0.5 1 60\n0 45 90\n0\n100 50 0\n";

fn profile(text: &str) -> LightProfile {
    parse(text.as_bytes()).unwrap().profile
}

fn error(text: &str) -> String {
    parse(text.as_bytes()).unwrap_err()
}

#[test]
fn intensities_are_multiplied_and_lie_at_their_angles() {
    let axial = profile(AXIAL);
    assert_eq!(axial.peak(), 100.0);
    let at = |profile: &LightProfile, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        profile.relative_intensity(DVec3::new(sin, 0.0, -cos)) * profile.peak()
    };
    for (degrees, expected) in [(0.0, 100.0), (22.5, 75.0), (45.0, 50.0), (60.0, 100.0 / 3.0), (120.0, 0.0)] {
        assert!((at(&axial, degrees) - expected).abs() < 1e-3, "{degrees}: {}", at(&axial, degrees));
    }
    assert_eq!(profile(&AXIAL.replace("1000 2 3", "1000 4.E0 3")).peak(), 200.0);
}

/// Only the standards before 2002 have a second factor of the ballast; 2019 describes the file with the number.
#[test]
fn the_second_ballast_factor_is_that_of_old_standards() {
    let of = |version: &str| {
        profile(&AXIAL.replace("IESNA:LM-63-2002", version).replace("0.5 1 60", "0.5 1.1 60")).peak()
    };
    for old in ["IESNA:LM-63-1995", "IESNA91", "IESNA86", "A luminaire of 1986"] {
        assert!((of(old) - 110.0).abs() < 1e-3, "{old}: {}", of(old));
    }
    for new in ["IESNA:LM-63-2002", "IES:LM-63-2019", "ies:lm-63-2019 "] {
        assert_eq!(of(new), 100.0, "{new}");
    }
}

#[test]
fn numbers_are_free_over_lines_and_tilts_are_skipped() {
    let plain = profile(AXIAL);
    let included = AXIAL.replace("TILT=NONE\n", "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9\n0.8\n");
    let named = AXIAL.replace("TILT=NONE", "tilt= lamp.til ");
    let crlf = AXIAL.replace('\n', "\r\n");
    let cr = AXIAL.replace('\n', "\r");
    let commas = AXIAL.replace("0 45 90", "0,45, 90").replace("100 50", "100\n\n50");
    let bom = format!("\u{feff}{AXIAL}trailing words");
    for text in [included, named, crlf, cr, commas, bom] {
        assert_eq!(profile(&text), plain, "{text}");
    }
}

#[test]
fn planes_and_types_are_read() {
    let planes = AXIAL
        .replace("2 3 1 1 2", "2 3 2 1 2")
        .replace("0 45 90\n0\n100 50 0", "0 45 90\n0 90\n100 50 0\n80 40 0");
    let planes = profile(&planes);
    let at = |x: f64, y: f64| planes.relative_intensity(DVec3::new(x, y, -1.0)) * planes.peak();
    assert!((at(1.0, 0.0) - 50.0).abs() < 1e-3 && (at(0.0, -1.0) - 40.0).abs() < 1e-3);
    let half = 0.5f64.sqrt();
    assert!((at(half, half) - 45.0).abs() < 1e-3);
    // Vertical angles of type B turn about Y, to which horizontal ones lead.
    let b =
        profile(&AXIAL.replace("2 3 1 1 2", "2 3 2 2 2").replace("90\n0\n100 50 0", "90\n0 90\n9 5 0 1 1 1"));
    assert!((b.relative_intensity(DVec3::Y) * b.peak() - 1.0).abs() < 1e-5);
    assert!((b.relative_intensity(DVec3::NEG_Z) * b.peak() - 9.0).abs() < 1e-5);
}

#[test]
fn negative_intensities_are_counted() {
    let file = parse(AXIAL.replace("100 50 0", "100 -50 0").as_bytes()).unwrap();
    assert_eq!(file.negative, 1);
    assert_eq!(parse(AXIAL.as_bytes()).unwrap().negative, 0);
}

#[test]
fn errors_name_the_line_and_what_is_expected() {
    assert_eq!(error(""), "no IES file: it has no line TILT=");
    assert_eq!(error("hello\nworld"), "no IES file: it has no line TILT=");
    let with = |a: &str, b: &str| error(&AXIAL.replace(a, b));
    assert_eq!(with("1 1000 2", "1 many 2"), "line 5: 'many' is no number; expected the lumens per lamp");
    assert_eq!(with("100 50 0\n", "100 50"), "the file ends before an intensity");
    assert_eq!(with("100 50", "100 nan"), "line 9: 'nan' is no number; expected an intensity");
    let huge = with("1000 2 3 1", "1000 2 3 16000000");
    assert!(huge.contains("line 6: 16000000 × 3 angles are more than the file has numbers for"), "{huge}");
    assert!(with("2 3 1 1 2", "2 1e9 1 1 2").contains("line 5: the number of vertical angles is 1000000000"));
    assert!(with("2 3 1 1 2", "2 0 1 1 2").contains("not a whole number from 1"));
    assert!(
        with("2 3 1 1 2", "2 3 1 7 2").contains("line 5: the photometric type 7 is not 1 (C), 2 (B) or 3")
    );
    assert!(with("1000 2 3", "1000 0 3").contains("line 5: the candela multiplier is 0"));
    assert!(with("100 50", "1e39 50").contains("line 9: the intensity 1"));
    assert!(
        with("0 45 90", "0 90 45")
            .contains("the vertical angles do not ascend: 90 degrees is followed by 45")
    );
}

#[test]
fn every_prefix_and_every_changed_byte_is_read_or_refused() {
    let mut read = 0;
    for end in 0..AXIAL.len() {
        read += usize::from(parse(&AXIAL.as_bytes()[..end]).is_ok());
    }
    assert_eq!(read, 1, "all but the last newline");
    for i in 0..AXIAL.len() {
        for byte in [0, b' ', b'9', b'-', b'e', 0xff] {
            let mut bytes = AXIAL.as_bytes().to_vec();
            bytes[i] = byte;
            if let Ok(file) = parse(&bytes) {
                assert!(file.profile.relative_intensity(DVec3::new(0.3, 0.2, -0.5)).is_finite());
            }
        }
    }
}
