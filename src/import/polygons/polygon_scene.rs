//! Scenes of polygon meshes.

use glam::{DAffine3, DVec3};

use super::polygon_mesh::{Part, PolygonMesh};
use super::used_vertices::UsedVertices;
use crate::error::{LoadError, Warnings};
use crate::finite_uvs::replace_nonfinite;
use crate::obj::TexturedMaterials;
use crate::options::LoadOptions;
use crate::unlit_rounds::show_unlit;
use blinn_scene::{AlphaMode, Instance, LocalTransform, Node, Scene, Source, SourceFormat};

/// A file of one polygon mesh.
pub(crate) struct PolygonFile {
    pub mesh: PolygonMesh,
    /// Origin that positions are relative to.
    pub origin: Option<DVec3>,
    pub format: SourceFormat,
    /// The program that wrote the file.
    pub generator: String,
    pub materials: TexturedMaterials,
}

/// Builds the scene. STL and PLY files have z up unless the options say otherwise.
pub(crate) fn build_scene(
    file: PolygonFile,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Scene, LoadError> {
    let PolygonFile { mut mesh, origin, format, generator, materials } = file;
    let TexturedMaterials { materials, images, textures } = materials;
    let root = options.root_transform(format);
    let local =
        LocalTransform::Matrix(DAffine3 { matrix3: root, translation: root * origin.unwrap_or_default() });
    let mut scene = Scene {
        source: Source { format, up: options.up_axis(format), generator, ..Default::default() },
        objects: std::mem::take(&mut mesh.objects),
        nodes: vec![Node { name: String::new(), local, visible: true, ..Default::default() }],
        materials,
        images,
        textures,
        ..Scene::default()
    };
    if scene.objects.is_empty() {
        scene.objects.push("default".into());
    }
    if format == SourceFormat::Ply && (mesh.faces > 0 || !mesh.edges.is_empty()) {
        let mut used = UsedVertices::new(mesh.positions.len());
        used.add(mesh.corners.iter().chain(mesh.edges.as_flattened()).copied());
        scene.source.loose_vertices = used.unused() as u64;
    }
    let lines = mesh.take_lines()?;
    let mut meshes = match (mesh.faces, &lines) {
        (0, None) => vec![(Part::default(), mesh.into_points())],
        (0, Some(_)) => Vec::new(),
        _ => mesh.into_meshes(&options.limits, &options.cancel, warnings)?,
    };
    meshes.extend(lines.map(|mesh| (Part::default(), mesh)));
    let mut nonfinite_uvs = 0;
    for (i, (part, mut mesh)) in meshes.into_iter().enumerate() {
        mesh.name = scene.objects[part.object as usize].clone();
        mesh.material = part.material;
        nonfinite_uvs += mesh.uvs.iter_mut().map(|uvs| replace_nonfinite(uvs)).sum::<usize>();
        if mesh.colors.iter().any(|color| color.w < 1.0) {
            scene.materials[part.material as usize].alpha_mode = AlphaMode::Blend;
        }
        scene.meshes.push(mesh);
        let object = part.object + 1;
        scene.instances.push(Instance { node: 0, mesh: i as u32, object, ..Instance::default() });
    }
    show_unlit(&mut scene);
    if nonfinite_uvs > 0 {
        warnings.add("", format!("{nonfinite_uvs} texture coordinates are not finite; used 0"));
    }
    Ok(scene)
}
