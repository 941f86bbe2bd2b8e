//! The command line: the only room that reads arguments, opens files and prints.

mod files;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tyndall_parser::diagnostic::Style;
use tyndall_parser::source::{SourceBytes, Sources};

use crate::compile::{CompileOptions, compile};
use crate::describe::describe;
use crate::image::codec::{ImageFile, Precision, encode};
use crate::render::{Unwatched, render};

/// Runs the program.
pub fn run() -> ExitCode {
    let args: Vec<String> = std::env::args().collect();
    let mut sources = Sources::new();
    let bytes = std::fs::read(&args[1]).expect("scene");
    let root = sources.add(args[1].clone(), Arc::new(bytes) as SourceBytes);
    let t = std::time::Instant::now();
    let (file, d) = tyndall_parser::parse(&mut sources, root, &files::FileLoader);
    eprint!("{}", d.render(&sources, Style::Plain));
    let (scene, d) = describe(file);
    eprint!("{}", d.render(&sources, Style::Plain));
    for frame in scene.frames {
        let assets = files::FileAssets { sources: &sources };
        let options = CompileOptions {
            spp: args.get(3).map(|s| s.parse().unwrap()),
            ..Default::default()
        };
        let (compiled, d) = compile(frame, &options, &assets);
        eprint!("{}", d.render(&sources, Style::Plain));
        let Some(compiled) = compiled else {
            return ExitCode::FAILURE;
        };
        eprintln!("loaded {:?}", t.elapsed());
        let rendered = render(&compiled.job, &Unwatched, &AtomicBool::new(false));
        eprintln!("rendered {:?} {:?}", t.elapsed(), rendered.report);
        let crop = compiled.job.film.crop;
        let file = ImageFile {
            image: rendered.image,
            origin: (crop.x0, crop.y0),
            display_window: compiled.frame,
            attributes: vec![],
        };
        let out = args.get(2).cloned().unwrap_or(compiled.filename);
        let bytes =
            encode(&file, out.rsplit('.').next().unwrap(), Precision::Float).expect("encodes");
        std::fs::write(&out, bytes).expect("writes");
    }
    ExitCode::SUCCESS
}
