//! References that lead out of a scene's folder: no file out there is read, however the reference is written
//! and wherever it stands.
//!
//! Outside lie canaries: valid buffers, images and material libraries, which show in the scene if they are
//! read.

use std::fs;
use std::path::PathBuf;

use blinn::import::{LoadError, LoadOptions, Warning, load};
use blinn::scene::Scene;

use crate::common::model_path;

/// The places of references.
const PLACES: [&str; 5] = ["buffer", "image", "mtllib", "map_Kd", "norm"];

/// The canary for each kind of reference: a valid file of that kind.
fn canary(place: &str) -> (&'static str, Vec<u8>) {
    match place {
        "buffer" => {
            ("canary.bin", [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat())
        }
        "mtllib" => ("canary.mtl", b"newmtl m\nKd .125 .25 .5\n".to_vec()),
        _ => ("canary.png", fs::read(model_path("tests/images/rgba.png")).unwrap()),
    }
}

/// A folder `outside/` with a canary, beside the folder `scene/`.
struct World {
    _dir: tempfile::TempDir,
    root: PathBuf,
    place: &'static str,
}

impl World {
    fn new(place: &'static str) -> World {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        fs::create_dir_all(root.join("scene/sub")).unwrap();
        fs::create_dir(root.join("outside")).unwrap();
        let (name, bytes) = canary(place);
        fs::write(root.join("outside").join(name), &bytes).unwrap();
        fs::write(root.join("scene").join(format!("own-{name}")), bytes).unwrap();
        World { _dir: dir, root, place }
    }

    fn canary(&self) -> PathBuf {
        self.root.join("outside").join(canary(self.place).0)
    }

    /// Loads a scene with `reference` at this place.
    fn load(&self, reference: &[u8], allow_outside: bool) -> Result<(Scene, Vec<Warning>), LoadError> {
        let at = |name: &str| self.root.join("scene").join(name);
        let json = |reference: &[u8]| serde_json::to_string(&String::from_utf8_lossy(reference)).unwrap();
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
        let scene = match self.place {
            "buffer" => {
                let text = format!(
                    r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
                    "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
                    "accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":3}}],
                    "bufferViews":[{{"buffer":0,"byteLength":36}}],
                    "buffers":[{{"byteLength":36,"uri":{}}}]}}"#,
                    json(reference)
                );
                fs::write(at("a.gltf"), text).unwrap();
                at("a.gltf")
            }
            "image" => {
                let text = format!(
                    r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
                    "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
                    "accessors":[{{"componentType":5126,"type":"VEC3","count":3}}],
                    "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
                    "textures":[{{"source":0}}],"images":[{{"uri":{}}}]}}"#,
                    json(reference)
                );
                fs::write(at("a.gltf"), text).unwrap();
                at("a.gltf")
            }
            "mtllib" => {
                let text = [b"mtllib ", reference, b"\nusemtl m\n", triangle.as_bytes(), b"f 1/1 2/1 3/1\n"];
                fs::write(at("a.obj"), text.concat()).unwrap();
                at("a.obj")
            }
            map => {
                let mtl = [b"newmtl m\n", map.as_bytes(), b" ", reference, b"\n"];
                fs::write(at("a.mtl"), mtl.concat()).unwrap();
                fs::write(at("a.obj"), format!("mtllib a.mtl\nusemtl m\n{triangle}f 1/1/1 2/1/1 3/1/1\n"))
                    .unwrap();
                at("a.obj")
            }
        };
        load(&scene, &LoadOptions { allow_outside, ..LoadOptions::default() })
    }

    /// Returns true if the canary is in the loaded scene.
    fn shows(&self, scene: &Scene) -> bool {
        match self.place {
            "buffer" => scene.meshes[0].positions.len() == 3,
            "mtllib" => scene.materials[0].base_color.factor.y == 0.25,
            _ => !scene.images.is_empty(),
        }
    }

    /// Each kind of path that leads out, by name.
    fn ways(&self) -> Vec<(&'static str, Vec<u8>)> {
        let path = self.canary();
        let (path, name) = (path.to_str().unwrap(), canary(self.place).0);
        let encoded: String = format!("../outside/{name}").bytes().map(|b| format!("%{b:02X}")).collect();
        let text = [
            ("..", format!("../outside/{name}")),
            (".. further down", format!("sub/../../outside/{name}")),
            (".. after what is not there", format!("missing/../../outside/{name}")),
            (".. far up", format!("{}{}", "../".repeat(40), &path[1..])),
            ("./..", format!("./.././outside/{name}")),
            ("..//", format!("..//outside//{name}")),
            ("backslashes", format!("..\\outside\\{name}")),
            ("mixed slashes", format!("sub\\../..\\outside/{name}")),
            ("%2e%2e", format!("%2e%2e/outside/{name}")),
            ("%2f", format!("..%2foutside%2f{name}")),
            ("%5c", format!("..%5coutside%5c{name}")),
            ("all of it percent-encoded", encoded),
            ("percent-encoded twice", format!("%252e%252e/outside/{name}")),
            ("overlong UTF-8", format!("%c0%ae%c0%ae/outside/{name}")),
            ("absolute", path.to_string()),
            ("absolute with more slashes", format!("//{path}")),
            ("file:", format!("file:{path}")),
            ("file://", format!("file://{path}")),
            ("FILE://localhost", format!("FILE://localhost{path}")),
            ("http:", format!("http://127.0.0.1:9/{name}")),
            ("a host without a scheme", format!("//127.0.0.1{path}")),
            ("UNC", format!("\\\\127.0.0.1\\outside\\{name}")),
            ("a drive", format!("C:\\outside\\{name}")),
            ("a drive's current folder", format!("C:{name}")),
            ("Windows's verbatim path", format!("\\\\?\\{path}")),
            ("home", format!("~/{name}")),
            ("the shell's", format!("$PWD/../outside/{name}")),
            ("NUL at the end", format!("../outside/{name}\0.png")),
            ("NUL percent-encoded", format!("own-{name}%00/../../outside/{name}")),
            ("the folder itself", ".".into()),
            ("the folder above", "..".into()),
            ("a symbolic link", "link".into()),
            ("a folder that is a symbolic link", format!("linked/{name}")),
            ("a symbolic link to a link", "link-to-link".into()),
            ("a pipe", "pipe".into()),
            ("a device", "/dev/zero".into()),
            ("a device by a link", "zero".into()),
            ("/proc", "/proc/self/environ".into()),
            ("/proc by a link", "environ".into()),
            ("/proc's way back", format!("/proc/self/root{path}")),
            ("a longer name than any", format!("{}../outside/{name}", "x/../".repeat(2000))),
            ("nothing", String::new()),
        ];
        let mut ways: Vec<_> = text.into_iter().map(|(way, text)| (way, text.into_bytes())).collect();
        ways.push(("bytes that are no UTF-8", [b"../outside/\xff\xfe/../", name.as_bytes()].concat()));
        ways
    }

    fn links(&self) {
        use std::os::unix::fs::symlink;
        let at = |name: &str| self.root.join("scene").join(name);
        symlink(self.canary(), at("link")).unwrap();
        symlink(at("link"), at("link-to-link")).unwrap();
        symlink(self.root.join("outside"), at("linked")).unwrap();
        symlink("/dev/zero", at("zero")).unwrap();
        symlink("/proc/self/environ", at("environ")).unwrap();
        let made = std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap();
        assert!(made.success());
    }
}

