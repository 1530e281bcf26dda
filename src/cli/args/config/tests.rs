use std::ffi::OsString;

use clap::{Arg, ArgAction};

use super::{key, merge_file, print};
use crate::args::command_tree::{built, find_command, innermost};
use crate::args::help;

fn argv(line: &str) -> Vec<OsString> {
    line.split(' ').filter(|word| !word.is_empty()).map(OsString::from).collect()
}

/// All options that a command line sets, explicitly or by default; `None` if it does not parse.
fn parsed(argv: &[OsString]) -> Option<Vec<(String, Vec<OsString>)>> {
    let matches = help::full().try_get_matches_from(argv).ok()?;
    let command = innermost(&matches)?;
    let raw = |arg: &Arg| {
        let values = command.matches.try_get_raw(arg.get_id().as_str()).ok().flatten();
        let values = values.into_iter().flatten().map(OsString::from).collect();
        Some((key(arg)?.to_string(), values))
    };
    Some(find_command(&built(), &command.path)?.get_arguments().filter_map(raw).collect())
}

/// Values of which at least one is valid for any option; those that are easily misread come first.
const VALUES: [&str; 21] = [
    "007",
    "-1,2,3",
    "1,2",
    "0,.5,1",
    "1,2,3,4",
    "1,2,3,0,-1,0,1,2,4",
    "1-3",
    "1/2",
    "32x18",
    "0.50",
    "16",
    "depth,uv",
    "file",
    "none",
    "off",
    "steps",
    "coco",
    "object",
    "sphere",
    "feature",
    "256",
];

/// A valid command line that sets an option.
fn line_with(arg: &Arg, command: &str) -> Option<String> {
    let flag = format!("--{}", arg.get_long()?);
    let possible = arg.get_possible_values();
    let own = possible.iter().rev().map(|value| value.get_name());
    let options = own.chain(VALUES).map(|value| match arg.get_action() {
        ArgAction::SetTrue => flag.clone(),
        ArgAction::Append => format!("{flag}={value} {flag}={value}"),
        _ => format!("{flag}={value}"),
    });
    let with_required = |option: String| {
        [
            "",
            "--frames=1-3",
            "--views=3",
            "--size=640x480",
            "--indirect=4",
            "--edges=all",
            "--check=golden",
            "--cameras=cameras.json",
            "--dataset=coco --views=3",
            "--ledger=x.jsonl --resume",
        ]
        .map(|other| format!("blinn {command} {option} {other} 1.50 007"))
    };
    options.flat_map(with_required).find(|line| parsed(&argv(line)).is_some())
}

#[test]
fn a_printed_config_sets_the_same_options() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("c.toml");
    let mut options = 0;
    for command in ["render", "turntable", "job slurm render"] {
        let (root, path) = (built(), command.split(' ').collect::<Vec<_>>());
        let args = find_command(&root, &path).unwrap().get_arguments();
        for arg in args.filter(|arg| arg.get_long().is_some() && key(arg).is_some()) {
            let line = line_with(arg, command)
                .unwrap_or_else(|| panic!("add a value or a companion of {arg} to VALUES or line_with"));
            let printed = print(&argv(&line)).unwrap();
            std::fs::write(&file, &printed).unwrap();
            let from_file = argv(&format!("blinn {command} --config {}", file.display()));
            let from_file = parsed(&merge_file(from_file).unwrap());
            assert!(from_file.is_some() && from_file == parsed(&argv(&line)), "{line}: {printed}");
            options += 1;
        }
    }
    assert!(options > 150, "{options}");
}

/// A value may read like the command.
#[test]
fn options_are_inserted_after_their_command() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("c.toml");
    std::fs::write(&file, "samples = 9").unwrap();
    let rest = format!("a.glb --frames=1-2 --config {}", file.display());
    for before in ["job slurm -o render render", "job slurm render", "job openjd --output=render render"] {
        let expected = argv(&format!("blinn {before} --samples=9 {rest}"));
        assert_eq!(merge_file(argv(&format!("blinn {before} {rest}"))).unwrap(), expected);
    }
}

#[test]
fn an_empty_list_sets_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("c.toml");
    std::fs::write(&file, "hide = []\nsun = []\nscenes = []").unwrap();
    let line = argv(&format!("blinn render a.glb --config {}", file.display()));
    assert_eq!(merge_file(line.clone()).unwrap(), line);
}

#[test]
fn a_scene_in_a_file_is_never_an_option() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("c.toml");
    std::fs::write(&file, "scenes = [\"-a.glb\"]").unwrap();
    let line = format!("blinn render --config {}", file.display());
    assert_eq!(merge_file(argv(&line)).unwrap()[2], "./-a.glb");
}

#[cfg(unix)]
#[test]
fn values_that_are_not_utf8_are_not_printed() {
    use std::os::unix::ffi::OsStringExt;
    let mut argv = argv("blinn render");
    argv.push(OsString::from_vec(b"m\xff.glb".to_vec()));
    assert!(print(&argv).unwrap_err().0.contains("not UTF-8"));
}
