//! Flags and commands of f3d, Blender, Mitsuba and other programs, and their equivalents here.

/// The equivalent of another program's flag: an option here, or an explanation why none is needed.
pub enum Equivalent {
    Use(&'static str),
    Unneeded(&'static str),
}

use Equivalent::{Unneeded, Use};

/// Looks up a command that other programs have, and returns how to do the same here.
pub fn command(word: &str) -> Option<&'static str> {
    COMMANDS.iter().find(|(words, _)| words.contains(&word)).map(|(_, usage)| *usage)
}

static COMMANDS: [(&[&str], &str); 7] = [
    (&["thumbnail", "thumb", "thumbnails"], "blinn render SCENE --max-size 256"),
    (&["compare", "cmp", "flip"], "blinn diff OLD NEW"),
    (&["dataset", "datasets", "coco", "bop", "nerf"], "blinn turntable SCENE --views N --dataset FORMATS"),
    (&["animate", "spin", "video", "orbit"], "blinn turntable SCENE"),
    (&["open", "show", "preview", "gui", "serve"], "blinn view SCENE"),
    (&["inspect", "stat", "stats", "print", "validate"], "blinn info SCENE"),
    (&["contact-sheet", "drawing", "dimensions"], "blinn sheet SCENE"),
];

/// Looks up a flag of another program.
pub fn flag(flag: &str) -> Option<&'static Equivalent> {
    // Scripts in Python write underscores.
    let name = flag.split('=').next().unwrap_or(flag).replace('_', "-");
    let mut entries = FLAGS.iter().chain(DATASET_FLAGS);
    entries.find(|(names, _)| names.contains(&name.as_str())).map(|(_, equivalent)| equivalent)
}

/// Looks up a flag that a command lacks, although other commands have it or it could be expected.
pub fn flag_of_command(command: &str, flag: &str) -> Option<&'static str> {
    let name = flag.split('=').next().unwrap_or(flag);
    let mut entries = FLAGS_OF_COMMANDS.iter();
    entries.find(|(of, names, _)| *of == command && names.contains(&name)).map(|(_, _, hint)| *hint)
}

static FLAGS_OF_COMMANDS: [(&str, &[&str], &str); 3] = [
    (
        "bench",
        &["--camera", "--cameras", "--view-point", "--look-at", "--yfov", "--azimuth", "--elevation"],
        "cameras are those of manifest.toml in the folder of --scenes",
    ),
    (
        "bench",
        &["-o", "--output", "--out"],
        "use --json FILE.json, --csv FILE.csv, --markdown FILE.md or --report FILE.html",
    ),
    ("bench", &["--simd"], "set the environment variable BLINN_SIMD to portable, avx2 or avx512"),
];

