//! Files that are written: checked before the work starts, complete or absent afterwards.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::files::{Bounds, Inputs, reason};
use crate::image::codec::{Attribute, ImageFile, Precision, encode};
use crate::image::{Image, PixelRect};

/// Where a file will be written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Place {
    /// As the user calls it.
    name: PathBuf,
    /// Without symbolic links: replacing a link by a file is not what its owner wants.
    target: PathBuf,
    bounds: Bounds,
}

impl Place {
    /// Makes sure that a file can be written there, short of a disk that fills up meanwhile.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn new(name: &Path) -> Result<Self, String> {
        Self::within(name, &Bounds::default())
    }

    /// The same within bounds.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn within(name: &Path, bounds: &Bounds) -> Result<Self, String> {
        let place = Self {
            name: name.to_owned(),
            target: bounds.admit(name).map_err(|why| refusal(name, &why))?,
            bounds: bounds.clone(),
        };
        let refusal = |why: String| Err(place.refusal(&why));
        let directory = place.directory();
        if place.target.is_dir() {
            return refusal("it is a directory".to_owned());
        }
        if !directory.is_dir() {
            return refusal(format!("there is no directory \"{}\"", directory.display()));
        }
        if place.is_replaced() {
            if let Some(why) = place.protection() {
                return refusal(why);
            }
            if let Err(error) = place.temporary() {
                return refusal(reason(&error));
            }
        }
        Ok(place)
    }

    /// As the user calls it.
    pub(super) fn name(&self) -> &Path {
        &self.name
    }

    /// The place beside this one for what is not finished: `out.partial.exr` for `out.exr`.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn partial(&self) -> Result<Self, String> {
        // Beside what the links lead to: the place of a link need not be writable.
        let is_link = fs::read_link(&self.name).is_ok();
        let whole = if is_link { &self.target } else { &self.name };
        let mut name = whole.file_stem().unwrap_or_default().to_owned();
        name.push(".partial");
        if let Some(extension) = self.name.extension() {
            name.push(".");
            name.push(extension);
        }
        Self::within(&whole.with_file_name(name), &self.bounds)
    }

    /// Makes sure that the file is none of those that were read.
    ///
    /// # Errors
    /// One sentence that names both.
    pub(super) fn spare(&self, inputs: &Inputs) -> Result<(), String> {
        match inputs.find(&self.target) {
            Some(input) => {
                let why = format!("it is read as \"{}\"", input.display());
                Err(self.refusal(&why))
            }
            None => Ok(()),
        }
    }

    /// Writes the file: beside its place, then renamed, so that nobody ever sees a part of it.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn write(&self, bytes: &[u8]) -> Result<(), String> {
        let write = || {
            if !self.is_replaced() {
                return fs::write(&self.target, bytes);
            }
            let mut temporary = self.temporary()?;
            let file = temporary.file.as_file_mut();
            // Before there is anything in it that not everyone may read.
            if let Ok(old) = fs::metadata(&self.target) {
                take_after(file, &old)?;
            }
            file.write_all(bytes)?;
            // The name must not point at data that are not on the disk yet.
            file.sync_data()?;
            let renamed = temporary.file.persist(&self.target);
            renamed.map_err(|error| error.error)?;
            Ok(())
        };
        write().map_err(|error| self.refusal(&reason(&error)))
    }

    fn refusal(&self, why: &str) -> String {
        refusal(&self.name, why)
    }

    fn directory(&self) -> &Path {
        match self.target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        }
    }

    /// Whether this is a file or nothing yet; devices and pipes are written to instead of replaced.
    fn is_replaced(&self) -> bool {
        fs::metadata(&self.target).map_or(true, |metadata| metadata.is_file())
    }

    /// Why the file that is there must not be replaced. Renaming asks for the permissions of the directory only, and who
    /// may do anything is not asked for any.
    fn protection(&self) -> Option<String> {
        let metadata = fs::metadata(&self.target).ok()?;
        if metadata.permissions().readonly() {
            return Some("it is write-protected".to_owned());
        }
        let opened = fs::File::options().write(true).open(&self.target);
        opened.err().map(|error| reason(&error))
    }

    /// An empty file beside the place. It is removed unless it is renamed.
    fn temporary(&self) -> std::io::Result<Temporary> {
        let mut pending = None;
        let mut builder = tempfile::Builder::new();
        let file = builder
            .prefix(".tyndall-")
            .make_in(self.directory(), |path| {
                // Told before it is there, so that a signal at any moment finds it.
                pending = Some(Pending::new(path));
                new_file(path)
            })?;
        Ok(Temporary {
            file,
            _pending: pending,
        })
    }
}

