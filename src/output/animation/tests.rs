//! Decodes the written files, with another decoder than the encoder's library where one exists.

use std::io;
use std::path::Path;

use crate::animation::*;
use crate::atomic::Overwrite;

const SETTINGS: AnimationSettings = AnimationSettings {
    width: 40,
    height: 30,
    fps: 12.0,
    repeat: true,
    quality: 90,
    overwrite: Overwrite::Yes,
    clockwise: false,
};

/// A disc that moves around on a background.
fn frame(i: u32, background: [u8; 4]) -> Vec<[u8; 4]> {
    let (width, height) = (SETTINGS.width as i32, SETTINGS.height as i32);
    let (cx, cy) = (20 + [8, 0, -8, 0][i as usize % 4], 15 + [0, 8, 0, -8][i as usize % 4]);
    let pixel = |p: i32| {
        let (x, y) = (p % width, p / width);
        let inside = (x - cx).pow(2) + (y - cy).pow(2) < 30;
        if inside { [200, (5 * x) as u8, (6 * y) as u8, 255] } else { background }
    };
    (0..width * height).map(pixel).collect()
}

/// Writes an animation and returns the bytes of the file.
fn encode(format: AnimationFormat, settings: &AnimationSettings, frames: &[Vec<[u8; 4]>]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("animation");
    let mut animation = AnimationFile::create(&path, format, settings).unwrap();
    for frame in frames {
        animation.push(frame).unwrap();
        assert_eq!(
            std::fs::read_dir(folder.path()).unwrap().count(),
            0,
            "the file is not visible before the end"
        );
    }
    animation.finish().unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    std::fs::read(path).unwrap()
}

/// Decodes a GIF to its frames as a screen shows them, with their delays.
fn decode_gif(bytes: &[u8]) -> (::gif::Repeat, Vec<(u16, Vec<[u8; 4]>)>) {
    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let width = usize::from(decoder.width());
    let mut screen = vec![[0u8; 4]; width * usize::from(decoder.height())];
    let mut frames = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (left, top) = (usize::from(frame.left), usize::from(frame.top));
        let columns = usize::from(frame.width);
        for (i, pixel) in frame.buffer.as_chunks::<4>().0.iter().enumerate() {
            if pixel[3] > 0 {
                screen[(top + i / columns) * width + left + i % columns] = *pixel;
            }
        }
        frames.push((frame.delay, screen.clone()));
        if frame.dispose == ::gif::DisposalMethod::Background {
            screen.fill([0; 4]);
        }
    }
    (decoder.repeat(), frames)
}

#[test]
fn gif_frames_are_exact_with_few_colours() {
    for background in [[10, 20, 30, 255], [0; 4]] {
        // The third frame is repeated: nothing changes.
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, background)).into();
        let (repeat, shown) = decode_gif(&encode(AnimationFormat::Gif, &SETTINGS, &frames));
        assert_eq!(repeat, ::gif::Repeat::Infinite);
        assert_eq!(shown.iter().map(|s| s.0).collect::<Vec<_>>(), [8, 9, 8, 8, 9]);
        assert_eq!(shown.into_iter().map(|s| s.1).collect::<Vec<_>>(), frames);
    }
}

#[test]
fn gif_alpha_is_thresholded_and_one_loop_ends() {
    let mut half = frame(0, [0; 4]);
    half[0] = [9, 9, 9, 127];
    half[1] = [9, 9, 9, 128];
    let settings = AnimationSettings { repeat: false, ..SETTINGS };
    let (repeat, shown) = decode_gif(&encode(AnimationFormat::Gif, &settings, &[half]));
    assert_eq!(repeat, ::gif::Repeat::Finite(0));
    assert_eq!((shown[0].1[0], shown[0].1[1]), ([0; 4], [9, 9, 9, 255]));
}

/// At the slowest rate, single delays are rounded up to 65536, which does not fit 16 bits.
#[test]
fn the_longest_gif_delays_do_not_wrap_to_zero() {
    let settings = AnimationSettings { fps: 0.001_525_892_8, ..SETTINGS };
    let frames: Vec<_> = (0..3).map(|i| frame(i, [0; 4])).collect();
    let (_, shown) = decode_gif(&encode(AnimationFormat::Gif, &settings, &frames));
    assert_eq!(shown.iter().map(|s| s.0).collect::<Vec<_>>(), [u16::MAX; 3]);
}

