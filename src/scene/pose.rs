//! A scene at one moment: where every node is, how every mesh is bent, where the lights stand.
//!
//! Transforms are f64. One centre is subtracted from everything, so that f32 has its precision
//! where the scene is, however far from the origin a node placed it.

use std::borrow::Cow;
use std::sync::OnceLock;

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};

use super::clip::OverClip;
use super::{
    Animation, FileCamera, Light, LightUnits, Local, Material, Mesh, PosedLight, Scene, Skin, Target,
};
use crate::geometry::{Aabb, HitId, Transform, cofactor};

/// Which animations play.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AnimationChoice {
    /// All where they drive different things (as Blender writes one for each object), else the
    /// first.
    #[default]
    Default,
    /// All; where two drive the same thing the later wins.
    All,
    /// One, by index.
    One(usize),
    /// None: the rest pose as the file stores it.
    Rest,
}

/// The moment, and which animations count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseSettings {
    /// Seconds.
    pub time: f64,
    /// Which animations play.
    pub animation: AnimationChoice,
    /// Subtracted from everything; `None` takes the middle of the posed bounds. A job of many
    /// frames takes the first frame's for all.
    pub centre: Option<DVec3>,
}

/// Why a scene cannot be posed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// There is no animation of that number.
    #[error("no animation {0}: the file has {1}")]
    NoAnimation(usize, usize),
}

/// A mesh bent by a skin or by morph targets.
#[derive(Clone, Debug, Default)]
pub struct Deformed {
    /// Replaces the mesh's positions.
    pub positions: Vec<Vec3>,
    /// Replaces its normals; empty where the mesh has none.
    pub normals: Vec<Vec3>,
    /// Replaces its tangents; empty where the mesh has none.
    pub tangents: Vec<Vec4>,
}

/// An instance in its place.
#[derive(Clone, Debug)]
pub struct PosedInstance {
    /// Local (or deformed) to world, relative to the centre.
    pub transform: Transform,
    /// Index into [`PosedScene::deformed`].
    pub deformed: Option<u32>,
    /// False where it, or a node above it, is hidden.
    pub visible: bool,
}

/// A scene at one moment. Instances are parallel to the scene's.
#[derive(Clone, Debug)]
pub struct PosedScene<'s> {
    /// What is posed.
    pub scene: &'s Scene,
    /// The scene's materials at this moment.
    pub materials: Cow<'s, [Material]>,
    /// The scene's cameras at this moment.
    pub cameras: Cow<'s, [FileCamera]>,
    lights: Cow<'s, [Light]>,
    /// Subtracted from every world position.
    pub centre: DVec3,
    /// Where each instance is.
    pub instances: Vec<PosedInstance>,
    /// Bent meshes.
    pub deformed: Vec<Deformed>,
    /// Node to world, not relative to the centre.
    node_to_world: Vec<DAffine3>,
    visible: Vec<bool>,
    animation: AnimationChoice,
    /// Of all that is visible, relative to the centre.
    pub(super) bounds: Aabb,
    /// What the whole clip takes up, once it was asked for.
    pub(super) over_clip: OnceLock<OverClip>,
}

