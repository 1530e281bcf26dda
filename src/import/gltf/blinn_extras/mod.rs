//! `extras.blinn`: what Blender shows of a scene and glTF has no field for, as the Blender extension writes it.

mod camera;
mod light;
mod material;
mod scene_settings;
mod world;

use std::fmt::Display;

use serde_json::{Map, Value};

use crate::error::Warnings;
use crate::files::escape::printable;

pub(super) use camera::{Lens, is_active_camera, lens};
pub(super) use light::{ellipse_aspect, extended_light};
pub(super) use material::is_thin_wall;
pub(super) use scene_settings::SceneExtras;

/// Name of the object in `extras`.
const NAME: &str = "blinn";

/// The members of `extras.blinn`, or of an object in it. A wrong value is a warning and not given.
#[derive(Debug)]
pub(super) struct Members {
    json: Map<String, Value>,
    /// Where they are in the file.
    place: String,
}

impl Members {
    /// Reads `extras.blinn` of the object at `place`, from the text of its `extras`.
    pub fn of(extras: Option<&str>, place: impl Display, warnings: &mut Warnings) -> Option<Members> {
        // Few files have any, and extras may be long.
        let text = extras.filter(|text| text.contains(NAME))?;
        Members::in_extras(&serde_json::from_str(text).ok()?, place, warnings)
    }

    /// Reads `extras.blinn` of the object at `place`, from its `extras`.
    fn in_extras(extras: &Value, place: impl Display, warnings: &mut Warnings) -> Option<Members> {
        Members::new(extras.get(NAME)?.clone(), format!("{place}.extras.{NAME}"), warnings)
    }

    fn new(value: Value, place: String, warnings: &mut Warnings) -> Option<Members> {
        match value {
            Value::Object(json) => Some(Members { json, place }),
            other => {
                warnings.add(place, format_args!("ignored {}, which is not an object", shown(&other)));
                None
            }
        }
    }

    /// Returns the member `name` as `read` understands it; `None`, with a warning, if it does not.
    pub fn get<T>(
        &self,
        name: &str,
        warnings: &mut Warnings,
        read: impl FnOnce(&Value) -> Option<T>,
    ) -> Option<T> {
        let value = self.json.get(name)?;
        let read = read(value);
        if read.is_none() {
            let place = format!("{}.{name}", self.place);
            warnings.add(place, format_args!("ignored invalid value {}", shown(value)));
        }
        read
    }

    /// Returns a number in a range.
    pub fn number(
        &self,
        name: &str,
        range: impl std::ops::RangeBounds<f64>,
        warnings: &mut Warnings,
    ) -> Option<f64> {
        self.get(name, warnings, |value| value.as_f64().filter(|v| v.is_finite() && range.contains(v)))
    }

    /// Returns `N` numbers in a range.
    pub fn numbers<const N: usize>(
        &self,
        name: &str,
        range: impl std::ops::RangeBounds<f64>,
        warnings: &mut Warnings,
    ) -> Option<[f64; N]> {
        self.get(name, warnings, |value| {
            let number = |v: &Value| v.as_f64().filter(|v| v.is_finite() && range.contains(v));
            let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(number).collect();
            numbers?.try_into().ok()
        })
    }

    /// Returns a whole number in a range.
    pub fn whole(
        &self,
        name: &str,
        range: std::ops::RangeInclusive<i64>,
        warnings: &mut Warnings,
    ) -> Option<i64> {
        let read = |value: &Value| {
            let float = || value.as_f64().filter(|v| v.fract() == 0.0 && v.abs() < 1e15).map(|v| v as i64);
            value.as_i64().or_else(float).filter(|v| range.contains(v))
        };
        self.get(name, warnings, read)
    }

    /// Returns true or false.
    pub fn flag(&self, name: &str, warnings: &mut Warnings) -> Option<bool> {
        self.get(name, warnings, Value::as_bool)
    }

    /// Returns a text that can be printed.
    pub fn text(&self, name: &str, warnings: &mut Warnings) -> Option<String> {
        self.get(name, warnings, |value| value.as_str().map(printable))
    }

    /// Returns an object.
    pub fn child(&self, name: &str, warnings: &mut Warnings) -> Option<Members> {
        let value = self.json.get(name)?.clone();
        Members::new(value, format!("{}.{name}", self.place), warnings)
    }
}

/// A value as messages show it.
fn shown(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = printable(&value.to_string());
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
