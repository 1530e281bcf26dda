//! Help pages, usage errors, shell completions, man pages and docs/reference/command-line.md.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::program::{blinn, folder, refused};

/// The output of a command line, at the width for output that is not a terminal.
#[track_caller]
fn prints(line: &str) -> String {
    let words = line.split_whitespace();
    let output =
        Command::new(env!("CARGO_BIN_EXE_blinn")).args(words).env_remove("COLUMNS").output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{line}");
    String::from_utf8(output.stdout).unwrap()
}

/// All commands, as the first help screen lists them.
fn commands() -> Vec<String> {
    let screen = prints("--help");
    let listed =
        screen.lines().skip_while(|l| !l.starts_with("Usage")).take_while(|l| !l.starts_with("Examples"));
    let names: Vec<String> = listed
        .filter_map(|l| l.strip_prefix("  ")?.split("  ").next())
        .map(|name| name.trim().to_string())
        .filter(|name| !name.is_empty() && name != "help")
        .collect();
    assert!(names.len() >= 6, "{names:?}");
    names
}

/// The subcommands of `job`, which have help pages of their own.
const ENGINES: [&str; 2] = ["job openjd", "job slurm"];

/// Every command with a help page, subcommands included.
fn pages() -> impl Iterator<Item = String> {
    commands().into_iter().chain(ENGINES.map(String::from))
}

#[test]
fn short_help_has_a_line_for_each_option() {
    let frames = ENGINES.iter().flat_map(|job| ["render", "turntable"].map(|name| format!("{job} {name}")));
    for name in pages().chain(frames) {
        let page = prints(&format!("{name} -h"));
        assert!(page.lines().count() <= 75, "{name}: {} lines", page.lines().count());
        for row in page.lines() {
            assert!(row.chars().count() <= 100, "{name}: {row}");
        }
        for row in page.lines().filter(|row| row.starts_with("  --") || row.starts_with("  -o")) {
            let (option, summary) = row.trim().split_once("  ").unwrap_or_else(|| panic!("{name}: {row}"));
            assert!(!option.is_empty() && summary.trim().len() > 8, "{name}: {row}");
        }
        assert!(page.contains("\nExamples:\n  blinn "), "{name}: {page}");
        assert!(page.ends_with(&format!("Help for every option: blinn {name} --help\n")), "{name}: {page}");
    }
    let render = prints("render -h");
    assert!(render.contains("\n  -o, --output OUT ") && render.contains("\nLights:\n"), "{render}");
    assert!(!render.contains("--caustics"), "only common options: {render}");
}

/// The commands with examples, also where every option of every command would be asked for.
#[test]
fn the_help_of_the_program_is_one_screen() {
    let screen = prints("--help");
    assert!(screen.lines().count() <= 24 && screen.lines().all(|row| row.chars().count() <= 80), "{screen}");
    assert_eq!(screen, prints("-h"));
}

/// Output that is no terminal never starts a pager.
#[test]
fn long_help_is_printed_without_a_pager_in_pipes() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_blinn"));
    let output =
        command.args(["info", "--help"]).env("PAGER", "false").env_remove("COLUMNS").output().unwrap();
    assert_eq!(
        (output.status.code(), String::from_utf8(output.stdout).unwrap()),
        (Some(0), prints("info --help"))
    );
    assert_eq!(prints("info --help"), prints("info --help-all"), "an older name");
}

#[test]
fn long_help_describes_every_flag() {
    let all = prints("render --help");
    for heading in ["Scene", "Output", "Image", "Camera", "Lights", "Shading", "Time", "Process"] {
        assert!(all.contains(&format!("\n{heading}:\n")), "{heading}");
    }
    assert!(all.contains("Examples:") && all.lines().count() > 100);
    for name in commands() {
        let all = prints(&format!("{name} --help"));
        for flag in all.lines().map(str::trim).filter(|l| l.starts_with("--") || l.starts_with("-o,")) {
            assert!(flag.len() > 2, "{name}: {flag}");
        }
    }
}

/// docs/reference/command-line.md has this program's help; `GOLDEN=update` rewrites it.
#[test]
fn the_reference_page_shows_the_help() {
    const HERE: &str = "<!-- From here on: the program's own help. -->";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/command-line.md");
    let page = fs::read_to_string(&path).unwrap();
    let (by_hand, _) = page.split_once(HERE).expect("a mark after which help follows");
    let mut expected = format!("{by_hand}{HERE}\n");
    for name in pages() {
        let help = prints(&format!("{name} --help"));
        let rows: Vec<&str> = help.lines().map(str::trim_end).collect();
        expected += &format!("\n## blinn {name}\n\n```text\n{}\n```\n", rows.join("\n").trim_end());
    }
    if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
        fs::write(&path, &expected).unwrap();
    }
    assert!(
        fs::read_to_string(&path).unwrap() == expected,
        "rewrite it with GOLDEN=update cargo test --test cli help::"
    );
}

