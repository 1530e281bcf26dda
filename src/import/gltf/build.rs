//! The parts put together: the walk's nodes, what hangs at them, and what that refers to.

use std::collections::{HashMap, HashSet};

use ::gltf::json::Node as JsonNode;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::super::tangents;
use super::animation::{Places, animations, skin};
use super::document::Document;
use super::geometry;
use super::geometry::PrimitiveId;
use super::graph;
use super::graph::Placed;
use super::instancing::Drawn;
use super::texture::Textures;
use super::{blender, extensions, instancing, light, material, topology, variants};
use crate::import::error::{LoadError, Warnings};
use crate::import::{LoadOptions, UpAxis};
use crate::scene::{Instance, LocalTransform, Material, Mesh, Node, Scene, Source, SourceFormat, rotation};

/// Builds the scene that `options` ask for.
pub(super) fn scene(
    doc: &Document<'_>,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Scene, LoadError> {
    let root = doc.root();
    let roots = graph::roots(root, &options.scene, warnings)?;
    let placed = graph::expand(root, &roots, doc.limits.nodes, warnings)?;
    check_instances(doc, &placed)?;

    let variant = variants::choose(doc, options.variant.as_deref())?;
    let wanted = primitives(doc, &placed, warnings)?;
    let source = source(doc);
    let by_blender = source.is_blender();
    // Those that no material of Blender's uses are behind the ones that one does, or behind white ones.
    if !by_blender && wanted.iter().filter_map(|id| id.json(doc)).any(geometry::has_more_colors) {
        warnings.add("", "vertex colours beyond the first set (COLOR_1 and on) are not shown");
    }
    let ((meshes, mesh_warnings), surfaces) =
        rayon::join(|| read_meshes(doc, &wanted), || Surfaces::read(doc, &wanted, variant, by_blender));
    let (surfaces, surface_warnings) = surfaces?;
    extensions::warn(&doc.json, |material| surfaces.of_file.contains_key(&material), warnings);
    warnings.extend(mesh_warnings);
    warnings.extend(surface_warnings);

    let mut scene = Scene { source, ..Scene::default() };
    let mesh_ids = scene.add_meshes(meshes?, &wanted, &surfaces);
    scene.materials = surfaces.materials;
    scene.images = surfaces.textures.images;
    scene.textures = surfaces.textures.textures;
    scene.add_nodes(doc, &placed, options.up);
    let offset = scene.nodes.len() - placed.len();
    let mut copies: Vec<Vec<u32>> = vec![Vec::new(); root.nodes.len()];
    for (i, p) in placed.iter().enumerate() {
        copies[p.node].push((offset + i) as u32);
    }
    let mut instances =
        Instances { doc, mesh_ids, copies: &copies, skins: HashMap::new(), fitted: HashSet::new() };
    let (mut cameras, mut lit): (HashMap<usize, Vec<u32>>, HashMap<usize, Vec<u32>>) = Default::default();
    for (i, p) in placed.iter().enumerate() {
        let (id, json) = ((offset + i) as u32, &root.nodes[p.node]);
        instances.place(&mut scene, p.node, id, warnings)?;
        if let Some(index) = json.camera.map(|c| c.value())
            && let Some(camera) = light::camera(&root.cameras[index], index, id, warnings)
        {
            cameras.entry(index).or_default().push(scene.cameras.len() as u32);
            scene.cameras.push(camera);
        }
        let light = json.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let lights = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let (Some(light), Some(lights)) = (light, lights)
            && let index = light.light.value()
            && let Some(json) = lights.lights.get(index)
            && let Some(light) = light::light(json, index, id, warnings)
        {
            lit.entry(index).or_default().push(scene.lights.len() as u32);
            scene.lights.push(light);
        }
    }
    let places = Places { nodes: &copies, materials: &surfaces.of_file, lights: &lit, cameras: &cameras };
    scene.animations = animations(doc, &places, warnings)?;
    if scene.source.is_blender() {
        blender::restore(&mut scene);
    }
    scene.add_tangents();
    Ok(scene)
}

fn source(doc: &Document<'_>) -> Source {
    let root = doc.root();
    Source {
        format: SourceFormat::Gltf,
        generator: root.asset.generator.clone().unwrap_or_default(),
        extensions: root.extensions_used.clone(),
        scenes: graph::scene_names(root),
        variants: variants::names(doc),
        ..Source::default()
    }
}

/// Counts what would be drawn before any of it is made.
fn check_instances(doc: &Document<'_>, placed: &[Placed]) -> Result<(), LoadError> {
    let root = doc.root();
    let drawn = |p: &Placed| {
        let node = &root.nodes[p.node];
        let primitives = node.mesh.map_or(0, |m| root.meshes[m.value()].primitives.len() as u64);
        primitives.saturating_mul(instancing::count(doc, node).unwrap_or(1))
    };
    let total = placed.iter().fold(0u64, |sum, p| sum.saturating_add(drawn(p)));
    LoadError::check_limit("instances", total, doc.limits.instances)?;
    doc.budget.charge_nodes(placed.len() as u64, total)
}

