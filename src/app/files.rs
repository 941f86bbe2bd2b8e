//! The file system: scenes, includes and the files that scenes name; which of them were read, and where anything may be
//! read or written at all.

use std::collections::HashMap;
use std::fs::{self, File, Metadata};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{FileId, LoadError, Loaded, Loader};

use super::plan::Input;
use super::resources;
use crate::compile::Assets;

/// What diagnostics call standard input.
const STDIN: &str = "<stdin>";
/// Bytes of a scene file that is not parsed: places in it would not fit 32 bits.
const TOO_LONG: u64 = 1 << 32;

/// Symbolic links that are followed from one name, as systems do.
const MOST_LINKS: usize = 40;

/// Where files may be read and written.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Bounds {
    /// As typed, and where that is; `None` for everywhere.
    directory: Option<(PathBuf, PathBuf)>,
}

impl Bounds {
    /// Within a directory, if there is one.
    ///
    /// # Errors
    /// One sentence that names the directory.
    pub(super) fn new(directory: Option<&Path>) -> Result<Self, String> {
        let resolve = |directory: &Path| {
            let name = directory.display();
            let real = fs::canonicalize(directory)
                .map_err(|error| format!("cannot confine to \"{name}\": {}", reason(&error)))?;
            if !real.is_dir() {
                return Err(format!("cannot confine to \"{name}\": it is no directory"));
            }
            Ok((directory.to_owned(), real))
        };
        let directory = directory.map(resolve).transpose()?;
        Ok(Self { directory })
    }

    /// The directory, where it really is, if there is one.
    pub(super) fn directory(&self) -> Option<&Path> {
        self.directory.as_ref().map(|(_, real)| real.as_path())
    }

    /// Where a path leads to that may be read or written; says the same of what is outside whether it is there or not.
    ///
    /// # Errors
    /// The end of the sentence "cannot … : ".
    pub(super) fn admit(&self, path: &Path) -> Result<PathBuf, String> {
        let target = follow_links(path)?;
        let Some((name, real)) = &self.directory else {
            return Ok(target);
        };
        let outside = || format!("it is outside of \"{}\"", name.display());
        let mut place = Path::new(".").join(&target);
        let mut behind = Vec::new();
        // What is not there yet has a directory that is.
        let there = loop {
            match fs::canonicalize(&place) {
                Ok(there) => break there,
                Err(_) => behind.extend(place.file_name().map(ToOwned::to_owned)),
            }
            if !place.pop() {
                return Err(outside());
            }
        };
        if !there.starts_with(real) {
            return Err(outside());
        }
        Ok(behind
            .into_iter()
            .rev()
            .fold(there, |path, name| path.join(name)))
    }
}

/// Where a path leads, also if there is nothing yet.
///
/// # Errors
/// The end of the sentence "cannot … : ".
pub(super) fn follow_links(path: &Path) -> Result<PathBuf, String> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&path) else {
            return Ok(path);
        };
        path = match path.parent() {
            Some(directory) => directory.join(next),
            None => next,
        };
    }
    Err("its links lead in circles".to_owned())
}

/// What tells a file from all others, whatever it is called.
#[cfg(unix)]
fn identity(metadata: &Metadata, _path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;

    Some((metadata.dev(), metadata.ino()))
}

/// Links of either kind lead to different names elsewhere, too, but only symbolic ones can be told.
#[cfg(not(unix))]
fn identity(_metadata: &Metadata, path: &Path) -> Option<PathBuf> {
    fs::canonicalize(path).ok()
}

#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

/// The files that were read, by what they are: none of them may be written over.
#[derive(Clone, Debug, Default)]
pub(super) struct Inputs {
    names: Arc<Mutex<HashMap<Identity, PathBuf>>>,
}

impl Inputs {
    fn names(&self) -> MutexGuard<'_, HashMap<Identity, PathBuf>> {
        self.names.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Remembers a file that is read.
    pub(super) fn add(&self, path: &Path, metadata: &Metadata) {
        if let Some(identity) = identity(metadata, path) {
            self.names()
                .entry(identity)
                .or_insert_with(|| path.to_owned());
        }
    }

    /// The same of a file that is named and will be read, if it is there.
    pub(super) fn expect(&self, path: &Path) {
        if let Ok(metadata) = fs::metadata(path)
            && metadata.is_file()
        {
            self.add(path, &metadata);
        }
    }

    /// The name by which a file was read.
    pub(super) fn find(&self, path: &Path) -> Option<PathBuf> {
        let metadata = fs::metadata(path).ok()?;
        self.names().get(&identity(&metadata, path)?).cloned()
    }

    /// Makes sure that standard output is not added to a file that was read.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn spare_stdout(&self) -> Result<(), String> {
        let input = metadata_of_stdout().and_then(|metadata| {
            let identity = identity(&metadata, Path::new(""))?;
            self.names().get(&identity).cloned()
        });
        match input {
            Some(input) => Err(format!(
                "cannot write to standard output: it is read as \"{}\"",
                input.display()
            )),
            None => Ok(()),
        }
    }
}

