//! The grammar: tokens to directives. Knows no file system and no meaning of plugin names.
//!
//! Where pbrt-v3 stops at the first fault, this reports it as [`Severity::Fatal`](crate::diagnostic::Severity) and goes
//! on with the next directive keyword, so that one run shows all faults. The lexer is built from nom parsers; the
//! grammar is not, because its input is a stack of files whose tokens run on across file ends.

use crate::diagnostic::{Diagnostic, Diagnostics, Severity};
use crate::dialect::Dialect;
use crate::directive::{ActiveTransform, Directive, Plugin, SceneFile};
use crate::include::{Kind, Lexeme, Loader, TokenStream};
use crate::lexer;
use crate::numbers::{self, Literal, Number};
use crate::schema::nearest;
use crate::source::{FileId, Sources, Span, Spanned, excerpt};

mod parameters;

/// Reads what stands behind a keyword. `None` for an `Include`, which acts at once.
type Rule = fn(&mut Parser<'_>) -> Parsed<Option<Directive>>;

/// Every directive keyword of pbrt-v3 with its grammar.
const DIRECTIVES: [(&str, Rule); 37] = [
    ("Accelerator", |p| {
        p.plugin().map(Directive::Accelerator).map(Some)
    }),
    ("ActiveTransform", |p| p.active_transform().map(Some)),
    ("AreaLightSource", |p| {
        p.plugin().map(Directive::AreaLightSource).map(Some)
    }),
    ("AttributeBegin", |_| Ok(Some(Directive::AttributeBegin))),
    ("AttributeEnd", |_| Ok(Some(Directive::AttributeEnd))),
    ("Camera", |p| p.plugin().map(Directive::Camera).map(Some)),
    ("ConcatTransform", |p| {
        p.matrix().map(Directive::ConcatTransform).map(Some)
    }),
    ("CoordSysTransform", |p| {
        p.name().map(Directive::CoordSysTransform).map(Some)
    }),
    ("CoordinateSystem", |p| {
        p.name().map(Directive::CoordinateSystem).map(Some)
    }),
    ("Film", |p| p.plugin().map(Directive::Film).map(Some)),
    ("Identity", |_| Ok(Some(Directive::Identity))),
    ("Include", |p| p.include().map(|()| None)),
    ("Integrator", |p| {
        p.plugin().map(Directive::Integrator).map(Some)
    }),
    ("LightSource", |p| {
        p.plugin().map(Directive::LightSource).map(Some)
    }),
    ("LookAt", |p| p.look_at().map(Some)),
    ("MakeNamedMaterial", |p| {
        p.plugin().map(Directive::MakeNamedMaterial).map(Some)
    }),
    ("MakeNamedMedium", |p| {
        p.plugin().map(Directive::MakeNamedMedium).map(Some)
    }),
    ("Material", |p| {
        p.plugin().map(Directive::Material).map(Some)
    }),
    ("MediumInterface", |p| p.medium_interface().map(Some)),
    ("NamedMaterial", |p| {
        p.plugin().map(Directive::NamedMaterial).map(Some)
    }),
    ("ObjectBegin", |p| {
        p.name().map(Directive::ObjectBegin).map(Some)
    }),
    ("ObjectEnd", |_| Ok(Some(Directive::ObjectEnd))),
    ("ObjectInstance", |p| {
        p.name().map(Directive::ObjectInstance).map(Some)
    }),
    ("PixelFilter", |p| {
        p.plugin().map(Directive::PixelFilter).map(Some)
    }),
    ("ReverseOrientation", |_| {
        Ok(Some(Directive::ReverseOrientation))
    }),
    ("Rotate", |p| p.rotate().map(Some)),
    ("Sampler", |p| p.plugin().map(Directive::Sampler).map(Some)),
    ("Scale", |p| p.numbers().map(Directive::Scale).map(Some)),
    ("Shape", |p| p.plugin().map(Directive::Shape).map(Some)),
    ("Texture", |p| p.texture().map(Some)),
    ("Transform", |p| {
        p.matrix().map(Directive::Transform).map(Some)
    }),
    ("TransformBegin", |_| Ok(Some(Directive::TransformBegin))),
    ("TransformEnd", |_| Ok(Some(Directive::TransformEnd))),
    ("TransformTimes", |p| {
        p.numbers().map(Directive::TransformTimes).map(Some)
    }),
    ("Translate", |p| {
        p.numbers().map(Directive::Translate).map(Some)
    }),
    ("WorldBegin", |_| Ok(Some(Directive::WorldBegin))),
    ("WorldEnd", |_| Ok(Some(Directive::WorldEnd))),
];

/// For each capital letter, where the keywords that start with it stand in [`DIRECTIVES`]: every directive of a scene
/// is looked up.
const WITH_LETTER: [[usize; 2]; 26] = {
    let mut ranges = [[0; 2]; 26];
    let mut i = 0;
    while i < DIRECTIVES.len() {
        let range = &mut ranges[(DIRECTIVES[i].0.as_bytes()[0] - b'A') as usize];
        if range[1] == 0 {
            range[0] = i;
        }
        // A test sees to it that they are sorted.
        range[1] = i + 1;
        i += 1;
    }
    ranges
};

/// Every directive keyword.
fn keywords() -> impl Iterator<Item = &'static str> {
    DIRECTIVES.iter().map(|&(keyword, _)| keyword)
}

