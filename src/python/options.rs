//! Options of the session as keyword arguments: `view_point=(1, 2, 3)` sets `view-point` to `1,2,3`.

use std::ffi::OsString;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};

use super::errors::value_error;
use blinn_accel::AccelSettings;
use blinn_core::closest_name::closest_name;
use blinn_core::worded;
use blinn_render::integrator::Aov;
use blinn_session::{
    Heading, NamedOptions, OptionDef, SessionError, SessionPlan, option_defs, simd_level, values,
};

/// Options of `load` among those of pictures.
const LOAD_ONLY: [&str; 2] = ["hide", "only-objects"];
/// The memory limit of `load`, which decides no pixels.
const MAX_MEMORY: &str = "max-memory";
/// Options that are parameters of their own.
const PARAMETERS: [&str; 2] = ["aov", "camera"];

/// Parameters of `Scene.render` that are no options.
const RENDER_PARAMETERS: [&str; 5] = ["camera", "size", "samples", "layers", "progress"];

/// The call that options belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionSet {
    Load,
    Render,
}

impl OptionSet {
    /// True for an option of the call.
    pub fn contains(self, def: &OptionDef) -> bool {
        let is_of_load =
            [Heading::Scene, Heading::Process].contains(&def.heading) || LOAD_ONLY.contains(&def.name);
        match self {
            OptionSet::Load => is_of_load,
            OptionSet::Render => !is_of_load && !PARAMETERS.contains(&def.name),
        }
    }

    /// The option with a name.
    fn find(self, name: &str) -> Option<&'static OptionDef> {
        option_defs().find(|def| def.name == name && self.contains(def))
    }

    /// Names of all options, sorted.
    fn keywords(self) -> Vec<String> {
        let names = option_defs().filter(|def| self.contains(def)).map(|def| def.name);
        let more = (self == OptionSet::Load).then_some(MAX_MEMORY);
        let mut names: Vec<String> = names.chain(more).map(|name| name.replace('-', "_")).collect();
        names.sort();
        names
    }
}

/// Return the names of all options of `Scene.render`.
#[pyfunction(name = "render_options")]
pub fn list_render_options() -> Vec<String> {
    OptionSet::Render.keywords()
}

/// Resolves keyword arguments into a plan. `more` are options by name.
pub fn plan(
    set: OptionSet,
    keywords: Option<&Bound<'_, PyDict>>,
    more: &[(&str, String)],
) -> PyResult<SessionPlan> {
    let mut options = NamedOptions::default();
    let mut max_memory = None;
    for (name, value) in more {
        options.set(name, value).map_err(option_error)?;
    }
    for (key, value) in keywords.into_iter().flatten() {
        let key: String = key.extract()?;
        let name = key.trim_end_matches('_').replace('_', "-");
        match set.find(&name) {
            Some(def) => set_option(&mut options, def, &value)?,
            None if set == OptionSet::Load && name == MAX_MEMORY => {
                max_memory = memory_limit(&value)?;
            }
            None => return Err(unknown(&key, set)),
        }
    }
    let options = options.finish().map_err(option_error)?;
    if options.depth_unit.is_some() && !options.aovs.aovs.contains(&Aov::Depth) {
        return Err(value_error(worded!("`depth-unit` applies only to the layer depth; add it")));
    }
    let build = AccelSettings { simd: simd_level().map_err(option_error)?, ..AccelSettings::default() };
    // Names of ids are for files beside images.
    let plan = SessionPlan { build, max_memory, holds_layers: false, ..SessionPlan::new(options) };
    plan.neighbours.check(&plan.options).map_err(option_error)?;
    Ok(plan)
}

/// The exception for an option.
pub fn option_error(error: SessionError) -> PyErr {
    value_error(error.to_string())
}

fn unknown(key: &str, set: OptionSet) -> PyErr {
    let (other, call) = match set {
        OptionSet::Load => (OptionSet::Render, "render"),
        OptionSet::Render => (OptionSet::Load, "load"),
    };
    if other.keywords().contains(&key.replace('-', "_")) {
        return PyTypeError::new_err(format!("'{key}' is an option of {call}()"));
    }
    let parameters: &[&str] = if set == OptionSet::Render { &RENDER_PARAMETERS } else { &["name"] };
    unknown_option(key, &set.keywords(), parameters)
}

/// The exception for a keyword argument of another name than options and parameters.
pub fn unknown_option(key: &str, options: &[String], parameters: &[&str]) -> PyErr {
    let names = options.iter().map(String::as_str).chain(parameters.iter().copied());
    PyTypeError::new_err(match closest_name(key, names) {
        Some(name) => format!("unknown option '{key}'; did you mean '{name}'?"),
        None => format!("unknown option '{key}'; options: {}", options.join(", ")),
    })
}

/// Sets an option. True stands for an option without value; None and False for no option; a sequence of sequences or
/// strings for an option that is repeated.
fn set_option(options: &mut NamedOptions, def: &OptionDef, value: &Bound<'_, PyAny>) -> PyResult<()> {
    if value.is_none() {
        return Ok(());
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        return match flag.is_true() {
            true if def.takes_value() => Err(value_error(worded!("`{}` needs a value", def.name))),
            true => options.set(def.name, "").map_err(option_error),
            false => Ok(()),
        };
    }
    if !def.takes_value() {
        return Err(value_error(worded!("`{}` is True or False", def.name)));
    }
    if def.is_repeatable && holds_values(value)? {
        for item in value.try_iter()? {
            options.set(def.name, text(&item?)?).map_err(option_error)?;
        }
        return Ok(());
    }
    options.set(def.name, text(value)?).map_err(option_error)
}

/// The bytes of a memory limit.
fn memory_limit(value: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    if value.is_none() {
        return Ok(None);
    }
    let limit = values::bytes(&text(value)?.to_string_lossy());
    limit.map(Some).map_err(|reason| value_error(worded!("`{}`: {}", MAX_MEMORY, reason)))
}

/// True for a sequence of sequences or of strings, false for a single value such as a vector.
fn holds_values(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    if is_scalar(value)? {
        return Ok(false);
    }
    let Some(first) = value.try_iter()?.next() else { return Ok(true) };
    Ok(first?.extract::<f64>().is_err())
}

fn is_scalar(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(value.is_instance_of::<PyString>() || value.hasattr("__fspath__")? || value.try_iter().is_err())
}

/// The text of a value. The items of a sequence are joined by commas.
fn text(value: &Bound<'_, PyAny>) -> PyResult<OsString> {
    if value.hasattr("__fspath__")? {
        return value.call_method0("__fspath__")?.extract();
    }
    if is_scalar(value)? {
        return value.str()?.extract();
    }
    let items = value.try_iter()?.map(|item| item?.str()?.extract::<String>());
    Ok(items.collect::<PyResult<Vec<String>>>()?.join(",").into())
}
