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
fn help_is_one_screen() {
    let frames = ENGINES.iter().flat_map(|job| ["render", "turntable"].map(|name| format!("{job} {name}")));
    let screens = pages().chain(frames).map(|name| format!("{name} --help"));
    for line in screens.chain(["--help".to_string()]) {
        let screen = prints(&line);
        assert!(screen.lines().count() <= 24, "{line}: {} lines", screen.lines().count());
        for row in screen.lines() {
            assert!(row.chars().count() <= 80, "{line}: {row}");
        }
        assert!(line == "--help" || screen.contains("\nExamples:\n  blinn "), "{line}: {screen}");
        assert_eq!(screen, prints(&line.replace("--help", "-h")));
    }
}

#[test]
fn help_all_has_every_flag_with_a_word_about_it() {
    let all = prints("render --help-all");
    for heading in ["Scene", "Output", "Image", "Camera", "Lights", "Shading", "Time", "Process"] {
        assert!(all.contains(&format!("\n{heading}:\n")), "{heading}");
    }
    assert!(all.contains("Examples:") && all.lines().count() > 100);
    for name in commands() {
        let all = prints(&format!("{name} --help-all"));
        for flag in all.lines().map(str::trim).filter(|l| l.starts_with("--") || l.starts_with("-o,")) {
            assert!(flag.len() > 2, "{name}: {flag}");
        }
    }
}

/// docs/reference/command-line.md has this program's help; `GOLDEN=update` rewrites it.
#[test]
fn the_reference_is_the_program_s_own_help() {
    const HERE: &str = "<!-- From here on: the program's own help. -->";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/command-line.md");
    let page = fs::read_to_string(&path).unwrap();
    let (by_hand, _) = page.split_once(HERE).expect("a mark after which help follows");
    let mut expected = format!("{by_hand}{HERE}\n");
    for name in pages() {
        let help = prints(&format!("{name} --help-all"));
        let rows: Vec<&str> = help.lines().map(str::trim_end).collect();
        expected += &format!("\n## blinn {name}\n\n```text\n{}\n```\n", rows.join("\n").trim_end());
    }
    if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
        fs::write(&path, &expected).unwrap();
    }
    assert!(
        fs::read_to_string(&path).unwrap() == expected,
        "GOLDEN=update cargo test --test help writes it anew"
    );
}

#[test]
fn the_layers_that_there_are_are_named() {
    let all = prints("render --help-all");
    let words = all.split_whitespace().collect::<Vec<_>>().join(" ");
    let names: Vec<&str> = blinn::integrator::Aov::ALL.iter().map(|aov| aov.name()).collect();
    let list = format!("Layers: {}, cryptomatte", names.join(", "));
    assert!(words.contains(&list), "--aov's help does not say '{list}'");
}

