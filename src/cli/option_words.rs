//! Options in the messages of the command line: flags.

/// Words an option as a flag: `--clip off`, and `-o`, which is known by its letter.
pub fn flag(name: &str, value: Option<&str>) -> String {
    match (name, value) {
        ("output", None) => "-o".into(),
        (_, Some(value)) => format!("--{name} {value}"),
        (_, None) => format!("--{name}"),
    }
}