#[test]
fn apng_frames_are_exact() {
    for (background, repeat) in [([10, 20, 30, 255], true), ([7, 8, 9, 60], false)] {
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, background)).into();
        let bytes = encode(AnimationFormat::Apng, &AnimationSettings { repeat, ..SETTINGS }, &frames);
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
fn unsupported_input_is_an_error_of_one_line() {
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
    refused(&path, AnimationFormat::Gif, &with(|s| s.fps = f64::NAN), "greater than zero");
    refused(&path, AnimationFormat::Gif, &with(|s| s.width = 70_000), "65535");
    refused(&path, AnimationFormat::Apng, &with(|s| s.fps = 0.1), "6.5 s");
    refused(&path, AnimationFormat::Apng, &with(|s| s.height = 0), "one pixel");
    refused(&folder.path().join("no/a.gif"), AnimationFormat::Gif, &SETTINGS, "cannot be written");
    refused(folder.path(), AnimationFormat::Gif, &SETTINGS, "folder");

    let mut animation = AnimationFile::create(&path, AnimationFormat::Gif, &SETTINGS).unwrap();
    assert!(animation.push(&[[0; 4]; 3]).unwrap_err().to_string().contains("40x30"));
    let empty = AnimationFile::create(&path, AnimationFormat::Apng, &SETTINGS).unwrap();
    assert!(empty.finish().unwrap_err().to_string().contains("no frames"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    std::fs::write(&path, "mine").unwrap();
    refused(&path, AnimationFormat::Gif, &with(|s| s.overwrite = Overwrite::No), "no-overwrite");
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
}

/// The chunks of a RIFF file after its header.
fn riff_chunks(mut rest: &[u8]) -> Vec<([u8; 4], &[u8])> {
    let mut all = Vec::new();
    while let [a, b, c, d, e, f, g, h, after @ ..] = rest {
        let length = u32::from_le_bytes([*e, *f, *g, *h]) as usize;
        all.push(([*a, *b, *c, *d], &after[..length]));
        rest = &after[length + length % 2..];
    }
    all
}

#[test]
fn webp_frames_are_exact_at_quality_100() {
    use image::AnimationDecoder;
    for (background, repeat) in [([10, 20, 30, 255], true), ([0; 4], false)] {
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, background)).into();
        let settings = AnimationSettings { quality: 100, repeat, ..SETTINGS };
        let bytes = encode(AnimationFormat::Webp, &settings, &frames);
        assert_eq!(u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize, bytes.len() - 8);
        let chunks = riff_chunks(&bytes[12..]);
        assert_eq!((chunks[0].0, chunks[1].0), (*b"VP8X", *b"ANIM"));
        assert_eq!(chunks[1].1[4..], [u8::from(!repeat), 0]);
        let delay = |frame: &[u8]| u32::from_le_bytes([frame[12], frame[13], frame[14], 0]);
        assert_eq!(chunks[2..].iter().map(|c| delay(c.1)).collect::<Vec<_>>(), [83, 84, 83, 83, 84]);

        let decoder = image::codecs::webp::WebPDecoder::new(io::Cursor::new(&bytes)).unwrap();
        let shown = decoder.into_frames().collect_frames().unwrap();
        assert_eq!(shown.len(), 5);
        for (i, (shown, expected)) in shown.iter().zip(&frames).enumerate() {
            // The colour of a transparent pixel does not matter.
            let visible = |p: &[u8; 4]| if p[3] == 0 { [0; 4] } else { *p };
            let shown: Vec<_> = shown.buffer().as_raw().as_chunks::<4>().0.iter().map(visible).collect();
            assert!(shown == *expected, "frame {i}");
        }
    }
    let noise = |i: u32| {
        (0..1200u32).map(move |p| [0, 1, 2].map(|c| (p * 3 + c + i).wrapping_mul(2_654_435_761) >> 24))
    };
    let noisy: Vec<Vec<[u8; 4]>> =
        (0..3).map(|i| noise(i).map(|[r, g, b]| [r as u8, g as u8, b as u8, 255]).collect()).collect();
    let length =
        |quality| encode(AnimationFormat::Webp, &AnimationSettings { quality, ..SETTINGS }, &noisy).len();
    assert!(length(10) < length(90));
}

/// The content of the MP4 box at `path`, a list of names.
fn mp4_box<'a>(mut inside: &'a [u8], path: &[&[u8; 4]]) -> &'a [u8] {
    let Some((name, deeper)) = path.split_first() else { return inside };
    loop {
        let length = u32::from_be_bytes(inside[..4].try_into().unwrap()) as usize;
        if inside[4..8] == name[..] {
            return mp4_box(&inside[8..length], deeper);
        }
        inside = &inside[length..];
    }
}

fn read_u32(bytes: &[u8], at: usize) -> u32 {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap())
}