/// Parses one scene: a top-level file and whatever it includes.
///
/// Never fails, never panics, prints nothing and reads nothing but through `loader`; included files are added to
/// `sources`. A result with [`Severity::Fatal`](crate::diagnostic::Severity) findings holds what could be understood.
pub fn parse(sources: &mut Sources, root: FileId, loader: &dyn Loader) -> (SceneFile, Diagnostics) {
    parse_all(sources, &[root], loader)
}

/// Parses several top-level files as one scene: directives in order of the files.
///
/// As in pbrt-v3 each file has its own search directory (the loader is told its name), and no parameter list goes on
/// from one top-level file to the next.
pub fn parse_all(
    sources: &mut Sources,
    roots: &[FileId],
    loader: &dyn Loader,
) -> (SceneFile, Diagnostics) {
    let mut directives = Vec::new();
    let found = parse_each(sources, roots, loader, &mut |directive| {
        directives.push(directive);
    });
    (SceneFile { directives }, found)
}

/// The same, each directive handed to `take` when it is read: they need not all be in memory at once.
pub fn parse_each(
    sources: &mut Sources,
    roots: &[FileId],
    loader: &dyn Loader,
    take: &mut dyn FnMut(Spanned<Directive>),
) -> Diagnostics {
    let mut parser = Parser {
        tokens: TokenStream::new(sources, loader),
        take,
        dialect: Dialect::default(),
        is_behind_world: false,
    };
    for &root in roots {
        parser.tokens.open(root);
        parser.run();
        if parser.tokens.report.is_full() {
            break;
        }
    }
    // What follows from it is easier to understand behind it.
    let mut found = Diagnostics::new();
    found.extend(parser.dialect.finding());
    found.append(parser.tokens.report.finish());
    found
}

/// The fault is reported; what follows is no longer understood up to the next keyword.
struct Resync;

/// What a part of the grammar yields.
type Parsed<T> = Result<T, Resync>;

/// The state of one parse.
struct Parser<'a> {
    tokens: TokenStream<'a>,
    take: &'a mut dyn FnMut(Spanned<Directive>),
    dialect: Dialect,
    /// Whether the last directive was `WorldEnd`.
    is_behind_world: bool,
}