/// Poses `scene`.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn pose<'s>(scene: &'s Scene, at: &PoseSettings) -> Result<PosedScene<'s>, PoseError> {
    let moving = playing(scene, &at.animation)?;
    let mut locals: Vec<Cow<'_, Local>> = scene.nodes.iter().map(|n| Cow::Borrowed(&n.local)).collect();
    let mut weights: Vec<Cow<'_, [f32]>> =
        scene.nodes.iter().map(|n| Cow::Borrowed(&n.weights[..])).collect();
    let mut shown: Vec<bool> = scene.nodes.iter().map(|n| n.visible).collect();
    let mut materials = Cow::Borrowed(&scene.materials[..]);
    let mut lights = Cow::Borrowed(&scene.lights[..]);
    let mut cameras = Cow::Borrowed(&scene.cameras[..]);
    for channel in moving.iter().flat_map(|a| &a.channels) {
        let keys = &channel.keys;
        match channel.target {
            Target::Translation(n) => *trs(&mut locals[n as usize]).0 = keys.sample_vec3(at.time),
            Target::Rotation(n) => *trs(&mut locals[n as usize]).1 = keys.sample_rotation(at.time),
            Target::Scale(n) => *trs(&mut locals[n as usize]).2 = keys.sample_vec3(at.time),
            Target::Weights(n) => {
                weights[n as usize] = keys.sample(at.time).iter().map(|&w| w as f32).collect();
            }
            Target::Weight(n, k) => {
                let own = weights[n as usize].to_mut();
                if own.is_empty() {
                    *own = scene.default_weights(n);
                }
                if let Some(w) = own.get_mut(k as usize) {
                    *w = keys.sample(at.time)[0] as f32;
                }
            }
            Target::Visibility(n) => shown[n as usize] = keys.sample(at.time)[0] > 0.5,
            Target::Material(i, field) => {
                materials.to_mut()[i as usize].drive(field, &keys.sample(at.time));
            }
            Target::Light(i, field) => lights.to_mut()[i as usize].drive(field, &keys.sample(at.time)),
            Target::Camera(i, field) => {
                cameras.to_mut()[i as usize].drive(field, keys.sample(at.time)[0]);
            }
        }
    }
    // Parents stand before their children, so one pass does it however deep the graph is.
    let mut node_to_world: Vec<DAffine3> = Vec::with_capacity(scene.nodes.len());
    for (node, local) in scene.nodes.iter().zip(&locals) {
        let above = node.parent.map_or(DAffine3::IDENTITY, |p| node_to_world[p as usize]);
        node_to_world.push(above * local.affine());
    }
    for (i, node) in scene.nodes.iter().enumerate() {
        shown[i] &= node.parent.is_none_or(|p| shown[p as usize]);
    }

    let mut posed = PosedScene {
        scene,
        materials,
        cameras,
        lights,
        centre: DVec3::ZERO,
        instances: Vec::with_capacity(scene.instances.len()),
        deformed: Vec::new(),
        node_to_world,
        visible: shown,
        animation: at.animation.clone(),
        bounds: Aabb::EMPTY,
        over_clip: OnceLock::new(),
    };
    posed.place(&weights);
    posed.bounds = posed.measure();
    let centre = at.centre.unwrap_or_else(|| posed.bounds.centre());
    if centre != DVec3::ZERO {
        posed.recentre(centre);
    }
    Ok(posed)
}

impl Scene {
    /// The weights that the meshes at a node have where the node gives none.
    fn default_weights(&self, node: u32) -> Vec<f32> {
        let drawn = self.instances.iter().find(|i| i.node == node);
        drawn.map_or_else(Vec::new, |i| self.meshes[i.mesh as usize].morph_weights.clone())
    }
}

/// The scale-rotation-translation of a local transform about to be animated.
fn trs<'a>(local: &'a mut Cow<'_, Local>) -> (&'a mut DVec3, &'a mut glam::DQuat, &'a mut DVec3) {
    let local = local.to_mut();
    if let Local::Matrix(m) = *local {
        let (scale, rotation, translation) = m.to_scale_rotation_translation();
        *local = Local::Trs { translation, rotation, scale };
    }
    match local {
        Local::Trs { translation, rotation, scale } => (translation, rotation, scale),
        Local::Matrix(_) => unreachable!("just decomposed"),
    }
}

/// The animations of a scene that play.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn playing<'s>(scene: &'s Scene, choice: &AnimationChoice) -> Result<Vec<&'s Animation>, PoseError> {
    let all = &scene.animations;
    Ok(match *choice {
        AnimationChoice::Rest => Vec::new(),
        AnimationChoice::All => all.iter().collect(),
        AnimationChoice::One(i) => vec![all.get(i).ok_or(PoseError::NoAnimation(i, all.len()))?],
        AnimationChoice::Default => {
            let mut driven = std::collections::HashSet::new();
            let disjoint = all.iter().all(|a| {
                let own: std::collections::HashSet<_> = a.channels.iter().map(|c| c.target).collect();
                let new = own.is_disjoint(&driven);
                driven.extend(own);
                new
            });
            if disjoint { all.iter().collect() } else { all.iter().take(1).collect() }
        }
    })
}

