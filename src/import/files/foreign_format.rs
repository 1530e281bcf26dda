//! Recognises files that are no scene that blinn reads, by their first bytes and then by their name, and says what they are
//! and how to get a scene.

use std::path::Path;

use blinn_core::option_words::word_options;

/// The help for a file of another format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Remedy {
    /// Blender imports it.
    Blender,
    /// The program that made it, or a converter, exports glTF.
    Export,
    /// A CAD program makes triangles of its surfaces.
    Tessellate,
    /// A few lines of Python convert it.
    Convert,
    /// It holds scenes.
    Extract,
    /// It is a picture.
    Picture,
    /// Other advice.
    Other(&'static str),
}

impl Remedy {
    fn text(self) -> &'static str {
        match self {
            Remedy::Blender => {
                "import it in Blender and export it as .glb (File > Export > glTF 2.0), or export .glb where it was made"
            }
            Remedy::Export => "export it as .glb from the program that made it",
            Remedy::Tessellate => {
                "export it as .glb or .stl from a CAD program, for example FreeCAD (File > Export > glTF)"
            }
            Remedy::Convert => {
                "export it as .glb or .stl from the CAD program or slicer, or convert it with the Python packages cascadio \
                 (STEP) and trimesh (3MF): docs/how-to/cad-files.md has a script"
            }
            Remedy::Extract => "extract it and name the .gltf, .glb, .obj, .stl or .ply file in it",
            Remedy::Picture => {
                "name a .gltf, .glb, .obj, .stl or .ply file; pictures are for `hdri`, and for the command diff"
            }
            Remedy::Other(advice) => advice,
        }
    }
}

/// Returns true if a name is that of a 3D model in a format that is not read.
pub fn is_foreign_model(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    let has_extension =
        |format: &&Format| format.extensions.iter().any(|known| extension.eq_ignore_ascii_case(known));
    let is_model = |format: &Format| {
        matches!(format.remedy, Remedy::Blender | Remedy::Export | Remedy::Tessellate | Remedy::Convert)
    };
    FORMATS.iter().find(has_extension).is_some_and(is_model)
}

/// A format: its name with an article, the bytes that its files begin with, its extensions, and what helps.
struct Format {
    name: &'static str,
    magics: &'static [&'static [u8]],
    extensions: &'static [&'static str],
    remedy: Remedy,
}

const fn format(
    name: &'static str,
    magics: &'static [&'static [u8]],
    extensions: &'static [&'static str],
    remedy: Remedy,
) -> Format {
    Format { name, magics, extensions, remedy }
}

