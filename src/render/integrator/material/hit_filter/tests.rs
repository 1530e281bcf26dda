use glam::{DAffine3, Vec2, Vec4};

use super::*;
use crate::integrator::surface::mesh_triangle::MeshTriangle;
use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use blinn_scene::{
    AlphaMode, Channels, ColorInput, Image, Instance, LocalTransform, Material, Mesh, MipMaps, Node,
    PoseSettings, ScalarInput, Scene, Texels, Texture, TextureChannel, TextureFilter, TextureRef,
    UvTransform, Wrap, pose,
};

const TRIANGLES: u32 = 400;

/// Random numbers in 0…1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn vec2(&mut self, size: f32) -> Vec2 {
        Vec2::new(self.next() - 0.5, self.next() - 0.5) * size
    }

    fn barycentrics(&mut self) -> [f32; 3] {
        let u = self.next();
        let v = self.next();
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        [1.0 - u - v, u, v]
    }
}

/// An image of alpha 255 with a few holes of alpha 40.
fn image_with_holes(random: &mut Random) -> Image {
    let (width, height) = (61, 48);
    let mut holes = vec![(0, 0)];
    holes.extend((0..2).map(|_| ((random.next() * 61.0) as u32, (random.next() * 48.0) as u32)));
    let in_hole = |i: u32| holes.iter().any(|&(x, y)| (i % width).abs_diff(x) + (i / width).abs_diff(y) < 4);
    let texels = (0..width * height).flat_map(|i| [9, 9, 9, if in_hole(i) { 40 } else { 255 }]).collect();
    Image {
        name: String::new(),
        width,
        height,
        channels: Channels::Rgba,
        texels: Texels::U8(texels),
        mips: MipMaps::default(),
    }
}

/// Random triangles with texture coordinates of all sizes, some of them not finite, and some vertex colours with alpha.
fn random_mesh(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let mut uvs = Vec::new();
    for i in 0..TRIANGLES as usize {
        let size = [0.02, 0.2, 3.0][i % 3];
        let centre = random.vec2(5.0);
        for _ in 0..3 {
            mesh.positions.push(random.vec2(1.0).extend(0.0));
            let factor = [f32::NAN, f32::INFINITY, 3e38][i / 50 % 3];
            let is_stray = i % 50 == 7 && uvs.len() % 3 == i / 50 % 3;
            uvs.push(centre + random.vec2(size) * if is_stray { factor } else { 1.0 });
            mesh.colors.push(Vec4::new(1.0, 1.0, 1.0, if i % 40 == 0 { random.next() } else { 1.0 }));
        }
    }
    mesh.uvs = vec![uvs];
    mesh.triangles = (0..TRIANGLES).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh
}

/// A scene whose alpha comes from a texture with holes.
fn scene(mode: AlphaMode, texture: Texture, transform: UvTransform, random: &mut Random) -> Scene {
    let image = image_with_holes(random);
    let mesh = random_mesh(random);
    let texture_ref = TextureRef { texture: 0, uv_set: 0, transform };
    let mut material = Material { alpha_mode: mode, ..Material::default() };
    if matches!(mode, AlphaMode::Mask(_)) {
        material.base_color = ColorInput { texture: Some(texture_ref), ..material.base_color };
        material.alpha_from_base = true;
    } else {
        material.alpha = ScalarInput { factor: 1.0, texture: Some((texture_ref, TextureChannel::A)) };
    }
    let local = LocalTransform::Matrix(DAffine3::IDENTITY);
    Scene {
        meshes: vec![mesh],
        nodes: vec![Node { local, visible: true, ..Node::default() }],
        instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
        materials: vec![material],
        images: vec![image],
        textures: vec![texture],
        ..Scene::default()
    }
}

/// Triangles marked as opaque are opaque at every point, and at least half of the opaque triangles are marked.
#[test]
fn opaque_triangles_have_no_holes() {
    let random = &mut Random(7);
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
            for mode in [AlphaMode::Blend, AlphaMode::Mask(0.5)] {
                let transform = match filter {
                    TextureFilter::Nearest => UvTransform::IDENTITY,
                    _ => UvTransform::khr(random.vec2(9.0), random.next(), Vec2::new(0.7, -1.3)),
                };
                let texture = Texture { image: 0, wrap: [wrap, Wrap::Repeat], filter, decode_last: false };
                check(&scene(mode, texture, transform, random), random);
            }
        }
    }
}

fn check(scene: &Scene, random: &mut Random) {
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let marked = posed.opaque_triangles(0);
    let mut opaque = 0;
    let mut unmarked = 0;
    for triangle in 0..TRIANGLES {
        let mut least = f32::INFINITY;
        for _ in 0..200 {
            let coords =
                TriangleCoords { b: random.barycentrics(), differentials: BarycentricDifferentials::POINT };
            let triangle = MeshTriangle::new(&posed, HitId { instance: 0, triangle });
            let ctx = TextureEvalContext { triangle, coords, tint: None, sampled_normal: None };
            least = least.min(opacity(&posed, &scene.materials[0], &ctx));
        }
        let is_opaque = least > 1.0 - 1e-5;
        assert!(is_opaque || !marked.contains(triangle), "{triangle}: {least} {:?}", scene.textures);
        opaque += usize::from(is_opaque);
        unmarked += usize::from(is_opaque && !marked.contains(triangle));
    }
    assert!(opaque > 100 && unmarked < opaque / 2, "{unmarked} of {opaque} {:?}", scene.textures);
}
