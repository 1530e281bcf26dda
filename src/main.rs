//! The program `blinn`: see `blinn --help`.

fn main() -> std::process::ExitCode {
    blinn_cli::run()
}
