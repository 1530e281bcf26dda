//! Animations of a scene that do not play.

use crate::error::SessionError;
use crate::log::SessionLog;
use crate::notice::Notice;
use blinn_scene::{Animation, AnimationChoice, Scene, active_animations};

/// Notes the animations that do not play because they have the same targets as others.
pub(crate) fn log_idle_animations(
    scene: &Scene,
    choice: &AnimationChoice,
    log: &dyn SessionLog,
) -> Result<(), SessionError> {
    let (active, idle) = scene.animations.split_at(active_animations(scene, choice)?.len());
    if *choice == AnimationChoice::Default && !idle.is_empty() {
        let names =
            |list: &[Animation]| list.iter().map(|a| format!("'{}'", a.name)).collect::<Vec<_>>().join(", ");
        let (active, idle) = (names(active), names(idle));
        log.note(Notice::IdleAnimations { active, idle });
    }
    Ok(())
}
