//! Attaches the objects of the file to the scene's nodes: instances of meshes with their skins, cameras and
//! lights.

use std::collections::{HashMap, HashSet};

use super::document::Document;
use super::graph::SceneNode;
use super::instancing::InstanceAttributes;
use super::photometric_light::Profiles;
use super::{area_light, blinn_extras, instancing, light, node_light, skin};
use crate::error::{LoadError, Warnings};
use blinn_scene::{Instance, LightUnits, Scene};

/// The scene's cameras and lights for each index of the file: one for each node with it.
#[derive(Default)]
pub(super) struct AttachedIds {
    pub cameras: HashMap<usize, Vec<u32>>,
    pub lights: HashMap<usize, Vec<u32>>,
    pub area_lights: HashMap<usize, Vec<u32>>,
    /// The scene's photometric light for each node of the file with one.
    pub photometric_lights: HashMap<usize, u32>,
}

/// Attaches instances of meshes, cameras and lights to nodes.
pub(super) struct ObjectBuilder<'a, 'd> {
    doc: &'d Document<'a>,
    /// The scene's meshes for each mesh of the file.
    mesh_ids: HashMap<usize, Vec<u32>>,
    /// The scene's node for each node of the file.
    scene_nodes: &'d [Option<u32>],
    /// The scene's skin for each skin of the file that was read.
    skins: HashMap<usize, Option<u32>>,
    /// Pairs of a scene's skin and a mesh of the file whose joint indices were checked.
    checked_joints: HashSet<(u32, usize)>,
}

impl<'a, 'd> ObjectBuilder<'a, 'd> {
    pub fn new(
        doc: &'d Document<'a>,
        mesh_ids: HashMap<usize, Vec<u32>>,
        scene_nodes: &'d [Option<u32>],
    ) -> ObjectBuilder<'a, 'd> {
        let skins = HashMap::new();
        ObjectBuilder { doc, mesh_ids, scene_nodes, skins, checked_joints: HashSet::new() }
    }

    /// Attaches everything to `nodes`, which are the last nodes of the scene.
    pub fn attach_all(
        mut self,
        scene: &mut Scene,
        nodes: &[SceneNode],
        warnings: &mut Warnings,
    ) -> Result<AttachedIds, LoadError> {
        let root = self.doc.root();
        let mut attached = AttachedIds::default();
        let mut profiles = Profiles::default();
        let offset = (scene.nodes.len() - nodes.len()) as u32;
        let units = LightUnits::Auto.resolve(&scene.source);
        for (id, node) in (offset..).zip(nodes) {
            let json = &root.nodes[node.node];
            if node.is_drawn {
                self.attach_mesh(scene, node.node, id, warnings)?;
            }
            if let Some(index) = json.camera.map(|c| c.value())
                && let Some(camera) = light::camera(&root.cameras[index], index, id, warnings)
            {
                attached.cameras.entry(index).or_default().push(scene.cameras.len() as u32);
                let extras = json.extras.as_ref().map(|raw| raw.get());
                if blinn_extras::is_active_camera(extras, node.node, warnings) {
                    scene.settings.camera.get_or_insert(scene.cameras.len());
                }
                scene.cameras.push(camera);
            }
            if !node.is_drawn {
                continue;
            }
            // A light of KHR_lights_punctual at the same node stands for programs without profiles.
            let photometric = profiles.light(self.doc, node.node, id, warnings)?;
            let has_profile = photometric.is_some();
            if let Some(light) = photometric {
                attached.photometric_lights.insert(node.node, scene.lights.len() as u32);
                scene.lights.push(light);
            }
            let light = json.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
            let lights = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
            if let (Some(light), Some(lights)) = (light, lights)
                && !has_profile
                && let index = light.light.value()
                && let Some(json) = lights.lights.get(index)
                && let Some(light) = light::light(json, index, id, units, warnings)
            {
                attached.lights.entry(index).or_default().push(scene.lights.len() as u32);
                scene.lights.push(light);
            }
            if let Some(index) = node_light::index_of(json, area_light::NAME)
                && let Some(light) = area_light::read(root, index, node.node, id, warnings)
            {
                attached.area_lights.entry(index as usize).or_default().push(scene.area_lights.len() as u32);
                scene.area_lights.push(light);
            }
        }
        scene.light_profiles = profiles.read;
        Ok(attached)
    }

    /// Adds the instances of a node's mesh. `index` is the node in the file, `node` in the scene.
    fn attach_mesh(
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
        let instances = match instancing::count(self.doc, json) {
            Some(_) => {
                let instances = instancing::read(self.doc, index, warnings);
                self.doc.tolerate_truncation(instances, warnings)?.unwrap_or_default()
            }
            None => vec![InstanceAttributes::default()],
        };
        let meshes = self.mesh_ids.get(&mesh).map_or(&[][..], Vec::as_slice);
        if let Some(skin) = skin.filter(|&s| self.checked_joints.insert((s, mesh))) {
            let joints = scene.skins[skin as usize].joints.len();
            let max = |m: &u32| scene.meshes[*m as usize].influences.joints.iter().max().copied();
            let max = meshes.iter().filter_map(max).max().map_or(0, usize::from);
            if max >= joints {
                let message =
                    format!("the mesh refers to joint {max}, but the skin has only {joints} joints");
                warnings.add(format_args!("nodes[{index}].skin"), message);
            }
        }
        for InstanceAttributes { trs, color } in instances {
            let name = json.name.as_ref().or(self.doc.root().meshes[mesh].name.as_ref());
            scene.objects.push(name.cloned().unwrap_or_default());
            let object = scene.objects.len() as u32;
            let instance = |&mesh: &u32| Instance { node, mesh, object, trs, skin, color };
            scene.instances.extend(meshes.iter().map(instance));
        }
        Ok(())
    }

    /// Reads a skin on its first use.
    fn skin(
        &mut self,
        scene: &mut Scene,
        index: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<u32>, LoadError> {
        if let Some(known) = self.skins.get(&index) {
            return Ok(*known);
        }
        let skin = skin::read(self.doc, index, self.scene_nodes, warnings);
        let skin = self.doc.tolerate_truncation(skin, warnings)?.flatten();
        let id = skin.map(|skin| {
            scene.skins.push(skin);
            scene.skins.len() as u32 - 1
        });
        self.skins.insert(index, id);
        Ok(id)
    }
}
