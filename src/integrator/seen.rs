//! The points that a batch of eye rays sees.

use glam::{DVec3, Vec3};

use super::coefficients::{Coefficients, add_look};
use super::columns::{Columns, Met, Rays, TOGETHER, vector};
use super::facet::{Facet, grazes};
use super::footprint::Spread;
use super::point::Point;
use super::triangles::ByTriangle;
use super::{Frame, Sample, Scratch};
use crate::geometry::{HitId, Ray, offset_point};

/// Memory that is used again from batch to batch.
#[derive(Default)]
pub(crate) struct Kept {
    columns: Columns,
    points: Vec<Point>,
    looks: Vec<Coefficients>,
    samples: Vec<usize>,
    by_triangle: ByTriangle,
}

/// The points of a batch: what is known of each, and of the triangles that they are on.
pub(super) struct Seen<'s> {
    pub points: Vec<Point>,
    /// What they look like, which many share: all but what the normals that a sample sees make of highlights.
    pub looks: Vec<Coefficients>,
    /// As many, once all points are made.
    pub columns: Columns,
    /// By the points on them, which follow each other: up to which.
    pub facets: Vec<(Facet<'s>, usize)>,
    /// Whose each point of the columns is.
    pub samples: Vec<usize>,
    by_triangle: ByTriangle,
}

impl<'s> Seen<'s> {
    /// No points; `kept` lends its memory.
    pub fn nothing(kept: &mut Kept) -> Seen<'s> {
        let Kept { mut columns, mut points, mut looks, mut samples, by_triangle } = std::mem::take(kept);
        columns.clear();
        points.clear();
        looks.clear();
        samples.clear();
        Seen { points, looks, columns, facets: Vec::new(), samples, by_triangle }
    }

    /// Gives the memory back.
    pub fn give_back(self, kept: &mut Kept) {
        let Seen { points, looks, columns, facets: _, samples, by_triangle } = self;
        *kept = Kept { columns, points, looks, samples, by_triangle };
    }

    /// Adds a look for points to have.
    #[inline(always)]
    pub fn add_look(&mut self, k: Coefficients) -> u32 {
        add_look(&mut self.looks, k)
    }

    /// What point `i` looks like.
    #[inline(always)]
    pub fn k(&self, i: usize) -> &Coefficients {
        &self.looks[self.points[i].look as usize]
    }

    /// Adds a point of the ground, where a ray along `d` meets it. It is at its height exactly.
    pub fn add_ground(&mut self, point: Point, p: Vec3, d: Vec3) {
        let (n, n_f32) = (DVec3::Y, Vec3::Y);
        let met = Met {
            p,
            clear: offset_point(p, Vec3::ZERO, n_f32, n_f32),
            n_g: n,
            n_v: n,
            b: [0.0; 3],
            spread: Spread::POINT,
        };
        let (group, at) = self.columns.more(1);
        group.put_one(at, d, &met);
        group.put_material(at, n, (1.0, 1.0));
        self.samples.push(point.sample);
        self.points.push(point);
    }

    /// Finds what the hits in `scratch` are on, by triangle, in columns for points yet to be made. `whose`
    /// says which of the samples each ray is of.
    pub fn find(&mut self, frame: &Frame<'s>, scratch: &Scratch, samples: &[Sample], whose: &[usize]) {
        let Seen { columns, facets, samples: all, by_triangle, .. } = self;
        by_triangle.sort(&scratch.hits);
        facets.reserve(by_triangle.count());
        let (origins, directions) = (&scratch.rays.origins, &scratch.rays.directions);
        let size = |hit: u32| samples[whose[hit as usize]].size;
        let (mut last_size, mut differential) = ([0.0; 2], None);
        let mut rays = Rays::NONE;
        for (id, first) in by_triangle.chains() {
            let facet = Facet::new(frame.posed, id);
            let mut at = Some(first);
            while let Some(hit) = at {
                if size(hit) != last_size {
                    last_size = size(hit);
                    differential = frame.differential(last_size);
                }
                let most = TOGETHER.min(columns.room());
                let mut count = 0;
                while let Some(hit) = at.filter(|&hit| count < most && size(hit) == last_size) {
                    rays.set(count, Ray { o: origins[hit as usize], d: directions[hit as usize] });
                    all.push(whose[hit as usize]);
                    count += 1;
                    at = by_triangle.after(hit);
                }
                facet.meet(frame.accel, &rays, count, differential, columns);
            }
            facets.push((facet, all.len()));
        }
    }

    /// The triangle of point `i`; `None` for one of the ground.
    #[inline(always)]
    pub fn facet(&self, i: usize) -> Option<&Facet<'s>> {
        self.facets.get(self.points[i].facet as usize).map(|(facet, _)| facet)
    }

    /// Shading normal of point `i`.
    #[inline(always)]
    pub fn n(&self, i: usize) -> DVec3 {
        let (group, at) = self.columns.of(i);
        vector(&group.n, at)
    }

    /// Where a shadow ray from point `i` towards `l` starts, and the triangle that cannot be in its way.
    pub fn start(&self, i: usize, l: DVec3) -> (Vec3, HitId) {
        let met = self.columns.met(i);
        let cos_g = met.n_g.dot(l);
        match self.facet(i) {
            Some(facet) if grazes(cos_g) => {
                // A light that the smooth surface sees and the triangle does not is seen past the
                // triangle's edge, or not at all.
                let source = if cos_g > 0.0 { facet.id } else { HitId::NONE };
                (facet.shadow_origin((met.p, met.b), (met.n_g, met.n_v), l), source)
            }
            _ => (met.clear, self.points[i].id),
        }
    }
}
