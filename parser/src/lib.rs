//! Parser for pbrt-v3 scene files: bytes in, directives with spans and located diagnostics out.
//!
//! It never panics, never prints and touches no file system: includes are asked for through a [`Loader`].
//!
//! ```
//! use tyndall_parser::diagnostic::Style;
//! use tyndall_parser::directive::Directive;
//! use tyndall_parser::params::ParamClass;
//! use tyndall_parser::{NoIncludes, Sources, parse, print};
//!
//! let mut sources = Sources::new();
//! let ball = sources.add_text("ball.pbrt", r#"
//!     WorldBegin
//!     Shape "sphere" "float radius" 2 "flaot zmin" -1
//!     WorldEnd
//! "#);
//! let (scene, found) = parse(&mut sources, ball, &NoIncludes);
//!
//! let Directive::Shape(sphere) = &scene.directives[1].value else { panic!("a shape was written") };
//! assert_eq!(sphere.name.value, "sphere");
//! assert!(sphere.params.get("radius", ParamClass::Float).is_some());
//! assert_eq!(sources.place(sphere.name.span), "ball.pbrt:3:11");
//!
//! let text = found.render(&sources, Style::Plain);
//! assert!(text.contains("ball.pbrt:3:37") && text.contains("did you mean \"float\"?"));
//! assert_eq!(print(&scene), "WorldBegin\n    Shape \"sphere\"\n        \"float radius\" [2]\nWorldEnd\n");
//! ```

pub mod diagnostic;
mod dialect;
pub mod directive;
mod grammar;
pub mod include;
pub mod lexer;
pub mod numbers;
pub mod params;
pub mod print;
mod report;
pub mod schema;
pub mod source;

pub use crate::diagnostic::{Diagnostic, Diagnostics, Severity};
pub use crate::directive::{Directive, SceneFile};
pub use crate::grammar::{parse, parse_all, parse_each};
pub use crate::include::{LoadError, Loaded, Loader, NoIncludes};
pub use crate::print::print;
pub use crate::source::{FileId, SourceBytes, Sources, Span, Spanned};
