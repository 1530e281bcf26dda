//! EXT_lights_ies: lights with the intensities of a measured luminaire, from an IES file.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use serde_json::Value;

use super::document::Document;
use super::node_light;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::ies;
use blinn_scene::{Light, LightKind, LightProfile};

pub(super) const NAME: &str = "EXT_lights_ies";

/// Bytes that a byte of an IES file takes while it is read.
const BYTES_PER_BYTE: u64 = 8;

/// The profiles of a file that its nodes use, each read once.
#[derive(Default)]
pub(super) struct Profiles {
    /// The scene's profile for each light of the extension; `None` if it could not be read.
    by_light: HashMap<u64, Option<u32>>,
    pub read: Vec<Arc<LightProfile>>,
}

impl Profiles {
    /// Returns the photometric light of a node of the file, `node` in the scene; `None`, with a warning, if its profile
    /// cannot be read.
    ///
    /// # Errors
    /// The profile exceeds a limit.
    pub fn light(
        &mut self,
        doc: &Document<'_>,
        node_index: usize,
        node: u32,
        warnings: &mut Warnings,
    ) -> Result<Option<Light>, LoadError> {
        let json = &doc.root().nodes[node_index];
        let Some(index) = node_light::index_of(json, NAME) else { return Ok(None) };
        let lights = node_light::lights_of(doc.root(), NAME);
        let Some(light) = usize::try_from(index).ok().and_then(|i| lights.get(i)) else {
            let place = format_args!("nodes[{node_index}].extensions.{NAME}.light");
            let has = lights.len();
            warnings
                .add(place, format_args!("ignored light {index}, which does not exist: the file has {has}"));
            return Ok(None);
        };
        let profile = match self.by_light.get(&index) {
            Some(&profile) => profile,
            None => {
                let profile = self.read_profile(doc, light, index, warnings)?;
                self.by_light.insert(index, profile);
                profile
            }
        };
        let Some(profile) = profile else { return Ok(None) };
        let body = json.extensions.as_ref().and_then(|e| e.others.get(NAME)).unwrap_or(&Value::Null);
        let place = format!("nodes[{node_index}].extensions.{NAME}");
        Ok(Some(Light {
            name: light.get("name").and_then(Value::as_str).unwrap_or_default().into(),
            node,
            kind: LightKind::Photometric { profile },
            color: color(body, &place, warnings),
            intensity: multiplier(body, &place, warnings),
            range: f32::INFINITY,
            radius: 0.0,
        }))
    }

    fn read_profile(
        &mut self,
        doc: &Document<'_>,
        light: &Value,
        index: u64,
        warnings: &mut Warnings,
    ) -> Result<Option<u32>, LoadError> {
        let place = format!("extensions.{NAME}.lights[{index}]");
        let bytes = match read_bytes(doc, light)? {
            Ok(bytes) => bytes,
            Err(cause) => {
                warnings.add(&place, format_args!("{cause}; the light is missing"));
                return Ok(None);
            }
        };
        doc.budget.charge((bytes.len() as u64).saturating_mul(BYTES_PER_BYTE))?;
        let file = match ies::parse(&bytes) {
            Ok(file) => file,
            Err(cause) => {
                let uri = light.get("uri").and_then(Value::as_str).filter(|uri| !uri.starts_with("data:"));
                let name = uri.map(|uri| format!("'{}', ", printable(uri))).unwrap_or_default();
                warnings.add(&place, format_args!("{name}{cause}; the light is missing"));
                return Ok(None);
            }
        };
        if file.negative > 0 {
            warnings.add(&place, format_args!("{} intensities below 0 are read as 0", file.negative));
        }
        self.read.push(Arc::new(file.profile));
        Ok(Some(self.read.len() as u32 - 1))
    }
}

/// Reads the IES file of a light. The inner error is a warning.
fn read_bytes<'d>(doc: &'d Document<'_>, light: &Value) -> Result<Result<Cow<'d, [u8]>, String>, LoadError> {
    if let Some(view) = light.get("bufferView") {
        let index = view.as_u64().and_then(|view| usize::try_from(view).ok());
        let Some(index) = index else { return Ok(Err("bufferView is no index".into())) };
        return Ok(doc.buffer_view(index).map(|view| Cow::Borrowed(view.bytes)).map_err(|e| e.to_string()));
    }
    let Some(uri) = light.get("uri").and_then(Value::as_str) else {
        return Ok(Err("has neither uri nor bufferView".into()));
    };
    match doc.folder.read_uri(uri, doc.limits.file_bytes) {
        Ok(bytes) => {
            doc.budget.charge(bytes.len() as u64)?;
            Ok(Ok(Cow::Owned(bytes)))
        }
        Err(error) => {
            let missing = || Ok(Err(error.message().to_owned()));
            error.limit_error(doc.limits.file_bytes).map_or_else(missing, Err)
        }
    }
}

fn multiplier(body: &Value, place: &str, warnings: &mut Warnings) -> f32 {
    let Some(value) = body.get("multiplier") else { return 1.0 };
    let number = value.as_f64().map(|v| v as f32).filter(|v| v.is_finite() && *v >= 0.0);
    number.unwrap_or_else(|| {
        let shown = printable(&value.to_string());
        warnings.add(format_args!("{place}.multiplier"), format_args!("ignored invalid value {shown}"));
        1.0
    })
}

fn color(body: &Value, place: &str, warnings: &mut Warnings) -> Vec3 {
    let Some(value) = body.get("color") else { return Vec3::ONE };
    let numbers = value.as_array().filter(|array| array.len() == 3).and_then(|array| {
        array
            .iter()
            .map(|v| v.as_f64().map(|v| v as f32).filter(|v| v.is_finite()))
            .collect::<Option<Vec<f32>>>()
    });
    let Some(numbers) = numbers else {
        let shown = printable(&value.to_string());
        warnings.add(format_args!("{place}.color"), format_args!("ignored invalid value {shown}"));
        return Vec3::ONE;
    };
    let color = Vec3::from_slice(&numbers);
    let clamped = color.clamp(Vec3::ZERO, Vec3::ONE);
    if clamped != color {
        warnings.add(format_args!("{place}.color"), "values outside 0 to 1 are clamped");
    }
    clamped
}
