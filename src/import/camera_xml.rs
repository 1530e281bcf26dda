//! Camera parameters in the lecture's XML format: a `<camera>` element.

use std::path::Path;

use glam::DVec3;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::error::LoadError;
use crate::files::read_file::read_scene_file;
use blinn_scene::{Projection, View};

/// Largest XML file in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Loads `<camera type="PerspectiveCamera">` (or `OrthographicCamera`) with `viewPoint`, `viewDir`, `viewUp`,
/// `projDistance`, `viewWidth` and `viewHeight`, as the whole document or inside a scene.
///
/// # Errors
/// The file cannot be read, is not well-formed XML, has no `<camera>` element, or the element has invalid
/// numbers.
pub fn load_camera_xml(path: &Path) -> Result<View, LoadError> {
    let bytes = read_scene_file(path, MAX_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    parse(&text).map_err(|error| {
        let line = text.bytes().take(error.offset).filter(|&b| b == b'\n').count() + 1;
        LoadError::parse(format!("{}, line {line}", path.display()), error.message)
    })
}

/// An error at a byte offset of the text.
#[derive(Debug)]
struct XmlError {
    offset: usize,
    message: String,
}

fn parse(text: &str) -> Result<View, XmlError> {
    let mut reader = Reader::from_str(text);
    let mut view = View::default();
    let mut inside = false;
    let mut element: Option<String> = None;
    let mut content = String::new();
    loop {
        let offset = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX);
        let error = |message: String| XmlError { offset, message };
        let event = reader.read_event().map_err(|e| error(format!("not well-formed XML: {e}")))?;
        match event {
            Event::Eof if inside => return Err(error("the <camera> element is not closed".into())),
            Event::Eof => {
                return Err(error(
                    "no <camera> element; expected <camera type=\"PerspectiveCamera\">".into(),
                ));
            }
            Event::Start(start) if start.name().as_ref() == "camera" => {
                view.projection = Some(projection(&start).map_err(error)?);
                inside = true;
            }
            Event::Start(start) if inside => {
                element = Some(start.name().as_ref().to_string());
                content.clear();
            }
            Event::Text(t) if element.is_some() => content.push_str(&t),
            Event::End(end) if end.name().as_ref() == "camera" && inside => {
                return if view.view_point.is_some() && view.view_dir.is_some() {
                    Ok(view)
                } else {
                    Err(error("the <camera> element needs <viewPoint> and <viewDir>".into()))
                };
            }
            Event::End(_) => {
                if let Some(name) = element.take() {
                    set_parameter(&mut view, &name, &content).map_err(|e| error(format!("<{name}>: {e}")))?;
                }
            }
            _ => {}
        }
    }
}

fn projection(start: &BytesStart) -> Result<Projection, String> {
    let kind = start.attributes().flatten().find(|a| a.key.as_ref() == "type");
    match kind.as_ref().map(|a| a.value.as_ref()) {
        None | Some("PerspectiveCamera") => Ok(Projection::Perspective),
        Some("OrthographicCamera" | "ParallelCamera") => Ok(Projection::Orthographic),
        Some(other) => {
            Err(format!("unknown camera type '{other}'; expected PerspectiveCamera or OrthographicCamera"))
        }
    }
}

fn set_parameter(view: &mut View, name: &str, text: &str) -> Result<(), String> {
    let numbers = || -> Result<Vec<f64>, String> {
        let words = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
        let number = |w: &str| match w.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ => Err(format!("'{w}' is not a number")),
        };
        words.map(number).collect()
    };
    let vector = || match numbers()?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three numbers".to_string()),
    };
    let length = || match numbers()?[..] {
        [v] if v > 0.0 => Ok(v),
        [v] => Err(format!("expected a positive number, not {v}")),
        _ => Err("expected one number".to_string()),
    };
    match name {
        "viewPoint" => view.view_point = Some(vector()?),
        "viewDir" => view.view_dir = Some(vector()?),
        "viewUp" => view.view_up = Some(vector()?),
        "projDistance" => view.proj_distance = Some(length()?),
        "viewWidth" => view.view_width = Some(length()?),
        "viewHeight" => view.view_height = Some(length()?),
        other => return Err(format!("unknown element '{other}' in <camera>")),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: &str = r#"<camera type="PerspectiveCamera">
        <viewPoint>10 4.2 6</viewPoint>
        <viewDir>-5 -2.1 -3</viewDir>
        <viewUp>0 1 0</viewUp>
        <projDistance>6</projDistance>
        <viewWidth>4</viewWidth>
        <viewHeight>2.25</viewHeight>
    </camera>"#;

    #[test]
    fn the_lectures_camera_element_is_parsed() {
        let view = parse(VIEW).unwrap();
        assert_eq!(view.view_point, Some(DVec3::new(10.0, 4.2, 6.0)));
        assert_eq!(view.view_dir, Some(DVec3::new(-5.0, -2.1, -3.0)));
        assert_eq!(view.projection, Some(Projection::Perspective));
        assert_eq!(
            (view.proj_distance, view.view_width, view.view_height),
            (Some(6.0), Some(4.0), Some(2.25))
        );
        let inside = format!("<?xml version=\"1.0\"?><scene>{VIEW}<surface/></scene>");
        assert_eq!(parse(&inside).unwrap(), view);
        let flat = parse(&VIEW.replace("Perspective", "Orthographic")).unwrap();
        assert_eq!(flat.projection, Some(Projection::Orthographic));
    }

    #[test]
    fn invalid_elements_are_errors_that_name_the_defect() {
        for (text, expected) in [
            ("", "no <camera> element"),
            ("<scene></scene>", "no <camera> element"),
            ("<camera type=\"Fisheye\"></camera>", "unknown camera type"),
            ("<camera><viewPoint>1 2</viewPoint></camera>", "three numbers"),
            ("<camera><viewPoint>1 2 x</viewPoint></camera>", "'x' is not a number"),
            ("<camera><viewWidth>0</viewWidth></camera>", "<viewWidth>: expected a positive number, not 0"),
            ("<camera><projDistance>-6</projDistance></camera>", "a positive number, not -6"),
            ("<camera><viewHeight>1 2</viewHeight></camera>", "expected one number"),
            ("<camera><viewSide>1</viewSide></camera>", "unknown element 'viewSide' in <camera>"),
            ("<camera><viewDir>1 2 3</viewDir></camera>", "needs <viewPoint>"),
            ("<camera><viewDir>1 2 3</viewDir>", "is not closed"),
        ] {
            let message = parse(text).unwrap_err().message;
            assert!(message.contains(expected), "{text}: {message}");
        }
        for end in 0..VIEW.len() - 1 {
            assert!(parse(&VIEW[..end]).is_err());
        }
    }
}