/// One sentence: why a file cannot be written.
fn refusal(name: &Path, why: &str) -> String {
    format!("cannot write \"{}\": {why}", name.display())
}

/// A file in the making.
struct Temporary {
    file: tempfile::NamedTempFile,
    /// Dropped behind it.
    _pending: Option<Pending>,
}

/// Files in the making: to be removed should the program end before they are made.
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// One of them.
struct Pending(PathBuf);

fn pending() -> MutexGuard<'static, Vec<PathBuf>> {
    PENDING.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Pending {
    fn new(path: &Path) -> Self {
        pending().push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        pending().retain(|path| *path != self.0);
    }
}

/// Removes what is in the making. Nothing can be begun afterwards: the program must end.
pub(super) fn forsake() {
    let pending = pending();
    for path in &*pending {
        // It may have been renamed this moment.
        let _ = fs::remove_file(path);
    }
    std::mem::forget(pending);
}

/// A file with the permissions that the umask leaves of read and write for all.
fn new_file(path: &Path) -> std::io::Result<fs::File> {
    fs::File::options()
        .read(true)
        .write(true)
        .create_new(true)
        .open(path)
}

/// Gives a file the owner and the permissions of the one that it replaces.
#[cfg(unix)]
fn take_after(file: &fs::File, old: &fs::Metadata) -> std::io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};

    let new = file.metadata()?;
    if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
        // Only who may do anything can give files away; others replace them by their own, as ever.
        let _ = fchown(file, Some(old.uid()), Some(old.gid()));
    }
    file.set_permissions(old.permissions())
}

/// There is nothing to keep.
#[cfg(not(unix))]
fn take_after(_file: &fs::File, _old: &fs::Metadata) -> std::io::Result<()> {
    Ok(())
}

/// A picture in the making: everything of its file but the pixels.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Output {
    /// Where it goes.
    pub(super) place: Place,
    /// Width of EXR samples.
    pub(super) precision: Precision,
    /// The full frame.
    pub(super) frame: PixelRect,
    /// The part that is rendered.
    pub(super) crop: PixelRect,
    /// Facts for the header.
    pub(super) attributes: Vec<(String, Attribute)>,
}

impl Output {
    /// Makes sure that the format can hold a picture of this size, before hours are spent on its pixels.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.extension().is_empty() {
            let why = "its name has no extension; use exr, pfm, png or tga";
            return Err(self.place.refusal(why));
        }
        // A row and a column meet every limit that the picture does.
        for (width, height) in [(self.crop.width, 1), (1, self.crop.height)] {
            self.encode(Image::new(width, height, 3, vec![0.0; 3 * width * height]))?;
        }
        Ok(())
    }

    /// Writes the picture.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn write(&self, image: Image) -> Result<(), String> {
        self.place.write(&self.encode(Ok(image))?)
    }

    /// The same for a picture that is not finished.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn partial(self) -> Result<Self, String> {
        let place = self.place.partial()?;
        Ok(Self { place, ..self })
    }

    /// Whether the file keeps attributes and heeds the precision.
    pub(super) fn is_exr(&self) -> bool {
        self.extension().eq_ignore_ascii_case("exr")
    }

    fn encode(&self, image: Result<Image, crate::image::ImageError>) -> Result<Vec<u8>, String> {
        let encoded = image.and_then(|image| {
            let file = ImageFile {
                image,
                origin: (self.crop.x0, self.crop.y0),
                display_window: self.frame,
                attributes: self.attributes.clone(),
            };
            encode(&file, &self.extension(), self.precision)
        });
        encoded.map_err(|error| self.place.refusal(&error.to_string()))
    }

    fn extension(&self) -> String {
        let extension = self.place.name.extension().unwrap_or_default();
        extension.to_string_lossy().into_owned()
    }
}
