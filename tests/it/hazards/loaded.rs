//! What loading makes of scenes that are not all right.

use std::sync::Arc;

use tyndall::compile::{Assets, CompileOptions, Compiled, compile};
use tyndall::describe::describe;
use tyndall_parser::diagnostic::Severity;
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{NoIncludes, parse};

/// A finding about a scene.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) code: &'static str,
    pub(crate) message: String,
    pub(crate) is_error: bool,
    pub(crate) is_located: bool,
}

/// One file, whatever it is called.
struct OneFile<'a>(Option<&'a [u8]>);

impl Assets for OneFile<'_> {
    fn read(&self, _path: &Spanned<String>) -> Result<SourceBytes, String> {
        let bytes = self.0.ok_or("it is not there")?;
        Ok(Arc::new(bytes.to_vec()) as SourceBytes)
    }
}

/// The job of a scene, if any, and everything that was found.
pub(crate) fn load(scene: &str, file: Option<&[u8]>) -> (Option<Compiled>, Vec<Found>) {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", scene.as_bytes().to_vec());
    let (parsed, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (scene, more) = describe(parsed);
    findings.extend(more);
    let mut compiled = None;
    if let Some(frame) = scene.frames.into_iter().next() {
        let (job, more) = compile(frame, &CompileOptions::default(), &OneFile(file));
        findings.extend(more);
        compiled = job;
    }
    let found = findings.list.into_iter().map(|finding| Found {
        code: finding.code,
        is_error: finding.severity > Severity::Warning,
        is_located: finding.span.is_some(),
        message: finding.message,
    });
    (compiled, found.collect())
}

/// Asserts that loading reports `code` with a place, as an error or not, and returns the job.
#[track_caller]
pub(crate) fn load_with(
    scene: &str,
    file: Option<&[u8]>,
    code: &str,
    is_error: bool,
) -> Option<Compiled> {
    let (compiled, found) = load(scene, file);
    let told = found
        .iter()
        .any(|finding| finding.code == code && finding.is_error == is_error && finding.is_located);
    assert!(
        told,
        "no {code} (error: {is_error}) in {found:?} of\n{scene}"
    );
    compiled
}
