//! Frames as files: their order by number, and the missing numbers.

use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap};
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Display, Path, PathBuf};

use anyhow::{Context, Result, bail};

use blinn_output::canonical_path;
use blinn_session::AovSelection;

/// Extensions of frames.
const EXTENSIONS: [&str; 4] = ["png", "jpg", "jpeg", "webp"];

/// The frames in a list of files and folders, in the order of their numbers, without `output`.
///
/// # Errors
/// A folder that cannot be read or that does not contain exactly one sequence; images together with previews of their
/// own AOVs.
pub fn frame_files(paths: &[PathBuf], output: &Path) -> Result<Vec<PathBuf>> {
    // The result of an earlier run is not a frame.
    let output = canonical_path(output);
    let is_output = |path: &Path| canonical_path(path) == output;
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(folder_sequence(path, is_output)?);
        } else if !is_output(path) {
            files.push(path.clone());
        }
    }
    if let Some((image, preview)) = image_with_preview(&files) {
        bail!("{preview} is an AOV of {image}; name the frames of one sequence");
    }
    files.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(files)
}

/// An image and the preview of one of its AOVs, such as `a_1.png` and `a_1.depth.png`.
fn image_with_preview(files: &[PathBuf]) -> Option<(Display<'_>, Display<'_>)> {
    let aovs = AovSelection::all().preview_names();
    let by_stem: HashMap<PathBuf, &PathBuf> = files.iter().map(|f| (f.with_extension(""), f)).collect();
    files.iter().find_map(|file| {
        let stem = file.with_extension("");
        let aov = stem.extension()?.to_str()?;
        let is_aov = aovs.iter().any(|known| known == aov);
        let image = is_aov.then(|| by_stem.get(&stem.with_extension("")))??;
        Some((image.display(), file.display()))
    })
}

/// The frames in a folder.
fn folder_sequence(folder: &Path, is_output: impl Fn(&Path) -> bool) -> Result<Vec<PathBuf>> {
    let unreadable = || format!("{} cannot be read", folder.display());
    let mut sequences: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let path = entry.with_context(unreadable)?.path();
        let extension = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let is_image = extension.is_some_and(|e| EXTENSIONS.contains(&e.as_str()));
        if is_image && path.is_file() && !is_output(&path) {
            sequences.entry(name_pattern(&path)).or_default().push(path);
        }
    }
    let names: Vec<&String> = sequences.keys().collect();
    match names[..] {
        [] => bail!("{} contains no .png, .jpg or .webp", folder.display()),
        [_] => Ok(sequences.into_values().flatten().collect()),
        [first, second, ..] => {
            let (folder, count) = (folder.display(), names.len());
            bail!("{folder} contains {count} sequences, such as {first} and {second}; name the frames of one")
        }
    }
}

/// A file name with `#` instead of its number.
fn name_pattern(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match frame_number(path) {
        Some((range, _)) => format!("{}#{}", &name[..range.start], &name[range.end..]),
        None => name,
    }
}

/// The last number in a name before its extension, and where it stands.
fn frame_number(path: &Path) -> Option<(Range<usize>, i64)> {
    let stem = path.file_stem()?.to_string_lossy().into_owned();
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let digits = stem[..end].trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let begin = match stem[..digits].strip_suffix('-') {
        Some(before) if is_minus_after(before.chars().next_back()) => before.len(),
        _ => digits,
    };
    Some((begin..end, stem[begin..end].parse().ok()?))
}

/// True if a dash between this character and digits is a minus sign. In `a-2` it is a separator.
fn is_minus_after(before: Option<char>) -> bool {
    before.is_none_or(|c| !c.is_alphanumeric())
}

/// The numbers that are missing between the frames of a sequence, as text. Frames with equal steps lack none.
pub fn missing_numbers(files: &[PathBuf]) -> Option<String> {
    let numbers: Vec<i64> = files.iter().map(|f| frame_number(f).map(|(_, n)| n)).collect::<Option<_>>()?;
    let is_one_sequence = files.windows(2).all(|pair| name_pattern(&pair[0]) == name_pattern(&pair[1]));
    let steps = numbers.windows(2).filter_map(|pair| pair[1].checked_sub(pair[0]));
    let step = steps.filter(|&step| step > 0).min()?;
    if !is_one_sequence {
        return None;
    }
    let gap = |pair: &[i64]| match pair[1].saturating_sub(pair[0]) {
        difference if difference <= step => None,
        difference if difference == step.saturating_mul(2) => Some(format!("{}", pair[0] + step)),
        _ => Some(format!("{} to {}", pair[0] + step, pair[1] - step)),
    };
    let gaps: Vec<String> = numbers.windows(2).filter_map(gap).collect();
    (!gaps.is_empty()).then(|| gaps.join(", "))
}

