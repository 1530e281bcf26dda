//! What Blender's exporter writes otherwise than glTF means it, taken back.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use ::gltf::json as gltf;
use glam::{DMat3, Vec3};

use super::material;
use crate::import::error::Warnings;
use crate::scene::{
    Channel, ChannelTarget, Interpolation, Keyframes, LightKind, LightProperty, Material, Mesh, Reflectance,
    Scene,
};

/// Makes of a scene out of Blender's exporter what it was in Blender.
pub(super) fn restore(scene: &mut Scene) {
    // Its exporter writes its maps' strengths as they are.
    scene.materials.iter_mut().filter_map(|m| m.normal.as_mut()).for_each(|map| map.scale_is_strength = true);
    scene.meshes.iter_mut().for_each(forget_tangents);
    restore_normals(scene);
    keep_shared_normals(scene);
    restore_intensities(scene);
    restore_cones(scene);
}

/// What has no material is matte in Blender, and seen from both sides; glTF's default is a metal's front. White
/// it stays, as other readers have it, where Blender shows .8.
pub(super) fn bare() -> Material {
    let mut bare = Material { double_sided: true, ..material::default() };
    make_matte(&mut bare);
    bare
}

/// Of shaders other than Principled and a few that emit, the exporter writes nothing but the material's name: to glTF a
/// white and fully rough metal, which is dark where there is nothing to mirror. A Principled one that is just that
/// looks the same in the file, and in Blender about as bright as matte white.
pub(super) fn restore_shading(material: &mut Material, json: &gltf::Material, warnings: &mut Warnings) {
    let pbr = &json.pbr_metallic_roughness;
    let textured = pbr.base_color_texture.is_some() || pbr.metallic_roughness_texture.is_some();
    let default = material::default();
    let unsaid = !textured
        && json.normal_texture.is_none()
        && json.extensions.as_ref().is_none_or(|e| e.others.is_empty())
        && (material.base_color, material.alpha) == (default.base_color, default.alpha)
        && (material.reflectance, material.transmission) == (default.reflectance, default.transmission);
    if unsaid {
        make_matte(material);
        let what = "says nothing of its shading, as Blender's exporter does of shaders other than Principled BSDF: \
                    shown as matte white";
        warnings.add("", format_args!("material '{}' {what}", material.name));
    }
}

fn make_matte(material: &mut Material) {
    if let Reflectance::MetallicRoughness { metallic, .. } = &mut material.reflectance {
        metallic.factor = 0.0;
    }
}

/// Blender's own shading takes tangents along the coordinates of the normal map. Those in its files are along
/// the mesh's main ones, and of skinned meshes they lack the turn of the armature.
fn forget_tangents(mesh: &mut Mesh) {
    mesh.tangents.clear();
    mesh.morph_targets.iter_mut().for_each(|target| target.tangents.clear());
}

/// Normals of skinned meshes are to be those of the world at rest. The exporter takes them there from the
/// armature's frame by its matrix A, where A⁻ᵀ would be right; so they are A⁻ᵀA⁻¹ away from that.
///
/// A bone at rest is A·B, its own B without scale, and its inverse bind matrix M = (A·B)⁻¹: so
/// A⁻ᵀA⁻¹ = MᵀM, whichever bone it is and whether or not the armature is in the file.
fn restore_normals(scene: &mut Scene) {
    let skins: HashMap<u32, u32> = scene.instances.iter().filter_map(|i| Some((i.mesh, i.skin?))).collect();
    for (mesh, skin) in skins {
        let Some(bind) = scene.skins[skin as usize].inverse_bind.first() else { continue };
        let stretch = bind.matrix3.transpose() * bind.matrix3;
        scene.meshes[mesh as usize].map_normals(&stretch);
    }
}

