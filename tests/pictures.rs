//! The picture files that the program writes, read again by other means.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn model(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name).to_str().unwrap().to_string()
}

fn blinn(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_blinn")).args(args).current_dir(folder).output().unwrap()
}

/// Renders and returns the path of what `-o out` named.
#[track_caller]
fn rendered(folder: &Path, scene: &str, out: &str, flags: &str) -> PathBuf {
    let mut args = vec!["render", scene, "-o", out, "-q"];
    args.extend(flags.split_whitespace());
    let output = blinn(folder, &args);
    assert_eq!(output.status.code(), Some(0), "{flags}: {}", String::from_utf8_lossy(&output.stderr));
    folder.join(out)
}

type Exr = exr::image::Image<
    exr::prelude::SmallVec<[exr::image::Layer<exr::image::AnyChannels<exr::image::FlatSamples>>; 2]>,
>;

fn read_exr(path: &Path) -> Exr {
    exr::prelude::read_all_flat_layers_from_file(path).unwrap()
}

/// Compositors put a crop where it belongs: the display window is the whole picture.
#[test]
fn a_cropped_exr_lies_in_its_picture() {
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
