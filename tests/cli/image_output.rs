//! Written image files, read back by other decoders.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::program::{blinn_args, folder, model, refused, runs};

/// Renders. Returns the path of the picture.
#[track_caller]
pub fn rendered(folder: &Path, scene: &str, out: &str, flags: &str) -> PathBuf {
    let mut args = vec!["render", scene, "-o", out, "-q"];
    args.extend(flags.split_whitespace());
    let output = blinn_args(folder, &args);
    assert_eq!(output.status.code(), Some(0), "{flags}: {}", String::from_utf8_lossy(&output.stderr));
    folder.join(out)
}

pub type Exr = exr::image::Image<
    exr::prelude::SmallVec<[exr::image::Layer<exr::image::AnyChannels<exr::image::FlatSamples>>; 2]>,
>;

pub fn read_exr(path: &Path) -> Exr {
    exr::prelude::read_all_flat_layers_from_file(path).unwrap()
}

/// Compositors place a crop by its windows: the display window is the whole picture.
#[test]
fn a_cropped_exr_has_the_display_window_of_the_image() {
    let dir = tempfile::tempdir().unwrap();
    let path =
        rendered(dir.path(), &model("cornell/cornell.glb"), "a.exr", "--size 40x30 -s 1 --crop 3,4,10,11");
    let image = read_exr(&path);
    let layer = &image.layer_data[0];
    let whole = image.attributes.display_window;
    assert_eq!((whole.position.0, whole.position.1, whole.size.0, whole.size.1), (0, 0, 40, 30));
    let at = layer.attributes.layer_position;
    assert_eq!((at.0, at.1, layer.size.0, layer.size.1), (3, 4, 10, 11));
}

/// The same picture in every format, within the format's precision.
#[test]
fn jpeg_and_webp_match_png() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("textured/textured.glb");
    let picture = |out: &str, flags: &str| {
        let path = rendered(dir.path(), &scene, out, &format!("--size 96x54 -s 2 {flags}"));
        image::open(path).unwrap()
    };
    let png = picture("a.png", "");
    assert!(png == picture("a.webp", ""), "a WebP loses nothing");
    let clear = picture("b.png", "--background transparent");
    assert!(clear.color().has_alpha() && clear == picture("b.webp", "--background transparent"));
    let error = |out: &str, flags: &str| {
        let jpeg = picture(out, flags).into_rgb8();
        let apart =
            png.to_rgb8().iter().zip(jpeg.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
        apart / jpeg.len() as f64
    };
    let (low, usual, high) = (
        error("l.jpg", "--encoder-quality 20"),
        error("a.JPEG", ""),
        error("h.jpg", "--encoder-quality 100"),
    );
    assert!(high < 1.0 && high < usual && usual < 3.0 && usual < low, "{high} {usual} {low}");
    let bytes = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert!(bytes("a.JPEG").starts_with(b"\xff\xd8\xff") && bytes("a.webp").starts_with(b"RIFF"));
}

/// Pictures larger than the format allows are rejected before the scene is read.
/// Thumbnailers of desktops are given an empty file whose name ends in random letters.
#[test]
fn an_empty_file_of_any_name_becomes_a_png() {
    let (_dir, at) = folder();
    let scene = model("tests/cube.obj");
    for name in [".gnome_desktop_thumbnail.X3KQ81", "thumbnail"] {
        fs::write(at.join(name), "").unwrap();
        runs(&at, &format!("render {scene} --max-size 32 -s 1 -q -o {name}"));
        let picture =
            image::load_from_memory_with_format(&fs::read(at.join(name)).unwrap(), image::ImageFormat::Png);
        assert_eq!(picture.unwrap().width(), 32, "{name}");
        // Now it has contents that a wrong name must not replace.
        refused(&at, &format!("render {scene} -o {name}"), "unknown format");
    }
    refused(&at, &format!("render {scene} -o missing.X3KQ81"), "unknown format");
}

