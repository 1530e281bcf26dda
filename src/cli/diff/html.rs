//! A comparison as a self-contained HTML page.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use anyhow::{Context, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::comparison::{Comparison, Heading, ShownPicture, ViewComparison};
use super::length::{LengthUnit, corner_texts};
use super::text::{amount_text, object_text, value_text};
use blinn_output::compare::{JsonDifference, ObjectDifference};
use blinn_output::{Overwrite, PAGE_STYLE, encode_png, escape_html, write_atomically};
use blinn_render::PixelRect;

/// The page, with placeholders for the title and the contents.
const PAGE: &str = include_str!("page.html");

/// The pictures that a viewer switches between: value, label.
const MODES: [(&str, &str); 4] =
    [("slider", "Slider"), ("before", "Before"), ("after", "After"), ("difference", "Difference")];

/// Writes the page.
///
/// # Errors
/// A picture cannot be encoded, or the file cannot be written.
pub fn write_page(
    file: &Path,
    heading: &Heading,
    comparison: &Comparison,
    overwrite: Overwrite,
) -> Result<()> {
    let html = page(heading, comparison)?;
    write_atomically(file, html.as_bytes(), overwrite)
        .with_context(|| format!("{} cannot be written", file.display()))
}

/// Removes the page of an earlier comparison, if there is one. Other files stay.
///
/// # Errors
/// The file cannot be read or removed.
pub fn remove_page(file: &Path) -> Result<()> {
    let start = PAGE.split_once("{{title}}").map_or(PAGE, |(start, _)| start).as_bytes();
    let remove = || -> io::Result<()> {
        let mut head = Vec::new();
        File::open(file)?.take(start.len() as u64).read_to_end(&mut head)?;
        if head == start { fs::remove_file(file) } else { Ok(()) }
    };
    match remove() {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error)
            .with_context(|| format!("{}, of an earlier comparison, cannot be removed", file.display())),
        _ => Ok(()),
    }
}

/// Builds the page.
///
/// # Errors
/// A picture cannot be encoded.
fn page(heading: &Heading, comparison: &Comparison) -> Result<String> {
    let name = |path: &Path| {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        escape_html(&name)
    };
    let title = format!("{} and {}", name(heading.old), name(heading.new));
    let mut body = header(heading, comparison);
    for (i, view) in comparison.views.iter().enumerate() {
        body += &viewer(i, view, heading, comparison)?;
    }
    body += &apart(&comparison.apart)?;
    body += &object_table(&comparison.objects, comparison.unit);
    body += &property_table(&comparison.properties);
    let (head, rest) = PAGE.split_once("{{title}}").unwrap_or((PAGE, ""));
    let (middle, rest) = rest.split_once("{{style}}").unwrap_or((rest, ""));
    let (style, tail) = rest.split_once("{{body}}").unwrap_or((rest, ""));
    Ok([head, &title, middle, PAGE_STYLE, style, &body, tail].concat())
}

/// The verdict, the files and the counts.
fn header(heading: &Heading, comparison: &Comparison) -> String {
    let is_different = comparison.is_different();
    let (class, verdict) = if is_different { ("different", "Different") } else { ("equal", "Equal") };
    let changed = comparison.views.iter().filter(|view| view.summary.changed > 0).count();
    let metric = match (heading.flip, heading.tolerance > 0.0) {
        (true, _) => format!("FLIP errors above {}", heading.tolerance),
        (false, true) => format!("differences above {}", heading.tolerance),
        (false, false) => "any difference".into(),
    };
    let mismatch = comparison.mismatch.as_ref().map(|text| format!("<p>{}.</p>\n", escape_html(text)));
    let hint = comparison.hint.as_ref().map(|text| format!("<p>Hint: {}.</p>\n", escape_html(text)));
    let plural =
        |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
    format!(
        "<header class=\"whole\">\n<p class=\"verdict {class}\">{verdict}</p>\n<h1><span>{}</span> <span class=\"to\" \
         aria-label=\"and\">→</span> <span>{}</span></h1>\n{}<p class=\"facts\">{} of {} changed ({metric}) · {} · \
         {}</p>\n</header>\n",
        escape_html(&heading.old.to_string_lossy()),
        escape_html(&heading.new.to_string_lossy()),
        mismatch.into_iter().chain(hint).collect::<String>(),
        changed,
        plural(comparison.views.len(), "picture", "pictures"),
        plural(comparison.objects.len(), "object", "objects"),
        plural(comparison.properties.len(), "property", "properties"),
    )
}

