//! PLY, the Stanford polygon format: text and binary files of either byte order.

mod elements;
mod header;
#[cfg(test)]
mod tests;
mod values;

use glam::{DVec3, Vec4};

use crate::error::{LoadError, Warning, Warnings};
use crate::files::{escape::printable, scene_folder::SceneFolder};
use crate::memory::MemoryBudget;
use crate::obj;
use crate::options::LoadOptions;
use crate::polygons::far_centre::far_centre;
use crate::polygons::polygon_mesh::Part;
use crate::polygons::polygon_scene::{PolygonFile, build_scene};
use blinn_core::cancellation::Cancelled;
use blinn_scene::{Scene, SourceFormat};
use elements::{Content, RowError, expected_rows, row_bytes, skip_rows};
use header::{Element, Encoding, Header};
use values::Values;

/// Properties of 3D Gaussian splats.
const SPLATS: [&str; 2] = ["f_dc_0", "rot_0"];

/// Returns true if a file begins as PLY files do.
pub(super) fn is_ply(head: &[u8]) -> bool {
    matches!(without_mark(head), [b'p', b'l', b'y', b'\n' | b'\r', ..])
}

/// Returns a file without the byte-order mark that some editors write before UTF-8.
fn without_mark(file: &[u8]) -> &[u8] {
    file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file)
}

/// Loads a PLY file with its textures.
pub(super) fn load(
    bytes: &[u8],
    folder: &SceneFolder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    if !is_ply(bytes) {
        return Err(LoadError::parse("PLY", "the file does not begin with the line 'ply'"));
    }
    let bytes = without_mark(bytes);
    let header = header::parse(bytes)?;
    check_positions(&header)?;
    let budget = MemoryBudget::of_import(options);
    let charged = charge_rows(&header, bytes, options, &budget)?;
    let mut warnings = Warnings::default();
    let mut content = read(&header, bytes, DVec3::ZERO, options, &mut warnings)?;
    let origin = match content.mesh.faces {
        0 => far_centre(content.mesh.positions.iter().copied()),
        _ => far_centre(content.mesh.corner_positions()),
    };
    if let Some(origin) = origin {
        // Free the first result before the second is read.
        drop(content);
        warnings = Warnings::default();
        content = read(&header, bytes, origin, options, &mut warnings)?;
    }
    let Content { mut mesh, mut face_colors, mut edge_colors, mut colors, textures, degenerate } = content;
    if degenerate > 0 {
        warnings.add("", format!("ignored {degenerate} faces with fewer than three vertices"));
    }
    if mesh.faces == 0 && mesh.edges.is_empty() && !is_cloud(&header, mesh.positions.len()) {
        return Err(no_faces_error(&header, mesh.positions.is_empty(), warnings));
    }
    for list in [&mut face_colors, &mut edge_colors, &mut colors] {
        if is_of_blender(&header) {
            show_missing_colors(list);
        }
        obj::displayed_to_linear(list, &mut warnings);
        ignore_zero_alpha(list, &mut warnings);
    }
    if face_colors.is_empty() && colors.is_empty() {
        warn_of_scalar_fields(&header, &mut warnings);
    }
    (mesh.face_colors, mesh.edge_colors, mesh.colors) = (face_colors, edge_colors, colors);
    let files = texture_files(&header);
    let last = files.len().saturating_sub(1) as u32;
    if !textures.is_empty() && last > 0 {
        mesh.face_parts = textures.iter().map(|&texture| texture.min(last)).collect();
        mesh.parts = (0..=last).map(|material| Part { object: 0, material }).collect();
    }
    let materials = obj::textured_materials(&files, folder, &options.limits, &budget, &mut warnings)?;
    let generator = generator(&header);
    budget.charge((mesh.bytes() + mesh.meshes_bytes()).saturating_sub(charged))?;
    let file = PolygonFile { mesh, origin, format: SourceFormat::Ply, generator, materials };
    let scene = build_scene(file, options, &mut warnings)?;
    Ok((scene, warnings.into_vec()))
}

/// Checks that vertices have positions.
fn check_positions(header: &Header) -> Result<(), LoadError> {
    let mut vertices = header.elements.iter().filter(|element| element.name == "vertex");
    match vertices.all(|element| ["x", "y", "z"].iter().all(|axis| element.has(&[axis]))) {
        true => Ok(()),
        false => Err(LoadError::invalid("PLY", "the vertices have no x, y and z")),
    }
}

/// Checks the numbers in the header, and charges the file and its rows, before memory is allocated. Returns the bytes charged
/// for rows: faces count as triangles until their corners are known.
fn charge_rows(
    header: &Header,
    bytes: &[u8],
    options: &LoadOptions,
    budget: &MemoryBudget,
) -> Result<u64, LoadError> {
    let remaining = bytes.len() - header.bytes;
    let expected = |element: &Element| expected_rows(element, header.encoding, remaining);
    let rows = |name: &str| {
        let elements = header.elements.iter().filter(|element| element.name == name);
        elements.map(expected).fold(0, u64::saturating_add)
    };
    let (faces, edges) = (rows("face"), rows("edge"));
    // Lines have vertices of their own.
    let vertices = rows("vertex").saturating_add(edges.saturating_mul(2));
    LoadError::check_limit("vertices", vertices, options.limits.vertices)?;
    LoadError::check_limit("triangles", faces, options.limits.triangles)?;
    budget.charge(bytes.len() as u64)?;
    let of_rows = header.elements.iter().map(|element| expected(element).saturating_mul(row_bytes(element)));
    let of_rows = of_rows.fold(0, u64::saturating_add);
    budget.charge(of_rows)?;
    Ok(of_rows)
}