/// The primitives to read, each once, in the order of the walk.
fn primitives(
    doc: &Document<'_>,
    placed: &[Placed],
    warnings: &mut Warnings,
) -> Result<Vec<PrimitiveId>, LoadError> {
    let root = doc.root();
    let mut seen = vec![false; root.meshes.len()];
    let (mut out, mut skipped) = (Vec::new(), 0usize);
    let (mut vertices, mut triangles) = (0u64, 0u64);
    for mesh in placed.iter().filter_map(|p| root.nodes[p.node].mesh).map(|m| m.value()) {
        if std::mem::replace(&mut seen[mesh], true) {
            continue;
        }
        for (primitive, json) in root.meshes[mesh].primitives.iter().enumerate() {
            if !topology::is_surface(geometry::mode(json)) {
                skipped += 1;
                continue;
            }
            let (v, t) = geometry::size(doc, json);
            vertices = vertices.saturating_add(v);
            triangles = triangles.saturating_add(t);
            out.push(PrimitiveId { mesh, primitive });
        }
    }
    if skipped > 0 {
        warnings.add("meshes", format_args!("{skipped} primitives of points or lines are not drawn"));
    }
    LoadError::check_limit("vertices", vertices, doc.limits.vertices)?;
    LoadError::check_limit("triangles", triangles, doc.limits.triangles)?;
    doc.budget.charge_meshes(vertices, triangles)?;
    Ok(out)
}

type Meshes = Result<Vec<Option<Mesh>>, LoadError>;

fn read_meshes(doc: &Document<'_>, wanted: &[PrimitiveId]) -> (Meshes, Warnings) {
    let read = |&id: &PrimitiveId| {
        let mut warnings = Warnings::default();
        (geometry::read(doc, id, &mut warnings), warnings)
    };
    let parts: Vec<_> = wanted.par_iter().map(read).collect();
    let mut all = Warnings::default();
    let mut meshes = Vec::with_capacity(parts.len());
    for (mesh, warnings) in parts {
        all.extend(warnings);
        meshes.push(mesh);
    }
    // The first error in the file's order, whichever thread met one first.
    (meshes.into_iter().collect(), all)
}

/// Materials in the order of their first use, and their textures.
struct Surfaces {
    materials: Vec<Material>,
    textures: Textures,
    of_primitive: HashMap<PrimitiveId, u32>,
    /// The scene's material for the file's.
    of_file: HashMap<usize, u32>,
}

impl Surfaces {
    /// The materials of what is wanted; `by_blender` where Blender's exporter wrote them.
    fn read(
        doc: &Document<'_>,
        wanted: &[PrimitiveId],
        variant: Option<usize>,
        by_blender: bool,
    ) -> Result<(Surfaces, Warnings), LoadError> {
        let mut warnings = Warnings::default();
        let mut order: Vec<Option<usize>> = Vec::new();
        let mut ids: HashMap<Option<usize>, u32> = HashMap::new();
        let mut of_primitive = HashMap::new();
        for id in wanted {
            let index = id.json(doc).and_then(|p| variants::material(p, variant));
            let number = *ids.entry(index).or_insert_with(|| {
                order.push(index);
                order.len() as u32 - 1
            });
            of_primitive.insert(*id, number);
        }
        let json = |index: &Option<usize>| index.and_then(|i| doc.root().materials.get(i));
        // Asked for all its textures, a material names them; then they are decoded; then it is read.
        let mut used: Vec<usize> = Vec::new();
        let mut seen = vec![false; doc.root().textures.len()];
        for material in order.iter().filter_map(json) {
            material::read(material, &mut |texture| {
                if seen.get_mut(texture).is_some_and(|s| !std::mem::replace(s, true)) {
                    used.push(texture);
                }
                None
            });
        }
        let textures = Textures::read(doc, &used, &mut warnings)?;
        let read = |index: &Option<usize>| match json(index) {
            Some(json) => {
                let mut material = material::read(json, &mut |texture| textures.get(texture));
                if by_blender {
                    blender::restore_shading(&mut material, json, &mut warnings);
                }
                material
            }
            None if by_blender => blender::bare(),
            None => material::default(),
        };
        let materials = order.iter().map(read).collect();
        let of_file = ids.into_iter().filter_map(|(index, id)| Some((index?, id))).collect();
        Ok((Surfaces { materials, textures, of_primitive, of_file }, warnings))
    }
}

impl Scene {
    /// Stores the meshes that there are, and says which scene meshes each of the file's meshes became.
    fn add_meshes(
        &mut self,
        meshes: Vec<Option<Mesh>>,
        wanted: &[PrimitiveId],
        surfaces: &Surfaces,
    ) -> HashMap<usize, Vec<u32>> {
        let mut ids: HashMap<usize, Vec<u32>> = HashMap::new();
        for (id, mesh) in wanted.iter().zip(meshes) {
            let list = ids.entry(id.mesh).or_default();
            if let Some(mut mesh) = mesh {
                mesh.material = surfaces.of_primitive[id];
                list.push(self.meshes.len() as u32);
                self.meshes.push(mesh);
            }
        }
        ids
    }

