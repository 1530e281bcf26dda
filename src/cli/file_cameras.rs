//! The cameras of a scene, as `blinn info` lists them.

use serde_json::{Value, json};

use super::light_sources::{coordinates, direction};
use blinn_scene::{FileProjection, PosedScene};

/// Lists the cameras of the file. Positions and directions are in world coordinates, as `--view-point`, `--view-dir` and
/// `--view-up` take them.
pub fn cameras(posed: &PosedScene) -> Vec<Value> {
    let cameras = posed.scene.cameras.iter().map(|camera| {
        let node = posed.node_to_world(camera.node);
        let (kind, yfov, ymag) = match camera.projection {
            FileProjection::Perspective { yfov, .. } => ("perspective", Some(yfov.to_degrees()), None),
            FileProjection::Orthographic { ymag, .. } => ("orthographic", None, Some(ymag)),
        };
        json!({
            "name": posed.scene.nodes[camera.node as usize].name,
            "kind": kind,
            "yfov_degrees": yfov,
            "ymag": ymag,
            "aspect": camera.aspect(),
            "znear": camera.znear,
            "zfar": camera.zfar.is_finite().then_some(camera.zfar),
            "position": coordinates(node.translation),
            "direction": direction(-node.matrix3.z_axis),
            "up": direction(node.matrix3.y_axis),
        })
    });
    cameras.collect()
}
