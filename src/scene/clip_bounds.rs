//! A scene over the whole of its clip: what must not change from frame to frame is taken from here.

use glam::DVec3;

use super::pose::playing;
use super::{AnimationChoice, PoseError, PoseSettings, Scene, pose};
use crate::geometry::Aabb;

/// Moments at which a clip is looked at, both ends counted.
const MOMENTS: u32 = 33;

/// The bounds of all that is visible over the clip that plays, in world coordinates: looked at in 33
/// moments, evenly from its start to its end.
///
/// # Errors
/// An animation index that the scene does not have.
pub fn clip_bounds(scene: &Scene, animation: &AnimationChoice) -> Result<Aabb, PoseError> {
    let ends = playing(scene, animation)?.iter().map(|a| f64::from(a.duration())).fold(0.0, f64::max);
    let moments = if ends > 0.0 && ends.is_finite() { MOMENTS } else { 1 };
    let mut bounds = Aabb::EMPTY;
    for i in 0..moments {
        let time = ends * f64::from(i) / f64::from(MOMENTS - 1);
        let at = PoseSettings { time, animation: animation.clone(), centre: Some(DVec3::ZERO) };
        bounds.join(&pose(scene, &at)?.bounds());
    }
    Ok(bounds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Animation, Channel, Instance, Interpolation, Keys, Local, Mesh, Node, Target};
    use glam::{DQuat, Vec3};

    #[test]
    fn a_ball_that_falls_has_its_ground_where_it_lands() {
        let local = Local::Trs { translation: DVec3::Y * 7.0, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        let mesh = Mesh { positions: vec![Vec3::NEG_ONE, Vec3::ONE], ..Mesh::default() };
        let keys = Keys {
            times: vec![0.0, 1.0, 2.0],
            values: vec![0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 3.0, 4.0, 0.0],
            width: 3,
            interpolation: Interpolation::Linear,
        };
        let channel = Channel { target: Target::Translation(0), keys };
        let scene = Scene {
            nodes: vec![Node { local, visible: true, ..Node::default() }],
            meshes: vec![mesh],
            instances: vec![Instance { node: 0, mesh: 0, object: 1, placement: None, skin: None }],
            animations: vec![Animation { name: String::new(), channels: vec![channel] }],
            ..Scene::default()
        };
        let bounds = clip_bounds(&scene, &AnimationChoice::Default).unwrap();
        assert_eq!((bounds.min, bounds.max), (DVec3::new(-1.0, -1.0, -1.0), DVec3::new(4.0, 6.0, 1.0)));
        let rest = clip_bounds(&scene, &AnimationChoice::Rest).unwrap();
        assert_eq!((rest.min.y, rest.max.y), (6.0, 8.0));
    }
}