/// Blender smooths a mesh that several objects share in the mesh's own frame, and any other in the world.
fn keep_shared_normals(scene: &mut Scene) {
    let mut users = vec![0u32; scene.meshes.len()];
    scene.instances.iter().for_each(|instance| users[instance.mesh as usize] += 1);
    for (mesh, users) in scene.meshes.iter_mut().zip(users) {
        // Objects that are bent have meshes of their own.
        mesh.interpolate_normals_locally =
            users > 1 && mesh.morph_targets.is_empty() && mesh.influences.per_vertex == 0;
    }
}

/// The exporter writes a lamp's intensity in its unit, and the keys of that intensity in watts, or in 683 times that: of
/// points and spots 4π times too much, of suns 683 times too little. One of the keys is the moment of the export, and
/// tells.
fn restore_intensities(scene: &mut Scene) {
    let Scene { animations, lights, .. } = scene;
    for channel in animations.iter_mut().flat_map(|animation| &mut animation.channels) {
        let ChannelTarget::Light(id, LightProperty::Intensity) = channel.target else { continue };
        let light = &lights[id as usize];
        let factor =
            if light.kind == LightKind::Directional { 683.0 } else { 0.25 * std::f32::consts::FRAC_1_PI };
        let values = &mut channel.keyframes.values;
        let is_light = |v: f32| light.intensity > 0.0 && (v / light.intensity - 1.0).abs() < 1e-3;
        if !values.iter().any(|&v| is_light(v)) && values.iter().any(|&v| is_light(v * factor)) {
            values.iter_mut().for_each(|v| *v *= factor);
        }
    }
}

/// Blender has a spot's blend, the share of its cone over which light falls off, where glTF has an angle. The exporter
/// writes keys of the blend as they are for the angle's, and where there are none the blend stays as the cone
/// changes, not the angle. As with intensities one of the keys tells.
fn restore_cones(scene: &mut Scene) {
    let Scene { animations, lights, .. } = scene;
    for channels in animations.iter_mut().map(|animation| &mut animation.channels) {
        let (mut sized, mut blended) = (BTreeMap::new(), BTreeSet::new());
        for Channel { target, keyframes: keys } in channels.iter_mut() {
            let ChannelTarget::Light(id, field) = *target else { continue };
            let LightKind::Spot { inner, outer } = lights[id as usize].kind else { continue };
            let blend = 1.0 - inner / outer;
            let has = |value: f32| keys.values.iter().any(|v| (v - value).abs() < 1e-4);
            match field {
                LightProperty::OuterCone if blend.is_finite() => {
                    sized.insert(id, blend);
                }
                LightProperty::InnerCone => {
                    blended.insert(id);
                    if has(blend) && !has(inner) {
                        *target = ChannelTarget::Light(id, LightProperty::Blend);
                    }
                }
                _ => {}
            }
        }
        for (id, blend) in sized.into_iter().filter(|(id, _)| !blended.contains(id)) {
            let keys = Keyframes {
                times: vec![0.0],
                values: vec![blend],
                width: 1,
                interpolation: Interpolation::Step,
            };
            channels
                .push(Channel { target: ChannelTarget::Light(id, LightProperty::Blend), keyframes: keys });
        }
        // Behind the cones that they are shares of.
        channels
            .sort_by_key(|channel| matches!(channel.target, ChannelTarget::Light(_, LightProperty::Blend)));
    }
}

impl Mesh {
    /// Takes every normal, at rest and as morphed, through a matrix.
    fn map_normals(&mut self, by: &DMat3) {
        let map = |n: Vec3| (*by * n.as_dvec3()).try_normalize().map_or(n, |n| n.as_vec3());
        let Mesh { normals, morph_targets, .. } = self;
        let mapped: Vec<Vec3> = normals.iter().map(|&n| map(n)).collect();
        for target in morph_targets {
            for ((d, &n), &to) in target.normals.iter_mut().zip(&*normals).zip(&mapped) {
                *d = map(n + *d) - to;
            }
        }
        *normals = mapped;
    }
}
