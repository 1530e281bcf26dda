//! The points that a batch of eye rays sees.

use glam::{DVec3, Vec3};

use crate::geometry::{HitId, Ray, Rgb, offset_ray_origin};
use crate::integrator::direct_light::Reached;
use crate::integrator::material::coefficients::{Coefficients, add_look};
use crate::integrator::point::Point;
use crate::integrator::surface::hits_by_triangle::ByTriangle;
use crate::integrator::surface::points::{Columns, Met, Rays, TOGETHER, narrow, vector};
use crate::integrator::surface::ray_differentials::Spread;
use crate::integrator::surface::shading_triangle::Facet;
use crate::integrator::surface::shadow_terminator::start;
use crate::integrator::{Frame, Sample, Scratch};

/// Memory that is used again from batch to batch.
#[derive(Default)]
pub(crate) struct Kept {
    columns: Columns,
    points: Vec<Point>,
    looks: Vec<Coefficients>,
    samples: Vec<usize>,
    by_triangle: ByTriangle,
    reached: Vec<Reached>,
}

/// The points of a batch: what is known of each, and of the triangles that they are on.
pub(crate) struct Seen<'s> {
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
    /// Those that the light at hand reaches, if nothing is in its way.
    pub reached: Vec<Reached>,
}

impl<'s> Seen<'s> {
    /// No points; `kept` lends its memory.
    pub fn nothing(kept: &mut Kept) -> Seen<'s> {
        let Kept { mut columns, mut points, mut looks, mut samples, by_triangle, reached } =
            std::mem::take(kept);
        columns.clear();
        points.clear();
        looks.clear();
        samples.clear();
        Seen { points, looks, columns, facets: Vec::new(), samples, by_triangle, reached }
    }

    /// Gives the memory back.
    pub fn give_back(self, kept: &mut Kept) {
        let Seen { points, looks, columns, facets: _, samples, by_triangle, reached } = self;
        *kept = Kept { columns, points, looks, samples, by_triangle, reached };
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

    /// Adds a point of the ground, where a ray along `d` meets it, with its light without lights. It is at its
    /// height exactly.
    pub fn add_ground(&mut self, point: Point, (p, d): (Vec3, Vec3), k: &Coefficients, unlit: Rgb) {
        let (n, n_f32) = (DVec3::Y, Vec3::Y);
        let met = Met {
            p,
            clear: offset_ray_origin(p, Vec3::ZERO, n_f32, n_f32),
            up: Vec3::ZERO,
            n_g: n,
            n_v: n,
            b: [0.0; 3],
            spread: Spread::POINT,
        };
        let (group, at) = self.columns.more(1);
        group.put_one(at, d, &met);
        group.shading.put(at, n, (k, 1.0), unlit);
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
        // Mostly all have one.
        let sizes_differ = samples.iter().any(|sample| sample.size != samples[0].size);
        let mut rays = Rays::NONE;
        let mut theirs = [0; TOGETHER];
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
                let goes_along = |hit: &u32| !sizes_differ || size(*hit) == last_size;
                while let Some(hit) = at.filter(|hit| count < most && goes_along(hit)) {
                    rays.set(count, Ray { o: origins[hit as usize], d: directions[hit as usize] });
                    theirs[count] = whose[hit as usize];
                    count += 1;
                    at = by_triangle.after(hit);
                }
                all.extend_from_slice(&theirs[..count]);
                facet.meet(frame.accel, &rays, count, differential, columns);
            }
            facets.push((facet, all.len()));
        }
    }

    /// Shading normal of point `i`.
    #[inline(always)]
    pub fn n(&self, i: usize) -> DVec3 {
        let (group, at) = self.columns.of(i);
        group.shading.n(at)
    }

    /// Where a shadow ray from point `i` towards `l` starts, and the triangle that cannot be in its way.
    pub fn start(&self, i: usize, l: DVec3) -> (Vec3, HitId) {
        let (group, at) = self.columns.of(i);
        let cos_g = vector(&group.n_g, at).dot(l);
        (start(narrow(&group.clear, at), narrow(&group.up, at), cos_g), self.source(i, cos_g > 0.0))
    }

    /// The triangle that cannot be in the way of light to point `i`. Light that the smooth surface sees and the
    /// triangle does not is not `above` it: it is seen past the triangle's edge, or not at all.
    #[inline(always)]
    pub fn source(&self, i: usize, above: bool) -> HitId {
        if above { self.points[i].id } else { HitId::NONE }
    }
}
