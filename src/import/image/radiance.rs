//! Radiance pictures (.hdr, .pic), as the programs that write them understand the format: any first line, all eight
//! orientations, RGBE and XYZE, exposures, and scanlines that are flat or compressed in either way (Ward, “Radiance File
//! Formats”).

/// Most bytes of a header and its size line.
const MAX_HEADER: usize = 1 << 16;
/// Lengths of scanlines that the newer compression applies to.
const COMPRESSED_LENGTHS: std::ops::RangeInclusive<usize> = 8..=0x7fff;
/// From CIE XYZ to linear Rec. 709 with the white point D65, by rows.
const XYZ_TO_RGB: [[f32; 3]; 3] = [
    [3.240_454_2, -1.537_138_5, -0.498_531_4],
    [-0.969_266, 1.876_010_8, 0.041_556],
    [0.055_643_4, -0.204_025_9, 1.057_225_2],
];

/// Returns true for Radiance pictures. Their first line begins with `#?` and a name of the program or the format; some
/// have none and begin with a variable of the header.
pub(super) fn is_radiance(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?") || {
        let start = &bytes[..bytes.len().min(1024)];
        start.windows(FORMAT.len()).any(|window| window == FORMAT)
    }
}

const FORMAT: &[u8] = b"FORMAT=32-bit_";

/// The header of a picture.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    pub width: u32,
    pub height: u32,
    orientation: Orientation,
    is_xyz: bool,
    /// Divides pixels: exposures and colour corrections multiplied.
    exposure: [f32; 3],
    /// Where the scanlines begin.
    data: usize,
}

/// The order of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Orientation {
    /// True if scanlines are columns.
    is_transposed: bool,
    /// True if columns go from right to left.
    right_to_left: bool,
    /// True if rows go from bottom to top.
    bottom_to_top: bool,
}

impl Header {
    /// # Errors
    /// The header is damaged, or has another format.
    pub fn read(bytes: &[u8]) -> Result<Header, String> {
        let mut header = Header {
            width: 0,
            height: 0,
            orientation: Orientation { is_transposed: false, right_to_left: false, bottom_to_top: false },
            is_xyz: false,
            exposure: [1.0; 3],
            data: 0,
        };
        let mut at = 0;
        while at < bytes.len().min(MAX_HEADER) {
            let rest = &bytes[at..];
            let end = rest.iter().position(|&b| b == b'\n').ok_or("the header has no end")?;
            at += end + 1;
            let line = String::from_utf8_lossy(&rest[..end]);
            let line = line.trim();
            if let Some((name, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) {
                header.set(name.trim(), value.trim())?;
            } else if let Some((size, orientation)) = parse_size(line) {
                [header.width, header.height] = size;
                header.orientation = orientation;
                header.data = at;
                return Ok(header);
            }
        }
        Err("the header has no size, such as -Y 512 +X 1024".into())
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        let divide = |factor: &mut f32, value: f32| {
            if value.is_finite() && value > 0.0 && (*factor * value).is_normal() {
                *factor *= value;
            }
        };
        match name {
            "FORMAT" => match value {
                // Some programs leave `rle` out, or write capitals.
                format if ends_with(format, "rgbe") => self.is_xyz = false,
                format if ends_with(format, "xyze") => self.is_xyz = true,
                other => return Err(format!("the pixel format {other} is unknown")),
            },
            "EXPOSURE" => {
                let value = value.parse().unwrap_or(1.0);
                self.exposure.iter_mut().for_each(|factor| divide(factor, value));
            }
            "COLORCORR" => {
                let values = value.split_whitespace().map(|word| word.parse().unwrap_or(1.0));
                self.exposure.iter_mut().zip(values).for_each(|(factor, value)| divide(factor, value));
            }
            _ => {}
        }
        Ok(())
    }

    /// The linear colour of a pixel.
    fn color(&self, [r, g, b, e]: [u8; 4]) -> [f32; 3] {
        if e == 0 {
            return [0.0; 3];
        }
        // 2^(e − 136) in two exact factors, of which neither is subnormal.
        let power = |e: i32| f32::from_bits(((e + 127) as u32) << 23);
        let e = i32::from(e) - 136;
        let scale = |v: u8| f32::from(v) * power(e / 2) * power(e - e / 2);
        let mut color = [scale(r), scale(g), scale(b)];
        for (v, exposure) in color.iter_mut().zip(self.exposure) {
            *v /= exposure;
        }
        if self.is_xyz {
            let [x, y, z] = color;
            color = XYZ_TO_RGB.map(|[a, b, c]| (a * x + b * y + c * z).max(0.0));
        }
        color
    }
}

fn ends_with(text: &str, end: &str) -> bool {
    text.to_ascii_lowercase().ends_with(end)
}

/// Parses the last line of the header, such as `-Y 512 +X 1024`: the axis from scanline to scanline, then that along
/// scanlines. Returns width and height.
fn parse_size(line: &str) -> Option<([u32; 2], Orientation)> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [slow, slow_count, fast, fast_count] = words[..] else { return None };
    let (slow_count, fast_count) = (slow_count.parse().ok()?, fast_count.parse().ok()?);
    let axis = |word: &str| match word {
        "+X" | "+x" => Some(('x', true)),
        "-X" | "-x" => Some(('x', false)),
        "+Y" | "+y" => Some(('y', true)),
        "-Y" | "-y" => Some(('y', false)),
        _ => None,
    };
    match (axis(slow)?, axis(fast)?) {
        (('y', up), ('x', right)) => {
            let orientation = Orientation { is_transposed: false, right_to_left: !right, bottom_to_top: up };
            Some(([fast_count, slow_count], orientation))
        }
        (('x', right), ('y', up)) => {
            let orientation = Orientation { is_transposed: true, right_to_left: !right, bottom_to_top: up };
            Some(([slow_count, fast_count], orientation))
        }
        _ => None,
    }
}

