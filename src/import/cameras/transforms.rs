//! `transforms.json` of NeRF, instant-ngp and nerfstudio, as `blinn turntable --views` writes it.

use std::fmt;
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

use super::json;
use super::lens_keys::LensKeys;
use super::listed_camera::{ListedCamera, MAX_CAMERAS};
use super::matrix::Matrix;
use super::names::picture_name;
use super::recorded_view::{RecordedKeys, RecordedView};
use crate::error::LoadError;
use blinn_scene::{CameraAxes, FARTHEST, LightRotation, SimilarityTransform};

/// The document. Other keys are ignored.
#[derive(Default)]
struct Document {
    lens: LensKeys,
    /// Metres per step of integer depth images.
    integer_depth_scale: Option<f64>,
    /// The exact view, if blinn recorded it.
    recorded: Option<RecordedView>,
    frames: Vec<Frame>,
}

/// A frame, whose lens may be completed by the root, which may follow it.
struct Frame {
    name: Option<String>,
    /// `None` for a picture whose pose is not known.
    to_world: Option<SimilarityTransform>,
    /// Seconds.
    time: Option<f64>,
    /// `None` without keys of its own.
    lens: Option<Box<LensKeys>>,
    own: OwnKeys,
}

/// The keys of a frame that only blinn writes. They count if the file has its record.
#[derive(Clone, Copy, Default)]
struct OwnKeys {
    light: LightRotation,
    /// Position in the scene's world, in metres.
    view_point: Option<DVec3>,
}

/// The cameras of a document.
pub(super) struct Transforms {
    /// In the order of the frames.
    pub cameras: Vec<ListedCamera>,
    /// The recorded lens.
    pub recorded: Option<RecordedView>,
    /// Number of frames without a pose.
    pub without_pose: usize,
}

/// Loads the cameras. Frames without a pose are left out, unless none has one.
pub(super) fn load(path: &Path, limit: u64) -> Result<Transforms, LoadError> {
    let Document { lens: root, integer_depth_scale, recorded, frames } = json::read_document(path, limit)?;
    if let Some(scale) = integer_depth_scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
        let message = format!("must be greater than zero, not {scale}");
        return Err(json::invalid(path, "integer_depth_scale", message));
    }
    let count = frames.len();
    if count > 0 && frames.iter().all(|frame| frame.to_world.is_none()) {
        return Err(json::invalid(path, "frames[0]", "has no transform_matrix"));
    }
    let complete = |(i, frame): (usize, Frame)| {
        let Some(to_world) = frame.to_world else { return Ok(None) };
        let (lens, size) = frame
            .lens
            .unwrap_or_default()
            .resolve(&root)
            .map_err(|message| json::invalid(path, &format!("frames[{i}]"), message))?;
        let (view_point, basis) = to_world.camera_pose(CameraAxes::OpenGl);
        let (view_point, light) = match &recorded {
            Some(view) => (view.position_in_metres(view_point, frame.own.view_point), frame.own.light),
            None => (view_point, LightRotation::default()),
        };
        // False for NaN, too.
        let is_near = view_point.abs().max_element() <= FARTHEST;
        if !is_near {
            let message = "is too far from the origin for single precision, without the normalization";
            return Err(json::invalid(path, &format!("frames[{i}]"), message));
        }
        Ok(Some(ListedCamera {
            name: frame.name,
            view_point,
            basis,
            lens,
            size,
            time: frame.time.or(recorded.map(|view| view.time)),
            depth_step: integer_depth_scale,
            light,
        }))
    };
    let completed = frames.into_iter().enumerate().map(complete);
    let cameras =
        completed.filter_map(Result::transpose).collect::<Result<Vec<ListedCamera>, LoadError>>()?;
    let is_same = |view: &RecordedView| {
        cameras.iter().all(|camera| view.matches(&camera.camera(view.size), camera.size))
    };
    let recorded = recorded.map(|view| RecordedView { is_exact: is_same(&view), ..view });
    let without_pose = count - cameras.len();
    Ok(Transforms { cameras, recorded, without_pose })
}

impl<'de> Deserialize<'de> for Document {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Document, D::Error> {
        struct DocumentVisitor;
        impl<'de> Visitor<'de> for DocumentVisitor {
            type Value = Document;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object with frames")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Document, A::Error> {
                let mut document = Document::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "frames" => document.frames = map.next_value::<Frames>()?.0,
                        "blinn" => {
                            let view = map.next_value::<RecordedKeys>()?.to_view();
                            document.recorded = Some(view.map_err(A::Error::custom)?);
                        }
                        "integer_depth_scale" => document.integer_depth_scale = map.next_value()?,
                        key if document.lens.read(key, &mut map)? => {}
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(document)
            }
        }
        deserializer.deserialize_map(DocumentVisitor)
    }
}

/// A limited number of frames.
struct Frames(Vec<Frame>);

impl<'de> Deserialize<'de> for Frames {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Frames, D::Error> {
        struct FramesVisitor;
        impl<'de> Visitor<'de> for FramesVisitor {
            type Value = Frames;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of frames")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Frames, A::Error> {
                let mut frames = Vec::new();
                while let Some(frame) = seq.next_element()? {
                    if frames.len() == MAX_CAMERAS {
                        return Err(A::Error::custom(format!("more than {MAX_CAMERAS} cameras")));
                    }
                    frames.push(frame);
                }
                Ok(Frames(frames))
            }
        }
        deserializer.deserialize_seq(FramesVisitor)
    }
}

impl<'de> Deserialize<'de> for Frame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Frame, D::Error> {
        struct FrameVisitor;
        impl<'de> Visitor<'de> for FrameVisitor {
            type Value = Frame;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a frame with a transform_matrix")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Frame, A::Error> {
                let (mut name, mut to_world, mut time) = (None, None, None);
                let mut lens = LensKeys::default();
                let mut own = OwnKeys::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "file_path" => name = map.next_value::<Option<String>>()?,
                        "time" => time = map.next_value::<Option<f64>>()?,
                        "transform_matrix" => {
                            let matrix = map.next_value::<Option<Matrix>>()?;
                            let named = |defect| A::Error::custom(format!("transform_matrix {defect}"));
                            let pose = matrix.map(|matrix| matrix.to_similarity());
                            to_world = pose.transpose().map_err(named)?;
                        }
                        "light_rotation" => own.light.sources = number(map.next_value()?),
                        "environment_rotation" => own.light.environment = number(map.next_value()?),
                        "scene_view_point" => own.view_point = point(&map.next_value()?),
                        key if lens.read(key, &mut map)? => {}
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(Frame {
                    name: name.as_deref().and_then(picture_name),
                    to_world,
                    time,
                    lens: (!lens.is_empty()).then(|| Box::new(lens)),
                    own,
                })
            }
        }
        deserializer.deserialize_map(FrameVisitor)
    }
}

/// A number of a file that may be another program's: 0 for anything else.
fn number(value: Value) -> f64 {
    value.as_f64().unwrap_or(0.0)
}

/// A point of a file that may be another program's.
fn point(value: &Value) -> Option<DVec3> {
    let [x, y, z] = value.as_array()?.as_slice() else { return None };
    Some(DVec3::new(x.as_f64()?, y.as_f64()?, z.as_f64()?))
}
