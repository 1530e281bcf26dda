//! Runs a program until it ends or the work is cancelled.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::Duration;

use blinn_core::cancellation::CancelToken;
use blinn_import::LoadError;

/// Longest time between two looks at the program.
const PERIOD: Duration = Duration::from_millis(20);

/// The end of the output that is kept.
const OUTPUT_BYTES: u64 = 1 << 16;

/// The end of a program.
pub struct Ended {
    pub status: ExitStatus,
    /// The end of what it printed.
    pub output: String,
}

/// Runs a program with open standard input, which closes when this process ends. A cancellation kills the program and
/// those that it started.
///
/// # Errors
/// The program cannot be started; the work was cancelled.
pub fn run(command: &mut Command, cancel: &CancelToken) -> Result<Ended, RunError> {
    let mut output = tempfile::tempfile()?;
    command.stdin(Stdio::piped()).stdout(output.try_clone()?).stderr(output.try_clone()?);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = KilledOnDrop(command.spawn()?);
    let mut pause = Duration::from_millis(1);
    let status = loop {
        if let Some(status) = child.0.try_wait()? {
            break status;
        }
        if cancel.is_cancelled() {
            return Err(RunError::Cancelled);
        }
        sleep(pause);
        pause = PERIOD.min(pause * 2);
    };
    Ok(Ended { status, output: tail(&mut output)? })
}

/// A program that did not run to its end.
#[derive(Debug)]
pub enum RunError {
    Io(io::Error),
    Cancelled,
}

impl From<io::Error> for RunError {
    fn from(error: io::Error) -> RunError {
        RunError::Io(error)
    }
}

impl RunError {
    /// The error of a load that ran `program`.
    pub fn into_load_error(self, program: &std::path::Path) -> LoadError {
        match self {
            RunError::Io(cause) => LoadError::Io { path: program.to_path_buf(), cause },
            RunError::Cancelled => LoadError::Cancelled(blinn_core::cancellation::Cancelled),
        }
    }
}

/// A running program, which is killed with its process group unless it has ended.
struct KilledOnDrop(Child);

impl Drop for KilledOnDrop {
    fn drop(&mut self) {
        if !matches!(self.0.try_wait(), Ok(None)) {
            return;
        }
        #[cfg(unix)]
        if let Some(group) = i32::try_from(self.0.id()).ok().and_then(rustix::process::Pid::from_raw) {
            let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Returns the end of a file as text.
fn tail(file: &mut File) -> io::Result<String> {
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(length.saturating_sub(OUTPUT_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(OUTPUT_BYTES).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(all(test, unix))]
mod tests {
    use std::time::Instant;

    use super::*;

    fn shell(script: &str, cancel: &CancelToken) -> Result<Ended, RunError> {
        run(Command::new("sh").args(["-c", script]), cancel)
    }

    #[test]
    fn both_outputs_and_the_status_are_returned() {
        let ended = shell("echo one; echo two >&2; exit 3", &CancelToken::default()).unwrap();
        assert_eq!((ended.status.code(), ended.output.as_str()), (Some(3), "one\ntwo\n"));
    }

    #[test]
    fn only_the_end_of_a_long_output_is_kept() {
        let ended =
            shell("head -c 300000 /dev/zero | tr '\\0' x; echo end", &CancelToken::default()).unwrap();
        assert!(ended.output.len() == OUTPUT_BYTES as usize && ended.output.ends_with("xend\n"));
    }

    #[test]
    fn a_cancellation_kills_the_program_and_its_children() {
        let dir = tempfile::tempdir().unwrap();
        let mark = dir.path().join("mark");
        let script = format!("(sleep 1; touch '{}') & sleep 100", mark.display());
        let (start, cancel) = (Instant::now(), CancelToken::with_timeout(Duration::from_millis(200)));
        assert!(matches!(shell(&script, &cancel), Err(RunError::Cancelled)));
        assert!(start.elapsed() < Duration::from_secs(20));
        sleep(Duration::from_millis(1500));
        assert!(!mark.exists());
    }
}
