//! Writes generated scenes as OBJ and MTL.

use std::fs::File;
use std::io::{BufWriter, Result, Write};
use std::path::Path;

use super::scene::GeneratedScene;

/// Writes a scene as OBJ with a copy of the mesh for each instance, and its colours to an MTL beside it. OBJ has no
/// cameras or lights.
///
/// # Errors
/// Errors of the file system.
pub fn write_obj(scene: &GeneratedScene, path: &Path) -> Result<()> {
    let materials = path.with_extension("mtl");
    let mut mtl = BufWriter::new(File::create(&materials)?);
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let [r, g, b] = mesh.color;
        writeln!(mtl, "newmtl {}{i}\nKd {r} {g} {b}\nKs 0.2 0.2 0.2\nNs 40\nillum 2\n", mesh.name)?;
    }
    mtl.flush()?;
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    writeln!(out, "# {} of {} triangles", scene.name, scene.drawn_triangles())?;
    if let Some(name) = materials.file_name() {
        writeln!(out, "mtllib {}", name.to_string_lossy())?;
    }
    // Indices count from 1.
    let mut first_position = 1;
    let mut first_normal = 1;
    for (i, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh];
        writeln!(out, "o {}.{i}\nusemtl {}{}", mesh.name, mesh.name, instance.mesh)?;
        for &p in &mesh.positions {
            let [x, y, z] = instance.transform_point(p);
            writeln!(out, "v {x:.6} {y:.6} {z:.6}")?;
        }
        for &n in &mesh.normals {
            let [x, y, z] = instance.transform_normal(n);
            writeln!(out, "vn {x:.4} {y:.4} {z:.4}")?;
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|k| k as usize + first_position);
            if mesh.normals.is_empty() {
                writeln!(out, "f {a} {b} {c}")?;
            } else {
                let [p, q, r] = t.map(|k| k as usize + first_normal);
                writeln!(out, "f {a}//{p} {b}//{q} {c}//{r}")?;
            }
        }
        first_position += mesh.positions.len();
        first_normal += mesh.normals.len();
    }
    out.flush()
}
