//! Messages between the page and the server, as JSON.

use serde::Deserialize;
use serde_json::{Value, json};

use super::state::ViewState;
use blinn_session::without_error_codes;

/// A message of the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum PageMessage {
    View(Box<ViewMessage>),
    Pick(PickMessage),
    Open(OpenMessage),
}

/// Another scene of the list, by its index.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct OpenMessage {
    pub file: usize,
}

/// The state to show. It replaces the one before.
#[derive(Clone, Debug, Deserialize)]
pub struct ViewMessage {
    pub serial: u64,
    /// True while more states follow at once.
    #[serde(default)]
    pub moving: bool,
    /// Width and height of the picture in pixels.
    pub size: (u32, u32),
    pub view: ViewState,
}

/// A pixel of the picture, from its top left corner.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct PickMessage {
    pub serial: u64,
    pub x: f64,
    pub y: f64,
}

/// The text of an error of a picture, which the next picture clears.
pub fn error(text: &str) -> String {
    json!({"type": "error", "text": without_error_codes(text), "scene": false}).to_string()
}

/// The text of an error of the scene's files, which stays until they are read without one.
pub fn scene_error(text: &str) -> String {
    json!({"type": "error", "text": without_error_codes(text), "scene": true}).to_string()
}

/// The text of a status: `loading`, `rendering`, `idle` or `reloading`.
pub fn status(state: &str, text: &str) -> String {
    json!({"type": "status", "state": state, "text": text}).to_string()
}

/// The text of the commands that make a picture.
pub fn command(
    serial: u64,
    render: &str,
    turntable: Option<&str>,
    hidden: &[u32],
    warnings: &[String],
) -> String {
    json!({
        "type": "command", "serial": serial, "render": render, "turntable": turntable,
        "hidden": hidden, "warnings": warnings,
    })
    .to_string()
}

/// The text of what is at a pixel: the index of an object and a point.
pub fn picked(serial: u64, hit: Option<(u32, [f64; 3])>) -> String {
    let (object, point): (Value, Value) = match hit {
        Some((object, point)) => (json!(object), json!(point)),
        None => (Value::Null, Value::Null),
    };
    json!({"type": "picked", "serial": serial, "object": object, "point": point}).to_string()
}
