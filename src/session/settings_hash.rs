//! The hash of everything that an image depends on except its input files.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};
use twox_hash::XxHash3_128;

/// Suffix of the word of an image that was rendered with warnings as errors.
const STRICT_SUFFIX: &str = "+strict";

/// A hash of everything that an image depends on except the input files: the settings, the frame and the program's
/// version.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SettingsHash {
    hash: u128,
    strict: bool,
}

impl SettingsHash {
    /// Hashes `settings`, which must contain everything that affects the image, as CBOR with the names of fields and the
    /// bits of numbers.
    pub fn of(settings: &impl Serialize) -> SettingsHash {
        let mut writer = HashWriter(XxHash3_128::new());
        writer.0.write(env!("CARGO_PKG_VERSION").as_bytes());
        let written = ciborium::into_writer(settings, &mut writer);
        // Writing to a hash cannot fail; paths, which need not be text, are serialised as bytes.
        debug_assert!(written.is_ok(), "{written:?}");
        SettingsHash { hash: writer.0.finish_128(), strict: false }
    }

    /// Sets whether warnings are errors. An image that was rendered without warnings is current for everyone; one
    /// that may have had warnings is not current for a strict render.
    pub fn strict(self, strict: bool) -> SettingsHash {
        SettingsHash { strict, ..self }
    }

    /// The hash without the strictness.
    pub fn hash(self) -> u128 {
        self.hash
    }

    /// The word of a fingerprint.
    pub(crate) fn word(self) -> String {
        format!("{:032x}{}", self.hash, if self.strict { STRICT_SUFFIX } else { "" })
    }

    /// Returns true if an image whose fingerprint has this word is current.
    pub(crate) fn accepts(self, word: &str) -> bool {
        word == SettingsHash { strict: true, ..self }.word() || !self.strict && word == self.word()
    }
}

struct HashWriter(XxHash3_128);

impl Write for HashWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Serialises a path, which need not be text.
pub(crate) fn path<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    path.as_os_str().as_encoded_bytes().serialize(serializer)
}

/// Serialises the path of an option.
pub(crate) fn optional_path<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
    path.as_ref().map(|path| path.as_os_str().as_encoded_bytes()).serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{EnvironmentSource, Exposure, OcclusionSampling, Options};

    fn distinct(all: &[Options]) -> bool {
        let hashes: Vec<u128> = all.iter().map(|options| SettingsHash::of(options).hash()).collect();
        (1..hashes.len()).all(|i| !hashes[..i].contains(&hashes[i]))
    }

    /// Text forms of numbers merge some of these.
    #[test]
    fn numbers_count_with_all_their_bits() {
        let exposures = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.1, 0.1f64.next_up()];
        let with_exposure = |ev: f64| Options { exposure: Some(Exposure::Stops(ev)), ..Options::default() };
        let mut all: Vec<Options> = exposures.into_iter().map(with_exposure).collect();
        all.push(Options { exposure: Some(Exposure::Auto), ..Options::default() });
        all.push(Options::default());
        assert!(distinct(&all));
        let distances = [None, Some(f64::INFINITY), Some(f64::NAN), Some(1.0)];
        let with_distance = |distance: Option<f64>| Options {
            ao: Some(OcclusionSampling { samples: 4, distance }),
            ..Options::default()
        };
        assert!(distinct(&distances.map(with_distance)));
    }

    /// Settings behind a path count, too.
    #[cfg(unix)]
    #[test]
    fn paths_need_not_be_text() {
        use std::os::unix::ffi::OsStringExt;
        let path = |bytes: &[u8]| PathBuf::from(std::ffi::OsString::from_vec(bytes.to_vec()));
        let of = |bytes: &[u8], samples: u32| Options {
            blender: Some(path(bytes)),
            camera_file: Some(path(bytes)),
            environment: Some(EnvironmentSource::File(path(bytes))),
            samples,
            ..Options::default()
        };
        assert!(distinct(&[of(b"a\xff", 1), of(b"a\xfe", 1), of(b"a\xff", 2), Options::default()]));
    }

    /// Limits, cancellation and what watches the memory depend on the machine.
    #[test]
    fn what_decides_no_pixels_does_not_count() {
        let mut options = Options::default();
        options.load.limits.file_bytes = 1;
        options.load.cancel = blinn_core::cancellation::CancelToken::new();
        options.load.memory = blinn_import::MemoryWatch::new(|_| true);
        assert_eq!(SettingsHash::of(&options), SettingsHash::of(&Options::default()));
    }
}