/// Reads the values. A file that ends early has its first vertices and faces.
fn read(
    header: &Header,
    bytes: &[u8],
    origin: DVec3,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Content, LoadError> {
    let cancel = &options.cancel;
    let mut content = Content::default();
    let mut values = Values::new(header.encoding, &bytes[header.bytes..]);
    for element in &header.elements {
        let expected = expected_rows(element, header.encoding, values.remaining()) as usize;
        let done = match element.name.as_str() {
            "vertex" => {
                content.mesh.positions.reserve_exact(expected);
                content.read_vertices(element, &mut values, origin, cancel)
            }
            "face" => {
                content.mesh.corners.reserve(expected);
                content.read_faces(element, &mut values, cancel)
            }
            "edge" => {
                content.mesh.edges.reserve_exact(expected);
                content.read_edges(element, &mut values, cancel)
            }
            "tristrips" => content.read_strips(element, &mut values, cancel),
            _ => skip_rows(element, &mut values, cancel),
        };
        match done {
            Ok(()) => {}
            Err(RowError::Cancelled) => return Err(LoadError::Cancelled(Cancelled)),
            Err(RowError::Invalid { row, reason }) => {
                let row = format!("{} {row}", printable(&element.name));
                let line = line_before_end(header, bytes, values.remaining());
                let location = line.map_or(row.clone(), |line| format!("line {line}, {row}"));
                return Err(LoadError::invalid(location, reason));
            }
            Err(RowError::End(rows)) => {
                let name = printable(&element.name);
                warnings.add("", format!("the file ends after {rows} of {} rows of '{name}'", element.rows));
                break;
            }
        }
    }
    let comma = values.decimal_comma().and_then(|left| line_before_end(header, bytes, left));
    if let Some(line) = comma {
        warnings.add(format!("PLY, line {line}"), "numbers have decimal commas: read as decimal points");
    }
    Ok(content)
}

/// Returns the number of the line of the place in a text file after which `left` bytes follow.
fn line_before_end(header: &Header, bytes: &[u8], left: usize) -> Option<usize> {
    let before =
        bytes.get(..bytes.len().checked_sub(left)?).filter(|_| header.encoding == Encoding::Ascii)?;
    let is_end = |pair: &[u8]| pair[0] == b'\n' || pair[0] == b'\r' && pair.get(1) != Some(&b'\n');
    Some(1 + (0..before.len()).filter(|&at| is_end(&before[at..])).count())
}

/// Returns true for a file that Blender wrote.
fn is_of_blender(header: &Header) -> bool {
    header.comments.iter().any(|comment| comment.starts_with("Created in Blender"))
}

/// Makes colours white whose components are all 0: Blender writes them for the objects without colours beside others with some.
fn show_missing_colors(colors: &mut [Vec4]) {
    colors.iter_mut().filter(|color| **color == Vec4::ZERO).for_each(|color| *color = Vec4::ONE);
}

/// Makes colours opaque if all have an alpha of 0, which some scanners write.
fn ignore_zero_alpha(colors: &mut [Vec4], warnings: &mut Warnings) {
    if !colors.is_empty() && colors.iter().all(|color| color.w == 0.0) {
        colors.iter_mut().for_each(|color| color.w = 1.0);
        warnings.add("", "ignored the alpha of colours, which is 0 everywhere");
    }
}

/// Warns of the scalar fields of CloudCompare, which may be all that it shows.
fn warn_of_scalar_fields(header: &Header, warnings: &mut Warnings) {
    let properties = header.element("vertex").map_or(&[][..], |vertices| vertices.properties.as_slice());
    let fields: Vec<String> =
        properties.iter().filter_map(|p| p.name.strip_prefix("scalar_")).map(printable).collect();
    if !fields.is_empty() {
        let fields = fields.join(", ");
        let help =
            "convert them to colours, for example in CloudCompare (Edit > Scalar fields > Convert to RGB)";
        warnings.add("", format!("the scalar fields of the vertices are not shown: {fields}; {help}"));
    }
}

/// Returns true for a file of points: without faces, and without 3D Gaussian splats.
fn is_cloud(header: &Header, points: usize) -> bool {
    let states_faces = |name: &str| header.element(name).is_some_and(|faces| faces.rows > 0);
    points > 0 && !states_faces("face") && !states_faces("tristrips") && !has_splats(header)
}

fn has_splats(header: &Header) -> bool {
    header.element("vertex").is_some_and(|vertices| SPLATS.iter().all(|name| vertices.has(&[name])))
}

/// Returns the error for a file without faces, edges and points. `is_empty` is true for a file without vertices. Warnings say
/// what is missing, as of a file that was cut off.
fn no_faces_error(header: &Header, is_empty: bool, warnings: Warnings) -> LoadError {
    let message = match has_splats(header) {
        true => {
            "the file has 3D Gaussian splats and no faces, and splats are not drawn; convert them to a mesh"
        }
        false if is_empty => "the file has no vertices",
        false => "the file has no faces to render",
    };
    LoadError::invalid("PLY", format!("{message}{}", warnings.into_ending()))
}

/// Returns the images that comments of MeshLab name.
fn texture_files(header: &Header) -> Vec<String> {
    let names = header.comments.iter().filter_map(|comment| comment.strip_prefix("TextureFile "));
    names.map(|name| name.trim().to_string()).collect()
}

/// Returns the first comment that names a program.
fn generator(header: &Header) -> String {
    let mut comments = header.comments.iter().filter(|comment| !comment.starts_with("TextureFile "));
    comments.next().map(|comment| printable(comment)).unwrap_or_default()
}
