//! Files are read back by other decoders than what wrote them, where there are any.

use std::path::Path;

use crate::output::animation::*;

pub(crate) const SETTINGS: AnimationSettings = AnimationSettings {
    width: 40,
    height: 30,
    fps: 12.0,
    repeat: true,
    quality: 90,
    overwrite: Overwrite::Yes,
    clockwise: false,
};

/// A disc that goes around on a ground, or on nothing.
pub(crate) fn frame(i: u32, ground: [u8; 4]) -> Vec<[u8; 4]> {
    let (width, height) = (SETTINGS.width as i32, SETTINGS.height as i32);
    let (cx, cy) = (20 + [8, 0, -8, 0][i as usize % 4], 15 + [0, 8, 0, -8][i as usize % 4]);
    let one = |p: i32| {
        let (x, y) = (p % width, p / width);
        let inside = (x - cx).pow(2) + (y - cy).pow(2) < 30;
        if inside { [200, (5 * x) as u8, (6 * y) as u8, 255] } else { ground }
    };
    (0..width * height).map(one).collect()
}

pub(crate) fn written(
    format: AnimationFormat,
    settings: &AnimationSettings,
    frames: &[Vec<[u8; 4]>],
) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moving");
    let mut moving = AnimationFile::create(&path, format, settings).unwrap();
    for frame in frames {
        moving.push(frame).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing shows before the end");
    }
    moving.finish().unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    std::fs::read(path).unwrap()
}

/// Frames as a screen shows them, with their delays.
fn shown_gif(bytes: &[u8]) -> (::gif::Repeat, Vec<(u16, Vec<[u8; 4]>)>) {
    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let width = usize::from(decoder.width());
    let mut screen = vec![[0u8; 4]; width * usize::from(decoder.height())];
    let mut shown = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (left, top) = (usize::from(frame.left), usize::from(frame.top));
        let columns = usize::from(frame.width);
        for (i, pixel) in frame.buffer.as_chunks::<4>().0.iter().enumerate() {
            if pixel[3] > 0 {
                screen[(top + i / columns) * width + left + i % columns] = *pixel;
            }
        }
        shown.push((frame.delay, screen.clone()));
        if frame.dispose == ::gif::DisposalMethod::Background {
            screen.fill([0; 4]);
        }
    }
    (decoder.repeat(), shown)
}

#[test]
fn a_gif_shows_its_frames() {
    for ground in [[10, 20, 30, 255], [0; 4]] {
        // The third frame again: nothing changes.
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, ground)).into();
        let (repeat, shown) = shown_gif(&written(AnimationFormat::Gif, &SETTINGS, &frames));
        assert_eq!(repeat, ::gif::Repeat::Infinite);
        assert_eq!(shown.iter().map(|s| s.0).collect::<Vec<_>>(), [8, 9, 8, 8, 9]);
        assert_eq!(shown.into_iter().map(|s| s.1).collect::<Vec<_>>(), frames);
    }
}

#[test]
fn a_gif_takes_alpha_by_half_and_ends_when_it_shall() {
    let mut half = frame(0, [0; 4]);
    half[0] = [9, 9, 9, 127];
    half[1] = [9, 9, 9, 128];
    let settings = AnimationSettings { repeat: false, ..SETTINGS };
    let (repeat, shown) = shown_gif(&written(AnimationFormat::Gif, &settings, &[half]));
    assert_eq!(repeat, ::gif::Repeat::Finite(0));
    assert_eq!((shown[0].1[0], shown[0].1[1]), ([0; 4], [9, 9, 9, 255]));
}

/// A delay has sixteen bits; between those that fit, one of a slow rate may be rounded up to what does not.
#[test]
fn the_longest_delays_of_a_gif_do_not_become_none() {
    let settings = AnimationSettings { fps: 0.001_525_892_8, ..SETTINGS };
    let frames: Vec<_> = (0..3).map(|i| frame(i, [0; 4])).collect();
    let (_, shown) = shown_gif(&written(AnimationFormat::Gif, &settings, &frames));
    assert_eq!(shown.iter().map(|s| s.0).collect::<Vec<_>>(), [u16::MAX; 3]);
}

