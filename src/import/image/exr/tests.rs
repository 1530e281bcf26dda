use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, Vec2, WritableImage, f16,
};

use super::*;

const WIDTH: usize = 6;
const HEIGHT: usize = 3;

/// Samples that count the pixels, from `first`.
fn samples(first: usize) -> Vec<f32> {
    (0..WIDTH * HEIGHT).map(|i| (first + i) as f32).collect()
}

fn floats(first: usize) -> FlatSamples {
    FlatSamples::F32(samples(first))
}

struct Part {
    name: Option<&'static str>,
    channels: Vec<(&'static str, FlatSamples)>,
    encoding: Encoding,
    position: Vec2<i32>,
}

impl Part {
    fn new(channels: Vec<(&'static str, FlatSamples)>) -> Part {
        let encoding = Encoding::UNCOMPRESSED;
        Part { name: None, channels, encoding, position: Vec2(0, 0) }
    }

    fn layer(self) -> Layer<AnyChannels<FlatSamples>> {
        let channels = self.channels.into_iter().map(|(name, data)| AnyChannel::new(name, data));
        let attributes = LayerAttributes {
            layer_name: self.name.map(Text::from),
            layer_position: self.position,
            ..Default::default()
        };
        let channels = AnyChannels::sort(channels.collect());
        Layer::new((WIDTH, HEIGHT), attributes, self.encoding, channels)
    }
}

fn file(parts: Vec<Part>, display: IntegerBounds) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let layers: Vec<_> = parts.into_iter().map(Part::layer).collect();
    let image = Image::from_layers(ImageAttributes::new(display), layers);
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn read(bytes: &[u8]) -> Result<([usize; 2], Vec<[f32; 3]>), String> {
    let picture = ExrPicture::open(bytes)?;
    Ok((picture.size(), picture.decode()?))
}

/// The pixels of a file with one part, where red counts from 0, green from 100 and blue from 200.
fn check(part: Part) {
    let names: Vec<_> = part.channels.iter().map(|(name, _)| *name).collect();
    let bytes = file(vec![part], IntegerBounds::from_dimensions((WIDTH, HEIGHT)));
    let (size, texels) = read(&bytes).unwrap_or_else(|e| panic!("{names:?}: {e}"));
    assert_eq!(size, [WIDTH, HEIGHT], "{names:?}");
    for (i, texel) in texels.into_iter().enumerate() {
        assert_eq!(texel, [0, 100, 200].map(|first| (first + i) as f32), "{names:?} {i}");
    }
}

fn rgb(names: [&'static str; 3]) -> Vec<(&'static str, FlatSamples)> {
    names.into_iter().zip([0, 100, 200]).map(|(name, first)| (name, floats(first))).collect()
}

#[test]
fn channels_are_found_by_all_usual_names() {
    for names in [
        ["R", "G", "B"],
        ["r", "g", "b"],
        ["Red", "Green", "Blue"],
        ["-X.R", "-X.G", "-X.B"],
        ["View Layer.Combined.R", "View Layer.Combined.G", "View Layer.Combined.B"],
        ["Composite.Combined.R", "Composite.Combined.G", "Composite.Combined.B"],
    ] {
        check(Part::new(rgb(names)));
        let with_alpha = [rgb(names), vec![("A", floats(900)), ("Z", floats(800))]].concat();
        check(Part::new(with_alpha));
    }
}

#[test]
fn the_plain_or_the_combined_layer_is_preferred() {
    let other = || ["diffuse.R", "diffuse.G", "diffuse.B"].map(|name| (name, floats(500)));
    check(Part::new([other().to_vec(), rgb(["R", "G", "B"])].concat()));
    let combined = rgb(["V.Combined.R", "V.Combined.G", "V.Combined.B"]);
    check(Part::new([other().to_vec(), combined].concat()));
}

/// A part without colour before the one with colour.
#[test]
fn colour_is_found_in_any_part() {
    let depth = Part { name: Some("depth"), ..Part::new(vec![("Z", floats(700))]) };
    let beauty = Part { name: Some("beauty"), ..Part::new(rgb(["R", "G", "B"])) };
    let bytes = file(vec![depth, beauty], IntegerBounds::from_dimensions((WIDTH, HEIGHT)));
    assert_eq!(read(&bytes).unwrap().1[1], [1.0, 101.0, 201.0]);
}

#[test]
fn one_channel_is_grey() {
    for channels in [vec![("Y", floats(0))], vec![("Y", floats(0)), ("A", floats(9))], vec![("V", floats(0))]]
    {
        let bytes = file(vec![Part::new(channels)], IntegerBounds::from_dimensions((WIDTH, HEIGHT)));
        assert_eq!(read(&bytes).unwrap().1[5], [5.0; 3]);
    }
    let two = Part::new(vec![("Z", floats(0)), ("A", floats(0))]);
    let error = read(&file(vec![two], IntegerBounds::from_dimensions((WIDTH, HEIGHT)))).unwrap_err();
    assert!(error.contains("no channels R, G and B and no Y, only A, Z"), "{error}");
}

#[test]
fn samples_may_be_half_floats_or_integers() {
    let red = FlatSamples::F16(samples(0).into_iter().map(f16::from_f32).collect());
    let green = FlatSamples::U32(samples(100).into_iter().map(|v| v as u32).collect());
    check(Part::new(vec![("R", red), ("G", green), ("B", floats(200))]));
}

/// Tiles of 4 × 2 do not fit 6 × 3 pixels.
#[test]
fn files_may_be_tiled_and_compressed() {
    use exr::prelude::Compression;
    for compression in [Compression::ZIP16, Compression::RLE, Compression::PIZ, Compression::ZIP1] {
        for blocks in [Blocks::Tiles(Vec2(4, 2)), Blocks::ScanLines] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            check(Part { encoding, ..Part::new(rgb(["R", "G", "B"])) });
        }
    }
}

/// Pixels outside the stored part are black, and stored ones outside the picture are not shown.
#[test]
fn the_data_window_is_placed_in_the_display_window() {
    let display = IntegerBounds { position: Vec2(10, 10), size: Vec2(8, 4) };
    for (position, shown_at, value) in [
        (Vec2(11, 10), [1, 0], 0.0),
        (Vec2(12, 11), [2, 1], 0.0),
        (Vec2(9, 9), [0, 0], 7.0),
        (Vec2(10, 10), [0, 0], 0.0),
    ] {
        let bytes = file(vec![Part { position, ..Part::new(rgb(["R", "G", "B"])) }], display);
        let (size, texels) = read(&bytes).unwrap();
        assert_eq!(size, [8, 4]);
        let [x, y] = shown_at;
        assert_eq!(texels[y * 8 + x], [value, value + 100.0, value + 200.0], "{position:?}");
        let lit = texels.iter().filter(|texel| texel[1] > 0.0).count();
        let covered = |at: i32, size: i32, all: i32| (at - 10 + size).min(all) - (at - 10).max(0);
        assert_eq!(lit as i32, covered(position.0, 6, 8) * covered(position.1, 3, 4), "{position:?}");
    }
}

/// Some programs write a display window of another size.
#[test]
fn a_panorama_in_the_data_window_is_used_whole() {
    let part = Part { position: Vec2(3, 4), ..Part::new(rgb(["R", "G", "B"])) };
    let bytes = file(vec![part], IntegerBounds::from_dimensions((5, 5)));
    let (size, texels) = read(&bytes).unwrap();
    assert_eq!((size, texels[17]), ([WIDTH, HEIGHT], [17.0, 117.0, 217.0]));
}
