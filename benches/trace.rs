//! Benchmarks of BVH build, refit, rays and whole frames, and of texture filtering (`cargo bench`).
//!
//! Compare results of one run only: machines drift between runs. `blinn bench` measures more than this.

use std::hint::black_box;

use blinn::accel::{Accel, AccelSettings};
use blinn::geometry::Rgba;
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Integrator, LowDiscrepancySampler, Phong, Sample, Scratch};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    Animation, Channel, ChannelTarget, Channels, ColorInput, Footprint, Image, Instance, Interpolation,
    Keyframes, Lighting, Material, Mesh, MipMaps, MorphTarget, Node, PoseSettings, PosedScene, Scene,
    TexelSemantics, Texels, Texture, TextureRef, UvTransform, View, pose,
};
use blinn_bench::scenes::SceneKind;
use blinn_bench::{BenchStage, RaySet, RaySets, Workload};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Quat, Vec2, Vec3};

fn frame<'a>(posed: &'a PosedScene<'a>, accel: &'a Accel, settings: &RenderSettings) -> Frame<'a> {
    let (camera, _) = View::default().resolve(posed, settings.width, settings.height).unwrap();
    let lit = Lighting::default().resolve(posed, &camera);
    Frame::new(posed, accel, camera, &lit)
}

/// The rays of these stages.
fn ray_sets<const N: usize>(
    frame: &Frame,
    settings: &RenderSettings,
    stages: [BenchStage; N],
) -> Vec<RaySet> {
    let mut sets = RaySets::new(frame, settings);
    let mut out = Vec::new();
    while let Some(set) = sets.next_set() {
        if stages.contains(&set.stage) {
            out.push(set.clone());
        }
    }
    assert_eq!(out.len(), N);
    out
}

/// Build, rays and a frame of the generated scan.
fn scan(c: &mut Criterion) {
    let subject = Workload::generate(SceneKind::Scan, 70_000).unwrap();
    let (scene, _) = load(&subject.file, &LoadOptions::default()).unwrap();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let settings = RenderSettings { width: 320, height: 180, samples: 1, ..Default::default() };
    let mut group = c.benchmark_group(subject.name.as_str());
    group.sample_size(10);
    group.bench_function("build", |b| b.iter(|| Accel::build(black_box(&posed), &AccelSettings::default())));

    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let frame = frame(&posed, &accel, &settings);
    for set in ray_sets(&frame, &settings, [BenchStage::Eye, BenchStage::Shadow, BenchStage::Bounce1]) {
        group.throughput(Throughput::Elements(set.len()));
        let name = format!("{} rays", set.stage.name());
        group.bench_function(name, |b| b.iter(|| black_box(&set).trace(&accel, &posed)));
    }
    group.throughput(Throughput::Elements(u64::from(settings.width) * u64::from(settings.height)));
    group.bench_function("frame, two lights", |b| {
        b.iter(|| render(black_box(&frame), &Phong::default(), &settings, &()).unwrap())
    });
    group.finish();
}