/// Reads the pixels behind a header, whose size the caller has checked: row by row from the top, linear Rec. 709.
///
/// # Errors
/// The file is truncated or damaged.
pub(super) fn decode(bytes: &[u8], header: &Header) -> Result<Vec<[f32; 3]>, String> {
    let (width, height) = (header.width as usize, header.height as usize);
    let Orientation { is_transposed, right_to_left, bottom_to_top } = header.orientation;
    let (lines, length) = if is_transposed { (width, height) } else { (height, width) };
    let mut texels = vec![[0.0; 3]; width * height];
    let mut data = bytes.get(header.data..).unwrap_or_default();
    let mut scanline = vec![[0u8; 4]; length];
    for line in 0..lines {
        read_scanline(&mut data, &mut scanline)?;
        for (i, &pixel) in scanline.iter().enumerate() {
            let (x, y) = if is_transposed { (line, i) } else { (i, line) };
            let x = if right_to_left { width - 1 - x } else { x };
            let y = if bottom_to_top { height - 1 - y } else { y };
            texels[y * width + x] = header.color(pixel);
        }
    }
    Ok(texels)
}

const TRUNCATED: &str = "the file is truncated";

/// Takes `N` bytes from the front of `data`.
fn take<const N: usize>(data: &mut &[u8]) -> Result<[u8; N], String> {
    let (first, rest) = data.split_first_chunk::<N>().ok_or(TRUNCATED)?;
    *data = rest;
    Ok(*first)
}

fn read_scanline(data: &mut &[u8], scanline: &mut [[u8; 4]]) -> Result<(), String> {
    let length = scanline.len();
    if let Some(&[2, 2, high, low]) = data.first_chunk()
        && COMPRESSED_LENGTHS.contains(&length)
        && usize::from(u16::from_be_bytes([high, low])) == length
    {
        *data = &data[4..];
        return (0..4).try_for_each(|channel| read_channel(data, scanline, channel));
    }
    read_pixels(data, scanline)
}

/// Reads one channel of a scanline of the newer compression: runs, and stretches without.
fn read_channel(data: &mut &[u8], scanline: &mut [[u8; 4]], channel: usize) -> Result<(), String> {
    let mut i = 0;
    while i < scanline.len() {
        let [code] = take(data)?;
        let is_run = code > 128;
        let count = usize::from(if is_run { code - 128 } else { code });
        let pixels = scanline.get_mut(i..i + count).filter(|pixels| !pixels.is_empty());
        let pixels = pixels.ok_or("a scanline is damaged")?;
        if is_run {
            let [value] = take(data)?;
            pixels.iter_mut().for_each(|pixel| pixel[channel] = value);
        } else {
            for pixel in pixels {
                [pixel[channel]] = take(data)?;
            }
        }
        i += count;
    }
    Ok(())
}

/// Reads flat pixels. In the older compression, 1 1 1 n repeats the last pixel n times; further such pixels are the higher
/// bytes of n.
fn read_pixels(data: &mut &[u8], scanline: &mut [[u8; 4]]) -> Result<(), String> {
    let (mut i, mut shift) = (0, 0);
    while i < scanline.len() {
        let pixel: [u8; 4] = take(data)?;
        if let [1, 1, 1, count] = pixel {
            let count = usize::from(count).checked_shl(shift).filter(|_| shift < 24);
            let end = count.and_then(|count| i.checked_add(count)).filter(|&end| end <= scanline.len());
            let end = end.filter(|_| i > 0).ok_or("a scanline is damaged")?;
            let last = scanline[i - 1];
            scanline[i..end].fill(last);
            (i, shift) = (end, shift + 8);
        } else {
            scanline[i] = pixel;
            (i, shift) = (i + 1, 0);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