/// The pictures of a view with their controls.
fn viewer(index: usize, view: &ViewComparison, heading: &Heading, comparison: &Comparison) -> Result<String> {
    let ViewComparison { width, height, summary, .. } = view;
    let name = escape_html(&view.name);
    let percent = 100.0 * summary.changed as f64 / (f64::from(*width) * f64::from(*height));
    let facts = if summary.changed == 0 {
        let noise = if view.noise > 0 { ", but for noise" } else { "" };
        format!("No pixel changed{noise}.")
    } else {
        let pixels = if summary.changed == 1 { "pixel" } else { "pixels" };
        let mean = if heading.flip {
            String::new()
        } else {
            format!("; the mean over all pixels is {:.5}", summary.mean)
        };
        let amount = amount_text(summary, heading.flip);
        format!("{} {pixels} changed ({percent:.2} %), {amount}{mean}.", summary.changed)
    };
    let state = if summary.changed == 0 { "equal" } else { "different" };
    let mut out = format!(
        "<section class=\"card view {state}\" aria-labelledby=\"view{index}\">\n<h2 id=\"view{index}\">{name}</h2>\n\
         <p>{facts}</p>\n<fieldset class=\"modes\"><legend>Picture of {name}</legend>\n"
    );
    let first = if summary.changed == 0 { "after" } else { "slider" };
    for (mode, label) in MODES {
        let checked = if mode == first { " checked" } else { "" };
        writeln!(
            out,
            "<label><input type=\"radio\" name=\"mode{index}\" value=\"{mode}\"{checked}><span>{label}</span></label>"
        )?;
    }
    let has_boxes = !summary.boxes.is_empty() || !view.objects.is_empty();
    if has_boxes {
        out += "<label class=\"boxes\"><input type=\"checkbox\" name=\"boxes\" checked><span>Boxes</span></label>\n";
    }
    write!(
        out,
        "</fieldset>\n<div class=\"stage\" data-mode=\"{first}\" style=\"aspect-ratio:{width}/{height};max-width:{}px\">\n",
        (*width).max(320)
    )?;
    for (class, pixels, text) in [
        ("before", &view.before, "before"),
        ("after", &view.after, "after"),
        ("difference", &view.difference, "differences"),
    ] {
        let png = data_url((*width, *height), pixels)?;
        writeln!(
            out,
            "<img class=\"{class}\" alt=\"{name}, {text}\" width=\"{width}\" height=\"{height}\" \
             src=\"{png}\">"
        )?;
    }
    if has_boxes {
        out += &boxes(view, &comparison.objects);
    }
    writeln!(
        out,
        "</div>\n<label class=\"split\"><span>Before</span><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" \
         aria-label=\"Share of {name} that shows the picture before, in percent\"><span>After</span></label>\n</section>"
    )?;
    Ok(out)
}

/// Two pictures beside each other.
fn apart(pictures: &[ShownPicture]) -> Result<String> {
    let mut out = String::new();
    for (picture, name) in pictures.iter().zip(["before", "after"]) {
        let ShownPicture { width, height, pixels } = picture;
        let png = data_url((*width, *height), pixels)?;
        write!(
            out,
            "<section class=\"card apart\" aria-labelledby=\"{name}\">\n<h2 id=\"{name}\">{name}</h2>\n\
             <p>{width} × {height}</p>\n<img alt=\"The picture {name}\" width=\"{width}\" height=\"{height}\" \
             src=\"{png}\">\n</section>\n"
        )?;
    }
    Ok(out)
}