#[test]
fn an_apng_shows_its_frames() {
    for (ground, repeat) in [([10, 20, 30, 255], true), ([7, 8, 9, 60], false)] {
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, ground)).into();
        let bytes = written(AnimationFormat::Apng, &AnimationSettings { repeat, ..SETTINGS }, &frames);
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (5, u32::from(!repeat)));
        let mut screen = vec![[0; 4]; frames[0].len()];
        let mut delays = Vec::new();
        for expected in &frames {
            let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut buffer).unwrap();
            let control = *reader.info().frame_control().unwrap();
            let columns = control.width as usize;
            let pixels = &buffer.as_chunks::<4>().0[..columns * control.height as usize];
            for (i, pixel) in pixels.iter().enumerate() {
                let at =
                    (control.y_offset as usize + i / columns) * 40 + control.x_offset as usize + i % columns;
                screen[at] = *pixel;
            }
            assert_eq!(&screen, expected);
            assert_eq!(control.delay_den, 10_000);
            delays.push(control.delay_num);
        }
        assert_eq!(delays, [833, 834, 833, 833, 834]);
    }
}

#[test]
fn what_cannot_be_written_is_an_error_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gif");
    let refused = |path: &Path, format, settings: &AnimationSettings, word: &str| {
        let text = AnimationFile::create(path, format, settings).err().expect(word).to_string();
        assert!(text.contains(word) && text.lines().count() == 1 && !text.contains(".part"), "{text}");
    };
    let with = |change: fn(&mut AnimationSettings)| {
        let mut settings = SETTINGS;
        change(&mut settings);
        settings
    };
    refused(&path, AnimationFormat::Gif, &with(|s| s.fps = 60.0), "50 frames a second");
    refused(&path, AnimationFormat::Gif, &with(|s| s.fps = f64::NAN), "number of frames");
    refused(&path, AnimationFormat::Gif, &with(|s| s.width = 70_000), "65535");
    refused(&path, AnimationFormat::Apng, &with(|s| s.fps = 0.1), "6.5 s");
    refused(&path, AnimationFormat::Apng, &with(|s| s.height = 0), "one pixel");
    refused(&folder.path().join("no/a.gif"), AnimationFormat::Gif, &SETTINGS, "cannot be written");
    refused(folder.path(), AnimationFormat::Gif, &SETTINGS, "folder");

    let mut moving = AnimationFile::create(&path, AnimationFormat::Gif, &SETTINGS).unwrap();
    assert!(moving.push(&[[0; 4]; 3]).unwrap_err().to_string().contains("40x30"));
    let empty = AnimationFile::create(&path, AnimationFormat::Apng, &SETTINGS).unwrap();
    assert!(empty.finish().unwrap_err().to_string().contains("no frames"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    std::fs::write(&path, "mine").unwrap();
    refused(&path, AnimationFormat::Gif, &with(|s| s.overwrite = Overwrite::No), "--no-overwrite");
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
}

/// Chunks of a RIFF file, after its header.
fn riff(mut rest: &[u8]) -> Vec<([u8; 4], &[u8])> {
    let mut all = Vec::new();
    while let [a, b, c, d, e, f, g, h, after @ ..] = rest {
        let length = u32::from_le_bytes([*e, *f, *g, *h]) as usize;
        all.push(([*a, *b, *c, *d], &after[..length]));
        rest = &after[length + length % 2..];
    }
    all
}

#[test]
fn a_webp_shows_its_frames() {
    use image::AnimationDecoder;
    for (ground, repeat) in [([10, 20, 30, 255], true), ([0; 4], false)] {
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, ground)).into();
        let settings = AnimationSettings { quality: 100, repeat, ..SETTINGS };
        let bytes = written(AnimationFormat::Webp, &settings, &frames);
        assert_eq!(u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize, bytes.len() - 8);
        let chunks = riff(&bytes[12..]);
        assert_eq!((chunks[0].0, chunks[1].0), (*b"VP8X", *b"ANIM"));
        assert_eq!(chunks[1].1[4..], [u8::from(!repeat), 0]);
        let delay = |frame: &[u8]| u32::from_le_bytes([frame[12], frame[13], frame[14], 0]);
        assert_eq!(chunks[2..].iter().map(|c| delay(c.1)).collect::<Vec<_>>(), [83, 84, 83, 83, 84]);

        let decoder = image::codecs::webp::WebPDecoder::new(io::Cursor::new(&bytes)).unwrap();
        let shown = decoder.into_frames().collect_frames().unwrap();
        assert_eq!(shown.len(), 5);
        for (i, (shown, expected)) in shown.iter().zip(&frames).enumerate() {
            // What colour nothing has is nobody's concern.
            let seen = |p: &[u8; 4]| if p[3] == 0 { [0; 4] } else { *p };
            let shown: Vec<_> = shown.buffer().as_raw().as_chunks::<4>().0.iter().map(seen).collect();
            assert!(shown == *expected, "frame {i}");
        }
    }
    let noise = |i: u32| {
        (0..1200u32).map(move |p| [0, 1, 2].map(|c| (p * 3 + c + i).wrapping_mul(2_654_435_761) >> 24))
    };
    let noisy: Vec<Vec<[u8; 4]>> =
        (0..3).map(|i| noise(i).map(|[r, g, b]| [r as u8, g as u8, b as u8, 255]).collect()).collect();
    let length =
        |quality| written(AnimationFormat::Webp, &AnimationSettings { quality, ..SETTINGS }, &noisy).len();
    assert!(length(10) < length(90));
}