/// Knows where the relative paths of each top-level file start.
#[derive(Default)]
pub(super) struct Files {
    /// From names as diagnostics show them: a path need not be text, its name is.
    directories: HashMap<String, PathBuf>,
    bounds: Bounds,
    inputs: Inputs,
    /// Bytes of memory that may be taken in all.
    max_memory: Option<u64>,
}

impl Files {
    /// Reads within `bounds`, where so much memory may be taken, and remembers what.
    pub(super) fn within(bounds: Bounds, inputs: Inputs, max_memory: Option<u64>) -> Self {
        Self {
            directories: HashMap::new(),
            bounds,
            inputs,
            max_memory,
        }
    }

    /// Reads a scene file. What the parser would refuse for its length is not read.
    fn read_scene(&self, path: &Path) -> Result<SourceBytes, String> {
        let room = room_for(&Vec::new(), self.max_memory);
        let (most, why) = if room < TOO_LONG {
            (room, TOO_LITTLE_MEMORY)
        } else {
            (TOO_LONG - 1, "a scene file may have 4 GiB")
        };
        Ok(Arc::new(self.read(path, Vec::new(), most, why)?))
    }

    /// Whether no memory is left to be taken.
    pub(super) fn is_exhausted(&self) -> bool {
        resources::memory_left(self.max_memory) == Some(0)
    }

    fn read(&self, path: &Path, buffer: Vec<u8>, most: u64, why: &str) -> Result<Vec<u8>, String> {
        let place = self.bounds.admit(path)?;
        let (bytes, metadata) = read_up_to(buffer, &place, most, why)?;
        self.inputs.add(path, &metadata);
        Ok(bytes)
    }

    /// Remembers a file that a scene names, if it is there: it will be read.
    pub(super) fn expect(&self, path: &str, top_level: &str) {
        self.inputs.expect(&self.resolve(path, top_level));
    }

    /// Reads a top-level file.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn open(&mut self, input: &Input, sources: &mut Sources) -> Result<FileId, String> {
        let (name, directory, bytes) = match input {
            Input::Stdin => {
                if let Some(metadata) = metadata_of_stdin() {
                    self.inputs.add(Path::new(STDIN), &metadata);
                }
                (
                    STDIN.to_owned(),
                    PathBuf::new(),
                    read_stdin(self.max_memory),
                )
            }
            Input::File(path) => {
                let directory = path.parent().map(Path::to_owned).unwrap_or_default();
                (path.display().to_string(), directory, self.read_scene(path))
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
            taken: AtomicU64::new(0),
        }
    }
}

impl Loader for Files {
    fn load(&self, path: &str, top_level: &str) -> Result<Loaded, LoadError> {
        let path = self.resolve(path, top_level);
        let bytes = self.read_scene(&path).map_err(LoadError::new)?;
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
    /// Bytes that were taken since it was last asked how many are left.
    taken: AtomicU64,
}

/// Bytes that are taken before it is asked again how many are left.
const WORTH_ASKING: u64 = 1 << 20;

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
        let buffer = buffer.unwrap_or_default();
        let room = room_for(&buffer, self.files.max_memory);
        Ok(Arc::new(Lent {
            bytes: self.files.read(&path, buffer, room, TOO_LITTLE_MEMORY)?,
            buffers: self.buffers.clone(),
        }))
    }

    fn memory_left(&self) -> u64 {
        resources::memory_left(self.files.max_memory).unwrap_or(u64::MAX)
    }

    fn takes(&self, n_bytes: u128) -> bool {
        let n_bytes = u64::try_from(n_bytes).unwrap_or(u64::MAX).min(WORTH_ASKING);
        let taken = self.taken.fetch_add(n_bytes, Ordering::Relaxed) + n_bytes;
        let is_due = taken >= WORTH_ASKING;
        // Where little is left, all are asked.
        if is_due && self.memory_left() > WORTH_ASKING {
            self.taken.store(0, Ordering::Relaxed);
        }
        is_due
    }
}

/// What standard input is if it is a file.
#[cfg(unix)]
fn metadata_of_stdin() -> Option<Metadata> {
    use std::os::fd::AsFd;

    metadata_of(io::stdin().as_fd().try_clone_to_owned())
}

/// The same of standard output.
#[cfg(unix)]
fn metadata_of_stdout() -> Option<Metadata> {
    use std::os::fd::AsFd;

    metadata_of(io::stdout().as_fd().try_clone_to_owned())
}

#[cfg(unix)]
fn metadata_of(stream: io::Result<std::os::fd::OwnedFd>) -> Option<Metadata> {
    let metadata = File::from(stream.ok()?).metadata().ok()?;
    metadata.is_file().then_some(metadata)
}

/// That is not known.
#[cfg(not(unix))]
fn metadata_of_stdin() -> Option<Metadata> {
    None
}

/// That is not known.
#[cfg(not(unix))]
fn metadata_of_stdout() -> Option<Metadata> {
    None
}