fn data_url(size: (u32, u32), pixels: &[[u8; 4]]) -> Result<String> {
    Ok(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(encode_png(size, pixels)?)))
}

/// Boxes of changed pixels and of changed objects, with names.
fn boxes(view: &ViewComparison, objects: &[ObjectDifference]) -> String {
    let rect = |class: &str, r: &PixelRect, title: &str| {
        format!(
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"><title>{title}</title></rect>\n",
            r.x, r.y, r.width, r.height
        )
    };
    let mut out = format!(
        "<svg viewBox=\"0 0 {} {}\" aria-hidden=\"true\" font-size=\"{}\">\n",
        view.width,
        view.height,
        (view.width / 45).max(8)
    );
    for r in &view.summary.boxes {
        let title = format!("changed pixels at {}, {}: {} by {}", r.x, r.y, r.width, r.height);
        out += &rect("pixels", &grown(r, 2), &title);
    }
    for (i, r) in &view.objects {
        let name = escape_html(objects.get(*i).map_or("", |object| &object.name));
        out += &rect("object", r, &name);
        // The name stands above the box, or inside it at the upper edge.
        let size = f64::from((view.width / 45).max(8));
        let y = if f64::from(r.y) > 1.4 * size { f64::from(r.y) - 0.3 * size } else { f64::from(r.y) + size };
        out += &format!("<text x=\"{}\" y=\"{y}\">{name}</text>\n", r.x + 1);
    }
    out + "</svg>\n"
}

/// A rectangle with a margin, so that its outline covers none of its pixels.
fn grown(r: &PixelRect, by: u32) -> PixelRect {
    let (x, y) = (r.x.saturating_sub(by), r.y.saturating_sub(by));
    PixelRect { x, y, width: r.x + r.width + by - x, height: r.y + r.height + by - y }
}

fn object_table(objects: &[ObjectDifference], unit: LengthUnit) -> String {
    if objects.is_empty() {
        return String::new();
    }
    let name = unit.name();
    let mut out = format!(
        "<section class=\"card whole\" aria-labelledby=\"objects\">\n<h2 id=\"objects\">Objects</h2>\n<div class=\"scrolls\">\
         <table>\n<thead><tr><th scope=\"col\">Name</th><th scope=\"col\">Change</th>\
         <th scope=\"col\">Lowest corner ({name}, y up)</th><th scope=\"col\">Highest corner ({name}, y up)</th></tr></thead>\n\
         <tbody>\n"
    );
    for object in objects {
        let [min, max] = match object.bounds.is_empty() {
            true => Default::default(),
            false => corner_texts(&object.bounds),
        };
        out += &format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{min}</td><td>{max}</td></tr>\n",
            escape_html(&object.name),
            escape_html(&object_text(object, unit)),
        );
    }
    out + "</tbody>\n</table></div>\n</section>\n"
}

fn property_table(properties: &[JsonDifference]) -> String {
    if properties.is_empty() {
        return String::new();
    }
    let mut out = "<section class=\"card whole\" aria-labelledby=\"properties\">\n<h2 id=\"properties\">Properties</h2>\n\
                   <div class=\"scrolls\"><table>\n<thead><tr><th scope=\"col\">Property</th>\
                   <th scope=\"col\">Before</th><th scope=\"col\">After</th></tr></thead>\n<tbody>\n"
        .to_string();
    for property in properties {
        let cell = |value: &Option<serde_json::Value>| match value {
            Some(value) => format!("<code>{}</code>", escape_html(&value_text(value))),
            None => "<span class=\"none\">none</span>".into(),
        };
        out += &format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td></tr>\n",
            escape_html(&property.path),
            cell(&property.old),
            cell(&property.new)
        );
    }
    out + "</tbody>\n</table></div>\n</section>\n"
}
