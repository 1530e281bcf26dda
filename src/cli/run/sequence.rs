//! Frames as files: which they are, in which order, and which are missing.

use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap};
use std::ffi::OsStr;
use std::path::{Display, Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::cli::args::values::Layers;
use crate::output::canonical_path;

/// Endings of files that frames are read from.
const ENDINGS: [&str; 4] = ["png", "jpg", "jpeg", "webp"];

/// The frames that were named, those of folders among them, in the order of their numbers; never `output`.
///
/// # Errors
/// A folder that cannot be read, that has no frames, or more than one series of them; pictures beside previews
/// of their own layers.
pub(crate) fn frames(named: &[PathBuf], output: &Path) -> Result<Vec<PathBuf>> {
    // What was made of frames before is none.
    let output = canonical_path(output);
    let is_output = |path: &Path| canonical_path(path) == output;
    let mut all = Vec::new();
    for path in named {
        if path.is_dir() {
            all.extend(of_folder(path, is_output)?);
        } else if !is_output(path) {
            all.push(path.clone());
        }
    }
    if let Some((picture, layer)) = beside_layer(&all) {
        bail!("{picture} and its layer {layer} are no series: name the frames of one");
    }
    all.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(all)
}

/// A picture and a preview of one of its layers, which lies beside it under its name.
fn beside_layer(frames: &[PathBuf]) -> Option<(Display<'_>, Display<'_>)> {
    let layers = Layers::all().names();
    let whole: HashMap<PathBuf, &PathBuf> = frames.iter().map(|f| (f.with_extension(""), f)).collect();
    frames.iter().find_map(|frame| {
        let name = frame.with_extension("");
        let layer = name.extension()?.to_str()?;
        let picture =
            layers.iter().any(|known| known == layer).then(|| whole.get(&name.with_extension("")))??;
        Some((picture.display(), frame.display()))
    })
}

fn of_folder(folder: &Path, is_output: impl Fn(&Path) -> bool) -> Result<Vec<PathBuf>> {
    let cannot = || format!("{} cannot be read", folder.display());
    let mut series: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        let path = entry.with_context(cannot)?.path();
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let image = ending.is_some_and(|e| ENDINGS.contains(&e.as_str()));
        if image && path.is_file() && !is_output(&path) {
            series.entry(pattern(&path)).or_default().push(path);
        }
    }
    let names: Vec<&String> = series.keys().collect();
    match names[..] {
        [] => bail!("{}: no .png, .jpg or .webp is in it", folder.display()),
        [_] => Ok(series.into_values().flatten().collect()),
        [first, second, ..] => {
            bail!(
                "{} holds {} series, {first} and {second} among them: name the frames of one",
                folder.display(),
                names.len()
            )
        }
    }
}

/// A file's name with `#` for its number.
fn pattern(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match number_in(path) {
        Some((range, _)) => format!("{}#{}", &name[..range.start], &name[range.end..]),
        None => name,
    }
}

/// The last digits of a name before its ending, and what they count.
fn number_in(path: &Path) -> Option<(std::ops::Range<usize>, i64)> {
    let stem = path.file_stem()?.to_string_lossy().into_owned();
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let digits = stem[..end].trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let begin = match stem[..digits].strip_suffix('-') {
        Some(before) if is_minus(before.chars().next_back()) => before.len(),
        _ => digits,
    };
    Some((begin..end, stem[begin..end].parse().ok()?))
}

/// Whether a dash between such a letter and digits is a number's sign: in `a-2` it only sets the number off.
fn is_minus(before: Option<char>) -> bool {
    before.is_none_or(|c| !c.is_alphanumeric())
}

/// Numbers that a sequence lacks, as text: those between its frames, where these go on by equal steps.
pub(crate) fn missing(frames: &[PathBuf]) -> Option<String> {
    let numbers: Vec<i64> = frames.iter().map(|f| number_in(f).map(|(_, n)| n)).collect::<Option<_>>()?;
    let alike = frames.windows(2).all(|two| pattern(&two[0]) == pattern(&two[1]));
    let step = numbers.windows(2).filter_map(|two| two[1].checked_sub(two[0])).filter(|&s| s > 0).min()?;
    if !alike {
        return None;
    }
    let gap = |two: &[i64]| match two[1].saturating_sub(two[0]) {
        apart if apart <= step => None,
        apart if apart == step.saturating_mul(2) => Some(format!("{}", two[0] + step)),
        _ => Some(format!("{} to {}", two[0] + step, two[1] - step)),
    };
    let gaps: Vec<String> = numbers.windows(2).filter_map(gap).collect();
    (!gaps.is_empty()).then(|| gaps.join(", "))
}

