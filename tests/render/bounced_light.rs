//! Light from all sides that bounces, and the shadows of bumps, against closed forms.

use blinn::geometry::Rgb;
use blinn::integrator::Frame;
use blinn::scene::{
    Channels, ColorInput, Dielectric, Environment, Image, Lighting, Material, Mesh, MipMaps, MtlReflectance,
    NormalMap, Panorama, Projection, Reflectance, Reflection, ScalarInput, Scene, Texels, Texture,
    TextureFilter, TextureRef, UvTransform, View, Volume, Wrap,
};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use crate::common::scenes::{self, add, assert_near, grid};

fn matte(albedo: f32, has_normal_map: bool) -> Material {
    let texture = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::IDENTITY };
    Material {
        base_color: ColorInput::new(Rgb::splat(albedo)),
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        normal: has_normal_map.then_some(NormalMap { texture, scale: 1.0, scale_is_strength: false }),
        double_sided: true,
        ..Material::default()
    }
}

/// Makes an image of 2 × 1 texels whose normals lean by ±`angle` the texture of the scene.
fn add_leaning_normals(scene: &mut Scene, angle: f64) {
    let code = |v: f64| ((v * 0.5 + 0.5) * 255.0).round() as u8;
    let texel = |angle: f64| [code(angle.sin()), 128, code(angle.cos()), 255];
    scene.images.push(Image {
        name: String::new(),
        width: 2,
        height: 1,
        channels: Channels::Rgba,
        texels: Texels::U8([texel(angle), texel(-angle)].concat()),
        mips: MipMaps::default(),
    });
    scene.textures.push(Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Nearest,
        decode_last: false,
    });
}

/// A horizontal square of side 2 `half`, whose texture is repeated `repeat` times.
fn square(half: f32, repeat: f32) -> Mesh {
    let mesh = grid(1, 1);
    let positions: Vec<Vec3> = mesh.positions.iter().map(|&p| p * half).collect();
    let uv = mesh.positions.iter().map(|p| Vec2::new(p.x, p.z) * 0.5 * repeat).collect();
    let normals = vec![Vec3::Y; positions.len()];
    let tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); positions.len()];
    Mesh { positions, uvs: vec![uv], normals, tangents, ..mesh }
}

fn looking(view_point: DVec3, view_dir: DVec3, width: f64) -> View {
    View {
        view_point: Some(view_point),
        view_dir: Some(view_dir),
        view_up: Some(DVec3::NEG_Z),
        view_width: Some(width),
        view_height: Some(width),
        projection: Some(Projection::Orthographic),
        ..View::default()
    }
}

/// Light of radiance 1 from beyond the scene, in all directions or nearly so.
enum Beyond {
    Ambient,
    /// A hundredth brighter above, and darker below: not known to be uniform.
    Panorama,
}

fn panorama() -> Environment {
    let (width, height) = (64, 32);
    let row = |y: u32| [if y < height / 2 { 1.01 } else { 0.99 }; 3];
    let texels = (0..width * height).map(|i| row(i / width)).collect();
    Environment::from_panorama(Panorama::new(width, height, texels).unwrap())
}

