//! The file system: scenes, includes and the files that scenes name.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{FileId, LoadError, Loaded, Loader};

use super::plan::Input;
use super::resources;
use crate::compile::Assets;

/// What diagnostics call standard input.
const STDIN: &str = "<stdin>";
/// Bytes of a scene file that is not parsed: places in it would not fit 32 bits.
const TOO_LONG: u64 = 1 << 32;

/// Knows where the relative paths of each top-level file start.
#[derive(Default)]
pub(super) struct Files {
    /// From names as diagnostics show them: a path need not be text, its name is.
    directories: HashMap<String, PathBuf>,
    /// Bytes of memory that may be taken in all.
    max_memory: Option<u64>,
}

impl Files {
    /// None yet, where so much memory may be taken.
    pub(super) fn new(max_memory: Option<u64>) -> Self {
        Self {
            directories: HashMap::new(),
            max_memory,
        }
    }

    /// Reads a top-level file.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn open(&mut self, input: &Input, sources: &mut Sources) -> Result<FileId, String> {
        let (name, directory, bytes) = match input {
            Input::Stdin => (STDIN.to_owned(), PathBuf::new(), read_stdin()),
            Input::File(path) => {
                let directory = path.parent().map(Path::to_owned).unwrap_or_default();
                (path.display().to_string(), directory, read_scene(path))
            }
        };
        let bytes = bytes.map_err(|error| format!("cannot read \"{name}\": {error}"))?;
        self.directories.insert(name.clone(), directory);
        Ok(sources.add(name, bytes))
    }

    /// Where a path of a scene leads. Relative ones start at the directory of the top-level file, or at the working
    /// directory for standard input.
    fn resolve(&self, path: &str, top_level: &str) -> PathBuf {
        match self.directories.get(top_level) {
            Some(directory) => directory.join(path),
            None => PathBuf::from(path),
        }
    }

    /// The files that parameters name, for scene files in `sources`.
    pub(super) fn assets<'a>(&'a self, sources: &'a Sources) -> impl Assets + 'a {
        FileAssets {
            files: self,
            sources,
            buffers: Buffers::default(),
        }
    }
}

impl Loader for Files {
    fn load(&self, path: &str, top_level: &str) -> Result<Loaded, LoadError> {
        let path = self.resolve(path, top_level);
        let bytes = read_scene(&path).map_err(LoadError::new)?;
        Ok(Loaded {
            name: path.display().to_string(),
            bytes,
        })
    }
}

struct FileAssets<'a> {
    files: &'a Files,
    sources: &'a Sources,
    buffers: Buffers,
}

/// Memory of files that were read and done with, for the next ones: fresh memory from the system takes as long as
/// reading.
type Buffers = Arc<Mutex<Vec<Vec<u8>>>>;

/// A file in memory that is given back.
struct Lent {
    bytes: Vec<u8>,
    buffers: Buffers,
}

impl AsRef<[u8]> for Lent {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let bytes = std::mem::take(&mut self.bytes);
        // There is nothing to be repaired after a panic elsewhere.
        if let Ok(mut buffers) = self.buffers.lock() {
            buffers.push(bytes);
        }
    }
}

impl Assets for FileAssets<'_> {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        let top_level = self.sources.name(self.sources.top_level(path.span.file));
        let buffer = self
            .buffers
            .lock()
            .ok()
            .and_then(|mut buffers| buffers.pop());
        let path = self.files.resolve(&path.value, top_level);
        Ok(Arc::new(Lent {
            bytes: read_into(buffer.unwrap_or_default(), &path, self.files.max_memory)?,
            buffers: self.buffers.clone(),
        }))
    }

    fn memory_left(&self) -> u64 {
        resources::memory_left(self.files.max_memory).unwrap_or(u64::MAX)
    }
}

/// Reads standard input; of what never ends, as much as the parser refuses.
fn read_stdin() -> Result<SourceBytes, String> {
    let mut bytes = Vec::new();
    let mut input = io::stdin().lock().take(TOO_LONG);
    input
        .read_to_end(&mut bytes)
        .map_err(|error| reason(&error))?;
    Ok(Arc::new(bytes))
}

/// Whether two paths lead to one file, or will.
pub(super) fn are_one(a: &Path, b: &Path) -> bool {
    let (a, b) = (resolved(a), resolved(b));
    a.is_some() && a == b
}

/// Where a path leads. A file that is yet to be made has a directory already.
fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(file) = std::fs::canonicalize(path) {
        return Some(file);
    }
    let directory = Path::new(".").join(path.parent()?);
    Some(
        std::fs::canonicalize(directory)
            .ok()?
            .join(path.file_name()?),
    )
}

/// Reads a scene file. What the parser would refuse for its length is not read.
fn read_scene(path: &Path) -> Result<SourceBytes, String> {
    let bytes = read_up_to(
        Vec::new(),
        path,
        TOO_LONG - 1,
        "a scene file may have 4 GiB",
    )?;
    Ok(Arc::new(bytes))
}

/// Reads a file that a scene or a command line names. Devices and pipes, which may never end, are refused: what comes out
/// of a pipe is read from standard input. So is what has no room in memory, before it is read: holes in a file cost
/// nothing, so that any length can be claimed.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, String> {
    read_into(Vec::new(), path, None)
}

/// The same into memory that is there already, if it suffices.
fn read_into(buffer: Vec<u8>, path: &Path, max_memory: Option<u64>) -> Result<Vec<u8>, String> {
    let room = resources::memory_left(max_memory).unwrap_or(u64::MAX);
    let room = room.saturating_add(buffer.capacity() as u64);
    read_up_to(buffer, path, room, "there is not so much memory")
}

fn read_up_to(buffer: Vec<u8>, path: &Path, most: u64, why: &str) -> Result<Vec<u8>, String> {
    let refusal = |error: io::Error| reason(&error);
    let metadata = std::fs::metadata(path).map_err(refusal)?;
    if !metadata.is_file() {
        return Err("it is not a regular file".to_owned());
    }
    if metadata.len() > most {
        return Err(format!("it is {} MiB long: {why}", metadata.len() >> 20));
    }
    let file = File::open(path).map_err(refusal)?;
    // Read, not mapped: a file that changes while it is mapped would be undefined behaviour. A file may grow meanwhile,
    // and some tell no length.
    let length = usize::try_from(metadata.len()).unwrap_or(usize::MAX);
    let mut bytes = if length <= buffer.capacity() {
        buffer
    } else {
        // Not grown: what it held would be moved.
        drop(buffer);
        Vec::new()
    };
    bytes.clear();
    bytes
        .try_reserve_exact(length)
        .map_err(|_| refusal(io::ErrorKind::OutOfMemory.into()))?;
    let n_read = file.take(most).read_to_end(&mut bytes).map_err(refusal)?;
    if n_read as u64 == most && most > metadata.len() {
        return Err(format!("it does not end after {} MiB: {why}", most >> 20));
    }
    Ok(bytes)
}

/// The system's words for an error, without its number.
pub(super) fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    match text.split_once(" (os error ") {
        Some((words, _)) => words.to_owned(),
        None => text,
    }
}