/// The box at `path`, by names.
fn boxed<'a>(mut inside: &'a [u8], path: &[&[u8; 4]]) -> &'a [u8] {
    let Some((name, deeper)) = path.split_first() else { return inside };
    loop {
        let length = u32::from_be_bytes(inside[..4].try_into().unwrap()) as usize;
        if inside[4..8] == name[..] {
            return boxed(&inside[8..length], deeper);
        }
        inside = &inside[length..];
    }
}

fn be(bytes: &[u8], at: usize) -> u32 {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap())
}

#[test]
fn an_mp4_has_its_index_in_front_and_its_frames_where_that_says() {
    let frames: Vec<_> = (0..30).map(|i| frame(i, [10, 20, 30, 255])).collect();
    let bytes = written(AnimationFormat::Mp4, &AnimationSettings { fps: 7.5, ..SETTINGS }, &frames);
    assert_eq!(&bytes[4..8], b"ftyp");
    let stbl = boxed(&bytes, &[b"moov", b"trak", b"mdia", b"minf", b"stbl"]);
    let sizes = boxed(stbl, &[b"stsz"]);
    assert_eq!(be(sizes, 8), 30);
    let at = be(boxed(stbl, &[b"stco"]), 8) as usize;
    assert_eq!(&bytes[at - 4..at], b"mdat");
    let all: u32 = (0..30).map(|i| be(sizes, 12 + 4 * i)).sum();
    assert_eq!(at + all as usize, bytes.len());
    // The first slice is of a frame that stands alone; two seconds later there is another.
    assert_eq!(bytes[at + 4] & 31, 5);
    let alone = boxed(stbl, &[b"stss"]);
    assert_eq!((be(alone, 4), be(alone, 8), be(alone, 12)), (2, 1, 16));
    let times = boxed(stbl, &[b"stts"]);
    // After two dates, of 64 bits in the second version of this box.
    let header = boxed(&bytes, &[b"moov", b"trak", b"mdia", b"mdhd"]);
    let scale = be(header, if header[0] == 1 { 20 } else { 12 });
    assert_eq!((be(times, 8), be(times, 12), scale), (30, 1000, 7500));
    assert_eq!(bytes, written(AnimationFormat::Mp4, &AnimationSettings { fps: 7.5, ..SETTINGS }, &frames));

    let small = written(AnimationFormat::Mp4, &AnimationSettings { quality: 10, ..SETTINGS }, &frames);
    assert!(small.len() * 2 < bytes.len(), "{} {}", small.len(), bytes.len());
    let folder = tempfile::tempdir().unwrap();
    let mut moving =
        AnimationFile::create(&folder.path().join("a.mp4"), AnimationFormat::Mp4, &SETTINGS).unwrap();
    assert!(moving.push(&frame(0, [0; 4])).unwrap_err().to_string().contains("no transparency"));
}

#[test]
fn a_page_holds_every_frame_and_its_title_is_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a<b>&{{width}}.html");
    let mut moving = AnimationFile::create(&path, AnimationFormat::Html, &SETTINGS).unwrap();
    for i in 0..4 {
        moving.push(&frame(i, [0; 4])).unwrap();
    }
    moving.finish().unwrap();
    let page = std::fs::read_to_string(&path).unwrap();
    assert_eq!(page.matches("\n\"UklGR").count(), 4);
    assert!(page.contains("<title>a&lt;b&gt;&amp;&#123;&#123;width}}</title>"));
    assert!(page.contains("width=\"40\" height=\"30\"") && page.contains("FPS = 12, REPEAT = true"));
    assert!(!page.contains("{{") && page.ends_with("</html>\n"));
    assert!(!page.contains("http"), "nothing is fetched");
}
