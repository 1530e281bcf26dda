//! Files are read back by other decoders than what wrote them, where there are any.

use std::path::Path;

use super::*;

pub(super) const SETTINGS: MovingSettings =
    MovingSettings { width: 40, height: 30, fps: 12.0, repeat: true, quality: 90, replace: Replace::Yes };

/// A disc that goes around on a ground, or on nothing.
pub(super) fn frame(i: u32, ground: [u8; 4]) -> Vec<[u8; 4]> {
    let (width, height) = (SETTINGS.width as i32, SETTINGS.height as i32);
    let (cx, cy) = (20 + [8, 0, -8, 0][i as usize % 4], 15 + [0, 8, 0, -8][i as usize % 4]);
    let one = |p: i32| {
        let (x, y) = (p % width, p / width);
        let inside = (x - cx).pow(2) + (y - cy).pow(2) < 30;
        if inside { [200, (5 * x) as u8, (6 * y) as u8, 255] } else { ground }
    };
    (0..width * height).map(one).collect()
}

pub(super) fn written(format: MovingFormat, settings: &MovingSettings, frames: &[Vec<[u8; 4]>]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moving");
    let mut moving = Moving::create(&path, format, settings).unwrap();
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
        let (repeat, shown) = shown_gif(&written(MovingFormat::Gif, &SETTINGS, &frames));
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
    let settings = MovingSettings { repeat: false, ..SETTINGS };
    let (repeat, shown) = shown_gif(&written(MovingFormat::Gif, &settings, &[half]));
    assert_eq!(repeat, ::gif::Repeat::Finite(0));
    assert_eq!((shown[0].1[0], shown[0].1[1]), ([0; 4], [9, 9, 9, 255]));
}

#[test]
fn an_apng_shows_its_frames() {
    for (ground, repeat) in [([10, 20, 30, 255], true), ([7, 8, 9, 60], false)] {
        let frames: Vec<_> = [0, 1, 2, 2, 3].map(|i| frame(i, ground)).into();
        let bytes = written(MovingFormat::Apng, &MovingSettings { repeat, ..SETTINGS }, &frames);
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
    let refused = |path: &Path, format, settings: &MovingSettings, word: &str| {
        let text = Moving::create(path, format, settings).err().expect(word).to_string();
        assert!(text.contains(word) && text.lines().count() == 1 && !text.contains(".part"), "{text}");
    };
    let with = |change: fn(&mut MovingSettings)| {
        let mut settings = SETTINGS;
        change(&mut settings);
        settings
    };
    refused(&path, MovingFormat::Gif, &with(|s| s.fps = 60.0), "50 frames a second");
    refused(&path, MovingFormat::Gif, &with(|s| s.fps = f64::NAN), "number of frames");
    refused(&path, MovingFormat::Gif, &with(|s| s.width = 70_000), "65535");
    refused(&path, MovingFormat::Apng, &with(|s| s.fps = 0.1), "6.5 s");
    refused(&path, MovingFormat::Apng, &with(|s| s.height = 0), "one pixel");
    refused(&folder.path().join("no/a.gif"), MovingFormat::Gif, &SETTINGS, "cannot be written");
    refused(folder.path(), MovingFormat::Gif, &SETTINGS, "folder");

    let mut moving = Moving::create(&path, MovingFormat::Gif, &SETTINGS).unwrap();
    assert!(moving.push(&[[0; 4]; 3]).unwrap_err().to_string().contains("40x30"));
    let empty = Moving::create(&path, MovingFormat::Apng, &SETTINGS).unwrap();
    assert!(empty.finish().unwrap_err().to_string().contains("no frames"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    std::fs::write(&path, "mine").unwrap();
    refused(&path, MovingFormat::Gif, &with(|s| s.replace = Replace::No), "--no-overwrite");
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
}