/// Flags of other programs. f3d's names of cameras and sizes are aliases and not listed.
static FLAGS: &[(&[&str], Equivalent)] = &[
    // f3d
    (&["--ambient-occlusion"], Use("--ao SAMPLES")),
    (&["--anti-aliasing", "--anti-aliasing-mode"], Use("-s SAMPLES")),
    (&["--background-color", "--bg-color", "--bg"], Use("--background COLOR")),
    (&["--hdri-file", "--hdri-ambient", "--env", "--envmap", "--environment"], Use("--hdri FILE")),
    (&["--hdri-skybox", "--skybox"], Use("--background hdri, with --hdri FILE")),
    (&["--light-intensity"], Use("--light-scale F")),
    (&["--tone-mapping", "--tonemap", "--tonemapping"], Use("--view agx")),
    (&["--animation-index"], Use("--animation INDEX")),
    (&["--animation-time"], Use("--time SECONDS")),
    (&["--grid", "--floor"], Use("--ground plane")),
    (&["--diffuse"], Use("--kd COLOR")),
    (&["--specular"], Use("--ks COLOR")),
    (&["--roughness", "--metallic", "--exponent"], Use("--shininess P")),
    (&["--translucency-support", "--raytracing", "--rt"], Unneeded("it is always enabled")),
    (&["--input", "--filename", "--file"], Use("the scene's file name without a flag")),
    // Blender
    (&["-f", "--render-frame"], Use("--frame N")),
    (&["-a", "--render-anim"], Use("--frames")),
    (&["-e", "--frame-start", "--frame-end", "--frame-jump"], Use("--frames 1-48:2")),
    (&["--render-output", "--out", "--output-file"], Use("-o OUT")),
    (&["-F", "--render-format", "--file-format"], Use("-o with an extension: .png, .exr, .jpg, .webp")),
    (&["-E", "--engine"], Unneeded("blinn is the engine, which has -s SAMPLES and --indirect N")),
    (&["--renderer"], Use("--integrator phong")),
    (&["-b"], Unneeded("no window is ever opened")),
    (&["-x", "--use-extension"], Unneeded("the extension of -o is the format")),
    (&["-y", "-Y", "--enable-autoexec", "--disable-autoexec"], Unneeded("scripts of .blend files never run")),
    (&["--factory-startup"], Unneeded("files are converted without preferences")),
    (&["--cycles-device"], Unneeded("pictures are rendered on the processor; --threads N limits its use")),
    (&["-S"], Use("--scene NAME")),
    (&["-P", "--python", "--python-expr"], Unneeded("use the Rust library blinn")),
    (&["-t", "-j", "--jobs"], Use("--threads N")),
    // Mitsuba and others
    (&["--spp", "--sample-count", "--samples-per-pixel", "--aa"], Use("-s SAMPLES")),
    (&["--sensor"], Use("--camera NAME|INDEX")),
    (&["-m", "--mode"], Use("--integrator phong")),
    (&["--no-progress"], Use("--progress none")),
    (&["-w", "--width", "--height", "--res", "--image-size"], Use("--size 1280x720")),
    (&["--fov", "--fovy", "--yFov", "--camera-fov"], Use("--yfov DEGREES")),
    (&["--eye", "--from", "--origin", "--position"], Use("--view-point X,Y,Z")),
    (&["--target", "--to", "--center", "--lookat", "--at"], Use("--look-at X,Y,Z")),
    (&["--up-axis", "--z-up"], Use("--up z")),
    (&["--transparent", "--alpha"], Use("--background transparent")),
    (&["--srgb"], Use("--view standard")),
    (&["--ev", "--brightness"], Use("--exposure EV")),
    (&["--frame-rate", "--framerate"], Use("--fps N")),
    (&["--force", "--overwrite"], Unneeded("files are overwritten unless --no-overwrite is set")),
    (&["--layers", "--passes", "--normals", "--depth-map"], Use("--aov depth,normal")),
    (&["--shadow-radius", "--soft-shadows"], Use("--light-radius R")),
    (&["--ortho", "--orthographic", "--parallel"], Use("--projection orthographic")),
    (&["--units", "--unit"], Use("--scale F, the length of the file's unit in metres")),
    (&["--lens", "--focal-length"], Use("--yfov DEGREES")),
    (&["--film-transparent"], Use("--background transparent")),
    (&["--shadow-catcher"], Use("--ground shadow")),
    (&["--isolate"], Use("--only-objects GLOB")),
    (&["--cryptomatte"], Use("--aov cryptomatte")),
    (&["--exr"], Use("-o with the extension .exr")),
    (
        &["--dof", "--depth-of-field", "--aperture", "--lens-radius", "--f-stop", "--fstop"],
        Use("--aperture-radius METRES (focal length / 2 / f-number) with --focus DISTANCE"),
    ),
    (&["--focus-distance", "--focal-distance", "--focus-point"], Use("--focus DISTANCE or X,Y,Z")),
    (&["--blades"], Use("--aperture-blades N")),
    (&["--baseline"], Use("--compare OLD.json")),
    (&["--repeat", "--repetitions", "--iterations"], Use("--rounds N")),
    (&["--wireframe", "--wire", "--show-edges"], Use("--edges all")),
    (&["--outline", "--outlines", "--contour"], Use("--edges silhouette")),
    (&["--json"], Use("blinn info --json, or --progress json")),
];