/// Formats whose first bytes or extension tell them. ZIP archives come last, as several formats are archives.
#[rustfmt::skip]
const FORMATS: &[Format] = &[
    format("a .blend file", &[b"BLENDER"], &["blend"], Remedy::Other(
        "blinn converts it if it is named by its path and Blender is installed; else export it as .glb (File > Export > \
         glTF 2.0)")),
    format("an FBX file", &[b"Kaydara FBX Binary", b"; FBX"], &["fbx"], Remedy::Blender),
    format("a USD file", &[b"#usda", b"PXR-USDC"], &["usd", "usda", "usdc", "usdz"], Remedy::Blender),
    format("a COLLADA file", &[], &["dae"], Remedy::Blender),
    format("an Alembic file", &[b"Ogawa"], &["abc"], Remedy::Blender),
    format("a 3MF file", &[], &["3mf"], Remedy::Convert),
    format("an X3D or VRML file", &[b"#VRML", b"#X3D"], &["wrl", "x3d", "x3dv"], Remedy::Blender),
    format("a 3D Studio file", &[], &["3ds", "max"], Remedy::Export),
    format("a Maya file", &[b"//Maya"], &["ma", "mb"], Remedy::Export),
    format("a Cinema 4D file", &[], &["c4d"], Remedy::Export),
    format("a SketchUp file", &[], &["skp"], Remedy::Export),
    format("a Rhino file", &[b"3D Geometry File Format"], &["3dm"], Remedy::Export),
    format("an IFC file", &[], &["ifc"], Remedy::Tessellate),
    format("a STEP file", &[b"ISO-10303-21"], &["step", "stp"], Remedy::Convert),
    format("an IGES file", &[], &["iges", "igs"], Remedy::Tessellate),
    format("an AutoCAD file", &[b"AC10"], &["dwg", "dxf"], Remedy::Tessellate),
    format("an OFF file", &[b"OFF\n", b"OFF\r", b"COFF", b"NOFF"], &["off"],
        Remedy::Other("convert it to .ply, for example in MeshLab (File > Export Mesh As)")),
    format("a VTK file", &[b"# vtk DataFile"], &["vtk", "vtp", "vtu"],
        Remedy::Other("export the surface as .glb or .ply, for example in ParaView (File > Export Scene)")),
    format("a point cloud", &[b"# .PCD", b"LASF", b"ASTM-E57"], &["pcd", "las", "laz", "e57", "xyz", "pts", "ptx"],
        Remedy::Other("save it as .ply, for example in CloudCompare")),
    format("a set of Gaussian splats", &[], &["splat", "spz", "ksplat"],
        Remedy::Other("splats are not drawn; convert them to a mesh")),
    format("a material library", &[], &["mtl"], Remedy::Other("name the .obj file that uses it")),
    format("a PNG picture", &[b"\x89PNG\r\n\x1a\n"], &["png"], Remedy::Picture),
    format("a JPEG picture", &[b"\xff\xd8\xff"], &["jpg", "jpeg"], Remedy::Picture),
    format("a GIF picture", &[b"GIF87a", b"GIF89a"], &["gif"], Remedy::Picture),
    format("a TIFF picture", &[b"II*\0", b"MM\0*"], &["tif", "tiff"], Remedy::Picture),
    format("an OpenEXR picture", &[b"\x76\x2f\x31\x01"], &["exr"], Remedy::Picture),
    format("a Radiance picture", &[b"#?RADIANCE", b"#?RGBE"], &["hdr"], Remedy::Picture),
    format("a KTX2 texture", &[b"\xabKTX 20\xbb"], &["ktx2"], Remedy::Picture),
    format("a Photoshop picture", &[b"8BPS"], &["psd"], Remedy::Picture),
    format("a WebP picture", &[], &["webp"], Remedy::Picture),
    format("a BMP or TGA picture", &[], &["bmp", "tga"], Remedy::Picture),
    format("a PDF document", &[b"%PDF-"], &["pdf"], Remedy::Other("export the model itself as .glb")),
    format("a web page", &[b"<!DOCTYPE html", b"<!doctype html", b"<html"], &["html", "htm"],
        Remedy::Other("download the model itself")),
    format("compressed with gzip", &[b"\x1f\x8b"], &["gz"], Remedy::Other("decompress it first")),
    format("compressed with Zstandard", &[b"\x28\xb5\x2f\xfd"], &["zst"], Remedy::Other("decompress it first")),
    format("compressed with bzip2", &[b"BZh"], &["bz2"], Remedy::Other("decompress it first")),
    format("compressed with xz", &[b"\xfd7zXZ\0"], &["xz"], Remedy::Other("decompress it first")),
    format("a 7-Zip archive", &[b"7z\xbc\xaf\x27\x1c"], &["7z"], Remedy::Extract),
    format("a RAR archive", &[b"Rar!\x1a\x07"], &["rar"], Remedy::Extract),
    format("a ZIP archive", &[b"PK\x03\x04"], &["zip"], Remedy::Extract),
];

/// Extensions of formats that are ZIP archives.
const ZIP_FORMATS: [&str; 2] = ["3mf", "usdz"];

