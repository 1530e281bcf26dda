//! `blinn assemble`: animations from frames on disk.

use std::path::Path;
use std::process::{Command, Output};

/// Writes a frame of one colour.
fn frame(path: &Path, size: (u32, u32), rgba: [u8; 4]) {
    image::RgbaImage::from_pixel(size.0, size.1, image::Rgba(rgba)).save(path).unwrap();
}

fn assemble(folder: &Path, words: &str) -> Output {
    let words = words.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_blinn"))
        .arg("assemble")
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[track_caller]
fn expect_line(output: &Output, code: i32, text: &str) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{error}");
    assert!(error.contains(text) && error.lines().count() == 1, "{error}");
}

fn three_frames() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("f")).unwrap();
    for (i, grey) in [(2, 100), (10, 150), (9, 200)] {
        frame(&folder.path().join(format!("f/a_{i}.png")), (32, 18), [grey, grey, grey, 255]);
    }
    folder
}

#[test]
fn frames_are_assembled_in_the_order_of_their_numbers() {
    let folder = three_frames();
    let out = assemble(folder.path(), "f/a_10.png f/a_2.png f/a_9.png -o a.gif --fps 10 -q");
    assert_eq!((out.status.code(), out.stderr.len()), (Some(0), 0));
    let bytes = std::fs::read(folder.path().join("a.gif")).unwrap();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&bytes[..]).unwrap();
    for grey in [100, 200, 150] {
        let shown = decoder.read_next_frame().unwrap().unwrap();
        assert_eq!((shown.delay, &shown.buffer[..4]), (10, &[grey, grey, grey, 255][..]));
    }
}

#[test]
fn missing_frames_are_a_warning_or_an_error_with_strict() {
    let folder = three_frames();
    let out = assemble(folder.path(), "f -o a.apng");
    let error = String::from_utf8_lossy(&out.stderr);
    assert_eq!(error, "warning: a.apng: missing frames: 3 to 8\nwrote a.apng\n");
    assert_eq!(out.status.code(), Some(0));
    expect_line(&assemble(folder.path(), "f -o b.apng --strict"), 1, "missing frames: 3 to 8");
    assert!(!folder.path().join("b.apng").exists());
}

/// `*.webp` also matches the output of the previous run.
#[test]
fn the_output_is_not_a_frame() {
    let folder = three_frames();
    for i in [1, 2] {
        frame(&folder.path().join(format!("f/{i}.webp")), (32, 18), [90, 90, 90, 255]);
    }
    let line = "f/1.webp f/2.webp f/../f/all.webp -o f/all.webp -q";
    assert_eq!(assemble(folder.path(), "f/1.webp f/2.webp -o f/all.webp -q").status.code(), Some(0));
    let once = std::fs::read(folder.path().join("f/all.webp")).unwrap();
    assert_eq!(assemble(folder.path(), line).status.code(), Some(0));
    assert!(std::fs::read(folder.path().join("f/all.webp")).unwrap() == once);
    expect_line(&assemble(folder.path(), "f/all.webp -o f/all.webp"), 1, "there are no frames");
}

#[test]
fn a_truncated_frame_is_an_error() {
    let folder = three_frames();
    let noise =
        image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([((x * 37) ^ (y * 91)) as u8, x as u8, 9]));
    for ending in ["png", "jpg", "webp"] {
        let file = folder.path().join(format!("cut.{ending}"));
        noise.save(&file).unwrap();
        let line = format!("cut.{ending} -o a.gif -q");
        assert_eq!(assemble(folder.path(), &line).status.code(), Some(0), "{ending}");
        let bytes = std::fs::read(&file).unwrap();
        std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
        expect_line(&assemble(folder.path(), &line), 1, &format!("cut.{ending} cannot be read as a frame"));
        std::fs::write(&file, "").unwrap();
        expect_line(
            &assemble(folder.path(), &line),
            1,
            &format!("cut.{ending} cannot be read as a frame: the file is empty"),
        );
    }
    let file = folder.path().join("damaged.png");
    noise.save(&file).unwrap();
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[20] ^= 0xff;
    std::fs::write(&file, bytes).unwrap();
    let output = assemble(folder.path(), "damaged.png -o a.gif -q");
    expect_line(&output, 1, "damaged.png cannot be read as a frame: ");
    let error = String::from_utf8(output.stderr).unwrap();
    let mut parts: Vec<&str> = error.trim().split(": ").collect();
    parts.sort_unstable();
    assert!(parts.windows(2).all(|two| two[0] != two[1]), "no part is repeated: {error}");
}

#[test]
fn every_format_is_written_and_mp4_needs_a_background() {
    let folder = three_frames();
    frame(&folder.path().join("f/a_9.png"), (32, 18), [255, 0, 0, 128]);
    for name in ["a.gif", "a.apng", "a.webp", "a.html"] {
        let out = assemble(folder.path(), &format!("f -o {name} -q"));
        assert_eq!(out.status.code(), Some(0), "{name}");
        assert!(folder.path().join(name).metadata().unwrap().len() > 100, "{name}");
    }
    expect_line(
        &assemble(folder.path(), "f -o a.mp4 -q"),
        1,
        "f/a_9.png: a.mp4 cannot be written: MP4 has no transparency",
    );
    assert_eq!(assemble(folder.path(), "f -o a.mp4 -q --background #ffffff").status.code(), Some(0));
}

#[test]
fn invalid_arguments_are_one_line() {
    let folder = three_frames();
    expect_line(&assemble(folder.path(), "f -o a.avi"), 2, "must end in .gif, .apng, .webp, .mp4 or .html");
    expect_line(
        &assemble(folder.path(), "f -o a.gif --encoder-quality 50"),
        2,
        "--encoder-quality applies only to .webp, .mp4 and .html",
    );
    expect_line(
        &assemble(folder.path(), "f -o a.gif --direction cw"),
        2,
        "--direction applies only to .html",
    );
    expect_line(&assemble(folder.path(), "f/b.png -o a.gif"), 1, "f/b.png cannot be read");
    std::fs::write(folder.path().join("text.png"), "no picture").unwrap();
    expect_line(
        &assemble(folder.path(), "text.png -o a.gif"),
        1,
        "text.png: a frame must be a .png, .jpg or .webp",
    );
    // Frames have a size of their own: `assemble` has no --size.
    frame(&folder.path().join("small.png"), (8, 8), [0, 0, 0, 255]);
    expect_line(&assemble(folder.path(), "small.png -o a.mp4 -q"), 1, "not 8x8; render in another --size");
    frame(&folder.path().join("f/a_3.png"), (18, 32), [0, 0, 0, 255]);
    expect_line(&assemble(folder.path(), "f -o a.gif -q"), 1, "f/a_3.png is 18x32, but f/a_2.png is 32x18");
    std::fs::write(folder.path().join("kept.gif"), "kept").unwrap();
    expect_line(&assemble(folder.path(), "f/a_2.png -o kept.gif --no-overwrite"), 1, "--no-overwrite");
    assert_eq!(std::fs::read(folder.path().join("kept.gif")).unwrap(), b"kept");
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 4, "f, text.png, small.png, kept.gif");
}