#[test]
fn what_is_wrong_is_said_in_one_line_with_what_would_be_right() {
    let (_dir, at) = folder();
    for (line, says) in [
        ("render a.glb --smaples 4", "blinn render has no --smaples: did you mean --samples?"),
        ("render a.glb --spp 4", "blinn render has no --spp: here it is -s SAMPLES"),
        ("render a.glb --ambient-occlusion", "here it is --ao SAMPLES"),
        ("render -b a.glb", "there never is a window"),
        ("render a.glb --render-output=x", "here it is -o OUT"),
        ("render a.glb --count 4", "blinn render has no --count: it belongs to blinn turntable"),
        ("info a.glb --size 4x4", "it belongs to blinn render and blinn turntable"),
        ("render a.glb --quux", "blinn render has no --quux: blinn render --help-all lists what there is"),
        (
            "render a.glb --filter gaus",
            "--filter cannot be 'gaus'; possible values: box, tent, gaussian, blackman-harris: did you mean gaussian?",
        ),
        ("render a.glb --size 100", "--size 100: expected WIDTHxHEIGHT, such as 1280x720"),
        ("render a.glb --threads x", "--threads x: expected a whole number"),
        ("render a.glb --threads -1", "--threads -1: -1 is not in 1..=1024"),
        ("render a.glb --zoom -1", "--zoom -1: "),
        ("render a.glb --clip -1,2", "--clip -1,2: "),
        ("render a.glb --crop -1,0,2,2", "--crop -1,0,2,2: "),
        ("render a.glb --ambient -1,0,0", "--ambient -1,0,0: "),
        ("render a.glb --resolution 100", "--resolution 100: expected WIDTHxHEIGHT"),
        ("turntable a.glb --frames=1-3", "--frames 1-3: expected how many frames"),
        ("turntable a.glb --frames=1-3", "--only 1-3"),
        ("turntable a.glb --count 0", "--count 0: expected how many frames"),
        ("render a.glb --fps 12", "--fps counts frames: add --frame N or --frames"),
        ("render a.glb --fps 24 --time 1", "--fps counts frames"),
        ("render a.glb --light-scale 5 --lights none", "--light-scale multiplies the file's lights"),
        ("render a.glb --light-scale 1 --lights headlight", "--light-scale multiplies the file's lights"),
        ("render a.glb --samples 0", "--samples 0: 0 is not in 1..=65536"),
        ("render a.glb --size", "--size needs a value: WxH"),
        ("render a.glb -q -q", "--quiet cannot be given twice"),
        ("render a.glb --yfov 20 --view-height 2", "--yfov cannot be used with --view-height"),
        ("render a.glb --chunk 1/2", "blinn render needs --frames"),
        ("render", "blinn render needs SCENE: see blinn render --help"),
        ("assemble a.png", "blinn assemble needs --output OUT"),
        ("rendr a.glb", "there is no command 'rendr': did you mean render?"),
        ("chair.OBJ", "to render it, say blinn render chair.OBJ"),
        ("xyzzy", "there is no command 'xyzzy': there are render, turntable, "),
        ("completions tcsh", "possible values: bash, elvish, fish, powershell, zsh"),
        ("man xyzzy", "there is no command 'xyzzy'"),
        ("man job xyzzy", "there is no command 'job xyzzy'"),
        ("bench a.glb --from c.json", "SCENE cannot be used with --from"),
        ("job slurm -o a.sh", "blinn job slurm needs render or turntable: see blinn job slurm --help"),
        ("job slurm render a.glb --quux", "blinn job slurm render has no --quux"),
        ("job slurm --count 8 turntable a.glb", "it stands behind turntable"),
        ("job slurm turntable a.glb --at-once 8", "it stands before turntable"),
    ] {
        refused(&at, line, says);
        let told = String::from_utf8(blinn(&at, line).stderr).unwrap();
        assert!(told.starts_with("blinn: ") && told.lines().count() == 1, "{line} told: {told}");
    }
}

#[test]
fn completions_know_commands_and_flags() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = prints(&format!("completions {shell}"));
        for word in ["turntable", "point-light", "help-all"] {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn every_command_has_a_page_with_its_flags() {
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
        let help = prints(&format!("{name} --help-all"));
        let flags = help.split_whitespace().filter(|w| w.starts_with("--") && w.len() > 2);
        for flag in flags.filter(|w| w[2..].chars().all(|c| c.is_ascii_lowercase() || c == '-')) {
            assert!(page.contains(&flag.replace('-', "\\-")), "{name}: {flag}");
        }
    }
}

/// Help pages refer to existing pages.
#[test]
fn pages_name_pages_that_there_are() {
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
fn a_wrong_command_line_is_told_in_a_farm_s_words_too() {
    let (_dir, at) = folder();
    fs::write(at.join("c.toml"), "progress = \"openjd\"\nquux = 1\n").unwrap();
    for line in [
        "render a.glb --quux --progress openjd",
        "render a.glb --progress=openjd --size 100",
        "turntable a.glb --only 99 --progress=openjd",
        "render a.glb --config c.toml --progress openjd",
    ] {
        let output = blinn(&at, line);
        let told = String::from_utf8(output.stderr).unwrap();
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!((output.status.code(), lines.len()), (Some(2), 2), "{line} told: {told}");
        let why = lines[1].strip_prefix("blinn: ").unwrap();
        assert_eq!(lines[0], format!("openjd_fail: {why}"), "{line}");
    }
}
