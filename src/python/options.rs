//! Options of the command line as keyword arguments: `view_point=(1, 2, 3)` stands for `--view-point=1,2,3`.

use std::ffi::OsString;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};

use super::plan_cache::resolve_plan;
use blinn_cli::embed::{Options, Repetition, render_options, scene_options};
use blinn_session::SessionPlan;

/// Options of `load` that the command line has among those that decide the pixels.
const LOAD_ONLY: [&str; 2] = ["hide", "only-objects"];
/// Options of `load` that the command line has among those of the process.
const PROCESS_OPTIONS: [&str; 2] = ["allow-outside", "max-memory"];
/// Options that have parameters of their own or make no sense here.
const NOT_OPTIONS: [&str; 2] = ["aov", "camera"];

/// The call that options belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionSet {
    Load,
    Render,
}

impl OptionSet {
    /// Options by their names on the command line.
    fn options(self) -> Options {
        let is_load_only = |name: &str| LOAD_ONLY.contains(&name);
        match self {
            OptionSet::Load => {
                let mut options = scene_options();
                options.extend(render_options().into_iter().filter(|(name, _)| is_load_only(name)));
                options.extend(PROCESS_OPTIONS.map(|name| (name.into(), Repetition(false))));
                options
            }
            OptionSet::Render => {
                let mut options = render_options();
                options.insert("animation".into(), Repetition(false));
                options.retain(|name, _| !is_load_only(name) && !NOT_OPTIONS.contains(&name.as_str()));
                options
            }
        }
    }
}

/// Return the names of all options of `Scene.render`.
#[pyfunction(name = "render_options")]
pub fn list_render_options() -> Vec<String> {
    OptionSet::Render.options().into_keys().map(|name| name.replace('-', "_")).collect()
}

/// Resolves keyword arguments into a plan. `more` are flags with values.
pub fn plan(
    set: OptionSet,
    options: Option<&Bound<'_, PyDict>>,
    more: &[(&str, String)],
) -> PyResult<SessionPlan> {
    let known = set.options();
    let mut argv = Vec::new();
    for (flag, value) in more {
        argv.push(format!("--{flag}={value}").into());
    }
    for (key, value) in options.into_iter().flatten() {
        let key: String = key.extract()?;
        let name = key.trim_end_matches('_').replace('_', "-");
        let Some(repetition) = known.get(&name) else { return Err(unknown(&key, set, &known)) };
        push_flag(&mut argv, &name, &value, *repetition)?;
    }
    resolve_plan(argv)
}

fn unknown(key: &str, set: OptionSet, known: &Options) -> PyErr {
    let other = match set {
        OptionSet::Load => OptionSet::Render,
        OptionSet::Render => OptionSet::Load,
    };
    let name = key.replace('_', "-");
    if other.options().contains_key(&name) {
        let call = if other == OptionSet::Load { "load" } else { "render" };
        return PyTypeError::new_err(format!("'{key}' is an option of {call}()"));
    }
    let names: Vec<String> = known.keys().map(|name| name.replace('-', "_")).collect();
    PyTypeError::new_err(format!("unknown option '{key}'; options: {}", names.join(", ")))
}

/// Appends `--name=value`. True stands for a flag without value; None and False for no flag; a sequence of sequences or
/// strings for a flag that is repeated.
fn push_flag(
    argv: &mut Vec<OsString>,
    name: &str,
    value: &Bound<'_, PyAny>,
    repetition: Repetition,
) -> PyResult<()> {
    if value.is_none() {
        return Ok(());
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        if flag.is_true() {
            argv.push(format!("--{name}").into());
        }
        return Ok(());
    }
    if repetition.0 && holds_values(value)? {
        for item in value.try_iter()? {
            push_flag(argv, name, &item?, Repetition(false))?;
        }
        return Ok(());
    }
    let mut flag = OsString::from(format!("--{name}="));
    flag.push(text(value)?);
    argv.push(flag);
    Ok(())
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
