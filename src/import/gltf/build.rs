//! Builds the scene from a glTF document: nodes, meshes, materials, instances, cameras, lights and
//! animations.

use std::collections::HashMap;

use ::gltf::json::Node as JsonNode;
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use super::super::tangents;
use super::animation::SceneIds;
use super::blinn_extras::SceneExtras;
use super::document::Document;
use super::graph::SceneNode;
use super::material_table::MaterialTable;
use super::objects::ObjectBuilder;
use super::primitive;
use super::primitive::PrimitiveId;
use super::{
    animation, blender, bump_nodes, coincident_meshes, extensions, forest, graph, image_based_light,
    instancing, levels_of_detail, light_temperature, lost_lights, round_primitive, sun_strengths, topology,
    variants,
};
use crate::error::{LoadError, Warnings};
use crate::options::LoadOptions;
use crate::unlit_rounds::show_unlit;
use blinn_scene::{LocalTransform, Mesh, Node, Scene, Source, SourceFormat, unit_quaternion};

/// Builds the scene that `options` select.
pub(super) fn scene(
    doc: &Document<'_>,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Scene, LoadError> {
    let root = doc.root();
    let roots = graph::roots(root, &options.scene, warnings)?;
    let mut nodes = forest::nodes(root, &roots, warnings);
    levels_of_detail::hide_coarser_levels(root, &mut nodes);
    LoadError::check_limit("nodes", nodes.len() as u64, doc.limits.nodes)?;
    graph::warn_of_empty_scene(root, &options.scene, &nodes, warnings);
    check_instances(doc, &nodes)?;

    let variant = variants::find(doc, options.variant.as_deref())?;
    let primitives = used_primitives(doc, &nodes)?;
    let source = source(doc, options);
    let is_blender = source.is_blender();
    // In Blender's files the further sets are either unused or follow a used set or white.
    if !is_blender && primitives.iter().filter_map(|id| id.json(doc)).any(primitive::has_more_colors) {
        warnings.add("", "ignored vertex colours beyond the first set (COLOR_1 and above)");
    }
    let ((meshes, mesh_warnings), materials) = rayon::join(
        || read_meshes(doc, &primitives),
        || MaterialTable::read(doc, &primitives, variant, &source),
    );
    let (materials, material_warnings) = materials?;
    let is_used = |material| materials.by_index.contains_key(&material);
    extensions::warn_unsupported(root, &doc.json.extensions, is_used, warnings);
    warnings.extend(mesh_warnings);
    warnings.extend(material_warnings);

    let selected = graph::selected_scene(root, &options.scene)?;
    let extras = SceneExtras::of(doc, selected, warnings);
    let source = Source { light_units: extras.light_units(warnings), ..source };
    let mut scene = Scene { source, settings: extras.settings(warnings), ..Scene::default() };
    let mesh_ids = add_meshes(&mut scene, meshes?, &primitives, &materials);
    let material_ids = materials.by_index;
    scene.materials = materials.materials;
    let copies = show_unlit(&mut scene);
    scene.images = materials.textures.images;
    scene.textures = materials.textures.textures;
    scene.environment = extras.world(doc, options.up.unwrap_or_default(), warnings)?;
    let mut image_based = None;
    if scene.environment.is_none() {
        scene.environment = image_based_light::read(doc, selected, options.up.unwrap_or_default(), warnings)?;
        image_based = selected.and_then(|scene| image_based_light::light_of(root, scene));
    }
    let scene_nodes = add_nodes(&mut scene, doc, &nodes, options.root_transform(SourceFormat::Gltf));
    let objects = ObjectBuilder::new(doc, mesh_ids, &scene_nodes);
    let attached = objects.attach_all(&mut scene, &nodes, warnings)?;
    let ids = SceneIds {
        nodes: &scene_nodes,
        materials: &material_ids,
        lights: &attached.lights,
        area_lights: &attached.area_lights,
        photometric_lights: &attached.photometric_lights,
        cameras: &attached.cameras,
        environment: image_based,
    };
    scene.animations = animation::read(doc, &ids, warnings)?;
    copies.animate(&mut scene.animations);
    if is_blender {
        blender::restore(&mut scene);
        let root_scale = libm::cbrt(options.root_transform(SourceFormat::Gltf).determinant().abs());
        bump_nodes::show(doc, &mut scene, root_scale, warnings)?;
        light_temperature::restore(&mut scene, warnings);
        let offset = (scene.nodes.len() - nodes.len()) as u32;
        scene.lost_lights = lost_lights::find(doc, &nodes, offset);
        sun_strengths::warn_of_lost(&scene, warnings);
        coincident_meshes::warn(&scene, warnings);
    }
    add_tangents(&mut scene, doc)?;
    Ok(scene)
}