/// Texts by their parts, digits as numbers: `a9` comes before `a10`, and `-2` before `-1`.
fn natural(a: &str, b: &str) -> Ordering {
    let digits = |s: &str| s.len() - s.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (mut left, mut right) = (a, b);
    loop {
        // Up to here both are alike, but for leading zeros.
        let begins = is_minus(a[..a.len() - left.len()].chars().next_back());
        let below_zero = |s: &str| begins && s.strip_prefix('-').is_some_and(|rest| digits(rest) > 0);
        let below = below_zero(left) && below_zero(right);
        if below {
            (left, right) = (&left[1..], &right[1..]);
        }
        let (x, y) = (digits(left), digits(right));
        if x > 0 && y > 0 {
            let (m, n) = (left[..x].trim_start_matches('0'), right[..y].trim_start_matches('0'));
            match m.len().cmp(&n.len()).then(m.cmp(n)) {
                Ordering::Equal => (left, right) = (&left[x..], &right[y..]),
                other => return if below { other.reverse() } else { other },
            }
            continue;
        }
        let (mut l, mut r) = (left.chars(), right.chars());
        match (l.next(), r.next()) {
            (Some(c), Some(d)) if c == d => (left, right) = (l.as_str(), r.as_str()),
            // Equal but for leading zeros: any order will do, if it is one.
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
    fn numbers_count_as_numbers() {
        let named = paths(&["f/a10.png", "f/a9.png", "f/a010.png", "f/a1b2.png", "f/a1b11.png", "f/é2.png"]);
        let sorted = frames(&named, Path::new("x.gif")).unwrap();
        let expected = ["f/a1b2.png", "f/a1b11.png", "f/a9.png", "f/a010.png", "f/a10.png", "f/é2.png"];
        assert_eq!(sorted, paths(&expected));
    }

    /// As `--frames=-2-2 -o f/####.png` names them.
    #[test]
    fn numbers_below_zero_come_first() {
        for prefix in ["", "a_", "a-"] {
            let name = |number: &str| format!("f/{prefix}{number}.png");
            let all = ["-0010", "-0002", "-0001", "0000", "0001"].map(name).to_vec();
            let expected = all.iter().map(PathBuf::from).collect::<Vec<_>>();
            let named: Vec<PathBuf> = [3, 0, 4, 2, 1].map(|i| expected[i].clone()).into();
            assert_eq!(frames(&named, Path::new("x.gif")).unwrap(), expected);
            assert_eq!(missing(&expected).as_deref(), Some("-9 to -3"));
        }
        // What only sets a number off is no sign.
        let apart = paths(&["f/a-1.png", "f/a-2.png", "f/a-4.png"]);
        assert_eq!(frames(&apart, Path::new("x.gif")).unwrap(), apart);
        assert_eq!(missing(&apart).as_deref(), Some("3"));
        let folder = tempfile::tempdir().unwrap();
        for name in ["-0001.png", "0000.png", "0001.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = frames(&[folder.path().to_path_buf()], Path::new("x.gif")).unwrap();
        assert_eq!(found.len(), 3);
        assert!(found[0].ends_with("-0001.png"));
    }

    #[test]
    fn what_is_missing_is_named() {
        let lacks = |names: &[&str]| missing(&paths(names));
        assert_eq!(lacks(&["a_1.png", "a_2.png", "a_3.png"]), None);
        assert_eq!(lacks(&["a_1.png", "a_2.png", "a_4.png", "a_9.png"]).as_deref(), Some("3, 5 to 8"));
        assert_eq!(lacks(&["a_10.png", "a_20.png", "a_30.png"]), None, "every tenth");
        assert_eq!(lacks(&["a_10.png", "a_20.png", "a_40.png"]).as_deref(), Some("30"));
        assert_eq!(lacks(&["front.png", "back.png"]), None);
        assert_eq!(lacks(&["a_1.png", "b_3.png", "b_4.png"]), None, "not one series");
        assert_eq!(lacks(&["a_1.png"]), None);
        assert_eq!(lacks(&["a_99999999999999999999999.png", "a_2.png"]), None);
    }

    #[test]
    fn previews_of_layers_are_no_frames_of_their_pictures() {
        let of = |names: &[&str]| frames(&paths(names), Path::new("x.gif")).map(|all| all.len());
        for layer in ["depth", "vertex-normal", "cryptomatte-object"] {
            let preview = format!("f/a_1.{layer}.png");
            let text = of(&["f/a_1.webp", "f/a_2.webp", &preview]).unwrap_err().to_string();
            assert!(text.contains(&format!("f/a_1.webp and its layer {preview}")), "{text}");
        }
        // Those alone are a series, and so is what is only called alike.
        assert_eq!(of(&["f/a_1.depth.png", "f/a_2.depth.png"]).unwrap(), 2);
        assert_eq!(of(&["f/a.png", "f/a.left.png", "g/a.depth.png"]).unwrap(), 3);
    }

    #[test]
    fn a_folder_has_one_series() {
        let folder = tempfile::tempdir().unwrap();
        let inside = |name: &str| folder.path().join(name);
        let of = |output: &str| frames(&[folder.path().to_path_buf()], &inside(output));
        assert!(of("x.gif").unwrap_err().to_string().contains("no .png"));
        for name in ["c_2.png", "c_1.PNG", "c_10.png", "notes.txt", "all.webp"] {
            std::fs::write(inside(name), "").unwrap();
        }
        // `.PNG` and `.png` are two series; what is written is in none.
        let text = of("all.webp").unwrap_err().to_string();
        assert!(text.contains("2 series, c_#.PNG and c_#.png"), "{text}");
        std::fs::remove_file(inside("c_1.PNG")).unwrap();
        assert_eq!(of("all.webp").unwrap(), [inside("c_2.png"), inside("c_10.png")]);
        std::fs::write(inside("c_2.depth.png"), "").unwrap();
        assert!(of("all.webp").unwrap_err().to_string().contains("name the frames"));
    }
}
