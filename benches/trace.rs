//! Build, rays and whole frames of the generated scan, and of a floor with a large texture. `cargo bench`;
//! ratios within one run are what counts, since machines drift (`blinn bench` is for more than that).

use std::hint::black_box;

use blinn::accel::{Accel, BuildSettings};
use blinn::bench::scenes::SceneKind;
use blinn::bench::{BenchRays, Workload};
use blinn::geometry::Rgba;
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Integrator, LowDiscrepancySampler, Phong, Sample, Scratch};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    Animation, Channel, ChannelTarget, Channels, ColorInput, Footprint, Image, Instance, Interpolation,
    Keyframes, Lighting, Material, Mesh, MipMaps, MorphTarget, Node, PoseSettings, PosedScene, Scene,
    TexelSemantics, Texels, Texture, TextureRef, UvTransform, View, pose,
};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Quat, Vec2, Vec3};

fn frame<'a>(posed: &'a PosedScene<'a>, accel: &'a Accel, settings: &RenderSettings) -> Frame<'a> {
    let (camera, _) = View::default().resolve(posed, settings.width, settings.height).unwrap();
    let lit = Lighting::default().resolve(posed, &camera);
    Frame::new(posed, accel, camera, &lit)
}

fn trace(c: &mut Criterion) {
    let subject = Workload::generate(SceneKind::Scan, 70_000).unwrap();
    let (scene, _) = load(&subject.file, &LoadOptions::default()).unwrap();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let settings = RenderSettings { width: 320, height: 180, samples: 1, ..Default::default() };
    let mut group = c.benchmark_group(subject.name.as_str());
    group.sample_size(10);
    group.bench_function("build", |b| b.iter(|| Accel::build(black_box(&posed), &BuildSettings::default())));

    let (accel, _) = Accel::build(&posed, &BuildSettings::default());
    let frame = frame(&posed, &accel, &settings);
    let rays = BenchRays::new(&frame, &settings);
    for (name, count, trace) in [
        ("eye rays", rays.eye_count(), BenchRays::trace_eye as fn(&BenchRays, &Accel, &PosedScene) -> u64),
        ("shadow rays", rays.hit_count(), BenchRays::trace_shadow),
        ("incoherent rays", rays.hit_count(), BenchRays::trace_incoherent),
    ] {
        group.throughput(Throughput::Elements(count));
        group.bench_function(name, |b| b.iter(|| trace(black_box(&rays), &accel, &posed)));
    }
    group.throughput(Throughput::Elements(u64::from(settings.width) * u64::from(settings.height)));
    group.bench_function("frame, two lights", |b| {
        b.iter(|| render(black_box(&frame), &Phong::default(), &settings, &()).unwrap())
    });
    group.finish();
}

/// A scan that is twisted about its axis by a clip: trees built anew for a moment, and trees that follow
/// it there from the one before; rays through both.
fn bending(c: &mut Criterion) {
    let subject = Workload::generate(SceneKind::Scan, 70_000).unwrap();
    let (mut scene, _) = load(&subject.file, &LoadOptions::default()).unwrap();
    let mesh = &mut scene.meshes[0];
    let twist = |p: &Vec3| Quat::from_rotation_y(2.5 * p.y) * *p - *p;
    let positions = mesh.positions.iter().map(twist).collect();
    mesh.morph_targets = vec![MorphTarget { positions, ..MorphTarget::default() }];
    mesh.morph_weights = vec![0.0];
    let target = ChannelTarget::Weights(scene.instances[0].node);
    let (times, values) = (vec![0.0, 1.0], vec![0.0, 1.0]);
    let keys = Keyframes { times, values, width: 1, interpolation: Interpolation::Linear };
    scene.animations =
        vec![Animation { name: String::new(), channels: vec![Channel { target, keyframes: keys }] }];
    let rest = pose(&scene, &PoseSettings::default()).unwrap();
    // At a third of the way trees that follow are nearly as long as they may become.
    let moments = [1.0 / 3.0, 1.0 / 3.0 - 1.0 / 24.0].map(|time| rest.at_time(time));
    let mut group = c.benchmark_group(format!("{}, twisted", subject.name));
    group.sample_size(10);
    let new = |posed: &PosedScene| Accel::build(posed, &BuildSettings::default()).0;
    group.bench_function("built anew", |b| b.iter(|| new(black_box(&moments[0]))));
    let mut kept = new(&rest);
    let mut next = moments.iter().cycle();
    group.bench_function("followed", |b| b.iter(|| kept.update(next.next().unwrap())));
    kept.update(&moments[0]);
    let settings = RenderSettings { width: 320, height: 180, samples: 1, ..Default::default() };
    for (name, accel) in [("new tree", new(&moments[0])), ("tree that followed", kept)] {
        let frame = frame(&moments[0], &accel, &settings);
        let rays = BenchRays::new(&frame, &settings);
        group.bench_function(format!("eye rays, {name}"), |b| b.iter(|| rays.trace_eye(&accel, &moments[0])));
        group.bench_function(format!("incoherent rays, {name}"), |b| {
            b.iter(|| rays.trace_incoherent(&accel, &moments[0]))
        });
    }
    group.finish();
}

/// Integrates with every sample a point: textures at their finest.
struct Points;

impl Integrator for Points {
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

/// A floor of tiles up to the horizon, of one photograph's size.
fn floor(side: u32) -> Scene {
    let texels = (0..side * side * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let (channels, texels) = (Channels::Rgb, Texels::U8(texels));
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

fn textures(c: &mut Criterion) {
    let scene = floor(4096);
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let (accel, _) = Accel::build(&posed, &BuildSettings::default());
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
    for (name, how) in [("points", &Points as &dyn Integrator), ("filtered", &Phong::default())] {
        group.bench_function(name, |b| b.iter(|| render(black_box(&frame), how, &settings, &()).unwrap()));
    }
    let wide = Footprint { dx: Vec2::X, dy: Vec2::Y };
    group.bench_function("pyramid of 4096 x 4096", |b| {
        let fresh = || vec![Image { mips: MipMaps::default(), ..scene.images[0].clone() }];
        b.iter_batched(
            fresh,
            |images| scene.textures[0].sample_filtered(&images, Vec2::ZERO, &wide, TexelSemantics::Color),
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, trace, bending, textures);
criterion_main!(benches);
