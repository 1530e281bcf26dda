//! Python types of all options, generated from the table: `src/python/blinn/_options.py`.

use pyo3::prelude::*;

use super::options::OptionSet;
use blinn_session::{Effect, OptionDef, option_defs, word_options};

const HEAD: &str = r#""""Types of options, for editors and type checkers. Generated from the table of options; `just pytest` compares it.

Rewrite it with ``GOLDEN=update just pytest -k test_options``.
"""

from __future__ import annotations

import os
from typing import Literal, Sequence, TypedDict, Union

Path = Union[str, "os.PathLike[str]"]
Number = Union[float, str]
Vector = Union[Sequence[float], str]
Names = Union[str, Sequence[str]]
"#;

/// Options that are parameters of their own.
const PARAMETERS: [&str; 2] = ["size", "samples"];

/// Return the source of `blinn/_options.py`.
#[pyfunction]
pub fn option_types() -> String {
    let mut source = HEAD.to_string();
    for (set, class, doc) in [
        (OptionSet::Load, "LoadOptions", "Options of `load` and of the constructors of `Scene`."),
        (
            OptionSet::Render,
            "RenderOptions",
            "Options of `Scene.render` and `Scene.render_many`, but for size and samples.",
        ),
    ] {
        source += &format!("\n\nclass {class}(TypedDict, total=False):\n    \"\"\"{doc}\"\"\"\n");
        for def in option_defs().filter(|def| set.contains(def) && !PARAMETERS.contains(&def.name)) {
            source += &field(&def.name.replace('-', "_"), &python_type(def), def.summary());
        }
        if set == OptionSet::Load {
            source +=
                &field("max_memory", "Union[int, str]", "Memory limit, such as 4GiB or a number of bytes.");
        }
    }
    source
}

/// A field with its documentation.
fn field(name: &str, python_type: &str, summary: &str) -> String {
    let summary = python_words(summary);
    let period = if summary.ends_with(['.', ']']) { "" } else { "." };
    format!("\n    {name}: {python_type} | None\n    \"\"\"{summary}{period}\"\"\"\n")
}

/// A summary on one line, with names of options as keywords.
fn python_words(summary: &str) -> String {
    word_options(summary).replace('\n', " ").replace('\\', "\\\\").replace("\"\"\"", "'''")
}

/// The type of an option's values.
fn python_type(def: &OptionDef) -> String {
    let value = def.value_name;
    match def.effect {
        Effect::Flag(_) => "bool".into(),
        Effect::Path(_) => "Path".into(),
        Effect::Value(_) if !def.choices.is_empty() => {
            let choices: Vec<String> = def.choices.iter().map(|choice| format!("\"{choice}\"")).collect();
            format!("Literal[{}]", choices.join(", "))
        }
        Effect::Value(_) if def.is_repeatable && value.contains(',') => {
            "Union[Vector, Sequence[Vector]]".into()
        }
        Effect::Value(_) if def.is_repeatable => "Names".into(),
        Effect::Value(_) if value == "WxH" => "Union[int, Vector]".into(),
        Effect::Value(_) if value.contains(['|']) && value.contains("NAME") => "Union[str, int]".into(),
        Effect::Value(_) if value == "LIST" => "Names".into(),
        // A colour may be one number.
        Effect::Value(_) if value.contains("COLOR") || value.contains("[,") => "Union[float, Vector]".into(),
        Effect::Value(_) if value.contains(',') => "Vector".into(),
        Effect::Value(_) if value == "NAME" => "str".into(),
        Effect::Value(_) => "Number".into(),
    }
}
