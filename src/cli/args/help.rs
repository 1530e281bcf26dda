//! Help pages: `-h` has a line for each option, `--help` describes every option.
//!
//! Both are made from the arguments' definitions. Of many options, `-h` lists those in `COMMON`.

use std::ffi::OsString;

use clap::{Arg, Command, CommandFactory};

use super::command_args::add_help_flags;
use super::root::Cli;

/// Options that `-h` lists of commands that have more than `MAX_LISTED`.
const COMMON: &str = "\
    output json resume aov size quality samples background exposure camera view-point look-at yfov orbit zoom \
    lights point-light sun light-radius ao ground kd ks hide time frames fps count only chunk turn axis port open \
    elevation views threads config report quiet";
const MAX_LISTED: usize = 20;
/// Width of a line in columns, and of the column of names.
const WIDTH: usize = 100;
const MAX_NAME: usize = 28;
/// Longest list of possible values that stands in for the name of a value.
const MAX_VALUES: usize = 24;

/// Examples of each command. `job` stands for the commands below it, too.
#[rustfmt::skip]
const EXAMPLES: [(&str, &str); 13] = [
    ("", "\
Examples:
  blinn render chair.obj                 # chair.png, framed and lit
  blinn turntable shoe.glb -o shoe.html  # turned by dragging
  blinn info shot.glb                    # contents of the file"),
    ("render", "\
Examples:
  blinn render chair.obj                 # chair.png, framed and lit
  blinn render shot.glb --camera Close --size 1920x1080 -s 16
  blinn render shoe.glb --orbit 90,20 --background transparent -o side.png
  blinn render walk.glb --frames -o walk.mp4"),
    ("turntable", "\
Examples:
  blinn turntable shoe.glb               # shoe_0001.png … shoe_0036.png
  blinn turntable shoe.glb -o shoe.html --ground shadow
  blinn turntable shoe.glb --views 100 --size 800x800 -o shoe/####.png"),
    ("view", "\
Examples:
  blinn view shoe.glb                    # prints the address of the page
  blinn view shoe.glb --open --lights headlight
  blinn view shot.glb --port 8080        # after ssh -L 8080:localhost:8080 host"),
    ("sheet", "\
Examples:
  blinn sheet shoe.glb                   # shoe_sheet.png
  blinn sheet shoe.glb -o shoe.png --size 1920x1440 --json
  blinn sheet shoe.glb --views front,30/20,cameras"),
    ("diff", "\
Examples:
  blinn diff old.glb new.glb             # prints what changed
  blinn diff old.glb new.glb -o diff.html
  blinn diff rev1/ rev2/ -o diffs/       # scenes of the same name
  blinn diff golden.png today.png --flip --tolerance 0.1"),
    ("assemble", "\
Examples:
  blinn assemble walk/ -o walk.webp --fps 24
  blinn assemble shoe_*.png -o shoe.html
  blinn assemble frames -o shoe.mp4 --background '#ffffff'"),
    ("info", "\
Examples:
  blinn info shot.glb
  blinn info --json *.glb"),
    ("bench", "\
Examples:
  blinn bench shot.glb
  blinn bench --suite --json today.json --report today.html
  blinn bench --suite --compare yesterday.json"),
    ("rays", "\
Examples:
  blinn rays shot.glb --dump rays.npz
  blinn rays shot.glb --dump rays.npz --kinds eye,bounce1 --triangles"),
    ("job", "\
Examples:
  blinn job slurm -o shoe.sh turntable shoe.glb --count 240 -o out/shoe.mp4
  blinn job openjd -o walk.json render walk.glb --frames -o walk/####.exr"),
    ("completions", "\
Examples:
  blinn completions bash > ~/.local/share/bash-completion/completions/blinn
  blinn completions fish > ~/.config/fish/completions/blinn.fish"),
    ("man", "\
Examples:
  blinn man turntable > blinn-turntable.1    # man ./blinn-turntable.1 shows it
  blinn man job slurm > blinn-job-slurm.1"),
];

const EXIT_CODES: &str = "\
Exit codes: 0 success; 1 something failed, and the rest was done; 2 wrong command line; 129, 130 and 143 hung up, \
interrupted or terminated, with no partial file left.";

/// True if `argv` asks for the description of every option.
pub fn is_long(argv: &[OsString]) -> bool {
    let mut flags = argv.iter().take_while(|arg| *arg != "--");
    flags.any(|arg| arg == "--help-all" || arg == "--help")
}

/// The command tree to parse `argv` with: `-h` prints short pages.
pub fn command(argv: &[OsString]) -> Command {
    // The program itself has no options, and the descriptions of all commands are a book.
    let is_root = argv.len() == 2 && argv[1] == "--help";
    if is_long(argv) && !is_root {
        return full().flatten_help(true);
    }
    if !may_print_screen(argv) {
        return full();
    }
    map_tree(full(), "", &|mut command, path| {
        if !command.has_subcommands() {
            // Defines its arguments.
            command.build();
        }
        let template = screen_template(&command, path);
        command.help_template(template)
    })
}

/// False if no screen of help is printed for `argv`: making the screens of all commands takes longer than parsing.
fn may_print_screen(argv: &[OsString]) -> bool {
    // Commands without arguments print their screens, too.
    let is_word = |arg: &OsString| arg.as_encoded_bytes().iter().all(u8::is_ascii_lowercase);
    let is_short = argv.len() <= "blinn job slurm".split(' ').count() && argv.iter().skip(1).all(is_word);
    let is_help = |arg: &OsString| {
        let arg = arg.as_encoded_bytes();
        arg == b"--help" || arg.starts_with(b"-") && !arg.starts_with(b"--") && arg.contains(&b'h')
    };
    is_short || argv.iter().any(is_help)
}

/// The command tree with complete help. A command has its arguments when a command line names it, or when it is built.
pub fn full() -> Command {
    let root = add_help_flags(Cli::command()).after_long_help(EXIT_CODES);
    map_tree(root, "", &|command, path| match examples(path) {
        Some(examples) if !path.is_empty() => command.after_long_help(examples),
        _ => command,
    })
}

/// Applies a function to a command and to all commands below it. The function gets the path of each, such as
/// `job slurm render`.
fn map_tree(command: Command, path: &str, function: &dyn Fn(Command, &str) -> Command) -> Command {
    function(command, path).mut_subcommands(|below| {
        let path = format!("{path} {}", below.get_name()).trim_start().to_string();
        map_tree(below, &path, function)
    })
}

/// The examples of a command, or else of the command above it.
fn examples(path: &str) -> Option<&'static str> {
    let own = EXAMPLES.iter().find(|(name, _)| *name == path).map(|(_, examples)| *examples);
    own.or_else(|| examples(path.rsplit_once(' ')?.0))
}

/// The clap template of a command's screen.
fn screen_template(command: &Command, path: &str) -> String {
    let usage = if path.is_empty() { "blinn COMMAND …" } else { "{usage}" };
    let mut template = format!("{{about}}\n\nUsage: {usage}\n\n");
    if command.has_subcommands() {
        template += "{subcommands}\n\n";
    }
    if !path.is_empty() {
        template += &option_rows(command);
    }
    if let Some(examples) = examples(path) {
        template += &format!("{examples}\n\n");
    }
    template
        + &match path {
            "" => "Common options of a command: blinn COMMAND -h; every option: --help\n".to_string(),
            path => format!("Help for every option: blinn {path} --help\n"),
        }
}

fn common_options() -> impl Iterator<Item = &'static str> {
    COMMON.split_whitespace()
}

/// A row for each option, by heading. All positional arguments and options are listed if they are few, else just the
/// common options.
fn option_rows(command: &Command) -> String {
    let options: Vec<&Arg> =
        command.get_arguments().filter(|arg| !arg.is_positional() && !arg.is_hide_set()).collect();
    let lists_all = options.len() <= MAX_LISTED;
    let mut rows = String::new();
    for arg in command.get_positionals().filter(|_| lists_all) {
        let values = possible_values(arg, ", ");
        let separator = if values.is_empty() { "" } else { ": " };
        rows += &row(&value_name(arg), &format!("{}{separator}{values}", summary(arg)));
    }
    let is_common =
        |arg: &Arg| arg.get_long().is_some_and(|name| common_options().any(|common| common == name));
    let mut groups: Vec<(&str, String)> = Vec::new();
    for arg in options.into_iter().filter(|arg| lists_all || is_common(arg)) {
        let heading = arg.get_help_heading().unwrap_or("Options");
        let row = row(&option_name(arg), &summary(arg));
        match groups.iter_mut().find(|(name, _)| *name == heading) {
            Some((_, rows)) => *rows += &row,
            None => groups.push((heading, row)),
        }
    }
    if !rows.is_empty() {
        rows += "\n";
    }
    for (heading, group) in &groups {
        rows += &format!("{heading}:\n{group}\n");
    }
    rows
}

/// A name and its summary on one line, which is cut at a word.
fn row(name: &str, summary: &str) -> String {
    let mut line = format!("  {name:<MAX_NAME$}  ");
    let room = WIDTH.saturating_sub(line.chars().count() + 2);
    if summary.chars().count() <= room + 2 {
        return line + summary + "\n";
    }
    let start: String = summary.chars().take(room).collect();
    let words = start.rsplit_once(' ').map_or(start.as_str(), |(words, _)| words);
    line += words.trim_end_matches([',', ':', ';', '(']);
    line + " …\n"
}

/// The first paragraph of an argument's help without its default.
fn summary(arg: &Arg) -> String {
    let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
    help.split("[default").next().unwrap_or_default().trim().replace('\n', " ")
}

/// An option with its value: `-o OUT`, `--ground shadow|plane`, `--frames [LIST]`.
fn option_name(arg: &Arg) -> String {
    let name = match (arg.get_short(), arg.get_long()) {
        (Some(short), Some(long)) => format!("-{short}, --{long}"),
        (Some(short), None) => format!("-{short}"),
        (None, long) => format!("--{}", long.unwrap_or_default()),
    };
    if !arg.get_action().takes_values() {
        return name;
    }
    let is_optional = arg.get_num_args().is_some_and(|count| count.min_values() == 0);
    if is_optional { format!("{name} [{}]", value_name(arg)) } else { format!("{name} {}", value_name(arg)) }
}

/// The possible values of an argument if they are short, else the name of its value.
fn value_name(arg: &Arg) -> String {
    let values = possible_values(arg, "|");
    if !arg.is_positional() && !values.is_empty() && values.len() <= MAX_VALUES {
        return values;
    }
    let names = arg.get_value_names().unwrap_or_default().join(" ");
    if names.is_empty() { arg.get_id().as_str().to_uppercase().replace('_', "-") } else { names }
}

fn possible_values(arg: &Arg, separator: &str) -> String {
    let values = arg.get_possible_values();
    values.iter().map(|value| value.get_name()).collect::<Vec<_>>().join(separator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::command_tree::{built, find_flag};

    #[test]
    fn common_options_exist() {
        let root = built();
        for name in common_options() {
            assert!(root.get_subcommands().any(|command| find_flag(command, name).is_some()), "{name}");
        }
    }

    #[test]
    fn examples_parse() {
        let lines = EXAMPLES.iter().flat_map(|(_, examples)| examples.lines());
        for line in lines.filter(|line| line.starts_with("  blinn ")) {
            // As in a shell, `#` begins a comment.
            let words = shlex::split(line).expect(line).into_iter().take_while(|word| word != ">");
            let parsed = full().try_get_matches_from(words);
            assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
        }
    }
}
