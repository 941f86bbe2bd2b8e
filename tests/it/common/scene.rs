//! From the text of a scene to a job.

use std::sync::Arc;

use tyndall::compile::{Assets, CompileOptions, Compiled, compile};
use tyndall::describe::describe;
use tyndall_parser::diagnostic::{Diagnostics, Style};
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{LoadError, Loaded, Loader, parse};

/// The files a scene may name, by name.
struct Files<R>(R);

impl<R: Fn(&str) -> Option<Vec<u8>>> Files<R> {
    fn bytes(&self, path: &str) -> Result<SourceBytes, String> {
        let bytes = (self.0)(path).ok_or_else(|| format!("{path} is not there"))?;
        Ok(Arc::new(bytes) as SourceBytes)
    }
}

impl<R: Fn(&str) -> Option<Vec<u8>>> Loader for Files<R> {
    fn load(&self, path: &str, _top_level: &str) -> Result<Loaded, LoadError> {
        let bytes = self.bytes(path).map_err(LoadError::new)?;
        Ok(Loaded {
            name: path.to_owned(),
            bytes,
        })
    }
}

impl<R: Fn(&str) -> Option<Vec<u8>> + Sync> Assets for Files<R> {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        self.bytes(&path.value)
    }
}

/// Compiles the one frame of a scene, whose files come from `read`. Panics on any finding: a scene of a test means
/// what it says.
#[track_caller]
pub(crate) fn compile_scene(
    text: impl Into<Vec<u8>>,
    options: &CompileOptions,
    read: impl Fn(&str) -> Option<Vec<u8>> + Sync,
) -> Compiled {
    let files = Files(read);
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text.into());
    let (file, mut findings) = parse(&mut sources, root, &files);
    let (scene, more) = describe(file);
    findings.extend(more);
    let mut frames = scene.frames.into_iter();
    let frame = frames.next();
    assert!(frames.next().is_none(), "a scene of a test is one frame");
    let (compiled, more) = match frame {
        Some(frame) => compile(frame, options, &files),
        None => (None, Diagnostics::default()),
    };
    findings.extend(more);
    // What pbrt-v3 would render differently, or an integrator leaves out, is told to users, and is what some tests
    // are about.
    let told = [
        "biased-in-pbrt",
        "bright-material",
        "ignored-scattering",
        "instanced-area-light",
        "negative-colour",
    ];
    findings
        .list
        .retain(|finding| !told.contains(&finding.code));
    assert!(
        findings.is_empty(),
        "{}",
        findings.render(&sources, Style::Plain)
    );
    compiled.expect("a scene without findings has a frame")
}
