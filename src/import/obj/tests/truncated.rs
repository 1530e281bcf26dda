//! Files that end in the middle of a line.

use super::{SQUARE, error, read};

const WARNING: &str = "the file ends in the middle of a line; ignored the line";

#[test]
fn a_last_line_that_is_cut_off_is_ignored() {
    for line in [
        "v 0.5 0.25",
        "v 0.5 0.25 -",
        "v 0.5 1e",
        "v",
        "vn 0 1",
        "vt -",
        "vt",
        "f 1 2 3/",
        "f 1/1/1 2/2/-",
        "f 1 2 -",
    ] {
        let (scene, warnings) = read(format!("{SQUARE}f 1 2 3\nf 1 3 4\n{line}"), &[]).unwrap();
        assert_eq!(scene.meshes[0].triangles.len(), if line == "f 1 2 3/" { 3 } else { 2 }, "{line}");
        let expected = if line == "f 1 2 3/" { vec![] } else { vec![format!("line 12: {WARNING}")] };
        assert_eq!(warnings, expected, "{line}");
    }
    // A continued line, and zeros after the end as a file system leaves them.
    let (scene, warnings) = read(format!("{SQUARE}f 1 2 3\nf 1 3 \\\n-"), &[]).unwrap();
    assert_eq!((scene.instanced_triangle_count(), warnings), (1, vec![format!("line 11: {WARNING}")]));
    let (scene, warnings) = read(format!("{SQUARE}f 1 2 3\nv 1 2\0\0\0\0"), &[]).unwrap();
    assert_eq!((scene.instanced_triangle_count(), warnings.len()), (1, 1));
}

#[test]
fn other_malformed_lines_remain_errors() {
    for (text, expected) in [
        (format!("{SQUARE}f 1 2 3\nv 0.5 0.25\n"), "line 11"),
        (format!("{SQUARE}v 0.5 x\nf 1 2 3"), "line 10"),
        (format!("{SQUARE}f 1 2 3\nv 1 2\n# end"), "line 11"),
        (format!("{SQUARE}f 1 2 9"), "vertex 9 does not exist"),
        ("v 0 0".to_string(), "the file has no vertices"),
    ] {
        let message = error(&text);
        assert!(message.contains(expected), "{text}: {message}");
    }
}

/// Every prefix of a file with faces loads.
#[test]
fn files_cut_at_any_byte_load() {
    let text = format!(
        "{SQUARE}mtllib a.mtl\no a\nusemtl m\nf 1/1/1 2/2/1 3/3/1\ns 1\nf -1/-1/-1 -2/-2/-1 -3/-3/-1\nv 0.5 -2 1e5\nvn 0 1 0\n"
    );
    let first_face = text.find("s 1").unwrap();
    let mut cut_off = 0;
    for end in first_face..text.len() {
        let (scene, warnings) = read(&text[..end], &[]).unwrap_or_else(|e| panic!("{:?}: {e}", &text[..end]));
        assert!(scene.instanced_triangle_count() > 0);
        cut_off += usize::from(warnings.iter().any(|w| w.contains(WARNING)));
    }
    assert!(cut_off > 15, "{cut_off}");
}