#[cfg(unix)]
#[test]
fn nothing_outside_is_read_and_it_is_said() {
    for place in PLACES {
        let world = World::new(place);
        world.links();
        let ways = world.ways();
        assert!(ways.len() >= 16);
        for (way, reference) in ways {
            match world.load(&reference, false) {
                Ok((scene, warnings)) => {
                    assert!(!world.shows(&scene), "{place}, {way}: the canary was read");
                    assert!(!warnings.is_empty(), "{place}, {way}: no warning");
                }
                Err(e) => assert!(place == "buffer", "{place}, {way}: {e}"),
            }
        }
    }
}

/// The same references are accepted inside the folder, or with `allow_outside`. Without this, the test above
/// could pass for other reasons.
#[cfg(unix)]
#[test]
fn canaries_show_in_the_scene_if_they_are_read() {
    for place in PLACES {
        let world = World::new(place);
        world.links();
        let name = canary(place).0;
        let (inside, _) = world.load(format!("own-{name}").as_bytes(), false).unwrap();
        assert!(world.shows(&inside), "{place}");
        let back = world.root.file_name().unwrap().to_str().unwrap();
        for way in [
            format!("../outside/{name}"),
            world.canary().to_str().unwrap().to_string(),
            "link".to_string(),
            format!("../../{back}/outside/{name}"),
        ] {
            let (outside, _) = world.load(way.as_bytes(), true).unwrap();
            assert!(world.shows(&outside), "{place}, {way}");
        }
    }
}
