//! What the accelerator asks of materials: is the surface there, and what passes through it.

use glam::Vec3;

use crate::accel::AnyHitFilter;
use crate::geometry::{HitId, Ray, Rgb};
use crate::integrator::material::coefficients::{alpha, transmitted};
use crate::integrator::surface::texture_eval::OnMesh;
use crate::scene::PosedScene;

/// Answers the accelerator's questions from a scene's materials.
pub struct MaterialHitFilter<'a>(pub &'a PosedScene<'a>);

impl AnyHitFilter for MaterialHitFilter<'_> {
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        let on = OnMesh::at(self.0, id, Ray { o, d });
        alpha(self.0, &self.0.materials[on.mesh.material as usize], &on) > 0.0
    }

    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Rgb {
        let on = OnMesh::at(self.0, id, Ray { o, d });
        // Colours beyond 1 do not make light more on its way.
        transmitted(self.0, &self.0.materials[on.mesh.material as usize], &on).clamp(Rgb::ZERO, Rgb::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::surface::ray_differentials::Spread;
    use crate::scene::pose;
    use crate::scene::{
        AlphaMode, Channels, ColorInput, Image, Instance, LocalTransform, Material, Mesh, MipMaps, Node,
        PoseSettings, ScalarInput, Scene, Texels, Texture, TextureChannel, TextureFilter, TextureRef,
        UvTransform, Wrap,
    };
    use glam::{DAffine3, Vec2, Vec4};

    /// Numbers from 0 to 1.
    struct Any(u64);

    impl Any {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1u64 << 24) as f32
        }

        fn place(&mut self, size: f32) -> Vec2 {
            Vec2::new(self.next() - 0.5, self.next() - 0.5) * size
        }
    }

    /// A texture with a few holes, by which `mode` is chosen.
    fn scene(mode: AlphaMode, texture: Texture, transform: UvTransform, any: &mut Any) -> Scene {
        let (width, height) = (61, 48);
        let mut holes = vec![(0, 0)];
        holes.extend((0..2).map(|_| ((any.next() * 61.0) as u32, (any.next() * 48.0) as u32)));
        let clear =
            |i: u32| holes.iter().any(|&(x, y)| (i % width).abs_diff(x) + (i / width).abs_diff(y) < 4);
        let texels = (0..width * height).flat_map(|i| [9, 9, 9, if clear(i) { 40 } else { 255 }]).collect();
        let image = Image {
            name: String::new(),
            width,
            height,
            channels: Channels::Rgba,
            texels: Texels::U8(texels),
            mips: MipMaps::default(),
        };
        let (mut positions, mut uv, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..400 {
            let (size, at) = ([0.02, 0.2, 3.0][i % 3], any.place(5.0));
            for _ in 0..3 {
                positions.push(any.place(1.0).extend(0.0));
                // One corner of some is nowhere or far out.
                let stray = [f32::NAN, f32::INFINITY, 3e38][i / 50 % 3];
                let strays = i % 50 == 7 && uv.len() % 3 == i / 50 % 3;
                uv.push(at + any.place(size) * if strays { stray } else { 1.0 });
                colors.push(Vec4::new(1.0, 1.0, 1.0, if i % 40 == 0 { any.next() } else { 1.0 }));
            }
        }
        let by = TextureRef { texture: 0, uv_set: 0, transform };
        let mut material = Material { alpha_mode: mode, ..Material::default() };
        if matches!(mode, AlphaMode::Mask(_)) {
            (material.base_color, material.alpha_from_base) =
                (ColorInput { texture: Some(by), ..material.base_color }, true);
        } else {
            material.alpha = ScalarInput { factor: 1.0, texture: Some((by, TextureChannel::A)) };
        }
        let triangles = (0..400).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = Mesh { positions, uvs: vec![uv], colors, triangles, ..Mesh::default() };
        Scene {
            meshes: vec![mesh],
            nodes: vec![Node {
                local: LocalTransform::Matrix(DAffine3::IDENTITY),
                visible: true,
                ..Node::default()
            }],
            instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
            materials: vec![material],
            images: vec![image],
            textures: vec![texture],
            ..Scene::default()
        }
    }

    /// What is said to be solid is there, wherever one looks; and of what is there much is said to be.
    #[test]
    fn solid_triangles_have_no_holes() {
        let any = &mut Any(7);
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
                for mode in [AlphaMode::Blend, AlphaMode::Mask(0.5)] {
                    let transform = match filter {
                        TextureFilter::Nearest => UvTransform::IDENTITY,
                        _ => UvTransform::khr(any.place(9.0), any.next(), Vec2::new(0.7, -1.3)),
                    };
                    let texture =
                        Texture { image: 0, wrap: [wrap, Wrap::Repeat], filter, decode_last: false };
                    let scene = scene(mode, texture, transform, any);
                    let posed = pose(&scene, &PoseSettings::default()).unwrap();
                    let (solid, mesh, material) =
                        (posed.opaque_triangles(0), &scene.meshes[0], &scene.materials[0]);
                    let (mut there, mut missed) = (0, 0);
                    for triangle in 0..400 {
                        let corners = mesh.triangles[triangle as usize];
                        let mut least = f32::INFINITY;
                        for _ in 0..200 {
                            let (u, v) = (any.next(), any.next());
                            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                            let b = [1.0 - u - v, u, v];
                            let on =
                                OnMesh { mesh, corners, b, spread: Spread::POINT, tint: None, fetched: None };
                            least = least.min(alpha(&posed, material, &on));
                        }
                        let whole = least > 1.0 - 1e-5;
                        assert!(
                            whole || !solid.contains(triangle),
                            "{triangle}: {least} {wrap:?} {filter:?} {mode:?}"
                        );
                        there += usize::from(whole);
                        missed += usize::from(whole && !solid.contains(triangle));
                    }
                    assert!(
                        there > 100 && missed < there / 2,
                        "{missed} of {there} {wrap:?} {filter:?} {mode:?}"
                    );
                }
            }
        }
    }
}