    /// Gives meshes tangents whose material needs them.
    fn add_tangents(&mut self) {
        let (materials, source) = (&self.materials, &self.source);
        self.meshes.par_iter_mut().for_each(|mesh| {
            if let Some(map) = &materials[mesh.material as usize].normal {
                tangents::generate(mesh, &map.texture, source);
            }
        });
    }

    /// The walk's nodes, below one more that turns the world where +Z is up in the file.
    fn add_nodes(&mut self, doc: &Document<'_>, placed: &[Placed], up: UpAxis) {
        if up == UpAxis::Z {
            let turn = DAffine3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y, DVec3::ZERO);
            self.nodes.push(Node { local: LocalTransform::Matrix(turn), visible: true, ..Node::default() });
        }
        let offset = self.nodes.len() as u32;
        let top = (up == UpAxis::Z).then_some(0);
        self.nodes.extend(placed.iter().map(|p| {
            let json = &doc.root().nodes[p.node];
            let others = json.extensions.as_ref().map(|e| &e.others);
            let visible = others.and_then(|o| o.get("KHR_node_visibility")).and_then(|v| v.get("visible"));
            Node {
                name: json.name.clone().unwrap_or_default(),
                parent: p.parent.map(|parent| parent + offset).or(top),
                local: local(json),
                weights: json.weights.clone().unwrap_or_default(),
                visible: visible.and_then(|v| v.as_bool()).unwrap_or(true),
            }
        }));
    }
}

fn local(json: &JsonNode) -> LocalTransform {
    if let Some(matrix) = &json.matrix {
        return LocalTransform::from_cols(&matrix.map(f64::from));
    }
    let vec = |v: Option<[f32; 3]>, or| v.map_or(or, |v| DVec3::from(v.map(f64::from)));
    LocalTransform::Trs {
        translation: vec(json.translation, DVec3::ZERO),
        rotation: rotation(json.rotation.unwrap_or_default().0),
        scale: vec(json.scale, DVec3::ONE),
    }
}

/// Hangs meshes at nodes.
struct Instances<'a, 'd> {
    doc: &'d Document<'a>,
    mesh_ids: HashMap<usize, Vec<u32>>,
    copies: &'d [Vec<u32>],
    /// The file's skins that were met, with their place in the scene.
    skins: HashMap<usize, Option<u32>>,
    /// Skins of the scene with meshes of the file whose joints were compared.
    fitted: HashSet<(u32, usize)>,
}

impl Instances<'_, '_> {
    fn place(
        &mut self,
        scene: &mut Scene,
        index: usize,
        node: u32,
        warnings: &mut Warnings,
    ) -> Result<(), LoadError> {
        let json = &self.doc.root().nodes[index];
        let Some(mesh) = json.mesh.map(|m| m.value()) else { return Ok(()) };
        let skin = match json.skin {
            Some(skin) => self.skin(scene, skin.value(), warnings)?,
            None => None,
        };
        let copies = match instancing::count(self.doc, json) {
            Some(_) => instancing::copies(self.doc, index, warnings)?,
            None => vec![Drawn::default()],
        };
        let meshes = self.mesh_ids.get(&mesh).map_or(&[][..], Vec::as_slice);
        if let Some(skin) = skin.filter(|&s| self.fitted.insert((s, mesh))) {
            let joints = scene.skins[skin as usize].joints.len();
            let most = |m: &u32| scene.meshes[*m as usize].influences.joints.iter().max().copied();
            let most = meshes.iter().filter_map(most).max().map_or(0, usize::from);
            if most >= joints {
                let what = format!("its mesh names joint {most}, and the skin has {joints}");
                warnings.add(format_args!("nodes[{index}].skin"), what);
            }
        }
        for Drawn { trs, color } in copies {
            let name = json.name.as_ref().or(self.doc.root().meshes[mesh].name.as_ref());
            scene.objects.push(name.cloned().unwrap_or_default());
            let object = scene.objects.len() as u32;
            let draw = |&mesh: &u32| Instance { node, mesh, object, trs, skin, color };
            scene.instances.extend(meshes.iter().map(draw));
        }
        Ok(())
    }

    fn skin(
        &mut self,
        scene: &mut Scene,
        index: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<u32>, LoadError> {
        if let Some(known) = self.skins.get(&index) {
            return Ok(*known);
        }
        let read = skin(self.doc, index, self.copies, warnings)?;
        let id = read.map(|skin| {
            scene.skins.push(skin);
            scene.skins.len() as u32 - 1
        });
        self.skins.insert(index, id);
        Ok(id)
    }
}
