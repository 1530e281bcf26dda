//! Object and material ids as PNG files whose pixels are the ids themselves.
//!
//! Up to 255 ids are indices into a palette, so that the file shows colours and programs read ids; more are 16-bit grey. An
//! iTXt chunk `names` holds a JSON object from id to name.

use std::collections::BTreeMap;
use std::io;

use super::png;
use super::preview::id_color;
use blinn_render::AovLayer;

/// Encodes a layer of ids; `None` if there are more ids than 16 bits hold. The form depends on the number of names, so
/// that all images of a scene have the same.
pub(super) fn encode(
    size: (u32, u32),
    layer: &AovLayer,
    names: &[String],
    fingerprint: Option<&str>,
) -> Option<io::Result<Vec<u8>>> {
    let ids: Vec<u32> = layer.values.iter().map(|&value| layer.aov.id(value)).collect();
    let largest = ids.iter().copied().max().unwrap_or(0).max(u32::try_from(names.len()).ok()?);
    let text = names_of(&ids, names);
    let texts = png::Texts { fingerprint, names: Some(&text) };
    if let Ok(largest) = u8::try_from(largest) {
        let indices: Vec<u8> = ids.iter().map(|&id| id as u8).collect();
        let black = [0; 3];
        let palette: Vec<[u8; 3]> =
            (0..=u32::from(largest)).map(|id| if id == 0 { black } else { id_color(id) }).collect();
        return Some(png::encode_indexed(size, &indices, &palette, texts));
    }
    let ids: Option<Vec<u16>> = ids.iter().map(|&id| u16::try_from(id).ok()).collect();
    ids.map(|ids| png::encode_grey16(size, &ids, texts))
}

/// JSON object from each id in the image to its name.
fn names_of(ids: &[u32], names: &[String]) -> String {
    let mut shown = BTreeMap::new();
    for &id in ids {
        if let Some(name) = (id as usize).checked_sub(1).and_then(|i| names.get(i)) {
            shown.entry(id).or_insert(name);
        }
    }
    serde_json::to_string(&shown).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_render::integrator::Aov;

    fn decoded(bytes: &[u8]) -> (::png::ColorType, ::png::BitDepth, Vec<u8>, Option<String>) {
        let mut reader = ::png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        let info = reader.info();
        let names = info.utf8_text.iter().find(|chunk| chunk.keyword == "names");
        let names = names.map(|chunk| chunk.get_text().unwrap());
        (info.color_type, info.bit_depth, pixels, names)
    }

    #[test]
    fn pixels_are_ids_and_have_names() {
        let layer = AovLayer { aov: Aov::ObjectId, values: vec![0.0, 2.0, 1.0, 2.0] };
        let named = |count: usize| (0..count).map(|i| format!("ö{i}")).collect::<Vec<_>>();
        let image = |count: usize| encode((2, 2), &layer, &named(count), Some("1 x")).map(Result::unwrap);
        let (color, _, pixels, names) = decoded(&image(3).unwrap());
        assert_eq!((color, pixels), (::png::ColorType::Indexed, vec![0, 2, 1, 2]));
        assert_eq!(names.as_deref(), Some(r#"{"1":"ö0","2":"ö1"}"#));
        assert_eq!(png::fingerprint(&image(3).unwrap()).as_deref(), Some(&b"1 x"[..]));
        assert_eq!(decoded(&image(255).unwrap()).0, ::png::ColorType::Indexed);
        // The form depends on the scene, not on the ids that an image shows.
        let (color, depth, pixels, _) = decoded(&image(256).unwrap());
        assert_eq!((color, depth), (::png::ColorType::Grayscale, ::png::BitDepth::Sixteen));
        assert_eq!(pixels, [0, 0, 0, 2, 0, 1, 0, 2]);
        let large = AovLayer { aov: Aov::ObjectId, values: vec![65_536.0] };
        assert!(encode((1, 1), &large, &named(1), None).is_none());
    }
}
