//! Exposure, lights with a radius, ambient occlusion, ground and environment maps from the command line.

use std::fs;

use serde_json::json;

use crate::common::gltf_fixture::Fixture;
use crate::common::program::*;

/// Metering uses the file's camera with its own aspect ratio, so thumbnails, strips and crops have the same
/// exposure.
#[test]
fn exposure_does_not_depend_on_image_size() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/lights.glb");
    let messages = |size: &str| {
        let args =
            ["render", scene.as_str(), "-o", "a.png", "-v", "-s", "1", "--exposure", "auto", "--size", size];
        let output = blinn_args(dir.path(), &args);
        let errors = String::from_utf8(output.stderr).unwrap();
        errors.lines().find(|l| l.starts_with("exposure: ")).unwrap_or_else(|| panic!("{errors}")).to_string()
    };
    let usual = messages("64x36");
    assert_eq!(messages("16x64"), usual);
    assert_eq!(messages("96x8"), usual);
}

#[test]
fn a_light_radius_softens_shadows_and_zero_does_not() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("lecture/lecture.obj");
    let fixed = ["render", scene.as_str(), "--size", "64x36", "-q", "-o"];
    let picture = |out: &str, more: &[&str]| {
        let output = blinn_args(dir.path(), &[&fixed[..], &[out], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        image::open(dir.path().join(out)).unwrap().into_rgba8().into_raw()
    };
    for lights in [&["--point-light", "4,6,1,40"][..], &["--lights", "three-point"], &["--sun", "0,-1,0,1"]] {
        let with = |r: &str, out: &str| picture(out, &[lights, &["--light-radius", r]].concat());
        let sharp = picture("a.png", lights);
        assert!(with("0", "b.png") == sharp && with(".5", "c.png") != sharp, "{lights:?}");
    }
}

#[test]
fn ambient_occlusion_shows_with_any_lights() {
    let dir = tempfile::tempdir().unwrap();
    let lights = [
        &[][..],
        &["--lights", "headlight"],
        &["--lights", "none"],
        &["--point-light", "0,3,0,1000"],
        &["--no-shadows"],
        &["--light-radius", ".1"],
        &["--ground", "shadow"],
    ];
    let close = model("lecture/view-1.xml");
    let close = ["--camera-xml", close.as_str()];
    for (name, camera) in [("lecture/lecture.obj", &close[..]), ("cornell/cornell.glb", &[])] {
        let scene = model(name);
        for light in lights {
            let levels = |more: &[&str]| {
                let fixed = ["render", scene.as_str(), "--size", "48x27", "-q", "-o", "a.png"];
                let output = blinn_args(dir.path(), &[&fixed, camera, light, more].concat());
                assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
                image::open(dir.path().join("a.png")).unwrap().into_luma8().into_vec()
            };
            // Within 1e-9 m there is no occluder: the ambient term stays.
            let (occluded, open) = (levels(&["--ao", "16"]), levels(&["--ao", "16,1e-9"]));
            let darker = occluded.iter().zip(&open).filter(|(a, b)| a.saturating_add(5) < **b).count();
            let lighter = occluded.iter().zip(&open).filter(|(a, b)| **a > b.saturating_add(1)).count();
            assert!(darker > 100 && lighter == 0, "{name} {light:?}: {darker} darker, {lighter} lighter");
        }
    }
}

#[test]
fn light_flags_without_effect_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let scene = scene.as_str();
    for (args, message) in [
        (
            &["--light-radius", ".1", "--integrator", "diffuse"][..],
            "--light-radius softens shadows, which --integrator diffuse disables",
        ),
        (&["--light-radius", ".1", "--no-shadows"], "which --no-shadows disables"),
        (&["--light-radius", ".1", "--lights", "none"], "which --lights none disables"),
        (&["--ao", "16", "--integrator", "shadow"], "which only --integrator phong has"),
        (&["--ao", "16", "--ambient", "0,0,0"], "no effect with --ambient 0,0,0"),
        (&["--ground", "shadow", "--integrator", "color"], "use --ground plane"),
        (&["--ground", "shadow", "--no-shadows"], "use --ground plane"),
        (&["--ao", "0"], "from 1 to 65536"),
        (&["--ao", "16,-2"], "expected metres, or 'inf'"),
        (&["--light-radius", "-1"], "from 0 to 1000000 metres"),
        (&["--ground", "grass"], "possible values"),
    ] {
        fails(dir.path(), &[&["render", scene], args].concat(), 2, message);
    }
}

