//! Models of COLMAP against projections written here.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::{LAYERS, Pinhole, cameras, check, write_scene};
use crate::common::program::*;

fn colmap_text(folder: &Path, cameras: &[Pinhole]) {
    let mut lenses = String::from("# Camera list\n");
    let mut images = String::from("# Image list with two lines of data per image:\n");
    for (i, camera) in cameras.iter().enumerate() {
        let [fx, fy, cx, cy] = camera.k;
        let (w, h) = camera.size;
        let lens = match i % 3 {
            0 => format!("PINHOLE {w} {h} {fx} {fy} {cx} {cy}"),
            1 => format!("OPENCV {w} {h} {fx} {fy} {cx} {cy} 0 0 0 0"),
            _ => format!("SIMPLE_PINHOLE {w} {h} {fx} {cx} {cy}"),
        };
        let _ = writeln!(lenses, "{} {lens}", i + 10);
        let (q, t) = (camera.quaternion, camera.t);
        let points = ["", "1.5 2.5 -1 3 4 7"][i % 2];
        let _ = writeln!(
            images,
            "{} {} {} {} {} {} {} {} {} cam {i}/img.png\n{points}",
            i + 1,
            q.w,
            q.x,
            q.y,
            q.z,
            t.x,
            t.y,
            t.z,
            i + 10
        );
    }
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("cameras.txt"), lenses).unwrap();
    fs::write(folder.join("images.txt"), images).unwrap();
}

fn colmap_binary(folder: &Path, cameras: &[Pinhole]) {
    let count = (cameras.len() as u64).to_le_bytes();
    let (mut lenses, mut images) = (count.to_vec(), count.to_vec());
    for (i, camera) in cameras.iter().enumerate() {
        let id = i as u32 + 10;
        lenses.extend(id.to_le_bytes());
        lenses.extend(1i32.to_le_bytes());
        lenses.extend(u64::from(camera.size.0).to_le_bytes());
        lenses.extend(u64::from(camera.size.1).to_le_bytes());
        camera.k.iter().for_each(|v| lenses.extend(v.to_le_bytes()));
        images.extend((i as u32).to_le_bytes());
        let (q, t) = (camera.quaternion, camera.t);
        [q.w, q.x, q.y, q.z, t.x, t.y, t.z].iter().for_each(|v| images.extend(v.to_le_bytes()));
        images.extend(id.to_le_bytes());
        images.extend(format!("img{i}.png\0").bytes());
        images.extend((i as u64).to_le_bytes());
        images.extend(vec![1; 24 * i]);
    }
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("cameras.bin"), lenses).unwrap();
    fs::write(folder.join("images.bin"), images).unwrap();
}

#[test]
fn colmap_models_project_to_pixel_centres() {
    let (_dir, at) = folder();
    write_scene(&at);
    let mut all = cameras(6);
    for camera in all.iter_mut().skip(2).step_by(3) {
        camera.k[1] = camera.k[0];
    }
    colmap_text(&at.join("text/sparse/0"), &all);
    colmap_binary(&at.join("binary"), &all);
    runs(&at, &format!("render cube.obj --cameras text {LAYERS} -o t/{{camera}}.exr"));
    runs(&at, &format!("render cube.obj --cameras binary/images.bin {LAYERS} -o b/{{camera}}.exr"));
    for (i, camera) in all.iter().enumerate() {
        check(&at.join(format!("t/cam {i}/img.exr")), camera);
        check(&at.join(format!("b/img{i}.exr")), camera);
    }
}

