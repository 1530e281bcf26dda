//! The Python modules of the Blender extension, for programs that run them in a Blender of the user.
#![deny(unsafe_code)]
#![warn(missing_docs)]

/// Lists modules by name, with their text.
macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!($name))),*]
    };
}

/// Name and text of each module. They belong into one folder.
pub const MODULES: &[(&str, &str)] = &modules![
    "__init__.py",
    "area_light.py",
    "bake.py",
    "bake_anisotropy.py",
    "bake_jobs.py",
    "bake_losses.py",
    "bake_material.py",
    "bake_mix.py",
    "bake_passes.py",
    "bake_routes.py",
    "bake_scene.py",
    "bake_unwrap.py",
    "bake_values.py",
    "camera.py",
    "conversion.py",
    "convert.py",
    "engine.py",
    "engine_export.py",
    "engine_panels.py",
    "engine_passes.py",
    "engine_settings.py",
    "engine_viewport.py",
    "export_hook.py",
    "export_options.py",
    "gltf_types.py",
    "import_camera.py",
    "import_hook.py",
    "import_lights.py",
    "import_scene.py",
    "import_values.py",
    "journal.py",
    "light_emission.py",
    "lost_objects.py",
    "material_extensions.py",
    "material_loss.py",
    "mesh_evaluation.py",
    "mesh_replacement.py",
    "node_links.py",
    "panorama.py",
    "principled.py",
    "punctual_light.py",
    "render_state.py",
    "scene_settings.py",
    "surface_nodes.py",
    "surface_substitutes.py",
    "surface_values.py",
    "texture_coordinates.py",
    "unused_alpha.py",
    "viewport_camera.py",
    "viewport_render.py",
    "world.py",
    "world_picture.py",
];

/// Name of the script that converts a .blend file.
pub const CONVERT: &str = "convert.py";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_modules_of_the_folder_are_listed() {
        let folder = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).unwrap();
        let names = folder.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = names.filter(|name| name.ends_with(".py")).collect();
        names.sort();
        let listed: Vec<_> = MODULES.iter().map(|(name, _)| *name).collect();
        assert!(names == listed && listed.contains(&CONVERT), "{names:?} {listed:?}");
    }
}
