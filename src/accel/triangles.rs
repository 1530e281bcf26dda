//! A tree over triangles in one frame.

use glam::{DVec3, Vec3};

use super::clean::{Alike, Cleaned, Face, Look, Raw, clean};
use super::hit::{Corners, TestRay};
use super::query::{Ids, Query};
use super::tree::{Box3, BoxRay, Stack, Tree};
use super::{CleanReport, Preset};

/// Triangles and the tree over them.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    tree: Tree,
    /// In the order of the leaves. Apart from `faces`, which hits alone need.
    corners: Vec<Corners>,
    faces: Vec<Face>,
    groups: Vec<Vec<Alike>>,
    /// Around all of them; `None` where there are none.
    pub bounds: Option<Box3>,
    pub report: CleanReport,
    centre: DVec3,
    radius: f64,
}

/// A ray in the frame of a tree. Its parameter times `unit` is the caller's t.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameRay {
    pub o: Vec3,
    pub d: Vec3,
    pub unit: f64,
}

impl FrameRay {
    /// A ray whose direction is brought to about unit length by a power of two, so that neither
    /// huge nor tiny directions overflow anything. `None` for rays that are nowhere or go nowhere.
    pub fn new(o: Vec3, d: Vec3) -> Option<FrameRay> {
        let size = d.abs().max_element();
        if !(o.is_finite() && d.is_finite() && size > 0.0) {
            return None;
        }
        // The power of two below `size`: its exponent alone, read from the bits of the f64.
        let power = f64::from_bits(f64::from(size).to_bits() & 0x7ff0_0000_0000_0000);
        let unit = 1.0 / power;
        Some(FrameRay { o, d: (d.as_dvec3() * unit).as_vec3(), unit })
    }

    /// A caller's t as this ray's parameter.
    pub fn parameter(&self, t: f32) -> f32 {
        (f64::from(t) / self.unit) as f32
    }

    /// What trees need to know of the limit and start of a query.
    pub fn limit(&self, query: &impl Query) -> f32 {
        BoxRay::limit(self.parameter(query.limit()))
    }
}

impl Triangles {
    /// A tree over `raw(0..count)`, which come by rising id.
    pub fn build(count: usize, raw: impl Fn(usize) -> Raw + Sync, preset: Preset) -> Triangles {
        let Cleaned { boxes, sizes, corners, faces, groups, report } = clean(count, raw);
        let (mut tree, order) = Tree::build(&boxes, preset);
        let mut starts = Vec::with_capacity(sizes.len());
        let mut sum = 0;
        for &size in &sizes {
            starts.push(sum);
            sum += size;
        }
        tree.widen(&order.iter().map(|&slot| sizes[slot as usize]).collect::<Vec<_>>());
        let entries = || {
            order.iter().flat_map(|&slot| {
                let first = starts[slot as usize] as usize;
                first..first + sizes[slot as usize] as usize
            })
        };
        let bounds = boxes.into_iter().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let (lo, hi) = bounds.map_or((DVec3::ZERO, DVec3::ZERO), |(a, b)| (a.as_dvec3(), b.as_dvec3()));
        Triangles {
            corners: entries().map(|i| corners[i]).collect(),
            faces: entries().map(|i| faces[i].clone()).collect(),
            tree,
            groups,
            bounds,
            report,
            centre: 0.5 * (lo + hi),
            radius: 0.5 * lo.distance(hi),
        }
    }

    /// Tells `query` of the triangles that `ray` meets, in any order. False once it has stopped.
    /// `instance` is whose triangles they are, where a shared mesh does not say.
    pub fn visit<Q: Query>(
        &self,
        ray: &FrameRay,
        instance: Option<u32>,
        query: &mut Q,
        stack: &mut Stack,
    ) -> bool {
        let boxes = BoxRay::new(ray.o, ray.d, 0.0, ray.parameter(query.start()));
        let test = TestRay::new(ray.o, ray.d, ray.unit, self.centre, self.radius);
        let mut limit = ray.limit(query);
        self.tree.walk(&boxes, stack, limit, |entries, _| {
            let first = entries.start;
            for (i, corners) in self.corners[entries].iter().enumerate() {
                if !test.may_hit(corners) {
                    continue;
                }
                let Some(met) = test.meet(corners) else { continue };
                let mut tell = |look: Look, ids| {
                    let back = met.against == look.reversed;
                    query.meet(met.t, look, back, Ids { ids, instance })
                };
                let stopped = match &self.faces[first + i] {
                    Face::One(id, look) => tell(*look, std::slice::from_ref(id)).is_break(),
                    Face::Many(group) => {
                        self.groups[*group as usize].iter().any(|a| tell(a.look, &a.ids).is_break())
                    }
                };
                if stopped {
                    return None;
                }
                limit = ray.limit(query);
            }
            Some(limit)
        })
    }

    /// True where no triangle can be hit.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Entries: triangles, coincident ones counted once.
    pub fn entries(&self) -> usize {
        self.corners.len()
    }

    /// Inner nodes of its tree.
    pub fn nodes(&self) -> usize {
        self.tree.nodes()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        let lists: usize = self.groups.iter().flatten().map(|a| a.ids.len() * size_of::<u64>()).sum();
        self.tree.bytes()
            + self.corners.capacity() * size_of::<Corners>()
            + self.faces.capacity() * size_of::<Face>()
            + lists
    }
}
