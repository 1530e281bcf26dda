//! Paths as a job names them: relative to the folder of the job's file, so that both can be moved together.

use std::path::{Component, Path, PathBuf, absolute};

use super::job_text::single_line_text;
use crate::usage::UsageError;

/// The folder that a job's paths are relative to.
#[derive(Clone, Debug)]
pub struct JobFolder(PathBuf);

/// A file or folder in a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobPath {
    /// Relative to the job's folder if it is inside, else absolute.
    pub path: String,
    pub is_inside: bool,
}

impl JobFolder {
    /// The folder of a job's file; the current folder for a job on standard output.
    pub fn of(job: Option<&Path>) -> Result<JobFolder, UsageError> {
        let folder = job.and_then(Path::parent).filter(|f| !f.as_os_str().is_empty());
        match absolute(folder.unwrap_or(Path::new("."))) {
            Ok(folder) => Ok(JobFolder(folder.components().collect())),
            Err(e) => Err(UsageError(format!("the current folder is unknown: {e}"))),
        }
    }

    /// The path in a job of `path`, which is relative to the current folder.
    ///
    /// # Errors
    /// Text that cannot be written in a job.
    pub fn job_path(&self, path: &Path) -> Result<JobPath, UsageError> {
        // The folder of a bare name is empty.
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        let absolute = absolute(path).map_err(|e| UsageError(format!("{}: {e}", path.display())))?;
        let inside = absolute.strip_prefix(&self.0).ok().filter(|rest| {
            // With links, `..` may lead anywhere.
            !rest.components().any(|c| matches!(c, Component::ParentDir))
        });
        let is_inside = inside.is_some();
        let text = match inside {
            Some(rest) if rest.as_os_str().is_empty() => ".".to_string(),
            Some(rest) => single_line_text("the name", rest.as_os_str())?,
            None => single_line_text("the name", absolute.as_os_str())?,
        };
        // A name that begins with a dash is not a flag.
        let path = if text.starts_with('-') { format!("./{text}") } else { text };
        Ok(JobPath { path, is_inside })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_relative_to_the_folder_of_the_job() {
        let here = std::env::current_dir().unwrap();
        let job_path = |job: Option<&str>, path: &Path| {
            JobFolder::of(job.map(Path::new)).unwrap().job_path(path).unwrap()
        };
        let inside = |path: &str| JobPath { path: path.into(), is_inside: true };
        assert_eq!(job_path(None, Path::new("a b/c.glb")), inside("a b/c.glb"));
        assert_eq!(job_path(Some("job.json"), Path::new("./c.glb")), inside("c.glb"));
        assert_eq!(job_path(Some("jobs/job.json"), Path::new("jobs/out")), inside("out"));
        assert_eq!(job_path(None, &here.join("c.glb")), inside("c.glb"));
        assert_eq!(job_path(None, Path::new("")), inside("."), "the current folder");
        assert_eq!(job_path(None, Path::new("-c.glb")), inside("./-c.glb"));
        for (job, path) in [("jobs/job.json", "c.glb"), ("job.json", "../c.glb"), ("job.json", "/x/c.glb")] {
            let found = job_path(Some(job), Path::new(path));
            assert!(!found.is_inside && Path::new(&found.path).is_absolute(), "{found:?}");
            assert_eq!(absolute(path).unwrap(), Path::new(&found.path));
        }
        let error = JobFolder::of(None).unwrap().job_path(Path::new("a\nb.glb")).unwrap_err();
        assert!(error.0.contains("line breaks"));
    }
}