/// Some programs write a line for each image only. Names with blanks have as many words as points.
#[test]
fn colmap_models_without_lines_of_points_keep_all_images() {
    let (_dir, at) = folder();
    write_scene(&at);
    let mut all = cameras(4);
    all[2].k[1] = all[2].k[0];
    colmap_text(&at.join("m"), &all);
    let file = at.join("m/images.txt");
    let images = fs::read_to_string(&file).unwrap();
    let with_points = images.replacen("\n\n", "\n10.5 20 -1 3e2 4.25 17\n", 1);
    let long = images.replacen("\n\n", &format!("\n{}\n", "1.5 2.5 -1 ".repeat(200_000)), 1);
    let names = |images: &str| images.replace("cam ", "my cam ");
    for text in [images.replace("\n\n", "\n"), names(&images).replace("\n\n", "\n"), with_points, long] {
        fs::write(&file, &text).unwrap();
        let folder = if text.contains("my cam") { "my cam" } else { "cam" };
        let _ = fs::remove_dir_all(at.join("o"));
        runs(&at, &format!("render cube.obj --cameras m {LAYERS} -o o/{{camera}}.exr"));
        for (i, camera) in all.iter().enumerate() {
            check(&at.join(format!("o/{folder} {i}/img.exr")), camera);
        }
    }
}

#[test]
fn bad_colmap_models_are_refused() {
    let (_dir, at) = folder();
    write_scene(&at);
    let camera = cameras(2);
    let refused_with = |name: &str, message: &str| {
        refused(&at, &format!("render cube.obj --cameras {name}"), message);
    };
    fs::create_dir(at.join("empty")).unwrap();
    refused_with("empty", "the folder has no COLMAP model");
    colmap_text(&at.join("m"), &camera);
    let file = |name: &str| at.join("m").join(name);
    let (lenses, images) =
        (fs::read_to_string(file("cameras.txt")).unwrap(), fs::read_to_string(file("images.txt")).unwrap());
    for (from, to, message) in [
        ("OPENCV", "OPENCV_FISHEYE", "the model OPENCV_FISHEYE is not a pinhole"),
        ("0 0 0 0", "0 0 0.1 0", "the model OPENCV has distortion, which is not supported"),
        ("0 0 0 0", "0 0 0", "the model OPENCV has 8 parameters, not 7"),
        ("OPENCV", "FANCY", "the model FANCY is not supported"),
        ("11 OPENCV", "12 OPENCV", "camera 11 is not in the list of cameras"),
        ("11 OPENCV", "x OPENCV", "CAMERA_ID 'x'"),
    ] {
        fs::write(file("cameras.txt"), lenses.replace(from, to)).unwrap();
        refused_with("m", message);
    }
    fs::write(file("cameras.txt"), &lenses).unwrap();
    // A line that is neither points nor an image.
    fs::write(file("images.txt"), images.replacen("\n\n", "\n10 20 3 40\n", 1)).unwrap();
    refused_with("m", "images.txt, line 3: has no QZ");
    fs::write(file("images.txt"), images.replace("\n2 ", "\n2 nan ")).unwrap();
    refused_with("m", "images.txt, line 4");
    fs::write(file("images.txt"), "1 2 3").unwrap();
    refused_with("m", "has no QY");
    fs::write(at.join("m/transforms.json"), "{}").unwrap();
    refused_with("m", "the folder has images.txt and transforms.json; name one of them");

    colmap_binary(&at.join("b"), &camera);
    for name in ["cameras.bin", "images.bin"] {
        let file = at.join("b").join(name);
        let bytes = fs::read(&file).unwrap();
        for length in [0, 7, 8, 30, 80, bytes.len() - 1] {
            fs::write(&file, &bytes[..length]).unwrap();
            refused_with("b", name);
        }
        let many = [&u64::MAX.to_le_bytes(), &bytes[8..]].concat();
        fs::write(&file, many).unwrap();
        refused_with("b", "exceeds the limit");
        fs::write(&file, bytes).unwrap();
    }
    let file = at.join("b/cameras.bin");
    let mut bytes = fs::read(&file).unwrap();
    bytes[12] = 99;
    fs::write(&file, &bytes).unwrap();
    refused_with("b", "camera 10 has the unknown model 99");
}
