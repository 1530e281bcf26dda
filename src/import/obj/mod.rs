//! The Wavefront OBJ and MTL importer.
//!
//! Two parsers turn text into [chunks](chunk) of numbers, faces and statements: a [fast](fast_parser) one for
//! well-formed text, and a [lenient](lenient_parser) one for everything else, which also reports what is wrong.
//! Everything after that is shared: [polygon triangulation](polygon), [smoothing groups](smoothing),
//! [vertex welding](welding), [meshes], [material libraries](material_libraries) and [textures].

mod chunk;
mod colors;
mod decimal_comma;
mod digits;
mod fast_parser;
mod float;
mod geometry;
mod import_size;
mod lenient_parser;
mod line_chunks;
mod material;
mod material_libraries;
mod meshes;
mod mtl;
mod mtl_opacity;
mod mtl_writer;
mod number;
mod plain_text;
mod recenter;
mod rounds;
mod segment;
mod smoothing;
mod text;
mod texture_files;
mod texture_map;
mod textured_materials;
mod textures;
mod used_materials;
mod vertex_numbering;
mod welding;

use std::io::{self, Read};

use glam::{DAffine3, DMat3, DVec3};

use super::error::{LoadError, Warning, Warnings};
use super::finite_uvs::replace_nonfinite;
use super::memory::MemoryBudget;
use super::smooth;
use super::{Limits, LoadOptions, NormalMode};
use crate::files::{escape::printable, scene_folder::SceneFolder, scene_input::SceneInput};
use crate::polygons::far_centre::far_centre;
use crate::polygons::used_vertices::UsedVertices;
use crate::unlit_rounds::show_unlit;
use blinn_core::cancellation::CancelToken;
use blinn_scene::{
    BlenderVersion, FileDigest, HashingReader, Instance, LocalTransform, Mesh, Node, Scene, Source,
    SourceFormat,
};
use fast_parser::ParsedChunks;
use geometry::ObjGeometry;
use line_chunks::CHUNK_BYTES;
use material_libraries::MaterialLibraries;
use meshes::MeshKey;
use mtl::MtlContext;
use rounds::RoundGroup;
use textures::TextureLibrary;
use used_materials::{UsedMaterials, color_of_name};

pub(super) use colors::to_linear as displayed_to_linear;
pub(super) use textured_materials::{TexturedMaterials, textured_materials};

/// Version of Blender from which on the exporter winds the faces of mirrored objects as their normals point.
const CONSISTENT_NORMALS: BlenderVersion = BlenderVersion::new(3, 1);

/// Loads an OBJ file with its MTL files and textures.
pub(super) fn load(
    input: SceneInput,
    folder: &SceneFolder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let limits = &options.limits;
    let budget = MemoryBudget::of_import(options);
    let mut file = parse_file(input, folder, limits, &budget, None)?;
    if let Some(centre) = far_centre(file.geometry.corners()) {
        // Free the first result before the second is parsed.
        drop(file);
        file = parse_file(input, folder, limits, &MemoryBudget::of_import(options), Some(centre))?;
    }
    build_scene(file, folder, options, &budget)
}

/// A parsed OBJ file, without materials.
struct ParsedFile {
    geometry: ObjGeometry,
    /// Origin that positions are relative to, if it is not that of the file.
    origin: Option<DVec3>,
    generator: String,
    warnings: Warnings,
}