#[test]
fn sizes_beyond_a_format_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let output = blinn_args(
        dir.path(),
        &["render", &model("tests/cube.obj"), "--size", "16385x1", "-s", "1", "-o", "a.webp"],
    );
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{messages}");
    assert!(messages.contains("at most 16384 pixels a side, not 16385x1"), "{messages}");
    assert!(std::fs::read_dir(dir.path()).unwrap().next().is_none());
}

pub fn channel(image: &Exr, name: &str) -> Vec<f32> {
    let list = &image.layer_data[0].channel_data.list;
    let found = list.iter().find(|c| c.name.to_string() == name).unwrap_or_else(|| panic!("no {name}"));
    found.sample_data.values_as_f32().collect()
}

/// The text of an attribute.
pub fn text(image: &Exr, name: &str) -> String {
    let found = image.layer_data[0].attributes.other.iter().find(|(key, _)| *key == name);
    match found {
        Some((_, exr::prelude::AttributeValue::Text(t))) => t.to_string(),
        other => panic!("{name}: {other:?}"),
    }
}

const CRYPTOMATTE: [(&str, &str, &str); 2] =
    // The first key is the one that other programs write for a layer of this name.
    [("crypto_object", "f834d0a", "object-id.I"), ("crypto_material", "", "material-id.I")];

/// Ids and coverages of each pixel, largest first.
pub fn ranks(image: &Exr, layer: &str, pixels: usize) -> Vec<Vec<(u32, f32)>> {
    let mut all = vec![Vec::new(); pixels];
    for i in 0..6 {
        let letters = if i % 2 == 0 { ["R", "G"] } else { ["B", "A"] };
        let [ids, coverages] = letters.map(|l| channel(image, &format!("{layer}{:02}.{l}", i / 2)));
        for (pixel, pair) in all.iter_mut().zip(ids.iter().map(|v| v.to_bits()).zip(coverages)) {
            pixel.push(pair);
        }
    }
    all
}

/// Mattes are ordered by coverage and named, and together cover what the picture covers.
#[test]
fn cryptomatte_covers_what_the_picture_covers() {
    let dir = tempfile::tempdir().unwrap();
    for (scene, flags) in [("alpha/alpha.glb", ""), ("assembly/assembly.glb", "--filter gaussian")] {
        let flags = format!(
            "--size 64x48 -s 16 --background transparent --aov cryptomatte,object-id,material-id {flags}"
        );
        let image = read_exr(&rendered(dir.path(), &model(scene), "a.exr", &flags));
        let again = std::fs::read(dir.path().join("a.exr")).unwrap();
        rendered(dir.path(), &model(scene), "a.exr", &format!("{flags} --threads 1"));
        assert!(again == std::fs::read(dir.path().join("a.exr")).unwrap(), "always the same bytes");
        let alpha = channel(&image, "A");
        for (layer, key, ids) in CRYPTOMATTE {
            let all = &image.layer_data[0].attributes.other;
            let name_of = |k: &str| {
                all.iter().find(|(name, value)| {
                    name.to_string().ends_with("/name")
                        && name.to_string().contains(k)
                        && matches!(value, exr::prelude::AttributeValue::Text(t) if t == layer)
                })
            };
            let (name, _) = name_of(key).unwrap_or_else(|| panic!("{layer} with key {key}"));
            let name = name.to_string();
            let about = |what: &str| text(&image, &name.replace("/name", &format!("/{what}")));
            assert_eq!(name.len(), "cryptomatte/f834d0a/name".len());
            assert_eq!(
                (about("hash").as_str(), about("conversion").as_str()),
                ("MurmurHash3_32", "uint32_to_float32")
            );
            let manifest: serde_json::Value = serde_json::from_str(&about("manifest")).unwrap();
            let manifest = manifest.as_object().unwrap();
            let known: Vec<u32> =
                manifest.values().map(|v| u32::from_str_radix(v.as_str().unwrap(), 16).unwrap()).collect();
            let first = channel(&image, ids);
            let (mut agree, mut whole, mut crowded) = (0, 0, 0);
            for (i, ranked) in ranks(&image, layer, alpha.len()).iter().enumerate() {
                let sum: f32 = ranked.iter().map(|r| r.1).sum();
                // Six ids are kept; only pixels with more lose coverage.
                let lacking = alpha[i] - sum;
                let full = ranked[5].1 > 0.0 && lacking > 0.0;
                crowded += usize::from(full);
                assert!(lacking.abs() < 2e-6 || full, "{layer} {i}: {sum} of {}", alpha[i]);
                assert!(ranked.windows(2).all(|w| w[0].1 >= w[1].1), "{ranked:?}");
                for (id, coverage) in ranked {
                    assert_eq!(*coverage == 0.0, *id == 0, "{ranked:?}");
                    assert!(crowded < 40, "{crowded} pixels of more than six");
                    assert!(*id == 0 || known.contains(id), "{id:x} is in the manifest");
                }
                if ranked[0].1 > 0.999 {
                    whole += 1;
                    agree += usize::from(known[first[i] as usize - 1] == ranked[0].0);
                }
            }
            assert!(
                whole > 300 && agree == whole,
                "{scene} {layer}: {agree} of {whole} are the object's own"
            );
        }
    }
}

