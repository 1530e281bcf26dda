//! Files as a job names them: wherever the job's own file is taken with all around it, they are found.

use std::path::{Component, Path, PathBuf, absolute};

use super::given::text;
use crate::cli::Usage;

/// The folder by which a job's paths are named.
#[derive(Clone, Debug)]
pub struct Base(PathBuf);

/// A file or folder, as a job names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Relative to the base where it lies in it, else absolute.
    pub path: String,
    /// Whether the base holds it.
    pub is_inside: bool,
}

impl Base {
    /// The folder of the job's file; the current one where it goes to standard output.
    pub fn of(job: Option<&Path>) -> Result<Base, Usage> {
        let folder = job.and_then(Path::parent).filter(|f| !f.as_os_str().is_empty());
        match absolute(folder.unwrap_or(Path::new("."))) {
            Ok(folder) => Ok(Base(folder.components().collect())),
            Err(e) => Err(Usage(format!("the current folder is not known: {e}"))),
        }
    }

    /// How a job names `path`, which is relative to the current folder.
    ///
    /// # Errors
    /// What no text of a job can hold.
    pub fn place(&self, path: &Path) -> Result<Place, Usage> {
        // The folder of a bare name.
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        let whole = absolute(path).map_err(|e| Usage(format!("{}: {e}", path.display())))?;
        let inside = whole.strip_prefix(&self.0).ok().filter(|rest| {
            // What leaves the base again may come back, or not: links decide.
            !rest.components().any(|c| matches!(c, Component::ParentDir))
        });
        let is_inside = inside.is_some();
        let path = match inside {
            Some(rest) if rest.as_os_str().is_empty() => ".".to_string(),
            Some(rest) => text("the name", rest.as_os_str())?,
            None => text("the name", whole.as_os_str())?,
        };
        // No flag.
        let path = if path.starts_with('-') { format!("./{path}") } else { path };
        Ok(Place { path, is_inside })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_named_by_the_jobs_folder() {
        let here = std::env::current_dir().unwrap();
        let place =
            |job: Option<&str>, path: &Path| Base::of(job.map(Path::new)).unwrap().place(path).unwrap();
        let inside = |path: &str| Place { path: path.into(), is_inside: true };
        assert_eq!(place(None, Path::new("a b/c.glb")), inside("a b/c.glb"));
        assert_eq!(place(Some("job.json"), Path::new("./c.glb")), inside("c.glb"));
        assert_eq!(place(Some("jobs/job.json"), Path::new("jobs/out")), inside("out"));
        assert_eq!(place(None, &here.join("c.glb")), inside("c.glb"));
        assert_eq!(place(None, Path::new("")), inside("."), "the current folder");
        assert_eq!(place(None, Path::new("-c.glb")), inside("./-c.glb"));
        for (job, path) in [("jobs/job.json", "c.glb"), ("job.json", "../c.glb"), ("job.json", "/x/c.glb")] {
            let found = place(Some(job), Path::new(path));
            assert!(!found.is_inside && Path::new(&found.path).is_absolute(), "{found:?}");
            assert_eq!(absolute(path).unwrap(), Path::new(&found.path));
        }
        assert!(Base::of(None).unwrap().place(Path::new("a\nb.glb")).unwrap_err().0.contains("line breaks"));
    }
}