/// Parses a file with the fast parser, or else with the lenient one.
fn parse_file(
    input: SceneInput,
    folder: &SceneFolder,
    limits: &Limits,
    budget: &MemoryBudget,
    origin: Option<DVec3>,
) -> Result<ParsedFile, LoadError> {
    let (file, bytes) = input.open(limits.file_bytes)?;
    // Text from an archive stays in memory beside the lists.
    if let SceneInput::Memory(text) = input {
        budget.charge(text.len() as u64)?;
    }
    let reserved = budget.charge_obj(bytes)?;
    let cancel = &folder.cancel;
    let mut file = HashingReader::new(CancellableReader { file, cancel });
    if let Some(parsed) = fast_parser::parse(&mut file, CHUNK_BYTES, limits, origin) {
        budget.charge(parsed.size.peak_bytes().saturating_sub(reserved))?;
        if let Some(parsed) = assemble(parsed, origin) {
            folder.sources.record_scene(file.digest());
            return Ok(parsed);
        }
    }
    cancel.check()?;
    budget.charge_obj_lenient(bytes)?;
    let bytes = input.read(limits.file_bytes)?;
    folder.sources.record_scene(FileDigest::of(&bytes));
    parse_lenient(&bytes, limits, origin, cancel)
}

/// A reader that fails once the import is cancelled.
struct CancellableReader<'c, R> {
    file: R,
    cancel: &'c CancelToken,
}

impl<R: Read> Read for CancellableReader<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.cancel.check().map_err(io::Error::other)?;
        self.file.read(buffer)
    }
}

/// Assembles what the fast parser returns. Returns `None` if the lenient parser is needed.
fn assemble(parsed: ParsedChunks, origin: Option<DVec3>) -> Option<ParsedFile> {
    let ParsedChunks { chunks, head, .. } = parsed;
    let generator = generator(&text::decode(&head).0);
    let geometry = ObjGeometry::assemble(chunks, objects_reset_materials(&generator))?;
    Some(ParsedFile { geometry, origin, generator, warnings: Warnings::default() })
}

/// Parses any text and collects warnings.
fn parse_lenient(
    bytes: &[u8],
    limits: &Limits,
    origin: Option<DVec3>,
    cancel: &CancelToken,
) -> Result<ParsedFile, LoadError> {
    let mut warnings = Warnings::default();
    let (text, guessed) = text::decode(bytes);
    if guessed {
        warnings.add("", "decoded lines that are not UTF-8 as Windows-1252");
    }
    let chunk = lenient_parser::parse(&text, limits, origin, cancel, &mut warnings)?;
    let generator = generator(&text);
    // The parser has checked every index, so this does not fail.
    let geometry = ObjGeometry::assemble(vec![chunk], objects_reset_materials(&generator));
    let geometry = geometry.ok_or_else(|| LoadError::invalid("OBJ", "a face index is out of range"))?;
    Ok(ParsedFile { geometry, origin, generator, warnings })
}

/// Returns true if the first bytes of a file have a statement of OBJ, or comments alone.
pub(super) fn may_be_obj(head: &[u8]) -> bool {
    let (text, _) = text::decode(head);
    let mut keywords = text::logical_lines(&text).map(|line| {
        let (keyword, _) = text::split_keyword(&line.text);
        keyword.to_ascii_lowercase()
    });
    let is_known = |keyword: String| {
        let common = ["v", "vt", "vn", "f", "fo", "l", "p", "o", "g", "s", "usemtl", "mtllib"];
        common.contains(&keyword.as_str()) || text::is_free_form(&keyword) || text::is_ignored(&keyword)
    };
    match keywords.next() {
        None => true,
        Some(first) => is_known(first) || keywords.any(is_known),
    }
}

/// Returns the error for a file without faces, lines and points, which may not be an OBJ at all.
fn no_faces_error(geometry: &ObjGeometry, warnings: Warnings) -> LoadError {
    if geometry.positions.is_empty() {
        return LoadError::invalid(
            "OBJ",
            "the file has no vertices and no faces; use a .gltf, .glb, .obj, .stl or .ply file",
        );
    }
    let message = format!("the file has no faces, lines or points to render{}", warnings.into_ending());
    LoadError::invalid("OBJ", message)
}

