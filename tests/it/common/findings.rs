//! What loading a scene reports.

use tyndall::compile::{CompileOptions, NoAssets, compile};
use tyndall::describe::describe;
use tyndall_parser::source::Sources;
use tyndall_parser::{NoIncludes, parse};

/// Code and message of every finding about a scene that names no files.
pub(crate) fn findings(text: &str) -> Vec<(String, String)> {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text);
    let (file, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (scene, more) = describe(file);
    findings.extend(more);
    for frame in scene.frames {
        findings.extend(compile(frame, &CompileOptions::default(), &NoAssets).1);
    }
    findings
        .list
        .into_iter()
        .map(|finding| (finding.code.to_owned(), finding.message))
        .collect()
}
