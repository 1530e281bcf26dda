//! Undoes deviations of Blender's exporter from the glTF specification, so that a scene looks as in Blender.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use ::gltf::json as gltf;
use glam::{DMat3, Vec3};

use super::{material, sheen};
use crate::error::Warnings;
use blinn_scene::{
    AnisotropyModel, Channel, ChannelTarget, Interpolation, Keyframes, LightKind, LightProperty, Material,
    Mesh, Reflectance, Reflection, Scene, SheenModel,
};

/// Restores the normals, lights and normal maps of a scene from Blender's exporter.
pub(super) fn restore(scene: &mut Scene) {
    // Blender's strength blends between the vertex normal and the map; the exporter writes it as glTF's
    // scale.
    scene.materials.iter_mut().filter_map(|m| m.normal.as_mut()).for_each(|map| map.scale_is_strength = true);
    scene.meshes.iter_mut().for_each(clear_tangents);
    scene.meshes.iter_mut().for_each(|mesh| mesh.keeps_normal_side = true);
    restore_normals(scene);
    mark_shared_meshes(scene);
    restore_intensities(scene);
    restore_cones(scene);
}

/// Blender's default material is diffuse and double-sided; glTF's is a single-sided metal. The colour is
/// white as in other importers, where Blender uses 0.8.
pub(super) fn default_material() -> Material {
    let mut material = Material { double_sided: true, ..material::default() };
    make_diffuse(&mut material);
    material
}

/// Makes materials without shading parameters diffuse. The exporter writes nothing but the name of shaders
/// other than Principled BSDF and some emissive ones, which in glTF means a white and fully rough metal: dark
/// without an environment. A Principled BSDF with exactly these parameters is written likewise; in Blender it
/// is about as bright as white diffuse.
pub(super) fn restore_shading(material: &mut Material, json: &gltf::Material, warnings: &mut Warnings) {
    let pbr = &json.pbr_metallic_roughness;
    let textured = pbr.base_color_texture.is_some() || pbr.metallic_roughness_texture.is_some();
    let default = material::default();
    let has_no_parameters = !textured
        && json.normal_texture.is_none()
        && json.extensions.as_ref().is_none_or(|e| e.others.is_empty())
        && (material.base_color, material.alpha) == (default.base_color, default.alpha)
        && (material.reflectance, material.transmission) == (default.reflectance, default.transmission);
    if has_no_parameters {
        make_diffuse(material);
        let message = "has no shading parameters, as Blender's exporter supports only Principled BSDF; \
                       used matte white";
        warnings.add("", format_args!("material '{}' {message}", material.name));
    }
}

/// Gives a sheen the fibres that Blender shows. Materials without one stay as other programs write them.
pub(super) fn restore_sheen(material: &mut Material, json: &gltf::Material) {
    let others = json.extensions.as_ref().map(|extensions| &extensions.others);
    if others.is_some_and(|others| others.contains_key(sheen::NAME)) {
        material.sheen.model = SheenModel::Microfibres;
    }
}

/// Stretches highlights as Blender does. The exporter writes the anisotropy of the Principled BSDF as the strength of the
/// extension, whose formula is another.
pub(super) fn restore_anisotropy(material: &mut Material) {
    if let Some(anisotropy) = &mut material.anisotropy {
        anisotropy.model = AnisotropyModel::Principled;
    }
}

fn make_diffuse(material: &mut Material) {
    if let Reflectance::MetallicRoughness { metallic, .. } = &mut material.reflectance {
        metallic.factor = 0.0;
    }
    material.reflection = Reflection::None;
}

/// Removes the file's tangents. Blender shades with tangents along the normal map's coordinates; the file has
/// those along the mesh's active coordinates, and those of skinned meshes lack the armature's rotation.
fn clear_tangents(mesh: &mut Mesh) {
    mesh.tangents.clear();
    mesh.morph_targets.iter_mut().for_each(|target| target.tangents.clear());
}

/// Corrects the normals of skinned meshes, which should be in world space of the bind pose. The exporter
/// transforms them from the armature's space by its matrix A instead of A⁻ᵀ; multiplication by A⁻ᵀA⁻¹
/// corrects them.
///
/// The bind pose of a bone is A·B with B without scale, and its inverse bind matrix M = (A·B)⁻¹. So A⁻ᵀA⁻¹ =
/// MᵀM for any bone, whether or not the armature is in the file.
fn restore_normals(scene: &mut Scene) {
    let skins: HashMap<u32, u32> = scene.instances.iter().filter_map(|i| Some((i.mesh, i.skin?))).collect();
    for (mesh, skin) in skins {
        let Some(bind) = scene.skins[skin as usize].inverse_bind.first() else { continue };
        let correction = bind.matrix3.transpose() * bind.matrix3;
        transform_normals(&mut scene.meshes[mesh as usize], &correction);
    }
}

