//! The public scenes of `--scenes DIR`: finds those that exist and lists those that are missing.

use std::path::{Path, PathBuf};

use crate::console::print_warning;
use crate::usage::UsageError;
use blinn_bench::Workload;
use blinn_bench::manifest::{Manifest, ManifestScene, find_scene_file, parse_manifest};

/// A larger manifest is not read.
const MAX_MANIFEST_BYTES: u64 = 1 << 20;
/// The file of a folder of scenes that adds scenes.
const MANIFEST_FILE: &str = "manifest.toml";

/// The scenes of the manifest.
#[derive(Debug)]
pub struct PublicScenes {
    folder: PathBuf,
    /// Those that exist, in the order of the manifest.
    pub workloads: Vec<Workload>,
    /// Those that do not exist. Of the built-in ones only if some exist, or the folder has no manifest of its own.
    missing: Vec<ManifestScene>,
    /// The number of scenes that were looked for.
    searched: usize,
}

impl PublicScenes {
    /// Looks for the scenes below `folder`.
    pub fn find(folder: &Path) -> Result<PublicScenes, UsageError> {
        let error = |message: String| UsageError(format!("--scenes: {}: {message}", folder.display()));
        if !folder.is_dir() {
            return Err(error("this is not a folder".into()));
        }
        let mut manifest = Manifest::built_in().map_err(|e| error(e.to_string()))?;
        let own = read_manifest(folder).map_err(error)?;
        let own = own.as_deref().map(parse_manifest).transpose();
        let own = own.map_err(|e| error(format!("{MANIFEST_FILE}: {e}")))?;
        let has_own = own.is_some();
        let own = own.unwrap_or_default();
        let own_names: Vec<String> = own.scenes.iter().map(|scene| scene.name.clone()).collect();
        manifest.extend(own);
        let searched = manifest.scenes.len();
        let mut public =
            PublicScenes { folder: folder.into(), workloads: Vec::new(), missing: Vec::new(), searched };
        let mut has_built_in = false;
        for scene in manifest.scenes {
            let is_own = own_names.contains(&scene.name);
            match find_scene_file(folder, &scene) {
                Some(file) => {
                    has_built_in |= !is_own;
                    public.workloads.push(Workload::public(scene, &file));
                }
                None => public.missing.push(scene),
            }
        }
        if has_own && !has_built_in {
            public.missing.retain(|scene| own_names.contains(&scene.name));
        }
        Ok(public)
    }

    /// Keeps only the scene of that name, if there is one.
    pub fn with_only(mut self, name: Option<&str>) -> PublicScenes {
        if let Some(name) = name {
            self.workloads.retain(|workload| workload.name == name);
        }
        self
    }

    /// Prints the scenes that are missing, with their files and sources.
    pub fn list_missing(&self, quiet: bool) {
        for scene in self.missing.iter().filter(|_| !quiet) {
            let ManifestScene { name, files, licence, source, .. } = scene;
            let source = source.as_ref().map(|source| format!(" from {source}")).unwrap_or_default();
            let licence =
                licence.as_ref().map(|licence| format!(" (licence: {licence})")).unwrap_or_default();
            print_warning(&format!("missing: {name}: {}{source}{licence}", files.join(" or ")));
        }
    }

    /// The message where no scene exists.
    pub fn none_found(&self, quiet: bool) -> String {
        let advice = if quiet {
            "run without --quiet to list them with their sources"
        } else {
            "download one, add yours to DIR/manifest.toml, or name files: blinn bench FILE..."
        };
        format!(
            "--scenes: {}: none of the {} scenes is there; {advice}",
            self.folder.display(),
            self.searched
        )
    }
}

/// The text of the folder's own manifest, if it has one.
fn read_manifest(folder: &Path) -> Result<Option<String>, String> {
    let file = folder.join(MANIFEST_FILE);
    if !file.is_file() {
        return Ok(None);
    }
    let error = |e: std::io::Error| format!("{MANIFEST_FILE}: {e}");
    let length = std::fs::metadata(&file).map_err(error)?.len();
    if length > MAX_MANIFEST_BYTES {
        return Err(format!("{MANIFEST_FILE}: {length} bytes are too many for a manifest"));
    }
    std::fs::read_to_string(&file).map(Some).map_err(error)
}

/// Lines about files that are not those of the manifest.
pub fn changed_files(workloads: &[Workload]) -> Vec<String> {
    let line = |workload: &Workload| {
        let (expected, found) = (workload.expected_sha256.as_ref()?, workload.sha256.as_ref()?);
        let name = &workload.name;
        let text = format!(
            "{name}: the file differs from that of the manifest (SHA-256 {found} instead of {expected})"
        );
        (expected != found).then_some(text)
    };
    workloads.iter().filter_map(line).collect()
}
