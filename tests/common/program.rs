//! Runs of the program in a folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The path of a file in models/, for a command line.
pub fn model(name: &str) -> String {
    super::model_path(name).to_str().unwrap().to_string()
}

pub fn blinn(folder: &Path, line: &str) -> Output {
    let words = line.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_blinn")).args(words).current_dir(folder).output().unwrap()
}

pub fn blinn_args(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_blinn")).args(args).current_dir(folder).output().unwrap()
}

/// Starts a command line eight times and kills it after a while, each time later. Returns how often it was still running.
pub fn kill_repeatedly(folder: &Path, line: &str) -> usize {
    let is_killed = |i: u64| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blinn"))
            .args(line.split_whitespace())
            .current_dir(folder)
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(30 + 40 * i));
        let _ = child.kill();
        child.wait().unwrap().code().is_none()
    };
    (0..8).filter(|&i| is_killed(i)).count()
}

/// Checks that it succeeds. Returns its messages.
#[track_caller]
pub fn runs(folder: &Path, line: &str) -> String {
    let output = blinn(folder, line);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{line}: {messages}");
    messages
}

/// Checks that the command line is rejected before anything is written.
#[track_caller]
pub fn refused(folder: &Path, line: &str, message: &str) {
    let before = files(folder);
    let output = blinn(folder, line);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{line}: {messages}");
    assert!(messages.contains(message), "{line}: {messages}");
    assert!(files(folder) == before, "{line} left something behind");
}

/// Checks that it fails with `code` and one line that contains `message`, and writes nothing.
#[track_caller]
pub fn fails(folder: &Path, args: &[&str], code: i32, message: &str) {
    let before = names(folder);
    let output = blinn_args(folder, args);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {errors}");
    if code == 1 {
        assert_eq!(errors.lines().count(), 1, "{args:?}: {errors}");
        assert!(errors.starts_with("blinn: "), "{errors}");
    }
    assert!(errors.contains(message), "{args:?}: {errors}");
    assert!(!errors.contains("panicked") && !errors.contains("backtrace"), "{errors}");
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder), before, "{args:?} left something behind");
}

/// All files below a folder with their contents.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        if path.is_dir() {
            all.extend(files(&path).into_iter().map(|(inside, bytes)| (format!("{name}/{inside}"), bytes)));
        } else {
            all.insert(name, fs::read(&path).unwrap());
        }
    }
    all
}

pub fn names(folder: &Path) -> Vec<String> {
    files(folder).into_keys().collect()
}

pub fn folder() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().to_path_buf();
    (dir, path)
}

/// Returns true if child processes react to a signal: background jobs of a shell script ignore interrupts.
pub fn heeds(signal: &str) -> bool {
    let number = [("-HUP", 1), ("-INT", 2), ("-TERM", 15)].iter().find(|(name, _)| *name == signal);
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.map_or(0, |mask| u64::from_str_radix(mask.trim(), 16).unwrap());
    number.is_none_or(|(_, number)| ignored >> (number - 1) & 1 == 0)
}