/// The mean radiance of a picture of 16 × 16 pixels.
fn mean_radiance(scene: &Scene, view: &View, beyond: Beyond, indirect: u8, samples: u32) -> f64 {
    let posed = scenes::posed(scene);
    let accel = scenes::build(&posed);
    let (camera, _) = view.resolve(&posed, 16, 16).unwrap();
    let environment = match beyond {
        Beyond::Ambient => None,
        Beyond::Panorama => Some(panorama()),
    };
    let lit =
        Lighting { sets: Some(Vec::new()), environment, ..Lighting::default() }.resolve(&posed, &camera);
    let frame = Frame {
        ambient: Rgb::ONE,
        indirect,
        caustics: true,
        bounces: 12,
        cull_back_faces: false,
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    scenes::mean_radiance(&frame, samples)
}

/// In a sphere, all points receive the same share f of the light through an opening. After N bounces, the radiance is
/// ρ f (1 + q + … + q^(N−1)) with q = ρ (1 − f).
#[test]
fn an_open_sphere_has_the_radiance_of_its_bounces() {
    let (albedo, down, open) = (0.8, 64, 22);
    let mut ball = scenes::ball(128, down);
    ball.normals.clear();
    ball.triangles.drain(..(open * 2 * 128) as usize);
    let f = 0.5 * (1.0 - (std::f64::consts::PI * f64::from(open) / f64::from(down)).cos());
    let scene = scenes::of_material(ball, matte(albedo, false));
    let view = looking(DVec3::ZERO, DVec3::NEG_Y, 0.5);
    let q = f64::from(albedo) * (1.0 - f);
    for bounces in 1..4 {
        let expected: f64 = (0..=bounces).map(|k| f64::from(albedo) * f * q.powi(k)).sum();
        let value = mean_radiance(&scene, &view, Beyond::Ambient, bounces as u8, 256);
        assert_near(value, expected, 0.02, &format!("{bounces} bounces"));
    }
}

/// The share of uniform light that a matte surface receives whose normals lean by `angle`: the integral over the hemispheres
/// of both normals of the cosine, times Smith's masking of GGX with α² = tan²(angle) / 8.
fn lit_share(angle: f64) -> f64 {
    let n = DVec3::new(angle.sin(), angle.cos(), 0.0);
    let alpha2 = (angle.tan().powi(2) / 8.0).min(1.0);
    let (rows, columns) = (400, 400);
    let mut sum = 0.0;
    for i in 0..rows {
        // Equal solid angles.
        let y = (f64::from(i) + 0.5) / f64::from(rows);
        let sin = (1.0 - y * y).sqrt();
        let masking = 2.0 / (1.0 + (1.0 + alpha2 * (1.0 / (y * y) - 1.0)).sqrt());
        for j in 0..columns {
            let turn = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(columns);
            let l = DVec3::new(sin * turn.cos(), y, sin * turn.sin());
            sum += n.dot(l).max(0.0) * masking;
        }
    }
    2.0 * sum / f64::from(rows * columns)
}

#[test]
fn bumps_darken_surfaces_under_light_from_all_sides() {
    for angle in [0.3, 0.8, 1.2] {
        let mut scene = scenes::of_material(square(10.0, 8.0), matte(0.7, true));
        add_leaning_normals(&mut scene, angle);
        let value = mean_radiance(&scene, &looking(DVec3::Y, DVec3::NEG_Y, 0.5), Beyond::Ambient, 1, 256);
        assert_near(value, 0.7 * lit_share(angle), 0.01, &format!("{angle} radians"));
    }
    assert!(lit_share(1.2) < 0.7 && lit_share(0.3) > 0.95);
}

/// The footprint of a diffuse ray holds many bumps, whose mean normal is flat.
#[test]
fn fine_bumps_reflect_as_much_light_as_coarse_ones() {
    let view = looking(DVec3::new(0.0, 0.5, 0.0), DVec3::NEG_Y, 0.2);
    let radiance = |repeat: f32| {
        // A matte floor below a bumpy ceiling, which is lit from the sides.
        let mut scene = scenes::of_material(square(0.5, 1.0), matte(0.9, false));
        let above = DAffine3::from_translation(DVec3::new(0.0, 1.0, 0.0));
        add(&mut scene, square(1.0, repeat), matte(0.9, true), &[above]);
        add_leaning_normals(&mut scene, 1.2);
        mean_radiance(&scene, &view, Beyond::Ambient, 2, 1024)
    };
    assert_near(radiance(512.0), radiance(8.0), 0.01, "bumps");
}

/// Rays below the horizon take no light of a white metal away.
#[test]
fn rough_metals_vanish_in_a_white_world() {
    for roughness in [0.25, 0.5, 1.0] {
        let metal = Material {
            base_color: ColorInput::new(Rgb::ONE),
            reflectance: Reflectance::MetallicRoughness {
                metallic: ScalarInput::new(1.0),
                roughness: ScalarInput::new(roughness),
                dielectric: Dielectric::default(),
            },
            reflection: Reflection::Fresnel,
            ..Material::default()
        };
        let scene = scenes::of_material(scenes::ball(128, 64), metal);
        let view = looking(DVec3::Y * 2.0, DVec3::NEG_Y, 1.2);
        for indirect in [0, 4] {
            let value = mean_radiance(&scene, &view, Beyond::Panorama, indirect, 64);
            // Half of the world is brighter by a hundredth.
            assert_near(value, 1.0, 0.02, &format!("roughness {roughness}, {indirect} bounces"));
        }
    }
}

/// A body of which the share `transmission` of the surface is glass.
fn glass(transmission: f32, roughness: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::ONE),
        reflectance: Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(0.0),
            roughness: ScalarInput::new(roughness),
            dielectric: Dielectric::default(),
        },
        reflection: Reflection::Fresnel,
        transmission: ScalarInput::new(transmission),
        volume: Some(Volume {
            thickness: 1.0,
            attenuation_color: Rgb::ONE,
            attenuation_distance: f32::INFINITY,
        }),
        ..Material::default()
    }
}

/// The radiance of a ball in a white world.
fn radiance_of_ball(material: Material, indirect: u8, samples: u32) -> f64 {
    let ball = Mesh { is_body: true, ..scenes::ball(128, 64) };
    let scene = scenes::of_material(ball, material);
    let view = looking(DVec3::Y * 2.0, DVec3::NEG_Y, 1.2);
    mean_radiance(&scene, &view, Beyond::Panorama, indirect, samples)
}

/// Light that a facet of rough glass sends to other facets leaves the glass later.
#[test]
fn rough_glass_vanishes_in_a_white_world() {
    for roughness in [0.25, 0.5, 0.8] {
        let value = radiance_of_ball(glass(1.0, roughness), 4, 256);
        assert_near(value, 1.0, 0.02, &format!("roughness {roughness}"));
    }
}

/// The glass above an opaque base reflects no light of the base a second time.
#[test]
fn half_transmitting_bodies_have_no_more_light_than_their_world() {
    let [few, many] = [2, 12].map(|indirect| radiance_of_ball(glass(0.5, 0.0), indirect, 256));
    assert!(few < many, "{few} {many}");
    assert_near(many, 1.0, 0.03, "half glass");
}