#[test]
fn help_lists_all_aovs() {
    let all = prints("render --help");
    let words = all.split_whitespace().collect::<Vec<_>>().join(" ");
    let names: Vec<&str> = blinn::integrator::Aov::ALL.iter().map(|aov| aov.name()).collect();
    let list = format!("AOVs: {}, cryptomatte", names.join(", "));
    assert!(words.contains(&list), "the help of --aov does not contain '{list}'");
}

#[test]
fn usage_errors_are_one_line_with_a_hint() {
    let (_dir, at) = folder();
    for (line, message) in [
        ("render a.glb --smaples 4", "unexpected argument '--smaples': did you mean --samples?"),
        ("render a.glb --spp 4", "unexpected argument '--spp': use -s SAMPLES"),
        ("render a.glb --ambient-occlusion", "use --ao SAMPLES"),
        ("render -b a.glb", "not needed, no window is ever opened"),
        ("render a.glb --render-output=x", "use -o OUT"),
        ("render a.glb --count 4", "unexpected argument '--count': it is an option of blinn turntable"),
        (
            "info a.glb --size 4x4",
            "it is an option of blinn render, blinn turntable, blinn view, blinn sheet, blinn diff, blinn bench and blinn rays",
        ),
        ("render a.glb --quux", "unexpected argument '--quux': see blinn render --help"),
        (
            "render a.glb --filter gaus",
            "invalid value 'gaus' for '--filter <FILTER>'; [possible values: box, tent, gaussian, blackman-harris]; \
             tip: a similar value exists: 'gaussian'",
        ),
        (
            "render a.glb --size 100px",
            "'100px' for '--size <WxH>': expected WIDTHxHEIGHT, such as 1280x720, or one number for both",
        ),
        (
            "render a.glb --edges",
            "a value is required for '--edges <KINDS>' but none was supplied: Draw edges over the picture: feature",
        ),
        ("render a.glb --threads x", "'x' for '--threads <THREADS>': expected a whole number"),
        ("render a.glb --threads -1", "'-1' for '--threads <THREADS>': -1 is not in 1..=1024"),
        ("render a.glb --zoom -1", "'-1' for '--zoom <F>': must be greater than zero"),
        ("render a.glb --clip -1,2", "'-1,2' for '--clip <NEAR,FAR|off>': "),
        ("render a.glb --crop -1,0,2,2", "'-1,0,2,2' for '--crop <X,Y,W,H>': "),
        ("render a.glb --ambient -1,0,0", "'-1,0,0' for '--ambient <COLOR>': "),
        ("render a.glb --resolution 100px", "expected WIDTHxHEIGHT"),
        ("turntable a.glb --frames=1-3", "'1-3' for '--count <N>': expected the number of frames"),
        ("turntable a.glb --frames=1-3", "--only 1-3"),
        ("turntable a.glb --count 0", "'0' for '--count <N>': expected the number of frames"),
        ("render a.glb --fps 12", "--fps applies only to --frame and --frames"),
        ("render a.glb --fps 24 --time 1", "--fps applies only to --frame and --frames"),
        (
            "turntable a.glb --fps 24",
            "--fps applies only to animations; set -o to .gif, .apng, .mp4 or .html",
        ),
        (
            "turntable a.glb --loop once",
            "--loop applies only to animations; set -o to .gif, .apng, .mp4 or .html",
        ),
        ("render a.glb --light-scale 5 --lights none", "--light-scale applies to the file's lights"),
        ("render a.glb --light-scale 1 --lights headlight", "--light-scale applies to the file's lights"),
        ("render a.glb --samples 0", "'0' for '--samples <SAMPLES>': 0 is not in 1..=65536"),
        ("render a.glb --size", "a value is required for '--size <WxH>' but none was supplied"),
        ("render a.glb -q -q", "the argument '--quiet' cannot be used multiple times"),
        (
            "render a.glb --yfov 20 --view-height 2",
            "'--yfov <DEGREES>' cannot be used with '--view-height <H>'",
        ),
        ("render a.glb --chunk 1/2", "--chunk: there is only one image; add --frames"),
        ("render", "the following required arguments were not provided: <SCENE>..."),
        ("assemble a.png", "required arguments were not provided: --output <OUT>"),
        ("rendr a.glb", "unknown command 'rendr': did you mean render?"),
        ("chair.OBJ", "to render it, use blinn render chair.OBJ"),
        ("xyzzy", "unknown command 'xyzzy': see blinn --help"),
        ("completions tcsh", "[possible values: bash, elvish, fish, powershell, zsh]"),
        ("man xyzzy", "unknown command 'xyzzy'"),
        ("man job xyzzy", "unknown command 'job xyzzy'"),
        ("bench a.glb --from c.json", "cannot be used with"),
        ("bench --from c.json --rounds 3", "cannot be used with"),
        ("bench", "name scene files, or --suite, --scenes DIR, --from FILE.json or --trace-bound FILE.json"),
        ("compare a.glb b.glb", "unknown command 'compare': use blinn diff OLD NEW"),
        ("render a.glb --dof", "unexpected argument '--dof': use --aperture-radius"),
        ("render a.glb --ortho", "unexpected argument '--ortho': use --projection orthographic"),
        ("turntable a.glb --views 3 --num_views 3", "unexpected argument '--num_views': use --views N"),
        ("render a.glb --output_dir=x", "unexpected argument '--output_dir': use -o FOLDER/"),
        ("render a.glb --gpu", "unexpected argument '--gpu': not needed, blinn renders on the processor"),
        (
            "turntable a.glb --views 3 --elevation 3",
            "; use --elevation-range LO,HI for the views of a dataset",
        ),
        ("render a.glb --unlike", "unexpected argument '--unlike': see blinn render --help"),
        ("job slurm -o a.sh", "'blinn job slurm' requires a subcommand"),
        ("job slurm render a.glb --quux", "see blinn job slurm render --help"),
        ("job slurm --count 8 turntable a.glb", "unexpected argument '--count': place it after turntable"),
        (
            "job slurm turntable a.glb --at-once 8",
            "unexpected argument '--at-once': place it before turntable",
        ),
    ] {
        refused(&at, line, message);
        let messages = String::from_utf8(blinn(&at, line).stderr).unwrap();
        assert!(messages.starts_with("blinn: ") && messages.lines().count() == 1, "{line}: {messages}");
    }
}