/// Builds the scene from a parsed file and its materials.
fn build_scene(
    file: ParsedFile,
    folder: &SceneFolder,
    options: &LoadOptions,
    budget: &MemoryBudget,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let ParsedFile { mut geometry, origin, generator, mut warnings } = file;
    warn_about_faces(&geometry, &mut warnings);
    if geometry.segments.is_empty() && geometry.rounds.groups.is_empty() {
        return Err(no_faces_error(&geometry, warnings));
    }
    let has_colors = colors::has_colors(&geometry.colors);
    colors::to_linear(&mut geometry.colors, &mut warnings);
    let names = std::mem::take(&mut geometry.materials);
    let is_defined = |name: &&String| color_of_name(name, &generator).is_none();
    let defined: Vec<String> = names.iter().filter(is_defined).cloned().collect();
    let libraries = MaterialLibraries::read(
        &geometry.libraries,
        &defined,
        folder,
        &options.limits,
        MtlContext { generator: &generator, colors: options.mtl_colors },
        &mut warnings,
    );
    let mut materials = UsedMaterials::new(names, &libraries);
    let mut images =
        TextureLibrary::load(&materials.defined(), folder, &options.limits, budget, &mut warnings)?;

    let mut scene = Scene {
        source: Source {
            format: SourceFormat::Obj,
            up: options.up_axis(SourceFormat::Obj),
            generator,
            ..Default::default()
        },
        objects: geometry.objects.clone(),
        ..Default::default()
    };
    let local = LocalTransform::Matrix(to_world(options.root_transform(SourceFormat::Obj), origin));
    scene.nodes.push(Node { name: String::new(), local, visible: true, ..Default::default() });
    options.cancel.check()?;
    let smooths_all =
        options.normals == NormalMode::Auto && smooths_everything(&geometry, &scene.source.generator);
    let mut used_vertices = UsedVertices::new(geometry.positions.len());
    let rounds = round_meshes(&mut geometry, &options.limits, &mut used_vertices)?;
    let mut meshes = meshes::build_meshes(geometry, &options.limits, &mut used_vertices)?;
    scene.source.loose_vertices = used_vertices.unused() as u64;
    meshes.extend(rounds);
    let keeps_normal_side = scene.source.blender_version() >= Some(CONSISTENT_NORMALS);
    let mut black = 0;
    let mut nonfinite_uvs = 0;
    for (i, (key, mut mesh)) in meshes.into_iter().enumerate() {
        options.cancel.check()?;
        let Scene { source, materials: built, .. } = &mut scene;
        mesh.material = materials.index(key.material, &source.generator, &mut images, built, &mut warnings);
        if materials.mtl(key.material).is_some_and(|m| m.writer.is_blender()) && !mesh.colors.is_empty() {
            // Blender exports colours that its materials do not use.
            mesh.colors = Vec::new();
            warnings.add("", "ignored vertex colours: Blender's materials do not use them");
        }
        mesh.keeps_normal_side = keeps_normal_side;
        nonfinite_uvs += mesh.uvs.iter_mut().map(|uvs| replace_nonfinite(uvs)).sum::<usize>();
        black += u64::from(has_colors && colors::remove_black(&mut mesh));
        if let Some(axes) = scene.materials[mesh.material as usize].tangent_axes()
            && !mesh.has_rounds()
        {
            // A normal map applies to flat faces too.
            budget.charge_tangents(&mesh)?;
            super::tangents::generate(&mut mesh, axes, &scene.source);
        }
        let (mesh_id, object) = (i as u32, key.object + 1);
        scene.instances.push(Instance { node: 0, mesh: mesh_id, object, ..Instance::default() });
        scene.meshes.push(mesh);
    }
    if nonfinite_uvs > 0 {
        warnings.add("", format!("{nonfinite_uvs} texture coordinates are not finite; used 0"));
    }
    if black > 0 {
        let what = "they are all 0 0 0 while other meshes have colours";
        warnings.add("", format!("ignored the vertex colours of {black} meshes: {what}"));
    }
    show_unlit(&mut scene);
    (scene.images, scene.textures) = (images.images, images.textures);
    if smooths_all {
        MemoryBudget::charge_normals(options, &scene)?;
        smooth::apply(&mut scene, NormalMode::CreaseAngle(CREASE_ANGLE), &options.cancel)?;
    }
    Ok((scene, warnings.into_vec()))
}