fn source(doc: &Document<'_>, options: &LoadOptions) -> Source {
    let root = doc.root();
    Source {
        format: SourceFormat::Gltf,
        up: options.up_axis(SourceFormat::Gltf),
        generator: root.asset.generator.clone().unwrap_or_default(),
        extensions: root.extensions_used.clone(),
        scenes: graph::scene_names(root),
        variants: variants::names(doc),
        ..Source::default()
    }
}

/// Checks the number of nodes and instances before they are created.
fn check_instances(doc: &Document<'_>, nodes: &[SceneNode]) -> Result<(), LoadError> {
    let root = doc.root();
    let instances = |n: &SceneNode| {
        let node = &root.nodes[n.node];
        let primitives = n.mesh(root).map_or(0, |m| root.meshes[m].primitives.len() as u64);
        primitives.saturating_mul(instancing::count(doc, node).unwrap_or(1))
    };
    let total = nodes.iter().fold(0u64, |sum, n| sum.saturating_add(instances(n)));
    LoadError::check_limit("instances", total, doc.limits.instances)?;
    doc.budget.charge_nodes(nodes.len() as u64, total)
}

/// The primitives of all used meshes, each once, in the order of the nodes. Checks their size before they are
/// read.
fn used_primitives(doc: &Document<'_>, nodes: &[SceneNode]) -> Result<Vec<PrimitiveId>, LoadError> {
    let root = doc.root();
    let mut is_used = vec![false; root.meshes.len()];
    let mut out = Vec::new();
    let mut vertices = 0u64;
    let mut triangles = 0u64;
    let mut vertex_bytes = 0u64;
    let mut indices = 0u64;
    for mesh in nodes.iter().filter_map(|n| n.mesh(root)) {
        if std::mem::replace(&mut is_used[mesh], true) {
            continue;
        }
        for (index, json) in root.meshes[mesh].primitives.iter().enumerate() {
            let size = primitive::max_size(doc, json);
            vertices = vertices.saturating_add(size.vertices);
            triangles = triangles.saturating_add(size.triangles);
            let bytes = size.vertices.saturating_mul(primitive::vertex_bytes(doc, json));
            let lists = primitive::round_list_bytes(doc, json);
            vertex_bytes = vertex_bytes.saturating_add(bytes).saturating_add(lists);
            indices = indices.saturating_add(primitive::index_count(doc, json));
            out.push(PrimitiveId { mesh, primitive: index });
        }
    }
    LoadError::check_limit("vertices", vertices, doc.limits.vertices)?;
    LoadError::check_limit("triangles", triangles, doc.limits.triangles)?;
    doc.budget.charge_primitives(vertex_bytes, triangles, indices)?;
    Ok(out)
}

type Meshes = Result<Vec<Option<Mesh>>, LoadError>;