impl<'s> PosedScene<'s> {
    /// The same scene at another moment: animation and centre are this one's, and what it found
    /// out about the whole clip stays known.
    pub fn at(&self, time: f64) -> PosedScene<'s> {
        let settings = PoseSettings { time, animation: self.animation.clone(), centre: Some(self.centre) };
        let mut posed = pose(self.scene, &settings).unwrap_or_else(|_| self.clone());
        posed.over_clip = self.over_clip.clone();
        posed
    }

    /// Which animations play.
    pub fn animation(&self) -> &AnimationChoice {
        &self.animation
    }

    /// Node to world in f64, not relative to the centre.
    pub fn node_to_world(&self, node: u32) -> DAffine3 {
        self.node_to_world[node as usize]
    }

    /// The mesh that an instance draws.
    #[inline]
    pub fn mesh(&self, instance: u32) -> &'s Mesh {
        &self.scene.meshes[self.scene.instances[instance as usize].mesh as usize]
    }

    /// An instance's vertices as posed, in the frame that its transform takes to the world.
    #[inline]
    pub fn positions(&self, instance: u32) -> &[Vec3] {
        match self.deformed_of(instance) {
            Some(d) => &d.positions,
            None => &self.mesh(instance).positions,
        }
    }

    /// Likewise its normals; empty means flat.
    #[inline]
    pub fn normals(&self, instance: u32) -> &[Vec3] {
        match self.deformed_of(instance) {
            Some(d) => &d.normals,
            None => &self.mesh(instance).normals,
        }
    }

    /// Likewise its tangents; may be empty.
    pub fn tangents(&self, instance: u32) -> &[Vec4] {
        match self.deformed_of(instance) {
            Some(d) => &d.tangents,
            None => &self.mesh(instance).tangents,
        }
    }

    #[inline]
    fn deformed_of(&self, instance: u32) -> Option<&Deformed> {
        self.instances[instance as usize].deformed.map(|d| &self.deformed[d as usize])
    }

    /// A triangle's corners in the frame that the instance's transform takes to the world.
    #[inline]
    pub fn local_triangle(&self, id: HitId) -> [Vec3; 3] {
        let positions = self.positions(id.instance);
        // Not by `map`, which is not always inlined: trees ask this of every triangle.
        let [a, b, c] = self.mesh(id.instance).triangles[id.triangle as usize];
        [positions[a as usize], positions[b as usize], positions[c as usize]]
    }

    /// A triangle's corners in the world, relative to the centre, each rounded once to f32. Trees
    /// over world triangles hold exactly these.
    #[inline]
    pub fn world_triangle(&self, id: HitId) -> [Vec3; 3] {
        let transform = &self.instances[id.instance as usize].transform;
        let [a, b, c] = self.local_triangle(id);
        [transform.point(a), transform.point(b), transform.point(c)]
    }

    /// The bounds of all that is visible, in world coordinates (the centre added back).
    pub fn bounds(&self) -> Aabb {
        let b = self.bounds;
        if b.is_empty() { b } else { Aabb { min: b.min + self.centre, max: b.max + self.centre } }
    }

    /// Nothing visible is farther than this from the centre.
    pub fn reach(&self) -> f64 {
        let b = self.bounds;
        if b.is_empty() { 0.0 } else { b.min.abs().max(b.max.abs()).length() }
    }

    /// The file's lights in the lecture's units, times `scale`.
    pub fn lights(&self, units: LightUnits, scale: f32) -> Vec<PosedLight> {
        let units = units.resolve(&self.scene.source);
        let visible = self.lights.iter().filter(|l| self.visible[l.node as usize]);
        visible
            .map(|light| {
                let to_world = self.node_to_world[light.node as usize];
                let position = (to_world.translation - self.centre).as_vec3();
                let kind = light.kind.posed(position, &to_world.matrix3, &self.scene.source);
                let intensity = light.color * (light.intensity * units.factor(light.kind) * scale);
                PosedLight { kind, intensity, range: light.range, radius: 0.0 }
            })
            .collect()
    }

    /// Places every instance and bends the meshes that bend, relative to the origin.
    fn place(&mut self, weights: &[Cow<'_, [f32]>]) {
        let scene = self.scene;
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let node = instance.node as usize;
            let mut to_world = self.node_to_world[node];
            if let Some(placement) = instance.placement {
                to_world *= placement;
            }
            // glTF has it say which side is the front even where joints place the vertices.
            let winding = to_world;
            let own = &weights[node];
            let shape: &[f32] = if own.is_empty() { &mesh.morph_weights } else { own };
            let skin = instance.skin.filter(|_| mesh.influences.per_vertex > 0);
            let morphed = mesh.morphs.iter().zip(shape).any(|(_, &w)| w != 0.0);
            let deformed = (morphed || skin.is_some()).then(|| {
                let mut shape = morph(mesh, shape);
                if let Some(skin) = skin {
                    self.bend(&mut shape, mesh, &scene.skins[skin as usize]);
                    to_world = DAffine3::IDENTITY;
                }
                shape
            });
            let deformed = deformed.map(|d| {
                self.deformed.push(d);
                self.deformed.len() as u32 - 1
            });
            let visible = self.visible[node];
            let transform = Transform::new(to_world).wound_by(&winding);
            self.instances.push(PosedInstance { transform, deformed, visible });
        }
    }

    /// Linear blend skinning: the joints' transforms alone place the vertices, in the world.
    fn bend(&self, shape: &mut Deformed, mesh: &Mesh, skin: &Skin) {
        let placed = |(&joint, inverse): (&u32, &DAffine3)| self.node_to_world[joint as usize] * *inverse;
        let joints: Vec<DAffine3> = skin.joints.iter().zip(&skin.inverse_bind).map(placed).collect();
        let for_normals: Vec<DMat3> = joints.iter().map(|joint| for_normals(joint.matrix3)).collect();
        let n = mesh.influences.per_vertex;
        for v in 0..shape.positions.len() {
            let pairs = (v * n..(v + 1) * n)
                .map(|i| (mesh.influences.joints[i] as usize, f64::from(mesh.influences.weights[i])))
                .filter(|&(j, w)| w != 0.0 && j < joints.len());
            let mut to_world = DAffine3::ZERO;
            let mut turned = DMat3::ZERO;
            for (j, w) in pairs {
                to_world.matrix3 += joints[j].matrix3 * w;
                to_world.translation += joints[j].translation * w;
                turned += for_normals[j] * w;
            }
            shape.positions[v] = to_world.transform_point3(shape.positions[v].as_dvec3()).as_vec3();
            if let Some(normal) = shape.normals.get_mut(v) {
                *normal = (turned * normal.as_dvec3()).normalize_or_zero().as_vec3();
            }
            if let Some(tangent) = shape.tangents.get_mut(v) {
                let t = to_world.transform_vector3(tangent.truncate().as_dvec3());
                *tangent = t.normalize_or_zero().as_vec3().extend(tangent.w);
            }
        }
    }

    fn recentre(&mut self, centre: DVec3) {
        self.centre = centre;
        self.bounds = Aabb { min: self.bounds.min - centre, max: self.bounds.max - centre };
        for instance in &mut self.instances {
            instance.transform.affine.translation -= centre;
        }
    }
}