/// Marks meshes that several objects share: Blender smooths them in object space, and other meshes in world
/// space.
fn mark_shared_meshes(scene: &mut Scene) {
    let mut users = vec![0u32; scene.meshes.len()];
    scene.instances.iter().for_each(|instance| users[instance.mesh as usize] += 1);
    for (mesh, users) in scene.meshes.iter_mut().zip(users) {
        // Deformed objects do not share meshes.
        mesh.interpolate_normals_locally =
            users > 1 && mesh.morph_targets.is_empty() && mesh.influences.per_vertex == 0;
    }
}

/// Corrects the units of animated intensities. The exporter writes a light's intensity in glTF's unit but its
/// keyframes in watts, possibly times 683 lm/W: 4π times too much for point and spot lights, 683 times too
/// little for suns. The wrong unit is detected by the keyframe that equals the light's intensity after
/// conversion.
fn restore_intensities(scene: &mut Scene) {
    let Scene { animations, lights, .. } = scene;
    for channel in animations.iter_mut().flat_map(|animation| &mut animation.channels) {
        let ChannelTarget::Light(id, LightProperty::Intensity) = channel.target else { continue };
        let light = &lights[id as usize];
        let factor =
            if light.kind == LightKind::Directional { 683.0 } else { 0.25 * std::f32::consts::FRAC_1_PI };
        let values = &mut channel.keyframes.values;
        let is_intensity = |v: f32| light.intensity > 0.0 && (v / light.intensity - 1.0).abs() < 1e-3;
        if !values.iter().any(|&v| is_intensity(v)) && values.iter().any(|&v| is_intensity(v * factor)) {
            values.iter_mut().for_each(|v| *v *= factor);
        }
    }
}

/// Corrects animated spot cones. Blender's blend is the fraction of the cone over which light falls off,
/// where glTF has an inner angle. The exporter writes keyframes of the blend as inner angles; without such
/// keyframes the blend is constant while the cone changes, not the inner angle. The keyframe that equals the
/// blend identifies them.
fn restore_cones(scene: &mut Scene) {
    let Scene { animations, lights, .. } = scene;
    for channels in animations.iter_mut().map(|animation| &mut animation.channels) {
        // Blends of the spots with an animated cone, and the spots with an animated inner angle or blend.
        let mut animated_cones = BTreeMap::new();
        let mut animated_blends = BTreeSet::new();
        for Channel { target, keyframes } in channels.iter_mut() {
            let ChannelTarget::Light(id, field) = *target else { continue };
            let LightKind::Spot { inner, outer } = lights[id as usize].kind else { continue };
            let blend = 1.0 - inner / outer;
            let has = |value: f32| keyframes.values.iter().any(|v| (v - value).abs() < 1e-4);
            match field {
                LightProperty::OuterCone if blend.is_finite() => {
                    animated_cones.insert(id, blend);
                }
                LightProperty::InnerCone => {
                    animated_blends.insert(id);
                    if has(blend) && !has(inner) {
                        *target = ChannelTarget::Light(id, LightProperty::Blend);
                    }
                }
                _ => {}
            }
        }
        for (id, blend) in animated_cones.into_iter().filter(|(id, _)| !animated_blends.contains(id)) {
            let keyframes = Keyframes {
                times: vec![0.0],
                values: vec![blend],
                width: 1,
                interpolation: Interpolation::Step,
            };
            channels.push(Channel { target: ChannelTarget::Light(id, LightProperty::Blend), keyframes });
        }
        // Blends are evaluated after the cones that they are fractions of.
        channels
            .sort_by_key(|channel| matches!(channel.target, ChannelTarget::Light(_, LightProperty::Blend)));
    }
}

/// Transforms the normals of the base shape and of all morph targets.
fn transform_normals(mesh: &mut Mesh, by: &DMat3) {
    let transform = |n: Vec3| (*by * n.as_dvec3()).try_normalize().map_or(n, |n| n.as_vec3());
    let Mesh { normals, morph_targets, .. } = mesh;
    let transformed: Vec<Vec3> = normals.iter().map(|&n| transform(n)).collect();
    for target in morph_targets {
        for ((d, &n), &to) in target.normals.iter_mut().zip(&*normals).zip(&transformed) {
            *d = transform(n + *d) - to;
        }
    }
    *normals = transformed;
}
