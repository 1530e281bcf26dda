//! `blinn render`: from flags to pictures and their names.

use std::fs;
use std::process::Command;

use crate::common::program::*;

#[test]
fn an_image_has_the_name_of_its_scene() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let output = blinn_args(dir.path(), &["render", scene.as_str(), "--size", "48x27"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert_eq!(errors.trim(), "wrote cornell.png");
    assert_eq!(names(dir.path()), ["cornell.png"]);
    let image = image::open(dir.path().join("cornell.png")).unwrap();
    assert_eq!((image.width(), image.height()), (48, 27));
}

#[test]
fn smooth_makes_normals_of_any_format_by_the_angle() {
    let dir = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 -1\nv 0 1 -1\nf 1 2 3 4\nf 5 1 4 6\n";
    fs::write(dir.path().join("a.obj"), obj).unwrap();
    let glb = model("cornell/cornell.glb");
    let picture = |scene: &str, smooth: &[&str], out: &str| {
        let fixed = ["render", scene, "-s", "1", "--size", "48x27", "-o", out];
        let output = blinn_args(dir.path(), &[&fixed, smooth].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        image::open(dir.path().join(out)).unwrap().into_rgba8()
    };
    let file = picture("a.obj", &[], "file.png");
    assert!(file == picture("a.obj", &["--smooth", "off"], "off.png"));
    assert!(file == picture("a.obj", &["--smooth", "90"], "sharp.png"));
    assert!(file != picture("a.obj", &["--smooth", "91"], "smooth.png"));
    let glb = glb.as_str();
    assert!(picture(glb, &["--smooth", "180"], "g.png") != picture(glb, &["--smooth", "off"], "h.png"));
    for wrong in ["181", "-1", "on"] {
        let asked = format!("--smooth={wrong}");
        fails(
            dir.path(),
            &["render", "a.obj", &asked],
            2,
            "expected auto, file, off, or an angle from 0 to 180 degrees",
        );
    }
}

#[test]
fn triangles_with_non_finite_vertices_are_ignored() {
    let dir = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv nan -nan(ind) 1.#QNAN\nf 1 2 3 4\nf 1 2 5\n";
    fs::write(dir.path().join("a.obj"), obj).unwrap();
    let output = blinn_args(dir.path(), &["render", "a.obj", "-s", "1", "--size", "48x27"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert!(errors.contains("ignored 1 triangles with coordinates that are not finite"), "{errors}");
    let picture = image::open(dir.path().join("a.png")).unwrap().into_rgb8();
    assert!(picture.get_pixel(24, 13).0[0] > 60, "{:?}", picture.get_pixel(24, 13));
}

#[test]
fn an_obj_is_rendered_into_a_new_folder() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.obj");
    let output =
        blinn_args(dir.path(), &["render", scene.as_str(), "--size", "48x27", "-o", "deep/er/a.exr"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(names(&dir.path().join("deep/er")), ["a.exr"]);
}

#[test]
fn standard_output_takes_a_png() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let output = blinn_args(dir.path(), &["render", scene.as_str(), "--size", "16x9", "-o", "-", "-q"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stdout.starts_with(b"\x89PNG") && output.stderr.is_empty());
    assert!(names(dir.path()).is_empty());
}

/// Of clips that animate the same properties, the first plays by default, and -v lists the others.
#[test]
fn idle_animations_are_listed_with_verbose() {
    let dir = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(model("tests/triangle.gltf")).unwrap();
    let mut scene: serde_json::Value = serde_json::from_str(&text).unwrap();
    let accessors = scene["accessors"].as_array_mut().unwrap();
    // Accessors without a buffer view are zeros: one key.
    let zeros = ["SCALAR", "VEC3"].map(|kind| {
        accessors.push(serde_json::json!({"componentType": 5126, "count": 1, "type": kind}));
        accessors.len() - 1
    });
    let clip = |name: &str| {
        serde_json::json!({"name": name, "samplers": [{"input": zeros[0], "output": zeros[1]}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]})
    };
    scene["animations"] = ["Idle", "Walk", "Run"].map(clip).into();
    fs::write(dir.path().join("clips.gltf"), scene.to_string()).unwrap();
    let messages = |flags: &[&str]| {
        let fixed = ["render", "clips.gltf", "--size", "8x8", "-v", "-o", "a.png"];
        String::from_utf8(blinn_args(dir.path(), &[&fixed[..], flags].concat()).stderr).unwrap()
    };
    let usual = messages(&[]);
    assert!(usual.contains("animation: 'Idle'; not played: 'Walk', 'Run'"), "{usual}");
    for chosen in ["Walk", "all", "none"] {
        let messages = messages(&["--animation", chosen]);
        assert!(messages.contains("wrote a.png") && !messages.contains("not played"), "{chosen}: {messages}");
    }
}

#[test]
fn a_variant_changes_the_image() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("tests/gltf/variants.glb");
    let picture = |variant: &str| {
        let args = ["render", scene.as_str(), "--size", "32x18", "-o", "-", "-q", "--variant", variant];
        let output = blinn_args(dir.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    assert_ne!(picture("Day"), picture("Night"));
    assert_ne!(picture("none"), picture("Night"));
}

/// AgX for Blender's glTF, sRGB for its OBJ, and always the requested one.
#[test]
fn the_view_transform_follows_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let picture = |scene: &str, flags: &[&str]| {
        let scene = model(scene);
        let mut args = vec!["render", scene.as_str(), "--size", "32x18", "-o", "-", "-q"];
        args.extend(flags);
        blinn_args(dir.path(), &args).stdout
    };
    let gltf = |flags: &[&str]| picture("cornell/cornell.glb", flags);
    assert_eq!(gltf(&[]), gltf(&["--view", "agx"]));
    assert_ne!(gltf(&[]), gltf(&["--view", "standard"]));
    assert_ne!(gltf(&["--view", "pbr-neutral"]), gltf(&["--view", "standard"]));
    let obj = |flags: &[&str]| picture("cornell/cornell.obj", flags);
    assert_eq!(obj(&[]), obj(&["--view", "standard"]));
}

#[test]
fn no_overwrite_keeps_existing_files() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    fs::write(dir.path().join("a.png"), "mine").unwrap();
    let args = ["render", scene.as_str(), "--size", "8x8", "-o", "a.png", "--no-overwrite"];
    fails(dir.path(), &args, 1, "no-overwrite");
    fails(dir.path(), &[&args[..], &["--dry-run"]].concat(), 1, "no-overwrite");
    assert_eq!(fs::read(dir.path().join("a.png")).unwrap(), b"mine");
}

#[test]
fn every_flag_is_accepted() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let xml = model("lecture/view-1.xml");
    let (scene, xml) = (scene.as_str(), xml.as_str());
    for flags in [
        "-s 2 --filter box --background #102030 --exposure auto --view standard --seed 7",
        "--filter tent --no-background --exposure -1.5 --view raw --depth 16",
        "--view agx --depth 16",
        "--view pbr-neutral",
        "--view filmic",
        "--view auto --exposure 0",
        "--filter gaussian --background transparent --crop 2,3,4,5 --aov depth,normal,uv",
        "--camera 0 --yfov 30 --view-up 0,1,0 --clip 0.1,100 --fit auto",
        "--camera Camera --clip off --fit horizontal --projection orthographic",
        "--view-point -1,2.5,-3e0 --view-dir 0,-.1,1 --view-width 2 --view-height 1.5 --proj-distance 1.2",
        "--view-point 0,1,9 --look-at 0,1,0 --camera-orthographic --view-width 3",
        "--camera-position 0,1,9 --camera-focal-point 0,1,0 --camera-view-up 0,1,0 --camera-view-angle 30",
        "--orbit -30,20 --zoom 1.5 --camera-azimuth-angle -10 --camera-elevation-angle 5",
        "--orbit 30,90,4 --look-at 0,1,0 --camera-zoom-factor 2 --camera-orthographic",
        "--camera-direction 0,0,-1 --camera-index 0 --hide Camera --only-objects *",
        "--lights file,headlight --point-light 0,1,0,5,#ffcc88 --sun 0,-1,0,.5,1,.5,.2 --light-scale .5",
        "--lights none --ambient .2,.2,.2 --light-units raw --no-shadows",
        "--lights three-point --light-units unitless",
        "--integrator shadow --kd 1,1,1 --ks 0,0,0 --shininess 10 --cull off --light-units standard",
        "--integrator color --up z --scene 0 --animation none --time 0 --variant none",
        "--integrator diffuse --frame 12 --fps 24 --animation all",
        "--animation 0 --threads 2 --progress json --perf -v",
        "--resolution 12,8 --progress plain --allow-outside --strict --progress plain",
    ] {
        let mut args = vec!["render", scene, "-o", "a.png"];
        args.extend(flags.split(' '));
        if !flags.contains("--resolution") {
            args.extend(["--size", "16x12"]);
        } else {
            args.truncate(args.len() - 2);
        }
        let output = blinn_args(dir.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{flags}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let output =
        blinn_args(dir.path(), &["render", scene, "-o", "b.exr", "--size", "16x9", "--camera-xml", xml]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(names(dir.path()).contains(&"a.depth.png".to_string()));
}

/// `BLINN_SIMD` selects the instructions and does not change the picture.
#[test]
fn every_simd_level_renders_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/models/still-life/still-life.glb");
    let render = |tier: &str| {
        let out = format!("{tier}.png");
        let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(["render", scene, "-o", &out, "--size", "96x54", "-s", "2", "-q"])
            .env("BLINN_SIMD", tier)
            .current_dir(folder.path())
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let bytes = |tier: &str| std::fs::read(folder.path().join(format!("{tier}.png"))).unwrap();
    assert_eq!(render("portable"), (Some(0), String::new()));
    for tier in blinn::accel::SimdLevel::ALL {
        if tier.is_supported() {
            assert_eq!(render(tier.name()).0, Some(0));
            assert!(bytes(tier.name()) == bytes("portable"), "{tier:?}");
        } else {
            assert_eq!(render(tier.name()).0, Some(2));
        }
    }
    let (code, error) = render("sse9");
    assert_eq!(code, Some(2));
    assert!(error.contains("unknown value 'sse9': expected portable, avx2, avx512"), "{error}");
}

/// Standard input is not lost when the program re-executes itself.
#[test]
fn a_config_file_may_read_scenes_from_standard_input() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("c.toml"), "scenes = [\"@-\"]\nsize = \"32x18\"\nsamples = 1\n").unwrap();
    let scene = model("tests/triangle.glb");
    fs::write(dir.path().join("list"), scene.as_str()).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(["render", "--config", "c.toml"])
        .current_dir(dir.path())
        .stdin(fs::File::open(dir.path().join("list")).unwrap())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(names(dir.path()).contains(&"triangle.png".to_string()));
}

#[test]
fn every_command_reads_scene_lists() {
    let dir = tempfile::tempdir().unwrap();
    let (one, two) = (model("tests/triangle.glb"), model("tests/cube.obj"));
    fs::write(dir.path().join("list"), format!("{}\n{}\n", one, two)).unwrap();
    let output = blinn_args(dir.path(), &["info", "@list", "--json"]);
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(facts.as_array().map(Vec::len), Some(2));
    let bench = [
        "bench",
        "@list",
        "--size",
        "8x8",
        "--rounds",
        "1",
        "--min-time",
        "0.001",
        "--threads",
        "1",
        "--json",
        "b.json",
        "-q",
    ];
    let output = blinn_args(dir.path(), &bench);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("triangle") && table.contains("cube"), "{table}");
    fails(dir.path(), &["info", "@gone"], 2, "@gone: the list cannot be read");
}