impl Parser<'_> {
    /// Parses all that is open.
    fn run(&mut self) {
        while let Some(lexeme) = self.tokens.next() {
            if self.tokens.report.is_full() {
                return;
            }
            if self.tokens.leave_if_no_scene(lexeme.span.file) {
                continue;
            }
            let parsed = match self.rule(lexeme) {
                Some(rule) => {
                    self.tokens.start_extent(lexeme.span);
                    rule(self)
                }
                None => match self.end_of_file(lexeme) {
                    Some(keyword) => {
                        self.tokens.start_extent(keyword);
                        Ok((!keyword.is_empty()).then_some(Directive::WorldEnd))
                    }
                    None => {
                        self.report_stray(lexeme);
                        Err(Resync)
                    }
                },
            };
            self.tokens.count(lexeme.span.file, parsed.is_ok());
            match parsed {
                Ok(Some(directive)) => {
                    self.dialect.see_directive(&directive);
                    self.is_behind_world = matches!(directive, Directive::WorldEnd);
                    let extent = self.tokens.extent();
                    (self.take)(Spanned::new(directive, extent));
                }
                Ok(None) => {}
                Err(Resync) => self.resync(),
            }
        }
    }

    /// Takes what old editors and file systems leave behind the last `WorldEnd`, NUL and Ctrl-Z, for the end of the
    /// file. Returns where that `WorldEnd` stands if it is part of the same word, and an empty place if it is not.
    fn end_of_file(&mut self, lexeme: Lexeme) -> Option<Span> {
        const MARKS: [u8; 2] = [0, 0x1a];
        let text = self.tokens.text(lexeme);
        let end = text.iter().position(|byte| MARKS.contains(byte))?;
        let is_end = match &text[..end] {
            b"" => self.is_behind_world,
            word => lexeme.kind == Kind::Word && word == b"WorldEnd",
        };
        let (keyword, marks) = {
            let at = lexeme.span.lo + end as u32;
            let keyword = Span {
                hi: at,
                ..lexeme.span
            };
            (keyword, keyword.end().to(lexeme.span))
        };
        let is_idle = |byte: &u8| MARKS.contains(byte) || numbers::is_space(*byte);
        if !is_end || !self.tokens.rest_of_file(marks.lo).iter().all(is_idle) {
            return None;
        }
        self.tokens.end_file();
        let message = "NUL or Ctrl-Z behind the last WorldEnd";
        self.report(
            Diagnostic::warning("end-of-file-mark", marks, message)
                .with_label("taken for the end of the file"),
        );
        Some(keyword)
    }

    /// Puts the tokens of another file before the next one.
    fn include(&mut self) -> Parsed<()> {
        let path = self.string("the path of a file in quotes")?;
        self.tokens.include(&path.value, self.tokens.extent());
        Ok(())
    }

    fn look_at(&mut self) -> Parsed<Directive> {
        Ok(Directive::LookAt {
            eye: self.numbers()?,
            target: self.numbers()?,
            up: self.numbers()?,
        })
    }

    fn rotate(&mut self) -> Parsed<Directive> {
        let [degrees] = self.numbers()?;
        Ok(Directive::Rotate {
            degrees,
            axis: self.numbers()?,
        })
    }

    fn medium_interface(&mut self) -> Parsed<Directive> {
        Ok(Directive::MediumInterface {
            inside: self.name()?,
            outside: self.optional_string(),
        })
    }

    fn texture(&mut self) -> Parsed<Directive> {
        let name = self.name()?;
        let value_type = self.string("the type of the texture's values in quotes")?;
        Ok(Directive::Texture {
            name,
            value_type,
            class: self.plugin()?,
        })
    }

    /// A quoted name and a parameter list.
    fn plugin(&mut self) -> Parsed<Plugin> {
        Ok(Plugin {
            name: self.name()?,
            params: self.params(),
        })
    }

    /// A name in quotes.
    fn name(&mut self) -> Parsed<Spanned<String>> {
        self.string("a name in quotes")
    }

    /// A quoted string; `what` completes "expected …".
    fn string(&mut self, what: &str) -> Parsed<Spanned<String>> {
        let lexeme = self.required(what)?;
        if lexeme.kind == Kind::Quoted {
            Ok(self.unquote(lexeme))
        } else {
            Err(self.unexpected(lexeme, what))
        }
    }

    /// A quoted string if one follows.
    fn optional_string(&mut self) -> Option<Spanned<String>> {
        let lexeme = self.tokens.next()?;
        if lexeme.kind == Kind::Quoted {
            return Some(self.unquote(lexeme));
        }
        self.tokens.push_back(lexeme);
        None
    }

    /// Plain numbers, no brackets.
    fn numbers<const N: usize>(&mut self) -> Parsed<[f64; N]> {
        let mut values = [0.0; N];
        let mut count = self.tokens.plain_numbers(&mut values);
        while count < N {
            let lexeme = self.required("a number")?;
            values[count] = self.number(lexeme)?.to_f64();
            count += 1;
            count += self.tokens.plain_numbers(&mut values[count..]);
        }
        Ok(values)
    }

    /// Sixteen numbers in brackets.
    fn matrix(&mut self) -> Parsed<[f64; 16]> {
        self.bracket(Kind::Open, "`[` and the sixteen numbers of a matrix")?;
        let matrix = self.numbers()?;
        self.bracket(Kind::Close, "`]` behind the sixteen numbers of a matrix")?;
        Ok(matrix)
    }

    fn bracket(&mut self, kind: Kind, what: &str) -> Parsed<()> {
        let lexeme = self.required(what)?;
        if lexeme.kind == kind {
            Ok(())
        } else {
            Err(self.unexpected(lexeme, what))
        }
    }

    fn active_transform(&mut self) -> Parsed<Directive> {
        const WHAT: &str = "`All`, `StartTime` or `EndTime`, without quotes";
        let lexeme = self.required(WHAT)?;
        match self.tokens.text(lexeme) {
            b"All" => Ok(Directive::ActiveTransform(ActiveTransform::All)),
            b"StartTime" => Ok(Directive::ActiveTransform(ActiveTransform::StartTime)),
            b"EndTime" => Ok(Directive::ActiveTransform(ActiveTransform::EndTime)),
            _ => Err(self.unexpected(lexeme, WHAT)),
        }
    }

    /// The number a word spells. Garbage behind it is ignored with a warning, as pbrt-v3 ignores it silently.
    fn number(&mut self, lexeme: Lexeme) -> Parsed<Number> {
        let text = self.tokens.text(lexeme);
        let word = (lexeme.kind == Kind::Word).then_some(text);
        let Some(Literal { number, used }) = word.and_then(numbers::literal) else {
            return Err(self.unexpected(lexeme, "a number"));
        };
        if used < text.len() {
            let garbage = Span {
                lo: lexeme.span.lo + used as u32,
                ..lexeme.span
            };
            let value = excerpt(&text[..used]);
            let message = format!("malformed number `{}`", excerpt(text));
            let label = format!("ignored: the number is read as {value}");
            self.report(
                Diagnostic::warning("malformed-number", garbage, message).with_label(label),
            );
        }
        Ok(number)
    }

    /// The next token, which must exist.
    fn required(&mut self, what: &str) -> Parsed<Lexeme> {
        self.tokens.next().ok_or_else(|| {
            let message = format!("expected {what}, found the end of the scene");
            self.report(Diagnostic::fatal(
                "unexpected-end",
                self.tokens.end(),
                message,
            ));
            Resync
        })
    }

    /// Reports a token that is not what should stand there, and gives it back: it may be the next keyword.
    fn unexpected(&mut self, lexeme: Lexeme, what: &str) -> Resync {
        if lexeme.kind != Kind::Unterminated {
            let message = format!("expected {what}, found `{}`", self.tokens.shown(lexeme));
            let fault = Diagnostic::fatal("unexpected-token", lexeme.span, message);
            let directive = self.tokens.extent_before();
            // What is missing is missing there; the fault itself may be lines away.
            let is_next = self.is_keyword(lexeme);
            self.report(if is_next {
                fault.with_note(directive, "this directive is not complete")
            } else {
                fault
            });
        }
        self.tokens.push_back(lexeme);
        Resync
    }

    /// Reports a token where a directive should start.
    fn report_stray(&mut self, lexeme: Lexeme) {
        let shown = self.tokens.shown(lexeme);
        let fault = match lexeme.kind {
            Kind::Unterminated => return,
            Kind::Word if numbers::literal(self.tokens.text(lexeme)).is_none() => {
                let is_of_other = self.dialect.see_word(self.tokens.text(lexeme), lexeme.span);
                let fault = Diagnostic::fatal(
                    "unknown-directive",
                    lexeme.span,
                    format!("unknown directive `{shown}`"),
                );
                let before_hash = shown.split('#').next().unwrap_or_default();
                if keywords().any(|keyword| keyword == before_hash) {
                    fault.with_help("a `#` inside a word starts no comment: put a space before it")
                } else if is_of_other {
                    fault
                } else if let Some(keyword) = nearest(&shown, keywords()) {
                    fault.with_help(format!("did you mean `{keyword}`?"))
                } else {
                    fault
                }
            }
            _ => {
                let message = format!("expected a directive, found `{shown}`");
                Diagnostic::fatal("unexpected-token", lexeme.span, message)
            }
        };
        self.report(fault);
    }

    /// Skips to the next directive keyword, or to what looks like a misspelt one.
    fn resync(&mut self) {
        while let Some(lexeme) = self.tokens.next() {
            let starts_alpha = || {
                self.tokens
                    .text(lexeme)
                    .first()
                    .is_some_and(u8::is_ascii_alphabetic)
            };
            let looks_like_one =
                lexeme.kind == Kind::Word && starts_alpha() && self.tokens.is_first_on_line(lexeme);
            if looks_like_one || self.is_keyword(lexeme) {
                self.tokens.push_back(lexeme);
                return;
            }
            // Long lists are passed over at full speed.
            self.tokens.numbers(|_| ());
        }
    }

    /// Whether a token is a directive keyword.
    fn is_keyword(&self, lexeme: Lexeme) -> bool {
        self.rule(lexeme).is_some()
    }

    /// The grammar of the directive that a token is the keyword of.
    fn rule(&self, lexeme: Lexeme) -> Option<Rule> {
        if lexeme.kind != Kind::Word {
            return None;
        }
        let text = self.tokens.text(lexeme);
        let letter = usize::from(text.first()?.wrapping_sub(b'A'));
        let [start, end] = *WITH_LETTER.get(letter)?;
        let found = DIRECTIVES[start..end]
            .iter()
            .find(|(keyword, _)| keyword.as_bytes() == text);
        found.map(|&(_, rule)| rule)
    }

    /// The text between the quotes, escapes undone.
    fn unquote(&mut self, lexeme: Lexeme) -> Spanned<String> {
        let mut unknown = Vec::new();
        let bytes = lexer::unescape(self.tokens.text(lexeme), |offset| {
            // One is enough: the findings are capped anyhow, and the memory must be.
            if unknown.is_empty() {
                unknown.push(offset);
            }
        });
        for offset in unknown {
            let lo = lexeme.span.lo + offset as u32;
            let span = Span {
                lo,
                hi: (lo + 2).min(lexeme.span.hi),
                ..lexeme.span
            };
            let message = format!(
                "unknown escape `{}`",
                excerpt(self.tokens.sources.text(span))
            );
            let help = r#"the escapes are \b \f \n \r \t \\ \' \"; a backslash in a path is written twice"#;
            self.report(Diagnostic::fatal("unknown-escape", span, message).with_help(help));
        }
        let value = String::from_utf8(bytes).unwrap_or_else(|error| {
            let message = "the string is not UTF-8";
            let label = "the bytes in question are replaced";
            self.report(Diagnostic::warning("not-utf8", lexeme.span, message).with_label(label));
            String::from_utf8_lossy(error.as_bytes()).into_owned()
        });
        Spanned::new(value, lexeme.span)
    }

    /// See [`Report::only_counts`](crate::report::Report::only_counts).
    fn only_counts(&mut self, severity: Severity, code: &'static str) -> bool {
        self.tokens.report.only_counts(severity, code)
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.tokens.report.push(diagnostic);
    }
}

