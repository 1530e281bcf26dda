//! Arbitrary triangles, instances and rays: the BVH returns what testing every triangle returns.

use std::path::Path;

use arbitrary::{Result, Unstructured};
use blinn::accel::{Accel, AccelSettings, Coherence, HitFilter, Preset, RayBatch, ShadowRayBatch};
use blinn::geometry::HitId;
use blinn::scene::{Instance, LocalTransform, Material, Mesh, Node, PoseSettings, Scene, pose};
use glam::{DAffine3, DVec3, Vec3};

/// Numbers that are difficult for geometry; most are small and few, so that triangles coincide.
const NUMBERS: [f32; 16] = [
    0.0,
    1.0,
    -1.0,
    0.5,
    0.25,
    2.0,
    -0.0,
    1e-20,
    1e-38,
    1e10,
    1e18,
    -1e19,
    f32::MAX,
    f32::MIN_POSITIVE,
    f32::NAN,
    f32::INFINITY,
];

fn number(u: &mut Unstructured) -> Result<f32> {
    Ok(match u.int_in_range(0..=9)? {
        0 => *u.choose(&NUMBERS)?,
        1 => f32::from_bits(u.arbitrary()?),
        2..=5 => f32::from(u.int_in_range(-4i8..=4)?) / 2.0,
        _ => f32::from(u.arbitrary::<i16>()?) / 8192.0,
    })
}

/// Ray origins as far out as triangles may be; hits beyond have no meaning in f32.
fn place(u: &mut Unstructured) -> Result<Vec3> {
    let v = vector(u)?;
    Ok(if v.abs().max_element() <= 1e9 { v } else { Vec3::ONE })
}

fn vector(u: &mut Unstructured) -> Result<Vec3> {
    Ok(Vec3::new(number(u)?, number(u)?, number(u)?))
}

struct Whole;

impl HitFilter for Whole {
    fn accepts(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmittance(&self, _: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}

fn scene(u: &mut Unstructured) -> Result<Scene> {
    let n = u.int_in_range(3..=40usize)?;
    let positions = (0..n).map(|_| vector(u)).collect::<Result<Vec<_>>>()?;
    let corner = |u: &mut Unstructured| -> Result<u32> { Ok(u.choose_index(n)? as u32) };
    let triangles = (0..u.int_in_range(0..=60)?)
        .map(|_| Ok([corner(u)?, corner(u)?, corner(u)?]))
        .collect::<Result<Vec<_>>>()?;
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    scene.meshes.push(Mesh { positions, triangles, ..Mesh::default() });
    for _ in 0..u.int_in_range(1..=3)? {
        let moved = DAffine3::from_translation(vector(u)?.as_dvec3());
        let local = LocalTransform::Matrix(moved * DAffine3::from_scale(DVec3::splat(f64::from(number(u)?))));
        let node = scene.nodes.len() as u32;
        scene.nodes.push(Node { local, visible: true, ..Node::default() });
        scene.instances.push(Instance { node, mesh: 0, object: node + 1, ..Instance::default() });
    }
    Ok(scene)
}

/// Accepted: a ray hit something.
pub fn target(bytes: &[u8], _: &Path) -> bool {
    answers_agree(&mut Unstructured::new(bytes)).unwrap_or(false)
}

fn answers_agree(u: &mut Unstructured) -> Result<bool> {
    let scene = scene(u)?;
    let Ok(posed) = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() })
    else {
        return Ok(false);
    };
    let settings = |preset| AccelSettings { preset, ..AccelSettings::default() };
    let (tree, cleaned) = Accel::build(&posed, &settings(Preset::Medium));
    let (flat, same) = Accel::build(&posed, &settings(Preset::BruteForce));
    assert_eq!(cleaned, same);
    let origin = place(u)?;
    let mut rays = RayBatch { coherence: Coherence::Origin(origin), ..RayBatch::default() };
    let mut shadows = ShadowRayBatch { coherence: Coherence::None, ..ShadowRayBatch::default() };
    for _ in 0..u.int_in_range(1..=64)? {
        let to = place(u)?;
        rays.push(origin, to);
        shadows.push(place(u)?, to, HitId::NONE);
    }
    let (mut hits, mut others) = (Vec::new(), Vec::new());
    tree.intersect(&rays, &Whole, &mut hits);
    flat.intersect(&rays, &Whole, &mut others);
    assert_eq!(hits, others, "rays from {origin}");
    let (mut blocked, mut other) = (Vec::new(), Vec::new());
    tree.occluded(&shadows, &Whole, &mut blocked);
    flat.occluded(&shadows, &Whole, &mut other);
    assert_eq!(blocked, other);
    Ok(hits.iter().any(|h| !h.is_miss()))
}
