//! Bad OBJ, MTL, image, camera and environment map files.

use super::Case;
use crate::common::model_path;
use crate::common::seed_files;

/// Three vertices, one texture coordinate, one normal.
const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";

pub fn cases() -> Vec<Case> {
    let mut all = objs();
    all.extend(polygon_files());
    all.extend(mtls());
    all.extend(pictures());
    all.extend(cameras());
    all.extend(skies());
    all
}

fn objs() -> Vec<Case> {
    let with_vertices: [(&str, &str); 22] = [
        ("no faces", ""),
        ("a face of nothing", "f 1 2 3\nf\n"),
        ("a face of two", "f 1 2 3\nf 1 2\n"),
        ("an index of zero", "f 1 0 3\n"),
        ("an index past the end", "f 1 2 4\n"),
        ("a negative index past the start", "f -1 -2 -4\n"),
        ("a huge index", "f 1 2 99999999999999999999\n"),
        ("an index that is a word", "f 1 two 3\n"),
        ("an index that is a fraction", "f 1 2.5 3\n"),
        ("a texture coordinate that is a word", "f 1/x 2/1 3/1\n"),
        ("a normal that is a word", "f 1//x 2//1 3//1\n"),
        ("texture coordinates past the end", "f 1/9 2/9 3/9\n"),
        ("normals past the end", "f 1//9 2//9 3//9\n"),
        ("four indices of a corner", "f 1/1/1/1 2/1/1/1 3/1/1/1\n"),
        ("a corner of slashes", "f // 2 3\n"),
        ("a corner used twice", "f 1 2 3\nf 1 1 3\n"),
        ("lines and points alone", "l 1 2\np 3\n"),
        ("statements not known", "f 1 2 3\nfrobnicate 1\nwhat\n"),
        ("a library that is missing", "mtllib missing.mtl\nusemtl a\nf 1 2 3\n"),
        ("a library outside", "mtllib ../outside.mtl\nusemtl a\nf 1 2 3\n"),
        ("a library without a name", "mtllib\nusemtl a\nf 1 2 3\n"),
        ("materials without a library", "usemtl a\nf 1 2 3\n"),
    ];
    let alone: [(&str, &[u8]); 10] = [
        ("an empty OBJ", b""),
        ("a comment alone", b"# nothing\n"),
        ("a vertex of two numbers", b"v 0 0\nf 1 1 1\n"),
        ("a vertex of words", b"v 0 zero 0\n"),
        ("a normal of two numbers", b"v 0 0 0\nvn 0 1\nf 1//1 1//1 1//1\n"),
        ("a texture coordinate of nothing", b"v 0 0 0\nvt\n"),
        ("bytes of no text", b"\x00\x01\x02\xfe\xff\x80"),
        ("compressed by gzip", b"\x1f\x8b\x08\0\0\0\0\0"),
        ("an archive", b"PK\x03\x04\x14\0"),
        ("text that is no UTF-8", b"v 0 0 0\nv 1 0 0\nv 0 1 0\no caf\xe9\nf 1 2 3\n"),
    ];
    let all = with_vertices.into_iter().map(|(name, text)| (name, format!("{VERTICES}{text}").into_bytes()));
    let all = all.chain(alone.into_iter().map(|(name, bytes)| (name, bytes.to_vec())));
    all.map(|(name, bytes)| Case::new(format!("OBJ: {name}"), "a.obj", bytes)).collect()
}

/// PLY and STL.
fn polygon_files() -> Vec<Case> {
    const HEAD: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const ROWS: &str = "0 0 0\n1 0 0\n0 1 0\n";
    let header = |from: &str, to: &str| format!("{}{ROWS}3 0 1 2\n", HEAD.replace(from, to)).into_bytes();
    let faces = |text: &str| format!("{HEAD}{ROWS}{text}").into_bytes();
    let binary = |bytes: usize, count: u8| {
        let mut file = vec![0; bytes];
        file.iter_mut().skip(80).take(1).for_each(|byte| *byte = count);
        file
    };
    let ply: [(&str, Vec<u8>); 9] = [
        ("another encoding", header("ascii", "utf-8")),
        ("a type that is not known", header("float z", "half z")),
        ("no positions", header("float z", "float w")),
        ("no end of the header", header("end_header\n", "")),
        ("an index past the end", faces("3 0 1 3\n")),
        ("an index that is a word", faces("3 0 1 two\n")),
        ("a face of two", faces("2 0 1\n")),
        ("no faces", header("face 1", "face 0")),
        ("huge counts", header("vertex 3", "vertex 99999999999999999")),
    ];
    let stl: [(&str, Vec<u8>); 6] = [
        (
            "a vertex of two numbers",
            b"solid\nfacet\nouter loop\nvertex 0 0\nvertex 0 0 1\nendloop\n".to_vec(),
        ),
        ("a vertex of words", b"solid\nfacet\nouter loop\nvertex a b c\nendloop\n".to_vec()),
        ("no facets", b"solid a\nendsolid a\n".to_vec()),
        ("bytes of no STL", b"hello".to_vec()),
        ("fewer triangles than stated", binary(84 + 60, 9)),
        ("a header alone", binary(84, 1)),
    ];
    let ply = ply.into_iter().map(|(name, bytes)| Case::new(format!("PLY: {name}"), "a.ply", bytes));
    ply.chain(stl.into_iter().map(|(name, bytes)| Case::new(format!("STL: {name}"), "a.stl", bytes)))
        .collect()
}

