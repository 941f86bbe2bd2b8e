//! The file system: scenes, includes and the files that scenes name.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{LoadError, Loaded, Loader};

use crate::compile::Assets;

/// Where a relative path of a scene starts: the directory of the top-level file, or the working directory for
/// standard input.
fn resolve(path: &str, top_level: &str) -> PathBuf {
    let directory = Path::new(top_level).parent().unwrap_or(Path::new(""));
    directory.join(path)
}

fn read(path: &Path) -> Result<SourceBytes, String> {
    // Read, not mapped: a file that changes while it is mapped would be undefined behaviour.
    std::fs::read(path)
        .map(|bytes| Arc::new(bytes) as SourceBytes)
        .map_err(|e| e.to_string())
}

/// Reads included files.
pub(super) struct FileLoader;

impl Loader for FileLoader {
    fn load(&self, path: &str, top_level: &str) -> Result<Loaded, LoadError> {
        let path = resolve(path, top_level);
        let bytes = read(&path).map_err(LoadError::new)?;
        Ok(Loaded {
            name: path.display().to_string(),
            bytes,
        })
    }
}

/// Reads the files that parameters name.
pub(super) struct FileAssets<'a> {
    pub(super) sources: &'a Sources,
}

impl Assets for FileAssets<'_> {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        let top_level = self.sources.name(self.sources.top_level(path.span.file));
        read(&resolve(&path.value, top_level))
    }
}
