//! The library's pictures are those of the command line, byte for byte.

use std::fs;

use blinn::integrator::Aov;
use blinn::session::{AovSelection, Exposure, Notice};
use blinn::{Options, Request, Scene, Session};

use crate::common::program::{folder, model, runs};

#[test]
fn a_scene_renders_as_the_command_does() {
    let (_guard, folder) = folder();
    let sizes = Options { size: Some((48, 27)), ..Options::default() };
    let layers = AovSelection { aovs: vec![Aov::Depth, Aov::ObjectId], cryptomatte: true };
    for (scene, name, flags, options) in [
        ("still-life/still-life.glb", "a.png", "--size 48x27", sizes.clone()),
        ("cornell/cornell.obj", "b.jpg", "--size 48x27 -s 9", Options { samples: 9, ..sizes.clone() }),
        (
            "lecture/lecture.obj",
            "c.exr",
            "--size 48x27 --aov depth,object-id,cryptomatte --exposure 1",
            Options { aovs: layers.clone(), exposure: Some(Exposure::Stops(1.0)), ..sizes.clone() },
        ),
        (
            "assembly/assembly.glb",
            "d.png",
            "--size 48x27 --aov depth,object-id,cryptomatte",
            Options { aovs: layers, ..sizes.clone() },
        ),
    ] {
        let scene = model(scene);
        runs(&folder, &format!("render {scene} {flags} -o {name}"));
        let saved = folder.join("library").join(name);
        fs::create_dir_all(saved.parent().unwrap()).unwrap();
        let files = Scene::load(&scene).unwrap().render(&options).unwrap().save(&saved).unwrap();
        assert_eq!(files.len(), if name == "d.png" { 5 } else { 1 });
        for file in files {
            let command = fs::read(folder.join(file.file_name().unwrap())).unwrap();
            assert!(fs::read(&file).unwrap() == command, "{}", file.display());
        }
    }
}

#[test]
fn a_session_renders_any_time_and_camera() {
    let (_guard, folder) = folder();
    let path = model("figure/figure.glb");
    let options = Options { size: Some((32, 24)), samples: 1, ..Options::default() };
    let scene = Scene::load(&path).unwrap();
    let mut session = Session::new(&scene, &options).unwrap();
    // The order of times does not matter.
    for time in [0.5, 0.0, 0.25] {
        runs(&folder, &format!("render {path} --size 32x24 -s 1 --time {time} -o command.png"));
        let picture = session.image(&Request { time, ..Request::default() }).unwrap();
        assert_eq!(picture.notices, []);
        picture.save(folder.join("library.png")).unwrap();
        let read = |name: &str| fs::read(folder.join(name)).unwrap();
        assert!(read("command.png") == read("library.png"), "{time} s");
    }
    let away = blinn::scene::View {
        view_point: Some(glam::DVec3::splat(9.0)),
        view_dir: Some(glam::DVec3::ONE),
        ..Default::default()
    };
    let posed = blinn::scene::pose(&scene.data, &Default::default()).unwrap();
    let (camera, _) = away.resolve(&posed, 32, 24).unwrap();
    let picture = session.image(&Request { camera: Some(camera), time: 0.0 }).unwrap();
    let [Notice::EmptyImages(text)] = &picture.notices[..] else { panic!("{:?}", picture.notices) };
    assert!(text.contains("looks away") && text.contains("use `look-at` or `orbit`"), "{text}");
}

#[test]
fn options_that_do_not_suit_the_scene_are_errors() {
    let scene = Scene::load(model("tests/cube.obj")).unwrap();
    let error = |options: Options| scene.render(&options).err().unwrap().to_string();
    let hidden = blinn::scene::Selection {
        hide: vec![blinn::scene::Glob::new("none of it").unwrap()],
        ..Default::default()
    };
    assert!(error(Options { selection: hidden, ..Options::default() }).contains("no node or object"));
    let up = blinn::import::LoadOptions { up: Some(blinn::scene::UpAxis::Z), ..Default::default() };
    assert!(error(Options { load: up.clone(), ..Options::default() }).contains("load_with"));
    let options = Options { load: up.clone(), size: Some((8, 8)), ..Options::default() };
    assert!(Scene::load_with(model("tests/cube.obj"), &up).unwrap().render(&options).is_ok());
    assert!(Scene::load("no such file.glb").is_err());
    let picture = scene.render(&Options { size: Some((8, 8)), ..Options::default() }).unwrap();
    assert!(picture.save("picture.xyz").unwrap_err().to_string().contains("must end in .png"));
}
