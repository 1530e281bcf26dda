//! Errors of a session.

use blinn_core::cancellation::Cancelled;
use blinn_core::option_words::option_word;
use blinn_import::LoadError;
use blinn_output::SaveError;
use blinn_scene::{NoMatch, PoseError, ViewError};

use crate::notice::Notice;

/// A scene cannot be rendered as the options ask.
///
/// Messages name an option in backticks, with a value or without: `` `clip off` ``, unless the program has other words
/// ([`set_option_word`](crate::set_option_word)).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The scene or another input cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The scene has no such animation.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// The camera does not suit the scene.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The objects to show or hide are not in the scene.
    #[error(transparent)]
    Selection(#[from] NoMatch),
    /// An image cannot be written.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// An option does not suit the scene or another option.
    #[error("{0}")]
    Option(String),
    /// A file that an option names cannot be read.
    #[error("{}: {}", option_word(.0, None), .1)]
    OptionFile(&'static str, LoadError),
    /// A warning that the caller made an error.
    #[error("{0}")]
    Warning(Notice),
}

impl SessionError {
    /// True if the work was cancelled.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, SessionError::Cancelled(_) | SessionError::Load(LoadError::Cancelled(_)))
    }
}
