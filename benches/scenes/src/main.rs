//! Writes a generated scene: `blinn-scenes KIND TRIANGLES FILE.glb|FILE.obj [--textured]`.

use std::path::Path;
use std::process::ExitCode;

use blinn_scenes::{SceneKind, parse_triangle_count, write_glb, write_obj};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run(words: &[String]) -> Result<(), String> {
    let (kind, triangles, path, textured) = match words {
        [kind, triangles, path] => (kind, triangles, path, false),
        [kind, triangles, path, flag] if flag == "--textured" => (kind, triangles, path, true),
        _ => return Err("usage: blinn-scenes KIND TRIANGLES FILE.glb|FILE.obj [--textured]".into()),
    };
    let path = Path::new(path);
    let write = match path.extension().and_then(|e| e.to_str()) {
        Some("glb") => write_glb,
        Some("obj") if !textured => write_obj,
        Some("obj") => return Err("an OBJ is written without textures: name a .glb".into()),
        _ => return Err(format!("{}: name a .glb or an .obj", path.display())),
    };
    let mut scene = kind.parse::<SceneKind>()?.generate(parse_triangle_count(triangles)?);
    scene.textured = textured;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    write(&scene, path).map_err(|e| format!("{}: {e}", path.display()))?;
    println!(
        "{}: {} triangles stored, {} drawn",
        path.display(),
        scene.stored_triangles(),
        scene.drawn_triangles()
    );
    Ok(())
}