fn mtls() -> Vec<Case> {
    let texts: [(&str, &str); 13] = [
        ("empty", ""),
        ("a statement before any material", "Kd 1 1 1\nnewmtl a\n"),
        ("a colour of one word", "newmtl a\nKd red\n"),
        ("a colour of two numbers", "newmtl a\nKd 1 .5\n"),
        ("a colour without numbers", "newmtl a\nKd\n"),
        ("a spectrum", "newmtl a\nKd spectral a.rfl\n"),
        ("a shininess that is a word", "newmtl a\nNs shiny\n"),
        ("both d and Tr", "newmtl a\nd .5\nTr .25\n"),
        ("a map that is missing", "newmtl a\nmap_Kd missing.png\n"),
        ("a map without a name", "newmtl a\nmap_Kd\n"),
        ("options that are not known", "newmtl a\nmap_Kd -boost 2 missing.png\n"),
        ("displacement", "newmtl a\ndisp missing.png\n"),
        ("statements not known", "newmtl a\nglow 3\n"),
    ];
    let obj = format!("mtllib a.mtl\n{VERTICES}usemtl a\nf 1/1/1 2/1/1 3/1/1\n");
    let case = |(name, text): (&str, &str)| {
        Case::new(format!("MTL: {name}"), "a.obj", obj.as_str()).with("a.mtl", text)
    };
    texts.into_iter().map(case).collect()
}

fn pictures() -> Vec<Case> {
    let read = |name: &str| std::fs::read(model_path("tests").join(name)).unwrap();
    let cut = |name: &str| {
        let bytes = read(name);
        bytes[..bytes.len() * 2 / 3].to_vec()
    };
    let sized = |name: &str, at: usize, size: &[u8]| {
        let mut bytes = read(name);
        bytes[at..at + size.len()].copy_from_slice(size);
        bytes
    };
    let files: [(&str, Vec<u8>); 17] = [
        ("empty", Vec::new()),
        ("text", b"hello".to_vec()),
        ("an icon", b"\0\0\x01\0\x01\0".to_vec()),
        ("a GIF without a frame", b"GIF89a\x01\0\x01\0\0\0\0;".to_vec()),
        ("a TIFF cut off", cut("images/lzw.tif")),
        ("a PNG cut off", cut("images/rgb.png")),
        ("a PNG's signature alone", read("images/rgb.png")[..8].to_vec()),
        ("a PNG of no width", sized("images/rgb.png", 16, &[0; 4])),
        ("a PNG of four thousand million columns", sized("images/rgb.png", 16, &[0xff; 4])),
        ("a PNG with a wrong checksum", sized("images/rgb.png", 29, &[1, 2, 3, 4])),
        ("a JPEG cut off in its header", read("images/rgb.jpg")[..100].to_vec()),
        ("a WebP cut off", cut("images/lossless.webp")),
        ("a BMP cut off", cut("images/rgb.bmp")),
        ("a KTX2 cut off", cut("gltf/ktx2/colour_uastc.ktx2")),
        ("a KTX2 without Basis Universal", read("gltf/ktx2/plain_rgba8_unorm.ktx2")),
        ("a KTX2 of no height", sized("gltf/ktx2/colour_uastc.ktx2", 24, &[0; 4])),
        ("an OpenEXR", read("light-units/sun.exr")),
    ];
    let case = |(name, bytes): (&str, Vec<u8>)| {
        Case::new(format!("picture: {name}"), "a.gltf", seed_files::pictured("a.img")).with("a.img", bytes)
    };
    files.into_iter().map(case).collect()
}

fn cameras() -> Vec<Case> {
    let block = |inside: &str| {
        format!("<scene>\n<camera type=\"PerspectiveCamera\">\n{inside}\n</camera>\n</scene>\n")
    };
    let point = "<viewPoint>1 2 3</viewPoint><viewDir>0 0 -1</viewDir>";
    let texts: [(&str, String); 11] = [
        ("empty", String::new()),
        ("no camera", "<scene>\n</scene>\n".into()),
        ("not closed", format!("<camera>\n{point}\n")),
        ("tags crossed", "<camera><viewPoint>1 2 3</camera></viewPoint>".into()),
        ("another type", "<camera type=\"Fisheye\"></camera>".into()),
        ("no direction", block("<viewPoint>1 2 3</viewPoint>")),
        ("a point of two numbers", block("<viewPoint>1 2</viewPoint>")),
        ("a point of words", block("<viewPoint>a b c</viewPoint>")),
        ("a width that is a word", block(&format!("{point}<viewWidth>wide</viewWidth>"))),
        ("a width of nothing", block(&format!("{point}<viewWidth>0</viewWidth>"))),
        ("a distance below zero", block(&format!("{point}<projDistance>-1</projDistance>"))),
    ];
    texts.into_iter().map(|(name, text)| Case::new(format!("camera: {name}"), "a.xml", text)).collect()
}

fn skies() -> Vec<Case> {
    let [(_, hdr), (_, exr), ..] = &seed_files::skies()[..] else { panic!("two formats") };
    let square = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80".to_vec();
    let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 120000\n".to_vec();
    let files: [(&str, Vec<u8>); 6] = [
        ("empty", Vec::new()),
        ("text", b"hello".to_vec()),
        ("a square", square),
        ("a huge one", huge),
        ("an HDR cut off", hdr[..hdr.len() / 2].to_vec()),
        ("an EXR cut off", exr[..exr.len() / 2].to_vec()),
    ];
    files.into_iter().map(|(name, bytes)| Case::new(format!("light: {name}"), "a.hdr", bytes)).collect()
}