#[test]
fn a_ground_changes_neither_camera_nor_exposure_and_is_in_alpha() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    let lights = model("tests/lights.glb");
    let picture = |scene: &str, more: &[&str]| {
        let fixed = ["render", scene, "--size", "64x48", "-v", "-s", "1", "-o", "a.png"];
        let output = blinn_args(dir.path(), &[&fixed, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let messages = String::from_utf8(output.stderr).unwrap();
        (image::open(dir.path().join("a.png")).unwrap().into_rgba8(), messages)
    };
    let clear = ["--background", "transparent"];
    let (bare, _) = picture(&scene, &clear);
    let (caught, _) = picture(&scene, &[&clear[..], &["--ground", "shadow"]].concat());
    let (mut same, mut shadow) = (0, 0);
    for (a, b) in bare.pixels().zip(caught.pixels()) {
        if a[3] > 0 {
            assert_eq!(a, b);
            same += 1;
        } else if b[3] > 0 {
            assert_eq!(b.0[..3], [0, 0, 0]);
            shadow += 1;
        }
    }
    assert!(same > 200 && shadow > 100, "{same} {shadow}");
    let messages = |more: &[&str]| picture(&lights, &[&["--exposure", "auto"], more].concat()).1;
    assert_eq!(messages(&["--ground", "plane"]), messages(&[]));
}

#[test]
fn an_environment_map_lights_by_direction() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    let light = dir.path().join("light.hdr");
    let from_above = |_, y| image::Rgb(if y < 8 { [0.0, 0.0, 0.8f32] } else { [0.0, 0.0, 0.0] });
    let light_picture: image::DynamicImage = image::ImageBuffer::from_fn(32, 16, from_above).into();
    light_picture.save(&light).unwrap();
    let picture = |more: &[&str]| {
        let fixed = ["render", scene.as_str(), "--size", "64x48", "-v", "--hdri", "light.hdr", "-o", "a.png"];
        let output = blinn_args(dir.path(), &[&fixed, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let messages = String::from_utf8(output.stderr).unwrap();
        (image::open(dir.path().join("a.png")).unwrap().into_rgba8(), messages)
    };
    let clear = ["--background", "transparent"];
    let (seen, messages) = picture(&clear);
    assert!(messages.contains("lights: none; ambient light from an environment"), "{messages}");
    let blue: Vec<u8> = seen.pixels().filter(|p| p[3] == 255).map(|p| p[2]).collect();
    // Encoded: the top receives all of the light, the sides half.
    assert!(blue.iter().max().unwrap() > &225 && (150..190).contains(blue.iter().min().unwrap()));
    assert!(seen.pixels().all(|p| p[0] == 0 && p[1] == 0));
    let (occluded, _) = picture(&["--background", "transparent", "--ao", "16", "--ground", "shadow"]);
    assert!(occluded.pixels().any(|p| p[3] > 5 && p[3] < 250 && p[2] == 0));
    assert!(picture(&["--ground", "shadow"]).1.contains("shows nothing"));
    let render = ["render", scene.as_str()];
    for (args, message) in [
        (&["--hdri", "missing.hdr"][..], "--hdri: missing.hdr"),
        (&["--hdri", "light.hdr", "--ambient", "1,1,1"], "cannot be used with"),
        (&["--hdri", "light.hdr", "--integrator", "shadow"], "which only --integrator phong has"),
        (
            &["--hdri", "sky", "--background-blur", "0.5"],
            "--background-blur applies only to --background hdri",
        ),
        (&["--hdri", "sky", "--hdri-strength", "-1"], "must not be negative"),
        (&["--hdri", "./studio"], "./studio"),
    ] {
        fails(dir.path(), &[&render, args].concat(), 2, message);
    }
    for (args, message) in [
        (&["--background", "hdri"][..], "no environment lights the scene; add --hdri FILE"),
        (&["--hdri-rotate", "90", "--strict"], "--hdri-rotate and --hdri-strength have no effect"),
    ] {
        fails(dir.path(), &[&render, args].concat(), 1, message);
    }
    fs::write(dir.path().join("text.exr"), "text").unwrap();
    fails(
        dir.path(),
        &[&render[..], &["--hdri", "text.exr"]].concat(),
        2,
        "not a Radiance HDR or OpenEXR file",
    );
}

/// The environment is red towards +X and black elsewhere. The camera looks along −Z.
#[test]
fn a_background_shows_the_environment_rotated_and_scaled() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    let towards_x = |x: u32, _| image::Rgb([if (12..20).contains(&x) { 0.4f32 } else { 0.0 }, 0.0, 0.0]);
    let light: image::DynamicImage = image::ImageBuffer::from_fn(32, 16, towards_x).into();
    light.save(dir.path().join("light.exr")).unwrap();
    let corner = |more: &[&str]| {
        let fixed = ["render", scene.as_str(), "--size", "64x48", "-q", "-o", "a.png", "--view", "raw"];
        let view = ["--view-point", "0,0,6", "--look-at", "0,0,0", "--background", "hdri"];
        let output = blinn_args(dir.path(), &[&fixed[..], &view, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let picture = image::open(dir.path().join("a.png")).unwrap().into_rgb8();
        picture.get_pixel(1, 1).0
    };
    assert_eq!(corner(&["--hdri", "light.exr"]), [0, 0, 0]);
    assert_eq!(corner(&["--hdri", "light.exr", "--hdri-rotate", "-90"]), [0, 0, 0]);
    assert_eq!(corner(&["--hdri", "light.exr", "--hdri-rotate", "90"]), [102, 0, 0]);
    assert_eq!(corner(&["--hdri", "light.exr", "--hdri-rotate", "90", "--hdri-strength", "2"]), [204, 0, 0]);
    let blurred = corner(&["--hdri", "light.exr", "--hdri-rotate", "90", "--background-blur", "1"]);
    assert!((20..80).contains(&blurred[0]) && blurred[1] == 0, "{blurred:?}");
    assert!(corner(&["--hdri", "studio"]) != corner(&["--hdri", "sky"]));
}

/// A background covers all pixels, and is no part of the scene.
#[test]
fn a_background_does_not_hide_that_an_image_is_empty() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/cube.obj");
    let away = ["--view-point", "0,0,6", "--view-dir", "0,0,1", "--size", "16x16"];
    let args = [&["render", scene.as_str(), "--hdri", "sky", "--background", "hdri"][..], &away].concat();
    let output = blinn_args(dir.path(), &args);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(messages.contains("the camera looks away from the scene"), "{messages}");
}

#[test]
fn dark_scenes_name_probable_area_lights_and_options() {
    let (_dir, at) = folder();
    let mut file = Fixture::triangle();
    file.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
    file.node(json!({"name": "Lamp", "rotation": [-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()]}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    let warning = "--lights file has no effect: no light of the file is shown; 'Lamp' without content";
    let messages = runs(&at, "render a.glb --size 8x8 --lights file");
    assert!(messages.contains(warning) && messages.contains("use --lights three-point, "), "{messages}");
    let messages = runs(&at, "render a.glb --size 8x8 --lights none");
    assert!(messages.contains("the picture is dark; lights: none; 'Lamp' without content"), "{messages}");
    for flags in ["", "--lights file --ambient .1,.1,.1", "--lights file,headlight"] {
        let messages = runs(&at, &format!("render a.glb --size 8x8 {flags}"));
        assert!(!messages.contains("'Lamp'"), "{flags}: {messages}");
    }
}

/// Radii of the file apply unless a radius is given.
#[test]
fn radii_of_the_file_soften_shadows() {
    let (_dir, at) = folder();
    let picture = |extras: serde_json::Value, flags: &str| {
        let mut file = Fixture::triangle();
        // A small triangle shadows the large one.
        file.json["nodes"][0]["scale"] = json!([8, 8, 8]);
        file.node(json!({"mesh": 0, "translation": [1, 1, 1]}));
        let light = json!({"type": "point", "intensity": 100, "extras": extras});
        file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        file.node(json!({"translation": [1, 1, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}}));
        fs::write(at.join("a.glb"), file.glb()).unwrap();
        runs(&at, &format!("render a.glb -o a.png --size 48x48 {flags}"));
        image::open(at.join("a.png")).unwrap().into_rgba8().into_raw()
    };
    let (none, soft) = (json!({}), json!({"shadow_soft_size": 0.5}));
    let sharp = picture(none.clone(), "");
    assert!(picture(soft.clone(), "") == picture(none.clone(), "--light-radius .5"));
    assert!(picture(soft.clone(), "") != sharp);
    assert!(picture(soft, "--light-radius 0") == sharp && picture(none, "--light-radius 0") == sharp);
}

/// The exporter leaves cameras and lights out by default.
#[test]
fn a_file_of_blender_without_camera_and_lights_gets_a_line() {
    let (_dir, at) = folder();
    let lines = |name: &str, flags: &str| {
        let scene = model(name);
        let messages = runs(&at, &format!("render {scene} -o a.png --size 8x8 -s 1 --strict {flags}"));
        messages.lines().filter(|line| line.contains("Include › Data › Cameras and Punctual Lights")).count()
    };
    assert_eq!(lines("tests/gltf/blender_plain.glb", ""), 1);
    for flags in ["--quiet", "--orbit 30,20", "--lights headlight", "--hdri sky"] {
        assert_eq!(lines("tests/gltf/blender_plain.glb", flags), 0, "{flags}");
    }
    for name in ["tower/tower.glb", "tests/cube.obj"] {
        assert_eq!(lines(name, ""), 0, "{name}");
    }
}

/// A triangle in the light of a lamp whose intensity goes from `start` to `end` in a second.
fn fading_lamp(start: f32, end: f32) -> Fixture {
    let mut file = Fixture::triangle();
    file.push("materials", json!({"doubleSided": true, "pbrMetallicRoughness": {"metallicFactor": 0}}));
    file.primitive()["material"] = json!(0);
    file.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": start}]}});
    file.node(json!({"translation": [0.3, 0.3, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}}));
    if start != end {
        let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
        let values = file.floats("SCALAR", 1, &[start, end]);
        let pointer = "/extensions/KHR_lights_punctual/lights/0/intensity";
        file.push(
            "animations",
            json!({"samplers": [{"input": times, "output": values}], "channels": [{"sampler": 0,
            "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}}]}),
        );
    }
    file
}

/// A lamp that fades in is dark at the start of the clip; one exposure for all frames suits the brightest of them.
#[test]
fn animated_light_is_metered_over_the_clip() {
    let (_dir, at) = folder();
    let picture = |file: &Fixture, flags: &str| {
        fs::write(at.join("a.glb"), file.glb()).unwrap();
        runs(&at, &format!("render a.glb -o a.png --size 24x24 -s 1 --background #000000 {flags}"));
        image::open(at.join("a.png")).unwrap().to_rgb8().into_raw()
    };
    let steady = picture(&fading_lamp(300.0, 300.0), "");
    let middle = steady.iter().filter(|&&v| (40..250).contains(&v)).count();
    assert!(middle > 100, "{steady:?}");
    // Fading in or out, the bright end looks as in steady light.
    assert_eq!(picture(&fading_lamp(0.001, 300.0), "--time 1"), steady);
    assert_eq!(picture(&fading_lamp(300.0, 0.001), "--time 0"), steady);
    // A frame alone has the exposure of the clip.
    let file = fading_lamp(0.001, 300.0);
    let half = picture(&file, "--time 0.5");
    assert!(half.iter().zip(&steady).all(|(a, b)| a <= b) && half != steady);
    runs(&at, "render a.glb -o f##.png --frames 0-2 --fps 2 --size 24x24 -s 1 --background #000000");
    assert_eq!(image::open(at.join("f01.png")).unwrap().to_rgb8().into_raw(), half);
}

/// Half of a white picture or more is as bright as the display shows.
#[test]
fn white_pictures_and_caustics_alone_are_remarked_on() {
    let (_dir, at) = folder();
    let look = "--view-point 0,0,3 --look-at 0,0,0 --size 16x16 --view standard --lights none";
    let render =
        |flags: &str| runs(&at, &format!("render {} {look} -o a.png {flags}", model("tests/cube.obj")));
    assert!(render("--sun 0,0,-1,50").contains("most of the picture is white; use --exposure auto"));
    assert!(!render("--sun 0,0,-1,.5").contains("white"));
    assert!(!render("--sun 0,0,-1,50 --exposure auto").contains("white"));
    // Exposure does not change points without normals.
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    fs::write(at.join("points.ply"), format!("{header}0 0 0\n1 0 0\n0 1 1\n")).unwrap();
    assert!(!runs(&at, "render points.ply -o a.png --size 32x24").contains("white"));
    assert!(render("--caustics").contains("--caustics has no effect without --indirect"));
    assert!(!render("--caustics --indirect 1").contains("has no effect"));
}
