//! Options of images as arguments: clap's definitions come from the session's table of options.

use std::ffi::{OsStr, OsString};
use std::marker::PhantomData;
use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, value_parser};

use crate::usage::UsageError;
use blinn_session::{Effect, Heading, NamedOptions, OptionDef, Options, option_defs, word_options};

/// The options of a group that a command line sets.
#[derive(Clone, Debug)]
pub struct OptionArgs<G> {
    /// In the order of the table.
    pub given: GivenOptions,
    group: PhantomData<G>,
}

/// Options of the table that a command has at one place.
pub trait OptionGroup {
    /// True for an option of the group.
    fn contains(def: &OptionDef) -> bool;

    /// The documentation of an option.
    fn help(def: &OptionDef) -> &'static str {
        def.help
    }
}

/// Options that select and interpret scene files.
#[derive(Clone, Debug)]
pub struct SceneGroup;

/// Options that decide the pixels: image, camera, lights and shading.
#[derive(Clone, Debug)]
pub struct PictureGroup;

/// Options of commands that have views of their own.
#[derive(Clone, Debug)]
pub struct PreviewGroup;

/// The animation.
#[derive(Clone, Debug)]
pub struct AnimationGroup;

/// Options that decide which files may be read.
#[derive(Clone, Debug)]
pub struct FileGroup;

impl OptionGroup for SceneGroup {
    fn contains(def: &OptionDef) -> bool {
        def.heading == Heading::Scene
    }
}

impl OptionGroup for PictureGroup {
    fn contains(def: &OptionDef) -> bool {
        use Heading::{Camera, Image, Lights, Output, Shading};
        [Image, Output, Camera, Lights, Shading].contains(&def.heading)
    }
}

impl OptionGroup for PreviewGroup {
    fn contains(def: &OptionDef) -> bool {
        [Heading::Lights, Heading::Shading].contains(&def.heading)
            || ["samples", "background", "exposure", "view"].contains(&def.name)
    }

    /// The defaults of the image are others.
    fn help(def: &OptionDef) -> &'static str {
        match def.heading {
            Heading::Image => def.help.split("[default").next().unwrap_or_default().trim_end(),
            _ => def.help,
        }
    }
}

impl OptionGroup for AnimationGroup {
    fn contains(def: &OptionDef) -> bool {
        def.heading == Heading::Time
    }
}

impl OptionGroup for FileGroup {
    fn contains(def: &OptionDef) -> bool {
        def.heading == Heading::Process
    }
}

impl<G: OptionGroup> Args for OptionArgs<G> {
    fn augment_args(command: Command) -> Command {
        option_defs().filter(|def| G::contains(def)).fold(command, |command, def| command.arg(arg::<G>(def)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<G: OptionGroup> FromArgMatches for OptionArgs<G> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut given = GivenOptions::default();
        let is_given = |def: &&OptionDef| matches.value_source(def.name) == Some(ValueSource::CommandLine);
        for def in option_defs().filter(|def| G::contains(def)).filter(is_given) {
            let values = matches.get_raw(def.name).filter(|_| def.takes_value());
            match values {
                Some(values) => given.0.extend(values.map(|value| (def, value.to_os_string()))),
                None => given.0.push((def, OsString::new())),
            }
        }
        Ok(OptionArgs { given, group: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The definition of an option.
fn arg<G: OptionGroup>(def: &'static OptionDef) -> Arg {
    let is_known = |name: &&str| OptionDef::find(name).is_some_and(G::contains);
    let mut arg = Arg::new(def.name)
        .long(def.name)
        .help_heading(def.heading.title())
        .hide(def.is_hidden)
        .conflicts_with_all(def.conflicts.iter().filter(|name| is_known(name)));
    if let Some(short) = def.short {
        arg = arg.short(short);
    }
    if let Some(alias) = def.alias {
        arg = arg.alias(alias);
    }
    if let Some(needed) = def.requires {
        arg = arg.requires(needed);
    }
    let help = word_options(G::help(def));
    if let Some((summary, _)) = help.split_once("\n\n") {
        arg = arg.help(summary.to_string()).long_help(help);
    } else {
        arg = arg.help(help);
    }
    if let Some(default) = def.default {
        arg = arg.default_value(default);
    }
    let action = if def.is_repeatable { ArgAction::Append } else { ArgAction::Set };
    match def.effect {
        Effect::Flag(_) => arg.action(ArgAction::SetTrue),
        Effect::Path(_) => arg.action(action).value_name(def.value_name).value_parser(value_parser!(PathBuf)),
        Effect::Value(_) if !def.choices.is_empty() => {
            arg.action(action).value_name(def.value_name).value_parser(PossibleValuesParser::new(def.choices))
        }
        Effect::Value(_) => {
            let check =
                |text: &str| def.apply(&mut Options::default(), text.as_ref()).map(|()| text.to_string());
            arg.action(action).value_name(def.value_name).value_parser(check)
        }
    }
}

/// Options with their values.
#[derive(Clone, Debug, Default)]
pub struct GivenOptions(Vec<(&'static OptionDef, OsString)>);

impl GivenOptions {
    /// True if an option is set.
    pub fn contains(&self, name: &str) -> bool {
        self.value(name).is_some()
    }

    /// The last value of an option; empty for an option without a value.
    pub fn value(&self, name: &str) -> Option<&OsStr> {
        self.0.iter().rev().find(|(def, _)| def.name == name).map(|(_, value)| value.as_os_str())
    }
}

/// Sets the options of several groups.
///
/// # Errors
/// A value has another form, which clap has found before.
pub fn named_options<const N: usize>(groups: [&GivenOptions; N]) -> Result<NamedOptions, UsageError> {
    let mut options = NamedOptions::default();
    for (def, value) in groups.into_iter().flat_map(|group| &group.0) {
        options.set(def.name, value)?;
    }
    Ok(options)
}
