//! All options of images, in the order in which programs show them. CONTRIBUTING.md
//! (“How to add an option”) lists what else a new one needs.

mod camera;
mod image;
mod lights;
mod scene;
mod shading;
#[cfg(test)]
mod tests;

use std::path::Path;

use crate::options::Options;
use blinn_core::closest_name::did_you_mean;

/// An option: names, documentation and effect.
#[derive(Debug)]
pub struct OptionDef {
    /// Name in words with dashes, such as `view-point`.
    pub name: &'static str,
    /// Another name, of another program.
    pub alias: Option<&'static str>,
    /// Letter for the command line.
    pub short: Option<char>,
    /// The group that the option belongs to.
    pub heading: Heading,
    /// Name of the value in documentation, such as `X,Y,Z`. Empty for options without a value.
    pub value_name: &'static str,
    /// The possible values, if these are few.
    pub choices: &'static [&'static str],
    /// The value that has the same effect as no option, if there is one.
    pub default: Option<&'static str>,
    /// Documentation: a paragraph that summarizes the option, and perhaps more of them after blank lines.
    pub help: &'static str,
    /// True if the option is not documented, such as another name for a value of an option.
    pub is_hidden: bool,
    /// True if each use of the option adds a value.
    pub is_repeatable: bool,
    /// Options that cannot be combined with this one.
    pub conflicts: &'static [&'static str],
    /// An option without which this one makes no sense.
    pub requires: Option<&'static str>,
    /// Options that this one sets, unless they are set beside it.
    pub presets: &'static [&'static str],
    /// Sets the option.
    pub effect: Effect,
}

/// The effect of an option on the options of images.
#[derive(Clone, Copy, Debug)]
pub enum Effect {
    /// The option has no value.
    Flag(fn(&mut Options)),
    /// The option has a value, whose error says which form is expected.
    Value(fn(&mut Options, &str) -> Result<(), String>),
    /// The value is the path of a file.
    Path(fn(&mut Options, &Path)),
}

/// A group of options.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heading {
    /// Options that select and interpret scene files.
    Scene,
    /// Size, sampling and display.
    Image,
    /// Layers beside images.
    Output,
    /// The camera.
    Camera,
    /// Light sources, shadows and environments.
    Lights,
    /// Materials and visible objects.
    Shading,
    /// The time in an animation.
    Time,
    /// How the work is done.
    Process,
}

impl Heading {
    /// The heading as it is shown.
    pub fn title(self) -> &'static str {
        match self {
            Heading::Scene => "Scene",
            Heading::Image => "Image",
            Heading::Output => "Output",
            Heading::Camera => "Camera",
            Heading::Lights => "Lights",
            Heading::Shading => "Shading",
            Heading::Time => "Time",
            Heading::Process => "Process",
        }
    }
}

impl OptionDef {
    /// An entry without documentation and effect.
    const BASE: OptionDef = OptionDef {
        name: "",
        alias: None,
        short: None,
        heading: Heading::Scene,
        value_name: "",
        choices: &[],
        default: None,
        help: "",
        is_hidden: false,
        is_repeatable: false,
        conflicts: &[],
        requires: None,
        presets: &[],
        effect: Effect::Flag(|_| ()),
    };

    /// The option with a name or an alias.
    pub fn find(name: &str) -> Option<&'static OptionDef> {
        option_defs().find(|def| def.name == name || def.alias == Some(name))
    }

    /// The first paragraph of the documentation.
    pub fn summary(&self) -> &'static str {
        self.help.split("\n\n").next().unwrap_or_default()
    }

    /// True for an option with a value.
    pub fn takes_value(&self) -> bool {
        !matches!(self.effect, Effect::Flag(_))
    }
}

/// Returns all options in the order in which programs show them.
pub fn option_defs() -> impl Iterator<Item = &'static OptionDef> {
    [scene::SCENE, image::IMAGE, camera::CAMERA, lights::LIGHTS, shading::SHADING, scene::TIME_AND_FILES]
        .into_iter()
        .flatten()
}

/// Stores a value that was read without error.
fn store<T>(field: &mut T, value: Result<T, String>) -> Result<(), String> {
    *field = value?;
    Ok(())
}

/// Names of values, and the values.
type Choices<T, const N: usize> = [(&'static str, T); N];

const fn names<T, const N: usize>(choices: &Choices<T, N>) -> [&'static str; N] {
    let mut names = [""; N];
    let mut i = 0;
    while i < N {
        names[i] = choices[i].0;
        i += 1;
    }
    names
}

/// Stores the value that a text names, in upper or lower case.
fn choose<T: Copy, const N: usize>(field: &mut T, text: &str, choices: &Choices<T, N>) -> Result<(), String> {
    match choices.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)) {
        Some((_, value)) => *field = *value,
        None => {
            let names = names(choices);
            return Err(format!("expected {}{}", names.join(", "), did_you_mean(text, names)));
        }
    }
    Ok(())
}