/// A scan that an animation twists about its axis: rebuilding the BVH for a frame against refitting that of the
/// frame before, and rays through both.
fn deforming(c: &mut Criterion) {
    let subject = Workload::generate(SceneKind::Scan, 70_000).unwrap();
    let (mut scene, _) = load(&subject.file, &LoadOptions::default()).unwrap();
    let mesh = &mut scene.meshes[0];
    let twist = |p: &Vec3| Quat::from_rotation_y(2.5 * p.y) * *p - *p;
    let positions = mesh.positions.iter().map(twist).collect();
    mesh.morph_targets = vec![MorphTarget { positions, ..MorphTarget::default() }];
    mesh.morph_weights = vec![0.0];
    let target = ChannelTarget::Weights(scene.instances[0].node);
    let linear = vec![0.0, 1.0];
    let keys =
        Keyframes { times: linear.clone(), values: linear, width: 1, interpolation: Interpolation::Linear };
    scene.animations =
        vec![Animation { name: String::new(), channels: vec![Channel { target, keyframes: keys }] }];
    let rest = pose(&scene, &PoseSettings::default()).unwrap();
    // At a third of the way the cost of the refitted BVH is close to the limit at which it is rebuilt.
    let poses = [1.0 / 3.0, 1.0 / 3.0 - 1.0 / 24.0].map(|time| rest.at_time(time));
    let mut group = c.benchmark_group(format!("{}, twisted", subject.name));
    group.sample_size(10);
    let build = |posed: &PosedScene| Accel::build(posed, &AccelSettings::default()).0;
    group.bench_function("rebuild", |b| b.iter(|| build(black_box(&poses[0]))));
    let mut refitted = build(&rest);
    let mut next = poses.iter().cycle();
    group.bench_function("refit", |b| b.iter(|| refitted.update(next.next().unwrap())));
    refitted.update(&poses[0]);
    let settings = RenderSettings { width: 320, height: 180, samples: 1, ..Default::default() };
    for (name, accel) in [("rebuilt BVH", build(&poses[0])), ("refitted BVH", refitted)] {
        let frame = frame(&poses[0], &accel, &settings);
        for set in ray_sets(&frame, &settings, [BenchStage::Eye, BenchStage::Bounce1]) {
            group.bench_function(format!("{} rays, {name}", set.stage.name()), |b| {
                b.iter(|| set.trace(&accel, &poses[0]))
            });
        }
    }
    group.finish();
}

/// Integrates with samples without footprint: textures are sampled at full resolution.
struct PointSamples;

impl Integrator for PointSamples {
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        draws: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    ) {
        let points: Vec<Sample> = samples.iter().map(|s| Sample { footprint: [0.0; 2], ..*s }).collect();
        Phong::default().render(frame, &points, draws, scratch, out);
    }
}

/// A floor to the horizon, tiled with a texture of `side` × `side` texels.
fn floor(side: u32) -> Scene {
    let texels = (0..side * side * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let channels = Channels::Rgb;
    let texels = Texels::U8(texels);
    let image =
        Image { name: String::new(), width: side, height: side, channels, texels, mips: MipMaps::default() };
    let texture = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::IDENTITY };
    let corners = [(-1.0f32, -1.0f32), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let mesh = Mesh {
        positions: corners.map(|(x, z)| Vec3::new(x * 100.0, 0.0, z * 100.0)).to_vec(),
        uvs: vec![corners.map(|(x, z)| Vec2::new(x, z) * 10.0).to_vec()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    };
    let base = ColorInput { factor: Vec3::ONE, texture: Some(texture) };
    Scene {
        nodes: vec![Node { visible: true, ..Default::default() }],
        meshes: vec![mesh],
        materials: vec![Material { base_color: base, double_sided: true, ..Default::default() }],
        textures: vec![Texture::default()],
        images: vec![image],
        instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
        ..Default::default()
    }
}

/// Texture filtering: a frame of the floor with point samples and filtered, and building mip maps.
fn textures(c: &mut Criterion) {
    let scene = floor(4096);
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 320, height: 180, samples: 1, ..Default::default() };
    let view = View {
        view_point: Some(DVec3::new(0.0, 1.5, 0.0)),
        view_dir: Some(DVec3::new(0.0, -0.2, -1.0)),
        ..Default::default()
    };
    let (camera, _) = view.resolve(&posed, settings.width, settings.height).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    let mut group = c.benchmark_group("textured floor");
    group.sample_size(10);
    for (name, how) in [("point samples", &PointSamples as &dyn Integrator), ("filtered", &Phong::default())]
    {
        group.bench_function(name, |b| b.iter(|| render(black_box(&frame), how, &settings, &()).unwrap()));
    }
    let wide = Footprint { dx: Vec2::X, dy: Vec2::Y };
    group.bench_function("mip maps of 4096 x 4096", |b| {
        let fresh = || vec![Image { mips: MipMaps::default(), ..scene.images[0].clone() }];
        b.iter_batched(
            fresh,
            |images| scene.textures[0].sample_filtered(&images, Vec2::ZERO, &wide, TexelSemantics::Color),
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, scan, deforming, textures);
criterion_main!(benches);
