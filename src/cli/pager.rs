//! Shows long texts with the user's pager, on a terminal.

use std::ffi::OsString;
use std::io::{self, ErrorKind, IsTerminal, Write, stdout};
use std::process::{Child, Command, Stdio};

/// The pager without PAGER.
const DEFAULT: &str = "less -R";

/// Shows a text with the pager if standard output is a terminal. Returns false if it was not shown: there is no terminal
/// or no pager.
///
/// # Errors
/// The pager takes no text.
pub fn show(text: &str) -> io::Result<bool> {
    if !stdout().is_terminal() {
        return Ok(false);
    }
    let Some(words) = pager(std::env::var_os("PAGER")) else { return Ok(false) };
    let Ok(child) = start(&words) else { return Ok(false) };
    // Ctrl-C is for the pager.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGINT, Default::default());
    feed(child, text)?;
    Ok(true)
}

/// The pager's command and its arguments; `None` if PAGER asks for none.
fn pager(variable: Option<OsString>) -> Option<Vec<String>> {
    let text = variable.map_or(Some(DEFAULT.to_string()), |value| value.into_string().ok())?;
    let words = shlex::split(&text)?;
    words.first().filter(|name| *name != "cat")?;
    Some(words)
}

fn start(words: &[String]) -> io::Result<Child> {
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).stdin(Stdio::piped());
    if std::env::var_os("LESS").is_none() {
        // Shows colours, ends at once if the text fits on the screen, and leaves it there.
        command.env("LESS", "FRX");
    }
    command.spawn()
}

/// Writes the text to the pager, and waits until it ends. A pager that is left early is no error.
fn feed(mut child: Child, text: &str) -> io::Result<()> {
    let written = child.stdin.take().map_or(Ok(()), |mut input| input.write_all(text.as_bytes()));
    child.wait()?;
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_names_the_pager_or_none() {
        let words = |value: Option<&str>| pager(value.map(OsString::from)).map(|words| words.join("|"));
        assert_eq!(words(None).as_deref(), Some("less|-R"));
        assert_eq!(words(Some("most -s 'a b'")).as_deref(), Some("most|-s|a b"));
        for none in ["", " ", "cat", "'open"] {
            assert_eq!(words(Some(none)), None, "{none}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_pager_may_be_left_early() {
        let long = "line\n".repeat(100_000);
        feed(start(&["true".into()]).unwrap(), &long).unwrap();
        assert!(start(&["no such pager".into()]).is_err());
    }
}
