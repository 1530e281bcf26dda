//! The triangles of a posed scene as input of BVH builds: of world BVHs and of instanced meshes.

use glam::Vec3;

use crate::build::blas_builder::build_blas;
use crate::build::input_triangles::{InputTriangle, count_rejected};
use crate::build::instancing_plan::{FlattenedInstance, InstancingPlan, World};
use crate::build::mesh_flags::MeshFlags;
use crate::bvh::blas::Blas;
use crate::bvh::triangle_ids::TriangleIdMap;
use crate::report::BuildReport;
use crate::rounds::Rounds;
use crate::settings::{FlattenBudget, Preset};
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::Transform;
use blinn_scene::PosedScene;

impl BuildReport {
    /// Counts the triangles, points and lines that a build would reject, without building. Does not count coincident ones.
    pub fn count_degenerate(posed: &PosedScene) -> BuildReport {
        let flags = |mesh| MeshFlags::by_material(posed, mesh);
        let plan = InstancingPlan::new(posed, FlattenBudget::DEFAULT, flags);
        let mut report = BuildReport::default();
        for world in [&plan.static_world, &plan.dynamic_world] {
            let (ids, count) = world_ids(posed, world);
            report.add(count_rejected(count, world_triangles(posed, world, &ids)), 1);
        }
        for (&mesh, instanced) in &plan.instanced {
            let count = posed.scene.meshes[mesh as usize].triangles.len();
            let rejected = count_rejected(count, mesh_triangles(posed, mesh, &instanced.flags));
            report.add(rejected, instanced.instances.len() as u64);
        }
        report.non_finite_rounds = Rounds::count_non_finite(posed);
        report
    }
}

/// Builds a world BVH.
pub(crate) fn build_world_blas(
    posed: &PosedScene,
    world: &World,
    preset: Preset,
    cancel: &CancelToken,
) -> Result<Blas, Cancelled> {
    let (ids, count) = world_ids(posed, world);
    let triangles = world_triangles(posed, world, &ids);
    Ok(Blas { ids: ids.clone(), ..build_blas(count, triangles, preset, cancel)? })
}

/// Builds the BLAS of an instanced mesh.
pub(crate) fn build_mesh_blas(
    posed: &PosedScene,
    mesh: u32,
    flags: &MeshFlags,
    preset: Preset,
    cancel: &CancelToken,
) -> Result<Blas, Cancelled> {
    let count = posed.scene.meshes[mesh as usize].triangles.len();
    let (ids, _) = TriangleIdMap::new([(0, count)].into_iter());
    Ok(Blas { ids, ..build_blas(count, mesh_triangles(posed, mesh, flags), preset, cancel)? })
}

fn world_ids(posed: &PosedScene, world: &World) -> (TriangleIdMap, usize) {
    TriangleIdMap::new(
        world
            .iter()
            .map(|FlattenedInstance { instance, .. }| (*instance, posed.mesh(*instance).triangles.len())),
    )
}

/// The triangles of a world BVH, by index.
pub(crate) fn world_triangles<'a>(
    posed: &'a PosedScene,
    world: &'a World,
    ids: &'a TriangleIdMap,
) -> impl Fn(usize) -> InputTriangle + 'a {
    let instances: Vec<WorldInstance> = world
        .iter()
        .map(|FlattenedInstance { instance, flags, .. }| WorldInstance {
            transform: &posed.instances[*instance as usize].transform,
            positions: posed.positions(*instance),
            triangles: &posed.mesh(*instance).triangles,
            flags,
        })
        .collect();
    move |i| {
        let (position, triangle) = ids.locate(i as u32);
        instances[position].triangle(triangle)
    }
}

/// A mesh in world space. Looked up once, not for each triangle.
struct WorldInstance<'a> {
    transform: &'a Transform,
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    flags: &'a MeshFlags,
}

impl WorldInstance<'_> {
    /// Returns a triangle as [`PosedScene::world_triangle`] does.
    #[inline(always)]
    fn triangle(&self, triangle: u32) -> InputTriangle {
        let vertex = |v: u32| self.transform.point(self.positions[v as usize]);
        let [a, b, c] = self.triangles[triangle as usize];
        InputTriangle { vertices: [vertex(a), vertex(b), vertex(c)], flags: self.flags.get(triangle) }
    }
}

/// The triangles of a mesh in local space, by index.
fn mesh_triangles<'a>(
    posed: &'a PosedScene,
    mesh: u32,
    flags: &'a MeshFlags,
) -> impl Fn(usize) -> InputTriangle + 'a {
    let mesh = &posed.scene.meshes[mesh as usize];
    move |i| {
        let vertices = mesh.triangles[i].map(|v| mesh.positions[v as usize]);
        InputTriangle { vertices, flags: flags.get(i as u32) }
    }
}