#[test]
fn the_mp4_index_precedes_the_frames_and_points_to_them() {
    let frames: Vec<_> = (0..30).map(|i| frame(i, [10, 20, 30, 255])).collect();
    let bytes = encode(AnimationFormat::Mp4, &AnimationSettings { fps: 7.5, ..SETTINGS }, &frames);
    assert_eq!(&bytes[4..8], b"ftyp");
    let stbl = mp4_box(&bytes, &[b"moov", b"trak", b"mdia", b"minf", b"stbl"]);
    let sizes = mp4_box(stbl, &[b"stsz"]);
    assert_eq!(read_u32(sizes, 8), 30);
    let offset = read_u32(mp4_box(stbl, &[b"stco"]), 8) as usize;
    assert_eq!(&bytes[offset - 4..offset], b"mdat");
    let total: u32 = (0..30).map(|i| read_u32(sizes, 12 + 4 * i)).sum();
    assert_eq!(offset + total as usize, bytes.len());
    // The first frame is a key frame; the next one follows after two seconds.
    assert_eq!(bytes[offset + 4] & 31, 5);
    let key_frames = mp4_box(stbl, &[b"stss"]);
    assert_eq!((read_u32(key_frames, 4), read_u32(key_frames, 8), read_u32(key_frames, 12)), (2, 1, 16));
    let times = mp4_box(stbl, &[b"stts"]);
    // The timescale follows two dates, which have 64 bits in version 1 of this box.
    let header = mp4_box(&bytes, &[b"moov", b"trak", b"mdia", b"mdhd"]);
    let timescale = read_u32(header, if header[0] == 1 { 20 } else { 12 });
    assert_eq!((read_u32(times, 8), read_u32(times, 12), timescale), (30, 1000, 7500));
    assert_eq!(bytes, encode(AnimationFormat::Mp4, &AnimationSettings { fps: 7.5, ..SETTINGS }, &frames));

    let small = encode(AnimationFormat::Mp4, &AnimationSettings { quality: 10, ..SETTINGS }, &frames);
    assert!(small.len() * 2 < bytes.len(), "{} {}", small.len(), bytes.len());
    let folder = tempfile::tempdir().unwrap();
    let mut animation =
        AnimationFile::create(&folder.path().join("a.mp4"), AnimationFormat::Mp4, &SETTINGS).unwrap();
    assert!(animation.push(&frame(0, [0; 4])).unwrap_err().to_string().contains("no transparency"));
}

/// The frames of an MP4, and its number of ticks a frame and a second.
fn mp4_frames(bytes: &[u8]) -> (u32, [u32; 2]) {
    let mdia = mp4_box(bytes, &[b"moov", b"trak", b"mdia"]);
    let stbl = mp4_box(mdia, &[b"minf", b"stbl"]);
    let header = mp4_box(mdia, &[b"mdhd"]);
    let timescale = read_u32(header, if header[0] == 1 { 20 } else { 12 });
    (read_u32(mp4_box(stbl, &[b"stsz"]), 8), [read_u32(mp4_box(stbl, &[b"stts"]), 12), timescale])
}

#[test]
fn mp4_has_all_frames_at_any_rate() {
    let frames: Vec<_> = (0..8).map(|i| frame(i, [10, 20, 30, 255])).collect();
    for (fps, timescale) in
        [(0.25, 250), (1.0, 1000), (1.001, 1001), (2.0, 2000), (5.5, 5500), (240.0, 240_000)]
    {
        let bytes = encode(AnimationFormat::Mp4, &AnimationSettings { fps, ..SETTINGS }, &frames);
        assert_eq!(mp4_frames(&bytes), (8, [1000, timescale]), "{fps}");
    }
}

/// Noise exceeds the encoder's buffer at high quality.
#[test]
fn mp4_of_noise_has_a_lower_quality() {
    let settings = AnimationSettings { width: 320, height: 240, quality: 100, ..SETTINGS };
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let mut frames: Vec<Vec<[u8; 4]>> =
        (0..3).map(|_| (0..320 * 240).map(|_| [noise(), noise(), noise(), 255]).collect()).collect();
    frames.insert(0, vec![[90, 120, 30, 255]; 320 * 240]);
    let bytes = encode(AnimationFormat::Mp4, &settings, &frames);
    assert_eq!(mp4_frames(&bytes).0, 4);
    assert!(bytes == encode(AnimationFormat::Mp4, &settings, &frames));
}

#[test]
fn an_html_page_embeds_all_frames_and_escapes_its_title() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a<b>&{{width}}.html");
    let mut animation = AnimationFile::create(&path, AnimationFormat::Html, &SETTINGS).unwrap();
    for i in 0..4 {
        animation.push(&frame(i, [0; 4])).unwrap();
    }
    animation.finish().unwrap();
    let page = std::fs::read_to_string(&path).unwrap();
    assert_eq!(page.matches("\n\"UklGR").count(), 4);
    assert!(page.contains("<title>a&lt;b&gt;&amp;&#123;&#123;width}}</title>"));
    assert!(page.contains("width=\"40\" height=\"30\"") && page.contains("FPS = 12, REPEAT = true"));
    assert!(!page.contains("{{") && page.ends_with("</html>\n"));
    assert!(!page.contains("http"), "the page loads nothing");
}
