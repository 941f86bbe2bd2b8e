//! Files that are written: checked before the work starts, complete or absent afterwards.

use std::fs::{self, Permissions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::files::reason;
use crate::image::codec::{Attribute, ImageFile, Precision, encode};
use crate::image::{Image, PixelRect};

/// Where a file will be written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Place {
    /// As the user calls it.
    name: PathBuf,
    /// Without symbolic links: replacing a link by a file is not what its owner wants.
    target: PathBuf,
}

impl Place {
    /// Makes sure that a file can be written there, short of a disk that fills up meanwhile.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub(super) fn new(name: &Path) -> Result<Self, String> {
        let place = Self {
            name: name.to_owned(),
            target: fs::canonicalize(name).unwrap_or_else(|_| name.to_owned()),
        };
        let refusal = |why: String| Err(place.refusal(&why));
        let directory = place.directory();
        if place.target.is_dir() {
            return refusal("it is a directory".to_owned());
        }
        if !directory.is_dir() {
            return refusal(format!("there is no directory \"{}\"", directory.display()));
        }
        if place.is_replaced()
            && let Err(error) = place.temporary()
        {
            return refusal(reason(&error));
        }
        Ok(place)
    }

    /// As the user calls it.
    pub(super) fn name(&self) -> &Path {
        &self.name
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
            let mut file = self.temporary()?;
            file.write_all(bytes)?;
            // The name must not point at data that are not on the disk yet.
            file.as_file().sync_data()?;
            file.persist(&self.target).map_err(|error| error.error)?;
            Ok(())
        };
        write().map_err(|error| self.refusal(&reason(&error)))
    }

    fn refusal(&self, why: &str) -> String {
        format!("cannot write \"{}\": {why}", self.name.display())
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

    /// An empty file beside the place. It is removed unless it is renamed.
    fn temporary(&self) -> std::io::Result<tempfile::NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".tyndall-");
        if let Some(permissions) = new_file_permissions() {
            builder.permissions(permissions);
        }
        builder.tempfile_in(self.directory())
    }
}

/// Those that the umask leaves of read and write for all, as for any new file; temporary files are private by default.
#[cfg(unix)]
fn new_file_permissions() -> Option<Permissions> {
    Some(std::os::unix::fs::PermissionsExt::from_mode(0o666))
}

#[cfg(not(unix))]
fn new_file_permissions() -> Option<Permissions> {
    None
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