#[cfg(test)]
mod tests {
    use super::{keywords, parse};
    use crate::include::NoIncludes;
    use crate::schema::DIRECTIVES;
    use crate::source::Sources;

    #[test]
    fn the_grammar_knows_the_keywords_of_the_schema() {
        let mut described: Vec<_> = DIRECTIVES.iter().map(|entry| entry.keyword).collect();
        described.sort_unstable();
        assert!(keywords().eq(described));
    }

    #[test]
    fn every_keyword_leads_to_its_own_directive() {
        for keyword in keywords().filter(|keyword| *keyword != "Include") {
            let numbers = match keyword {
                "Transform" | "ConcatTransform" => format!("[{}]", "1 ".repeat(16)),
                "Translate" | "Scale" => "1 2 3".into(),
                "Rotate" => "1 2 3 4".into(),
                "LookAt" => "1 2 3 4 5 6 7 8 9".into(),
                "TransformTimes" => "0 1".into(),
                "ActiveTransform" => "All".into(),
                "Texture" => r#""a" "float" "b""#.into(),
                _ if keyword.ends_with("Begin") && keyword != "ObjectBegin"
                    || keyword.ends_with("End") =>
                {
                    "".into()
                }
                "Identity" | "ReverseOrientation" => "".into(),
                _ => "\"a\"".into(),
            };
            let mut sources = Sources::new();
            let file = sources.add_text("a", format!("{keyword} {numbers}"));
            let (scene, found) = parse(&mut sources, file, &NoIncludes);
            assert!(found.is_empty(), "{keyword}: {found:?}");
            let keywords: Vec<_> = scene
                .directives
                .iter()
                .map(|directive| directive.value.keyword())
                .collect();
            assert_eq!(keywords, [keyword]);
        }
    }
}