/// Returns the meshes of points and lines, and adds their vertices to `used`.
fn round_meshes(
    geometry: &mut ObjGeometry,
    limits: &Limits,
    used: &mut UsedVertices,
) -> Result<Vec<(MeshKey, Mesh)>, LoadError> {
    let groups = std::mem::take(&mut geometry.rounds.groups);
    let vertices = groups.iter().map(|group| group.vertices.len() as u64).sum();
    LoadError::check_limit("vertices", vertices, limits.vertices)?;
    LoadError::check_limit("instances", groups.len() as u64, limits.instances)?;
    let mut mesh = |group: RoundGroup| {
        used.add(group.vertices.iter().copied());
        let key = MeshKey::of_rounds(group.object, group.material);
        let name = &geometry.objects[group.object as usize];
        let mut mesh = group.into_mesh(name, &geometry.positions, &geometry.colors);
        if geometry.is_cloud && geometry.normals.len() == geometry.positions.len() {
            mesh.normals = std::mem::take(&mut geometry.normals);
            mesh.normals.iter_mut().for_each(|n| *n = n.as_dvec3().normalize_or_zero().as_vec3());
        }
        (key, mesh)
    };
    Ok(groups.into_iter().map(&mut mesh).collect())
}

/// Returns true for the program whose objects without a material have no `usemtl`. By the format's definition they would
/// have that of the object before.
fn objects_reset_materials(generator: &str) -> bool {
    generator.contains("mikedh/trimesh")
}

/// Programs that write `s 1` for everything, flat walls too.
const SMOOTHING_PROGRAMS: [&str; 2] = ["IfcOpenShell", "OpenCTM"];
/// Angle in degrees above which edges of their surfaces are sharp.
const CREASE_ANGLE: f64 = 30.0;

/// Returns true if smoothing groups, which a program writes for everything, are the only source of normals.
fn smooths_everything(geometry: &ObjGeometry, generator: &str) -> bool {
    SMOOTHING_PROGRAMS.iter().any(|program| generator.contains(program))
        && geometry.segments.iter().any(|segment| segment.key.smoothing != 0)
        && geometry.segments.iter().all(|segment| !segment.key.format.normal)
}

/// Warns about geometry that is ignored or triangulated as fans.
fn warn_about_faces(geometry: &ObjGeometry, warnings: &mut Warnings) {
    let mut warn = |count: u64, message: &str| {
        if count > 0 {
            warnings.add("", message.replace("{}", &count.to_string()));
        }
    };
    warn(geometry.degenerate, "ignored {} faces with fewer than three vertices");
    warn(geometry.too_large, "triangulated {} concave polygons as fans: too many corners");
    warn(geometry.self_intersecting, "triangulated {} self-intersecting polygons as fans: too many corners");
}

/// Returns the transform from coordinates relative to `origin` to the world; `root` is that of the file's coordinates.
fn to_world(root: DMat3, origin: Option<DVec3>) -> DAffine3 {
    DAffine3 { matrix3: root, translation: root * origin.unwrap_or_default() }
}

/// Returns the first comment with a word, in which exporters name themselves: some draw lines of `#` around it.
fn generator(text: &str) -> String {
    let lines = text.trim_start_matches('\u{feff}').split(['\n', '\r']).map(str::trim);
    let mut comments = lines.filter(|line| !line.is_empty()).map_while(|line| line.strip_prefix('#'));
    let first = comments.find(|comment| comment.contains(char::is_alphanumeric));
    first.map(|comment| printable(comment.trim_matches(['#', ' ', '\t']))).unwrap_or_default()
}

#[cfg(test)]
mod tests;