/// A pane of opacity .25 in front of a wall: both ids, ordered by their coverage over the samples.
#[test]
fn cryptomatte_ranks_a_blended_pane_by_coverage() {
    let dir = tempfile::tempdir().unwrap();
    let quad = |z: f32, x: f32| {
        format!("v {} -1 {z}\nv {x} -1 {z}\nv {x} 1.1 {z}\nv {} 1.1 {z}\n", x - 2.03, x - 2.03)
    };
    let obj = format!(
        "mtllib a.mtl\n{}{}o wall\nusemtl wall\nf 1 2 3 4\no pane\nusemtl pane\nf 5 6 7 8\no wall\nusemtl wall\n\
         f 1 4 2\n",
        quad(0.0, 1.0),
        quad(1.0, 0.0)
    );
    std::fs::write(dir.path().join("a.obj"), obj).unwrap();
    std::fs::write(dir.path().join("a.mtl"), "newmtl wall\nKd 1 1 1\nnewmtl pane\nKd 1 0 0\nd .25\n")
        .unwrap();
    let view = "--view-point 0,0,9 --view-dir 0,0,-1 --camera-orthographic --view-width 2 --size 16x16 -s 4";
    let image =
        read_exr(&rendered(dir.path(), "a.obj", "a.exr", &format!("{view} --aov cryptomatte --filter box")));
    let ranked = ranks(&image, "crypto_object", 256);
    let shares =
        |pixel: usize| -> Vec<f32> { ranked[pixel].iter().map(|r| r.1).filter(|&c| c > 0.0).collect() };
    assert_eq!(shares(8 * 16 + 3), [0.75, 0.25], "left: pane and wall");
    assert_eq!(shares(8 * 16 + 12), [1.0], "right: the wall alone");
    // The second object named wall gets a unique name.
    let manifest = text(&image, "cryptomatte/f834d0a/manifest");
    assert!(manifest.contains("\"wall\":") && manifest.contains("\"wall.001\":"), "{manifest}");
}

/// Pictures of formats without layers get a preview file for each.
#[test]
fn aovs_have_previews_beside_images() {
    let dir = tempfile::tempdir().unwrap();
    let names = ["depth", "object-id", "cryptomatte-object", "cryptomatte-material"];
    for ending in ["png", "jpg", "webp"] {
        let flags = "--size 40x30 -s 2 --aov depth,object-id,cryptomatte";
        rendered(dir.path(), &model("cornell/cornell.glb"), &format!("{ending}.{ending}"), flags);
        for name in names {
            let preview = image::open(dir.path().join(format!("{ending}.{name}.png"))).unwrap();
            assert_eq!((preview.width(), preview.height()), (40, 30), "{ending} {name}");
        }
    }
}
