//! Writes and prints results.

use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::args::BenchArgs;
use crate::console::{eprint_line, is_stdout, print_error, print_stdout, single_line};
use crate::files::create_parent_folder;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_output::{Overwrite, write_atomically};

/// The files that results are written to, by their options.
pub fn output_files(args: &BenchArgs) -> [(&'static str, &Option<PathBuf>); 4] {
    [("json", &args.json), ("report", &args.report), ("markdown", &args.markdown), ("csv", &args.csv)]
}

/// The options of results, each with the extensions of its format.
const EXTENSIONS: [(&str, &[&str]); 4] =
    [("json", &["json"]), ("report", &["html", "htm"]), ("markdown", &["md", "markdown"]), ("csv", &["csv"])];

/// Returns an error if the name of a file of results has the extension of another option's format.
pub fn check_extension(option: &str, file: &Path) -> Result<(), UsageError> {
    let Some(extension) = file.extension().and_then(|extension| extension.to_str()) else { return Ok(()) };
    let has_extension =
        |extensions: &[&str]| extensions.iter().any(|known| known.eq_ignore_ascii_case(extension));
    match EXTENSIONS.iter().find(|(_, extensions)| has_extension(extensions)) {
        Some((other, _)) if *other != option => Err(UsageError(worded!(
            "`{}`: {} has the extension of `{}`; use `{}`, or name another file",
            option,
            file.display(),
            other,
            other
        ))),
        _ => Ok(()),
    }
}

/// Prints to standard output, or to standard error if a file of results goes there.
pub fn print(args: &BenchArgs, text: &str, summary: &mut Summary) {
    if output_files(args).iter().filter_map(|(_, file)| file.as_ref()).any(|file| is_stdout(file)) {
        eprint_line(text.trim_end());
    } else {
        summary.record(print_stdout(text.as_bytes()));
    }
}

/// Writes a file of results, if it is wanted.
pub fn write(summary: &mut Summary, args: &BenchArgs, file: Option<&Path>, text: impl FnOnce() -> String) {
    let Some(file) = file else { return };
    if is_stdout(file) {
        return summary.record(print_stdout(text().as_bytes()));
    }
    let written = create_parent_folder(file).and_then(|()| {
        write_atomically(file, text().as_bytes(), Overwrite::Yes)
            .with_context(|| format!("{} cannot be written", file.display()))
    });
    match written {
        Ok(()) if args.common.quiet => {}
        Ok(()) => eprint_line(&single_line(&format!("wrote {}", file.display()))),
        Err(error) => fail(summary, &format!("{error:#}")),
    }
}

/// Reports a failure.
pub fn fail(summary: &mut Summary, text: &str) {
    print_error(text);
    summary.add_failure(single_line(text));
}
