//! Caustics: light that specular surfaces send to matte ones. Random paths find it rarely, and then it is bright.
//!
//! Without [`Frame::caustics`], paths meet no specular lobes behind a diffuse bounce, and bodies of glass cast shadows, as in
//! Cycles without reflective and refractive caustics. Thin walls let light pass straight either way.

use glam::Vec3;

use crate::integrator::frame::Frame;
use crate::integrator::material::hit_filter::MaterialHitFilter;
use crate::integrator::paths::PathStates;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::set3;
use blinn_accel::HitFilter;
use blinn_core::geometry::{HitId, Rgb};

impl Frame<'_> {
    /// True if paths have no specular lobes behind a diffuse bounce.
    pub(crate) fn leaves_out_caustics(&self) -> bool {
        self.indirect > 0 && !self.caustics
    }
}

/// Removes specular lobes and the transmission of bodies from the points that paths meet behind a diffuse bounce.
pub(crate) fn remove_specular_lobes(frame: &Frame, batch: &mut ShadingBatch, states: PathStates) {
    for i in 0..batch.points.len() {
        let point = batch.points[i];
        if !states.is_indirect(point.path) {
            continue;
        }
        let (block, lane) = batch.soa.lane_mut(i);
        set3(&mut block.k.k_s, lane, [0.0; 3]);
        if frame.is_body(point.id) {
            block.k.remove_transmission(lane);
        }
        if block.reflects(lane) {
            block.remove_specular_layers(lane);
        }
    }
}

/// The hit filter of shadow rays that bodies block, whose light other rays find.
pub(crate) struct OpaqueBodies<'a> {
    pub filter: MaterialHitFilter<'a>,
    /// True if bodies of glass are among them.
    pub blocks_glass: bool,
}

impl HitFilter for OpaqueBodies<'_> {
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        self.filter.accepts(id, o, d)
    }

    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Rgb {
        if self.filter.is_body(id) && (self.blocks_glass || self.filter.diffuses_inside(id)) {
            Rgb::splat(self.filter.uncovered(id, o, d))
        } else {
            self.filter.transmittance(id, o, d)
        }
    }
}