/// Flags of BlenderProc, Kubric, pyrender and scripts that render datasets, with hyphens.
static DATASET_FLAGS: &[(&[&str], Equivalent)] = &[
    (
        &["--num-views", "--n-views", "--num-images", "--num-renders", "--num-cameras", "--view-count"],
        Use("--views N of blinn turntable"),
    ),
    (
        &["--camera-distance", "--camera-dist", "--cam-dist", "--distance", "--radius", "--camera-radius"],
        Use(
            "--orbit AZIMUTH,ELEVATION,DISTANCE, or of blinn turntable --views N with --distance-range LO,HI",
        ),
    ),
    (&["--azimuth", "--azim", "--elev"], Use("--orbit AZIMUTH,ELEVATION")),
    (&["--elevation-min", "--elevation-max"], Use("--elevation-range LO,HI of blinn turntable --views N")),
    (
        &["--only-northern-hemisphere", "--upper-hemisphere", "--upper-views"],
        Use("--on hemisphere of blinn turntable --views N"),
    ),
    (&["--random-cameras", "--random-views"], Use("--on random of blinn turntable --views N")),
    (&["--random-lighting", "--random-light"], Use("--random-lights of blinn turntable --views N")),
    (&["--random-seed", "--rng-seed"], Use("--seed N")),
    (
        &[
            "--output-dir",
            "--out-dir",
            "--outdir",
            "--output-folder",
            "--output-path",
            "--save-dir",
            "--render-dir",
            "--job-dir",
        ],
        Use("-o FOLDER/"),
    ),
    (
        &[
            "--object-path",
            "--obj-path",
            "--mesh",
            "--mesh-path",
            "--model-path",
            "--scene-path",
            "--models-dir",
            "--input-dir",
            "--data-dir",
        ],
        Use("the name of a scene's file or of a folder without a flag"),
    ),
    (
        &[
            "--camera-poses",
            "--poses",
            "--cam-poses",
            "--camera-path",
            "--camera-file",
            "--trajectory",
            "--extrinsics",
        ],
        Use("--cameras FILE of blinn render"),
    ),
    (&["--fov-x", "--fovx", "--xfov", "--camera-angle-x"], Use("--yfov DEGREES, the vertical angle")),
    (
        &["--resolution-x", "--resolution-y", "--img-size", "--img-res", "--render-size"],
        Use("--size 1280x720"),
    ),
    (&["--hdri-dir", "--hdri-path", "--haven-path", "--hdr", "--hdr-path"], Use("--hdri FILE")),
    (&["--num-samples", "--n-samples", "--max-samples", "--max-amount-of-samples"], Use("-s SAMPLES")),
    (&["--light-energy", "--light-strength", "--energy"], Use("--light-scale F")),
    (&["--near", "--far", "--znear", "--zfar", "--clip-start", "--clip-end"], Use("--clip NEAR,FAR")),
    (&["--white-background", "--white-bg"], Use("--background white")),
    (&["--save-depth", "--render-depth", "--normal-map", "--save-normals"], Use("--aov depth,normal")),
    (
        &["--mask", "--masks", "--segmentation", "--segmentation-map", "--segmap", "--instance-masks"],
        Use("--aov object-id,mask, or --dataset coco of blinn turntable --views N"),
    ),
    (
        &["--coco", "--bop", "--nerf", "--colmap", "--annotations", "--bbox"],
        Use("--dataset nerf,colmap,bop,coco of blinn turntable --views N"),
    ),
    (
        &["--label", "--labels", "--class", "--classes", "--category-id"],
        Use("--category RULE of blinn turntable --dataset coco"),
    ),
    (
        &["--normalize-scene", "--unit-cube", "--rescale"],
        Use("--normalize unit-cube of blinn turntable --views N"),
    ),
    (
        &["--start-index", "--end-index", "--start-idx", "--end-idx", "--num-shards", "--shard-id"],
        Use("--chunk I/N"),
    ),
    (&["--skip-existing", "--skip-done"], Use("--resume")),
    (&["--num-workers", "--workers", "--num-processes", "--processes"], Use("--threads N")),
    (
        &["--gpu", "--gpus", "--num-gpus", "--gpu-id", "--cuda", "--device"],
        Unneeded("blinn renders on the processor, by default on all its cores; --threads N limits them"),
    ),
    (&["--headless", "--offscreen", "--egl", "--osmesa"], Unneeded("no window is ever opened")),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::command_tree::{built, find_flag};

    #[test]
    fn commands_lead_to_those_that_exist() {
        let root = built();
        for (words, usage) in &COMMANDS {
            let mut named = usage.split(' ').skip(1);
            let command = root.find_subcommand(named.next().unwrap()).unwrap();
            for flag in named.filter_map(|word| word.strip_prefix("--")) {
                assert!(find_flag(command, flag).is_some(), "--{flag}");
            }
            assert!(words.iter().all(|word| root.find_subcommand(word).is_none()), "{words:?}");
        }
    }

    #[test]
    fn flags_of_blenders_command_line_are_known() {
        // Flags of `blender -b scene.blend -E CYCLES -s 1 -e 48 -o //picture_#### -F PNG -x 1 -t 8 -a`.
        let render = built().find_subcommand("render").unwrap().clone();
        for name in ["-b", "-E", "-s", "-e", "-o", "-F", "-x", "-t", "-a", "-f", "-S", "-P", "-y"] {
            let short = name.chars().nth(1);
            let exists = render.get_arguments().any(|arg| arg.get_short() == short);
            assert_ne!(exists, flag(name).is_some(), "{name}");
        }
    }

    #[test]
    fn flags_of_commands_do_not_exist() {
        let root = built();
        for (name, flags, _) in &FLAGS_OF_COMMANDS {
            let command = root.find_subcommand(name).unwrap();
            for flag in *flags {
                let long = flag.strip_prefix("--");
                assert!(long.is_none_or(|long| find_flag(command, long).is_none()), "{flag} exists");
                assert!(flag_of_command(name, flag).is_some());
            }
        }
        assert_eq!(flag_of_command("render", "--simd"), None);
    }

    #[test]
    fn equivalents_exist_and_foreign_flags_do_not() {
        let root = built();
        let arguments: Vec<_> = root.get_subcommands().flat_map(|command| command.get_arguments()).collect();
        let exists = |flag: &str| {
            let long = flag.strip_prefix("--");
            let short = flag.strip_prefix('-').and_then(|name| name.chars().next());
            arguments.iter().any(|arg| match long {
                Some(long) => arg.get_long() == Some(long),
                None => arg.get_short() == short,
            })
        };
        let render = root.find_subcommand("render").unwrap();
        for (names, equivalent) in FLAGS.iter().chain(DATASET_FLAGS) {
            if let Use(text) = equivalent {
                for flag in text.split([' ', ',', ';']).filter(|word| word.starts_with('-')) {
                    assert!(exists(flag), "{flag}");
                }
            }
            for long in names.iter().filter_map(|name| name.strip_prefix("--")) {
                assert!(find_flag(render, long).is_none(), "--{long} exists");
                assert!(!long.contains('_'), "--{long} is looked up with hyphens");
            }
        }
    }

    #[test]
    fn underscores_are_hyphens() {
        for (word, expected) in
            [("--num_views", "--views N"), ("--output_dir=x", "-o FOLDER/"), ("--image_size", "--size")]
        {
            assert!(matches!(flag(word), Some(Use(text)) if text.starts_with(expected)), "{word}");
        }
        assert!(matches!(flag("--gpu"), Some(Unneeded(_))));
        assert!(flag("--unknown_flag").is_none());
    }

    /// A word has one meaning.
    #[test]
    fn words_are_listed_once() {
        let mut all: Vec<&str> =
            FLAGS.iter().chain(DATASET_FLAGS).flat_map(|(names, _)| *names).copied().collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count);
    }
}