/// Reads standard input; of what never ends, as much as the parser or memory refuses.
fn read_stdin(max_memory: Option<u64>) -> Result<SourceBytes, String> {
    let mut bytes = Vec::new();
    let room = room_for(&bytes, max_memory);
    let mut input = io::stdin().lock().take(TOO_LONG.min(room));
    let n_read = input
        .read_to_end(&mut bytes)
        .map_err(|error| reason(&error))?;
    if n_read as u64 == room && room < TOO_LONG {
        let length = room >> 20;
        return Err(format!(
            "it does not end after {length} MiB: {TOO_LITTLE_MEMORY}"
        ));
    }
    Ok(Arc::new(bytes))
}

/// Whether two paths lead to one file, or will.
pub(super) fn are_one(a: &Path, b: &Path) -> bool {
    let inputs = Inputs::default();
    inputs.expect(a);
    let (there, behind) = (resolved(a), resolved(b));
    inputs.find(b).is_some() || there.is_some() && there == behind
}

/// Where a path leads. A file that is yet to be made has a directory already.
fn resolved(path: &Path) -> Option<PathBuf> {
    let path = follow_links(path).ok()?;
    if let Ok(file) = fs::canonicalize(&path) {
        return Some(file);
    }
    let directory = Path::new(".").join(path.parent()?);
    Some(fs::canonicalize(directory).ok()?.join(path.file_name()?))
}

const TOO_LITTLE_MEMORY: &str = "there is not so much memory";

/// Reads a file that a command line names. Devices and pipes, which may never end, are refused: what comes out of a pipe
/// is read from standard input. So is what has no room in memory, before it is read: holes in a file cost nothing, so
/// that any length can be claimed.
pub(super) fn read(path: &Path, bounds: &Bounds) -> Result<Vec<u8>, String> {
    let (buffer, place) = (Vec::new(), bounds.admit(path)?);
    let room = room_for(&buffer, None);
    let (bytes, _) = read_up_to(buffer, &place, room, TOO_LITTLE_MEMORY)?;
    Ok(bytes)
}

/// Bytes that can be read with the help of memory that is there already.
fn room_for(buffer: &Vec<u8>, max_memory: Option<u64>) -> u64 {
    let room = resources::memory_left(max_memory).unwrap_or(u64::MAX);
    room.saturating_add(buffer.capacity() as u64)
}

fn read_up_to(
    buffer: Vec<u8>,
    path: &Path,
    most: u64,
    why: &str,
) -> Result<(Vec<u8>, Metadata), String> {
    let refusal = |error: io::Error| reason(&error);
    let metadata = std::fs::metadata(path).map_err(refusal)?;
    if !metadata.is_file() {
        return Err("it is not a regular file".to_owned());
    }
    if is_of_the_system(path) {
        return Err("it is made by the system as it is read, and may never end".to_owned());
    }
    if metadata.len() > most {
        return Err(format!("it is {} MiB long: {why}", metadata.len() >> 20));
    }
    let file = open(path).map_err(refusal)?;
    let metadata = file.metadata().map_err(refusal)?;
    if !metadata.is_file() {
        return Err("it is not a regular file".to_owned());
    }
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
    Ok((bytes, metadata))
}

/// Opens a file. Should it have become a pipe meanwhile, nobody waits for its other end.
#[cfg(unix)]
fn open(path: &Path) -> io::Result<File> {
    use nix::fcntl::OFlag;
    use std::os::unix::fs::OpenOptionsExt;

    let mut options = File::options();
    options.read(true).custom_flags(OFlag::O_NONBLOCK.bits());
    options.open(path)
}

#[cfg(not(unix))]
fn open(path: &Path) -> io::Result<File> {
    File::open(path)
}

/// Whether a file is one of those that are no files, although they are called regular: reading `/proc/kmsg` waits for the
/// next message.
#[cfg(target_os = "linux")]
fn is_of_the_system(path: &Path) -> bool {
    use nix::sys::statfs::{
        BPF_FS_MAGIC, CGROUP_SUPER_MAGIC, CGROUP2_SUPER_MAGIC, DEBUGFS_MAGIC, PROC_SUPER_MAGIC,
        SECURITYFS_MAGIC, SELINUX_MAGIC, SYSFS_MAGIC, TRACEFS_MAGIC, statfs,
    };

    let systems = [
        PROC_SUPER_MAGIC,
        SYSFS_MAGIC,
        DEBUGFS_MAGIC,
        TRACEFS_MAGIC,
        SECURITYFS_MAGIC,
        SELINUX_MAGIC,
        CGROUP_SUPER_MAGIC,
        CGROUP2_SUPER_MAGIC,
        BPF_FS_MAGIC,
    ];
    statfs(path).is_ok_and(|system| systems.contains(&system.filesystem_type()))
}

/// Nothing is known of such files elsewhere.
#[cfg(not(target_os = "linux"))]
fn is_of_the_system(_path: &Path) -> bool {
    false
}

/// The system's words for an error, without its number.
pub(super) fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    match text.split_once(" (os error ") {
        Some((words, _)) => words.to_owned(),
        None => text,
    }
}