/// Returns the reason why a file is no scene and what to do, as a sentence. `None` if it may be one: names of other formats
/// count only for files that do not begin as glTF or PLY files do.
pub(crate) fn hint(path: &Path, head: &[u8]) -> Option<String> {
    if head.trim_ascii().is_empty() {
        return Some("the file is empty".into());
    }
    if let Some(encoding) = unread_encoding(head) {
        return Some(format!("the file is text in {encoding}; save it as UTF-8"));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let extension = extension.as_str();
    let by_name = || FORMATS.iter().find(|format| format.extensions.contains(&extension));
    let by_magic = FORMATS.iter().find(|format| format.magics.iter().any(|magic| head.starts_with(magic)));
    let is_zip = by_magic.is_some_and(|format| format.name == "a ZIP archive");
    let found = if is_zip && ZIP_FORMATS.contains(&extension) {
        by_name()
    } else if by_magic.is_some() {
        // IFC files are STEP files.
        by_magic.map(|format| by_name().filter(|named| named.name == "an IFC file").unwrap_or(format))
    } else if let Some(format) = by_content(head) {
        Some(format)
    } else if may_be_scene(head) {
        None
    } else {
        let cloud = || FORMATS.iter().find(|format| format.extensions.contains(&"xyz"));
        by_name().or_else(|| cloud().filter(|_| is_table_of_numbers(head)))
    };
    found.map(|format| format!("the file is {}; {}", format.name, word_options(format.remedy.text())))
}

/// Returns the encoding of a text that no importer decodes: UTF-32, and UTF-16 unless it is that of an OBJ or STL file.
fn unread_encoding(head: &[u8]) -> Option<&'static str> {
    // A byte-order mark, or a first character of ASCII.
    let is_text = |unit: &[u8]| matches!(unit, [b'\t' | b'\n' | b'\r' | b' '..=b'~']);
    match head {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => return Some("UTF-32"),
        [a, 0, 0, 0, b, 0, 0, 0, ..] | [0, 0, 0, a, 0, 0, 0, b, ..] if is_text(&[*a]) && is_text(&[*b]) => {
            return Some("UTF-32");
        }
        _ => {}
    }
    let body = head.strip_prefix(b"\xff\xfe").or_else(|| head.strip_prefix(b"\xfe\xff")).unwrap_or(head);
    let letters: Option<Vec<u8>> = body
        .as_chunks::<2>()
        .0
        .iter()
        .take(4)
        .map(|unit| match *unit {
            [letter, 0] | [0, letter] => Some(letter),
            _ => None,
        })
        .collect();
    crate::ply::is_ply(&letters?).then_some("UTF-16")
}

/// Recognises formats by more than their first bytes.
fn by_content(head: &[u8]) -> Option<&'static Format> {
    let contains = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    let is_xml = head.trim_ascii_start().starts_with(b"<");
    let extension = match head {
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => "webp",
        _ if is_xml && contains(b"<COLLADA") => "dae",
        _ if is_xml && contains(b"<X3D") => "x3d",
        _ => return None,
    };
    FORMATS.iter().find(|format| format.extensions.contains(&extension))
}

/// Returns true if all lines are three or more numbers, as point clouds are written as text (`.xyz`, `.pts`, `.asc`, `.csv`). The
/// first line may have the names of the columns, or the number of points. The last one may be cut off.
fn is_table_of_numbers(head: &[u8]) -> bool {
    let Some(complete) = head.iter().rposition(|byte| matches!(byte, b'\n' | b'\r')) else { return false };
    let Ok(text) = std::str::from_utf8(head.get(..complete).unwrap_or_default()) else { return false };
    let is_row = |line: &str| {
        let words =
            line.split(|c: char| c.is_whitespace() || ",;".contains(c)).filter(|word| !word.is_empty());
        let numbers = words.map(|word| word.parse::<f64>().is_ok());
        let numbers: Vec<bool> = numbers.collect();
        numbers.len() >= 3 && numbers.iter().all(|is_number| *is_number)
    };
    let lines = text.lines().map(str::trim);
    let mut lines =
        lines.filter(|line| !line.is_empty() && !line.starts_with('#') && !line.starts_with("//"));
    let Some(first) = lines.next() else { return false };
    let mut rows = lines.peekable();
    let is_header = rows.peek().is_some();
    (is_row(first) || is_header) && rows.all(is_row)
}

