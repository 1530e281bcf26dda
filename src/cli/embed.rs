//! The parts of the command line that the Python module uses: the program itself, the properties that `blinn info` prints,
//! its flags and words for them, and the handling of panics.

use std::ffi::OsString;

use blinn_core::option_words::{OptionWord, set_option_word};

use super::{Host, run_arguments};

pub use super::args::usage_error::{has_flag, shown_flags};
pub use super::info::scene_properties;
pub use super::option_words::flag;
pub use super::run::panics::{catch as catch_panic, install_hook as install_panic_hook};

/// Runs the program with the given arguments, its name first, inside a process of another program, whose messages word
/// options with `word` from now on. Returns the exit code.
pub fn run_program(arguments: Vec<OsString>, word: OptionWord) -> u8 {
    set_option_word(word);
    run_arguments(arguments, Host::Other)
}
