//! Ptex files: read and decoded once for all textures that share them.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Spanned;

use crate::compile::assets::read_file;
use crate::compile::textures::TextureBuilder;
use crate::ids::PtexId;
use crate::image::ptex::{Ptex, PtexFile};

/// Most bytes of texels that the Ptex files of a picture take together, as much as pbrt-v3 keeps of them at a time.
pub(super) const BYTES_MAX: u64 = 1 << 32;

/// What stands in for a file that cannot be read, as in pbrt-v3.
const INSTEAD: &str = "black is used";

impl TextureBuilder<'_> {
    /// A file of one or three channels; `None` if it is none, which is reported where it is named first.
    pub(super) fn ptex_file(
        &mut self,
        file: &Spanned<String>,
        diagnostics: &mut Diagnostics,
    ) -> Option<PtexId> {
        if let Some(known) = self.ptex_files.get(&file.value) {
            return *known;
        }
        let read = self.read_ptex(file, diagnostics);
        let read = read.map(|ptex| {
            self.ptex_bytes_left = self.ptex_bytes_left.saturating_sub(ptex.n_bytes());
            self.textures.add_ptex(ptex)
        });
        self.ptex_files.insert(file.value.clone(), read);
        read
    }

    fn read_ptex(&self, file: &Spanned<String>, diagnostics: &mut Diagnostics) -> Option<Ptex> {
        let name = &file.value;
        let bytes = match read_file(file, self.assets) {
            Ok(bytes) => bytes,
            Err(missing) => {
                diagnostics.push(missing.with_label(INSTEAD));
                return None;
            }
        };
        let mut fail = |code: &'static str, message: String| {
            diagnostics.push(Diagnostic::error(code, file.span, message).with_label(INSTEAD));
        };
        let room = self.ptex_bytes_left.min(self.assets.memory_left());
        let decoded = Ptex::decode((*bytes).as_ref(), room);
        let PtexFile {
            ptex,
            dropped_levels,
            bad_samples,
        } = match decoded {
            Ok(decoded) => decoded,
            Err(error) => {
                fail("bad-ptex", format!("cannot decode \"{name}\": {error}"));
                return None;
            }
        };
        let channels = ptex.channels();
        if !matches!(channels, 1 | 3) {
            let message =
                format!("\"{name}\" has {channels} channels: only one and three can be shown");
            fail("unsupported", message);
            return None;
        }
        let mut warn = |code: &'static str, message: String| {
            diagnostics.push(Diagnostic::warning(code, file.span, message));
        };
        if dropped_levels > 0 {
            let times = 1u32 << dropped_levels;
            let message = format!(
                "there is no room for \"{name}\": it is shown at 1/{times} of its resolution"
            );
            warn("large-ptex", message);
        }
        if bad_samples > 0 {
            let message = format!(
                "\"{name}\" holds {bad_samples} values that are infinite or not numbers: they are set to 0"
            );
            warn("bad-texels", message);
        }
        Some(ptex)
    }
}