/// Compares text with digits as numbers: `a9` before `a10`, and `-2` before `-1`.
fn natural_order(a: &str, b: &str) -> Ordering {
    let digits = |s: &str| s.len() - s.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let mut left = a;
    let mut right = b;
    loop {
        // The text before `left` and `right` is equal except for leading zeros.
        let may_be_negative = is_minus_after(a[..a.len() - left.len()].chars().next_back());
        let is_negative =
            |s: &str| may_be_negative && s.strip_prefix('-').is_some_and(|rest| digits(rest) > 0);
        let both_negative = is_negative(left) && is_negative(right);
        if both_negative {
            left = &left[1..];
            right = &right[1..];
        }
        let (x, y) = (digits(left), digits(right));
        if x > 0 && y > 0 {
            let m = left[..x].trim_start_matches('0');
            let n = right[..y].trim_start_matches('0');
            match m.len().cmp(&n.len()).then(m.cmp(n)) {
                Ordering::Equal => {
                    left = &left[x..];
                    right = &right[y..];
                }
                order => return if both_negative { order.reverse() } else { order },
            }
            continue;
        }
        let mut l = left.chars();
        let mut r = right.chars();
        match (l.next(), r.next()) {
            (Some(c), Some(d)) if c == d => {
                left = l.as_str();
                right = r.as_str();
            }
            // Equal except for leading zeros: any total order will do.
            (None, None) => return a.cmp(b),
            (c, d) => return c.cmp(&d),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn frames_are_sorted_by_number() {
        let named = paths(&["f/a10.png", "f/a9.png", "f/a010.png", "f/a1b2.png", "f/a1b11.png", "f/é2.png"]);
        let sorted = frame_files(&named, Path::new("x.gif")).unwrap();
        let expected = ["f/a1b2.png", "f/a1b11.png", "f/a9.png", "f/a010.png", "f/a10.png", "f/é2.png"];
        assert_eq!(sorted, paths(&expected));
    }

    /// The names that `--frames=-2-2 -o f/####.png` gives.
    #[test]
    fn negative_numbers_come_first() {
        for prefix in ["", "a_", "a-"] {
            let name = |number: &str| format!("f/{prefix}{number}.png");
            let all = ["-0010", "-0002", "-0001", "0000", "0001"].map(name).to_vec();
            let expected = all.iter().map(PathBuf::from).collect::<Vec<_>>();
            let named: Vec<PathBuf> = [3, 0, 4, 2, 1].map(|i| expected[i].clone()).into();
            assert_eq!(frame_files(&named, Path::new("x.gif")).unwrap(), expected);
            assert_eq!(missing_numbers(&expected).as_deref(), Some("-9 to -3"));
        }
        // A separator is not a minus sign.
        let separated = paths(&["f/a-1.png", "f/a-2.png", "f/a-4.png"]);
        assert_eq!(frame_files(&separated, Path::new("x.gif")).unwrap(), separated);
        assert_eq!(missing_numbers(&separated).as_deref(), Some("3"));
        let folder = tempfile::tempdir().unwrap();
        for name in ["-0001.png", "0000.png", "0001.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = frame_files(&[folder.path().to_path_buf()], Path::new("x.gif")).unwrap();
        assert_eq!(found.len(), 3);
        assert!(found[0].ends_with("-0001.png"));
    }

    #[test]
    fn missing_numbers_are_listed() {
        let missing = |names: &[&str]| missing_numbers(&paths(names));
        assert_eq!(missing(&["a_1.png", "a_2.png", "a_3.png"]), None);
        assert_eq!(missing(&["a_1.png", "a_2.png", "a_4.png", "a_9.png"]).as_deref(), Some("3, 5 to 8"));
        assert_eq!(missing(&["a_10.png", "a_20.png", "a_30.png"]), None, "every tenth");
        assert_eq!(missing(&["a_10.png", "a_20.png", "a_40.png"]).as_deref(), Some("30"));
        assert_eq!(missing(&["front.png", "back.png"]), None);
        assert_eq!(missing(&["a_1.png", "b_3.png", "b_4.png"]), None, "several sequences");
        assert_eq!(missing(&["a_1.png"]), None);
        assert_eq!(missing(&["a_99999999999999999999999.png", "a_2.png"]), None);
    }

    #[test]
    fn aov_previews_are_not_frames_of_their_images() {
        let of = |names: &[&str]| frame_files(&paths(names), Path::new("x.gif")).map(|all| all.len());
        for aov in ["depth", "vertex-normal", "cryptomatte-object"] {
            let preview = format!("f/a_1.{aov}.png");
            let text = of(&["f/a_1.webp", "f/a_2.webp", &preview]).unwrap_err().to_string();
            assert!(text.contains(&format!("{preview} is an AOV of f/a_1.webp")), "{text}");
        }
        // Previews alone are a sequence. So are names that only look like previews.
        assert_eq!(of(&["f/a_1.depth.png", "f/a_2.depth.png"]).unwrap(), 2);
        assert_eq!(of(&["f/a.png", "f/a.left.png", "g/a.depth.png"]).unwrap(), 3);
    }

    #[test]
    fn a_folder_must_have_one_sequence() {
        let folder = tempfile::tempdir().unwrap();
        let inside = |name: &str| folder.path().join(name);
        let of = |output: &str| frame_files(&[folder.path().to_path_buf()], &inside(output));
        assert!(of("x.gif").unwrap_err().to_string().contains("no .png"));
        for name in ["c_2.png", "c_1.PNG", "c_10.png", "notes.txt", "all.webp"] {
            std::fs::write(inside(name), "").unwrap();
        }
        // `.PNG` and `.png` are two sequences. The output is in none of them.
        let text = of("all.webp").unwrap_err().to_string();
        assert!(text.contains("2 sequences, such as c_#.PNG and c_#.png"), "{text}");
        std::fs::remove_file(inside("c_1.PNG")).unwrap();
        assert_eq!(of("all.webp").unwrap(), [inside("c_2.png"), inside("c_10.png")]);
        std::fs::write(inside("c_2.depth.png"), "").unwrap();
        assert!(of("all.webp").unwrap_err().to_string().contains("name the frames"));
    }
}
