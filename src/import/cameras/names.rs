//! Names of pictures in lists, as names of output files.

/// Extensions of pictures, which are not a part of the name.
const EXTENSIONS: [&str; 13] =
    ["png", "jpg", "jpeg", "webp", "exr", "tif", "tiff", "bmp", "hdr", "ppm", "pgm", "npy", "heic"];
/// Longest name in bytes.
const MAX_BYTES: usize = 1024;

/// Returns a relative path without extension for the file of a picture, with `/` between its folders. A path that is
/// absolute or leads upwards keeps only its last part. `None` if nothing is left, or too much.
pub(super) fn picture_name(file: &str) -> Option<String> {
    let mut parts: Vec<String> =
        file.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".").map(safe_part).collect();
    let is_absolute = file.starts_with(['/', '\\']) || file.as_bytes().get(1) == Some(&b':');
    if is_absolute || parts.iter().any(|part| part == "..") {
        parts.drain(..parts.len().saturating_sub(1));
    }
    let last = parts.last_mut()?;
    if let Some((stem, extension)) = last.rsplit_once('.')
        && !stem.is_empty()
        && EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known))
    {
        *last = stem.to_string();
    }
    let name = parts.join("/");
    (name != ".." && !name.is_empty() && name.len() <= MAX_BYTES).then_some(name)
}

/// Replaces characters that a system does not allow in names.
fn safe_part(part: &str) -> String {
    let safe = |c: char| if c.is_control() || "<>:\"|?*".contains(c) { '_' } else { c };
    part.chars().map(safe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_below_their_folder() {
        for (file, name) in [
            ("./train/r_0", Some("train/r_0")),
            ("images/frame_00001.jpg", Some("images/frame_00001")),
            ("a.b.PNG", Some("a.b")),
            ("v.1", Some("v.1")),
            (".png", Some(".png")),
            ("cam 1\\img.tif", Some("cam 1/img")),
            ("/home/me/data/7.png", Some("7")),
            ("C:\\data\\7.png", Some("7")),
            ("../../etc/passwd", Some("passwd")),
            ("a/../../b.png", Some("b")),
            ("..", None),
            ("a/..", None),
            ("", None),
            ("/", None),
            ("a\0b\n<c>", Some("a_b__c_")),
        ] {
            assert_eq!(picture_name(file).as_deref(), name, "{file}");
        }
        assert_eq!(picture_name(&"x".repeat(1025)), None);
    }
}
