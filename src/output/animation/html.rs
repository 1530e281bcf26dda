//! A self-contained HTML page that turns the model by mouse, keys and touch.

use std::io::{self, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::encoder::{AnimationSettings, Encoder};
use super::spool::Spool;
use super::webp;
use crate::escape::escape_html;
use crate::page::PAGE_STYLE;

/// The page, with a placeholder for the frames.
const PAGE: &str = include_str!("player.html");
const FRAMES_PLACEHOLDER: &str = "/*FRAMES*/";

pub(super) struct Html {
    settings: AnimationSettings,
    title: String,
}

impl Html {
    pub fn new(path: &Path, settings: &AnimationSettings) -> Html {
        let title = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        Html { settings: *settings, title }
    }
}

impl Encoder for Html {
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()> {
        let AnimationSettings { width, height, quality, .. } = self.settings;
        let image = webp::compress(width, height, pixels, quality)?;
        writeln!(body, "\"{}\",", STANDARD.encode(image))
    }

    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>> {
        let AnimationSettings { width, height, fps, repeat, clockwise, .. } = self.settings;
        let (head, tail) = PAGE.split_once(FRAMES_PLACEHOLDER).unwrap_or((PAGE, ""));
        body.write_all(tail.as_bytes())?;
        let values = [
            ("{{style}}", PAGE_STYLE.to_string()),
            // A title with braces must not be taken for a placeholder.
            ("{{title}}", escape_html(&self.title).replace('{', "&#123;")),
            ("{{width}}", width.to_string()),
            ("{{height}}", height.to_string()),
            ("{{fps}}", fps.to_string()),
            ("{{repeat}}", repeat.to_string()),
            ("{{way}}", if clockwise { "-1" } else { "1" }.to_string()),
        ];
        Ok(values.iter().fold(head.to_string(), |page, (name, value)| page.replace(name, value)).into_bytes())
    }
}
