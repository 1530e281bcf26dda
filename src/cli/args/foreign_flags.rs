//! Words of other programs, and what they are called here.

/// What a flag of f3d, Blender, Mitsuba or another renderer is called here; `None` for words that
/// nobody is known to use.
pub(crate) fn called_here(flag: &str) -> Option<&'static str> {
    let name = flag.split('=').next().unwrap_or(flag);
    WORDS.iter().find(|(words, _)| words.contains(&name)).map(|(_, here)| *here)
}

/// Flags, and what does the same here. f3d's names for cameras and sizes are aliases and not in here.
static WORDS: [(&[&str], &str); 42] = [
    // f3d
    (&["--ambient-occlusion"], "--ao SAMPLES"),
    (&["--anti-aliasing", "--anti-aliasing-mode"], "-s SAMPLES"),
    (&["--background-color", "--bg-color", "--bg"], "--background COLOR"),
    (&["--hdri-file", "--hdri-ambient", "--env", "--envmap", "--environment"], "--hdri FILE"),
    (&["--hdri-skybox"], "--background COLOR; --hdri FILE lights alone"),
    (&["--light-intensity"], "--light-scale F"),
    (&["--tone-mapping", "--tonemap", "--tonemapping"], "--view agx"),
    (&["--animation-index"], "--animation INDEX"),
    (&["--animation-time"], "--time SECONDS"),
    (&["--grid", "--floor"], "--ground plane"),
    (&["--color", "--diffuse"], "--kd COLOR"),
    (&["--specular"], "--ks COLOR"),
    (&["--roughness", "--metallic", "--exponent"], "--shininess P"),
    (&["--translucency-support", "--raytracing", "--rt"], "nothing: it is always so"),
    (&["--input", "--filename", "--file"], "the scene's name alone"),
    // Blender
    (&["-f", "--render-frame"], "--frame N"),
    (&["-a", "--render-anim"], "--frames"),
    (&["-e", "--frame-start", "--frame-end", "--frame-jump"], "--frames 1-48:2"),
    (&["--render-output", "--out", "--output-file"], "-o OUT"),
    (&["-F", "--render-format", "--format", "--file-format"], "-o with an ending: .png, .exr, .jpg, .webp"),
    (&["-E", "--engine", "--renderer"], "--integrator phong"),
    (&["-b"], "nothing: there never is a window"),
    (&["-S"], "--scene NAME"),
    (&["-P", "--python", "--python-expr"], "nothing: use the library blinn from Rust"),
    (&["-t", "-j", "--jobs"], "--threads N"),
    // Mitsuba and others
    (&["--spp", "--sample-count", "--samples-per-pixel", "--aa"], "-s SAMPLES"),
    (&["--sensor"], "--camera NAME|INDEX"),
    (&["-m", "--mode"], "--integrator phong"),
    (&["--no-progress"], "--progress none"),
    (&["-w", "--width", "--height", "--res", "--image-size"], "--size 1280x720"),
    (&["--fov", "--fovy", "--yFov", "--camera-fov"], "--yfov DEGREES"),
    (&["--eye", "--from", "--origin", "--position"], "--view-point X,Y,Z"),
    (&["--target", "--to", "--center", "--lookat", "--at"], "--look-at X,Y,Z"),
    (&["--up-axis", "--z-up"], "--up z"),
    (&["--transparent", "--alpha"], "--background transparent"),
    (&["--gamma", "--srgb"], "--view standard"),
    (&["--ev", "--brightness"], "--exposure EV"),
    (&["--frame-rate", "--framerate"], "--fps N"),
    (&["--force", "--overwrite"], "nothing: files are replaced, unless --no-overwrite says so"),
    (&["--layers", "--passes", "--normals", "--depth-map"], "--aov depth,normal"),
    (&["--shadow-radius", "--soft-shadows"], "--light-radius R"),
    (&["--json"], "blinn info --json, or --progress json"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::help;

    #[test]
    fn words_lead_to_flags_that_exist_and_hide_none() {
        let cli = help::full();
        let flags: Vec<String> = cli
            .get_subcommands()
            .flat_map(|c| c.get_arguments())
            .flat_map(|a| [a.get_long().map(|l| format!("--{l}")), a.get_short().map(|s| format!("-{s}"))])
            .flatten()
            .collect();
        for (words, here) in WORDS {
            for flag in here.split([' ', ',', ';']).filter(|w| w.starts_with('-')) {
                assert!(flags.iter().any(|f| f == flag), "{flag}");
            }
            for word in words {
                let own = cli.find_subcommand("render").into_iter().flat_map(|c| c.get_arguments());
                let mut names = own.flat_map(|a| a.get_long_and_visible_aliases().unwrap_or_default());
                assert!(!names.any(|name| *word == format!("--{name}")), "{word} is a flag itself");
            }
        }
    }
}