/// What a joint's `m` does to the normals it bends: its inverse transpose, as large as `m` is on the whole, so
/// that normals are blended as vectors are. What turns and scales evenly is its own; what flattens stays finite.
fn for_normals(m: DMat3) -> DMat3 {
    let cofactor = cofactor(m);
    let axes = [cofactor.x_axis, cofactor.y_axis, cofactor.z_axis];
    let area = (axes.map(DVec3::length_squared).iter().sum::<f64>() / 3.0).sqrt();
    let side = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    if area > 0.0 { cofactor * (side / area.sqrt()) } else { DMat3::ZERO }
}

/// A mesh with its morph targets blended in.
fn morph(mesh: &Mesh, weights: &[f32]) -> Deformed {
    let mut shape = Deformed {
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        tangents: mesh.tangents.clone(),
    };
    for (target, &w) in mesh.morphs.iter().zip(weights).filter(|&(_, &w)| w != 0.0) {
        for (p, d) in shape.positions.iter_mut().zip(&target.positions) {
            *p += *d * w;
        }
        for (n, d) in shape.normals.iter_mut().zip(&target.normals) {
            *n += *d * w;
        }
        for (t, d) in shape.tangents.iter_mut().zip(&target.tangents) {
            *t += (*d * w).extend(0.0);
        }
    }
    for n in &mut shape.normals {
        *n = n.normalize_or_zero();
    }
    for t in &mut shape.tangents {
        *t = t.truncate().normalize_or_zero().extend(t.w);
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MorphTarget;

    /// A joint weighs as much in a normal as in the position, so a bend has the normals of three.js.
    #[test]
    fn a_joint_that_turns_and_scales_evenly_moves_normals_as_it_moves_vectors() {
        for scale in [1.0, 1e-3, -2.0] {
            let m = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1) * scale;
            assert!(for_normals(m).abs_diff_eq(m, 1e-14));
        }
    }

    #[test]
    fn normals_stay_perpendicular_to_what_a_joint_stretches() {
        let m = DMat3::from_diagonal(DVec3::new(4.0, 1.0, 1.0));
        let normal = for_normals(m) * DVec3::new(1.0, 1.0, 0.0);
        assert!(normal.dot(m * DVec3::new(1.0, -1.0, 0.0)).abs() < 1e-12);
        let flat = for_normals(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)));
        assert!(flat.is_finite() && (flat * DVec3::Y).y > 0.0);
        assert_eq!(for_normals(DMat3::from_diagonal(DVec3::X)), DMat3::ZERO);
    }

    /// What normal maps build on keeps its length, whatever a target adds.
    #[test]
    fn morphed_normals_and_tangents_have_unit_length() {
        let target = MorphTarget {
            positions: vec![Vec3::X],
            normals: vec![Vec3::X],
            tangents: vec![Vec3::new(1.0, 0.0, -1.0)],
            ..MorphTarget::default()
        };
        let mesh = Mesh {
            positions: vec![Vec3::ZERO],
            normals: vec![Vec3::Z],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, -1.0)],
            morphs: vec![target],
            ..Mesh::default()
        };
        let shape = morph(&mesh, &[1.0]);
        assert!(shape.normals[0].is_normalized());
        assert!(shape.tangents[0].truncate().is_normalized() && shape.tangents[0].w == -1.0);
    }
}