/// Reads the primitives in parallel. Incomplete primitives of a truncated file are left out, unless all are.
fn read_meshes(doc: &Document<'_>, primitives: &[PrimitiveId]) -> (Meshes, Warnings) {
    let read = |&id: &PrimitiveId| {
        let mut warnings = Warnings::default();
        let cancelled = doc.folder.cancel.check();
        let is_surface = id.json(doc).is_none_or(|json| topology::is_surface(primitive::mode(json)));
        let read = if is_surface { primitive::read } else { round_primitive::read };
        (cancelled.map_err(LoadError::from).and_then(|()| read(doc, id, &mut warnings)), warnings)
    };
    let results: Vec<_> = primitives.par_iter().map(read).collect();
    let has_triangles = results.iter().any(|(mesh, _)| matches!(mesh, Ok(Some(_))));
    let mut all = Warnings::default();
    let mut meshes = Vec::with_capacity(results.len());
    for (mesh, warnings) in results {
        all.extend(warnings);
        let is_optional = has_triangles && doc.is_truncated();
        meshes.push(if is_optional {
            doc.tolerate_truncation(mesh, &mut all).map(Option::flatten)
        } else {
            mesh
        });
    }
    if doc.is_truncated() && !has_triangles && !primitives.is_empty() {
        meshes
            .push(Err(LoadError::parse("GLB", "the file is truncated before the end of its first triangle")));
    }
    // Returns the first error in file order, whichever thread found one first.
    (meshes.into_iter().collect(), all)
}

/// Adds the meshes that have something to draw. Returns the scene's meshes for each mesh of the file.
fn add_meshes(
    scene: &mut Scene,
    meshes: Vec<Option<Mesh>>,
    primitives: &[PrimitiveId],
    materials: &MaterialTable,
) -> HashMap<usize, Vec<u32>> {
    let mut ids: HashMap<usize, Vec<u32>> = HashMap::new();
    for (primitive, mesh) in primitives.iter().zip(meshes) {
        let list = ids.entry(primitive.mesh).or_default();
        if let Some(mut mesh) = mesh {
            mesh.material = materials.by_primitive[primitive];
            list.push(scene.meshes.len() as u32);
            scene.meshes.push(mesh);
        }
    }
    ids
}

/// Generates tangents for meshes whose materials have normal maps.
fn add_tangents(scene: &mut Scene, doc: &Document<'_>) -> Result<(), LoadError> {
    let Scene { meshes, materials, source, .. } = scene;
    meshes.par_iter_mut().filter(|mesh| !mesh.has_rounds()).try_for_each(|mesh| {
        if let Some(axes) = materials[mesh.material as usize].tangent_axes() {
            doc.folder.cancel.check()?;
            doc.budget.charge_tangents(mesh)?;
            tangents::generate(mesh, axes, source);
        }
        Ok(())
    })
}

/// Adds the nodes, below a root with the transform `root` unless that is the identity. Returns the scene's node for each
/// node of the file.
fn add_nodes(scene: &mut Scene, doc: &Document<'_>, nodes: &[SceneNode], root: DMat3) -> Vec<Option<u32>> {
    let top = (root != DMat3::IDENTITY).then_some(0);
    if top.is_some() {
        let local = LocalTransform::Matrix(DAffine3::from_mat3(root));
        scene.nodes.push(Node { local, visible: true, ..Node::default() });
    }
    let offset = scene.nodes.len() as u32;
    let mut scene_nodes = vec![None; doc.root().nodes.len()];
    for (id, node) in (offset..).zip(nodes) {
        let json = &doc.root().nodes[node.node];
        let others = json.extensions.as_ref().map(|e| &e.others);
        let visible = others.and_then(|o| o.get("KHR_node_visibility")).and_then(|v| v.get("visible"));
        scene.nodes.push(Node {
            name: json.name.clone().unwrap_or_default(),
            parent: node.parent.map(|parent| parent + offset).or(top),
            local: local_transform(json),
            weights: json.weights.clone().unwrap_or_default(),
            visible: visible.and_then(|v| v.as_bool()).unwrap_or(true),
        });
        scene_nodes[node.node] = Some(id);
    }
    scene_nodes
}

fn local_transform(json: &JsonNode) -> LocalTransform {
    if let Some(matrix) = &json.matrix {
        return LocalTransform::from_cols(&matrix.map(f64::from));
    }
    let vec = |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
    LocalTransform::Trs {
        translation: vec(json.translation, DVec3::ZERO),
        rotation: unit_quaternion(json.rotation.unwrap_or_default().0),
        scale: vec(json.scale, DVec3::ONE),
    }
}