#[test]
fn completions_contain_commands_and_flags() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = prints(&format!("completions {shell}"));
        for word in ["turntable", "point-light", "print-config"] {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn every_command_has_a_man_page_with_its_flags() {
    let page = prints("man");
    assert!(page.contains(".TH blinn 1") && page.contains("Exit codes"), "{page}");
    let titled = |page: &str, name: &str| {
        let title = name.replace(' ', "-");
        page.contains(&format!(".TH blinn-{title} 1"))
            || page.contains(&format!(".TH blinn\\-{} 1", title.replace('-', "\\-")))
    };
    for name in pages() {
        let page = prints(&format!("man {name}"));
        assert!(titled(&page, &name), "{name}: {page}");
        let help = prints(&format!("{name} --help"));
        let flags = help.split_whitespace().filter(|w| w.starts_with("--") && w.len() > 2);
        for flag in flags.filter(|w| w[2..].chars().all(|c| c.is_ascii_lowercase() || c == '-')) {
            assert!(page.contains(&flag.replace('-', "\\-")), "{name}: {flag}");
        }
    }
}

/// Help pages refer to existing pages.
#[test]
fn man_pages_refer_to_existing_pages() {
    let known: Vec<String> = pages().map(|name| format!("blinn-{}(1)", name.replace(' ', "-"))).collect();
    let mut named = 0;
    for line in pages().map(|name| format!("man {name}")).chain(["man".into()]) {
        let page = prints(&line).replace("\\-", "-");
        for other in page.split_whitespace().filter(|w| w.starts_with("blinn-") && w.ends_with("(1)")) {
            assert!(known.iter().any(|name| name == other), "{line} names {other}");
            named += 1;
        }
    }
    assert!(named >= known.len(), "{named}");
}

/// Usage errors of Open Job Description tasks are reported in its protocol.
#[test]
fn usage_errors_are_reported_to_openjd_too() {
    let (_dir, at) = folder();
    fs::write(at.join("c.toml"), "progress = \"openjd\"\nquux = 1\n").unwrap();
    for line in [
        "render a.glb --quux --progress openjd",
        "render a.glb --progress=openjd --size 100px",
        "turntable a.glb --only 99 --progress=openjd",
        "render a.glb --config c.toml --progress openjd",
    ] {
        let output = blinn(&at, line);
        let messages = String::from_utf8(output.stderr).unwrap();
        let lines: Vec<&str> = messages.lines().collect();
        assert_eq!((output.status.code(), lines.len()), (Some(2), 2), "{line}: {messages}");
        let why = lines[1].strip_prefix("blinn: ").unwrap();
        assert_eq!(lines[0], format!("openjd_fail: {why}"), "{line}");
    }
}