/// Returns true if a file begins as scenes with a mark do.
fn may_be_scene(head: &[u8]) -> bool {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    head.starts_with(b"glTF") || text.starts_with(b"{") || crate::ply::is_ply(head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn says(name: &str, head: &[u8], words: &[&str]) {
        let hint = hint(Path::new(name), head).unwrap_or_else(|| panic!("{name}: no hint"));
        assert!(words.iter().all(|word| hint.contains(word)) && !hint.contains('\n'), "{name}: {hint}");
    }

    #[test]
    fn other_formats_are_named_by_their_content() {
        says("a.glb", b"", &["the file is empty"]);
        says("a.glb", b" \n\n", &["the file is empty"]);
        says("a", b"Kaydara FBX Binary  \0", &["an FBX file", ".glb"]);
        says("a.glb", b"\x89PNG\r\n\x1a\n", &["a PNG picture"]);
        says("a.glb", b"PK\x03\x04", &["a ZIP archive", "extract it"]);
        says("a.usdz", b"PK\x03\x04", &["a USD file"]);
        says("a.3mf", b"PK\x03\x04", &["a 3MF file"]);
        says("a.glb", b"<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4\">", &["a COLLADA file"]);
        says("house.ifc", b"ISO-10303-21;", &["an IFC file"]);
        says("a.obj", b"ISO-10303-21;", &["a STEP file", "CAD", "docs/how-to/cad-files.md"]);
        says("a.glb", b"<!DOCTYPE html><html>", &["a web page"]);
        says("a.glb", b"RIFF\0\0\0\0WEBPVP8 ", &["a WebP picture"]);
        for cloud in [
            &b"1.888e-01 -1.98 9.6e-01 1.5e+02 1.0e+02 2.4e+02\n0.1 0.2"[..],
            b"3\n0 0 0\n1 0 0\n0 1 0\n",
            b"x,y,z\r\n0.5,1,2\r\n1,1,2\r\n",
            b"//X Y Z Intensity\n0,5;1;2;3\n",
            b"# scan\n\n1\t2\t3\n",
        ] {
            for name in ["-", "a.xyz", "a.csv", "a.asc", "a.obj"] {
                says(name, cloud, &["a point cloud; save it as .ply"]);
            }
        }
        for text in
            [&b"v 0 0 0\nv 1 0 0\n"[..], b"1 2\n3 4\n", b"a\n1 2 x\n", b"1 2 3", b"\n", b"\xff\n1 2 3\n"]
        {
            assert_eq!(hint(Path::new("a.txt"), text).filter(|hint| hint.contains("cloud")), None);
        }
    }

    #[test]
    fn encodings_that_are_not_read_are_named() {
        let utf16 =
            |text: &str, to_bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to_bytes).collect();
        let utf32 = |text: &str, to_bytes: fn(u32) -> [u8; 4]| {
            text.chars().flat_map(|c| to_bytes(u32::from(c))).collect()
        };
        let obj = "v 0 0 0\nv 1 0 0\n";
        for (name, encoded) in
            [("a.ply", "ply\nformat ascii 1.0\n"), ("a.obj", obj), ("a.stl", "solid a\nfacet")]
        {
            for mark in ["", "\u{feff}"] {
                let text = format!("{mark}{encoded}");
                let wide: [Vec<u8>; 2] = [utf32(&text, u32::to_le_bytes), utf32(&text, u32::to_be_bytes)];
                wide.iter().for_each(|bytes| says(name, bytes, &["UTF-32", "save it as UTF-8"]));
                let narrow: [Vec<u8>; 2] = [utf16(&text, u16::to_le_bytes), utf16(&text, u16::to_be_bytes)];
                for bytes in narrow {
                    match name {
                        "a.ply" => says(name, &bytes, &["UTF-16", "save it as UTF-8"]),
                        // Their importers decode it.
                        _ => assert_eq!(hint(Path::new(name), &bytes), None),
                    }
                }
            }
        }
        // A binary STL file without a header.
        assert_eq!(hint(Path::new("a.stl"), &[0; 84]), None);
    }

    #[test]
    fn other_formats_are_named_by_their_extension() {
        says("a.FBX", b"\0\0", &["an FBX file"]);
        says("a.igs", b"START RECORD", &["an IGES file"]);
        says("a.pts", b"\x01\x02", &["a point cloud"]);
        says("a.off", b"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", &["an OFF file"]);
        says("chair.mtl", b"newmtl wood", &["a material library", ".obj"]);
        assert_eq!(hint(Path::new("a.fbx"), b"glTF\x02"), None);
        assert_eq!(hint(Path::new("a.png"), b" {\"asset\""), None);
        assert_eq!(hint(Path::new("a.obj"), b"v 0 0 0"), None);
        assert_eq!(hint(Path::new("a"), b"v 0 0 0"), None);
    }

    #[test]
    fn every_format_has_an_extension_of_its_own() {
        let mut extensions: Vec<&str> =
            FORMATS.iter().flat_map(|format| format.extensions).copied().collect();
        let count = extensions.len();
        extensions.sort_unstable();
        extensions.dedup();
        assert_eq!(extensions.len(), count);
        assert!(extensions.iter().all(|extension| !crate::SCENE_EXTENSIONS.contains(extension)));
    }
}
