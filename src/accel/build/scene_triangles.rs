//! The triangles of a posed scene, as trees take them.

use crate::accel::build::input_triangles::{InputTriangle, left_out};
use crate::accel::build::instancing_plan::{FlattenBudget, Member, Plan, World};
use crate::accel::build::surface_flags::MeshFlags;
use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::triangle_ids::TriangleIdMap;
use crate::accel::{BuildReport, Preset};
use crate::geometry::HitId;
use crate::scene::PosedScene;

impl BuildReport {
    /// What trees of a posed scene would leave out, without building them. Coincident triangles, which
    /// they do not, are not counted.
    pub fn count_degenerate(posed: &PosedScene) -> BuildReport {
        let plan = Plan::new(posed, FlattenBudget::DEFAULT, |mesh| MeshFlags::by_material(posed, mesh));
        let mut report = BuildReport::default();
        for world in [&plan.still, &plan.moving] {
            let (spans, count) = world_spans(posed, world);
            report.add(left_out(count, world_raw(posed, world, &spans)), 1);
        }
        for (&mesh, placed) in &plan.placed {
            let (count, raw) = mesh_raw(posed, mesh, &placed.look);
            report.add(left_out(count, raw), placed.instances.len() as u64);
        }
        report
    }
}

/// The triangles of a world.
pub(crate) fn world_raw<'a>(
    posed: &'a PosedScene,
    world: &'a World,
    spans: &'a TriangleIdMap,
) -> impl Fn(usize) -> InputTriangle + 'a {
    |i| {
        let (which, triangle) = spans.find(i as u32);
        let Member { instance, look, .. } = &world[which];
        let v = posed.world_triangle(HitId { instance: *instance, triangle });
        InputTriangle { v, look: look.of(triangle) }
    }
}

fn world_spans(posed: &PosedScene, world: &World) -> (TriangleIdMap, usize) {
    TriangleIdMap::new(
        world.iter().map(|member| (member.instance, posed.mesh(member.instance).triangles.len())),
    )
}

pub(crate) fn world_triangles(posed: &PosedScene, world: &World, preset: Preset) -> Blas {
    let (spans, count) = world_spans(posed, world);
    let finder = spans.clone();
    Blas::build((spans, count), world_raw(posed, world, &finder), preset)
}

fn mesh_raw<'a>(
    posed: &'a PosedScene,
    mesh: u32,
    look: &'a MeshFlags,
) -> (usize, impl Fn(usize) -> InputTriangle + 'a) {
    let mesh = &posed.scene.meshes[mesh as usize];
    let raw = move |i: usize| {
        let v = mesh.triangles[i].map(|v| mesh.positions[v as usize]);
        InputTriangle { v, look: look.of(i as u32) }
    };
    (mesh.triangles.len(), raw)
}

pub(crate) fn mesh_triangles(posed: &PosedScene, mesh: u32, look: &MeshFlags, preset: Preset) -> Blas {
    let (count, raw) = mesh_raw(posed, mesh, look);
    Blas::build(TriangleIdMap::new([(0, count)].into_iter()), raw, preset)
}
