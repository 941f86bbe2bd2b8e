//! The lexer: bytes to tokens, nothing copied. Knows no files and no directives.
//!
//! Token rules of pbrt-v3 (`Tokenizer::Next` in `core/parser.cpp`): white space is space, TAB, LF and CR; brackets are
//! tokens of their own; a string runs from quote to quote within one line; a comment starts with `#` at the *start* of
//! a token only; anything else up to white space, a quote or a bracket is a word.

use nom::bytes::complete::{tag, take, take_till1, take_while};
use nom::combinator::{map, value};
use nom::{IResult, Parser};

use memchr::{memchr, memchr2, memchr3};

use crate::numbers::{is_delimiter, is_space};

/// One token of the text it was read from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Token<'src> {
    /// `[`
    Open,
    /// `]`
    Close,
    /// A quoted string, its two quotes and its escapes included.
    Quoted(&'src [u8]),
    /// A word or a number.
    Word(&'src [u8]),
    /// A string that meets the end of its line or file: from its quote to there.
    Unterminated(&'src [u8]),
}

impl<'src> Token<'src> {
    /// The bytes it was read from.
    pub fn text(&self) -> &'src [u8] {
        match self {
            Self::Open => b"[",
            Self::Close => b"]",
            Self::Quoted(text) | Self::Word(text) | Self::Unterminated(text) => text,
        }
    }
}

/// Skips white space and comments.
#[inline]
pub fn trivia(text: &[u8]) -> IResult<&[u8], (), ()> {
    let (mut text, _) = take_while(is_space)(text)?;
    while text.first() == Some(&b'#') {
        (text, _) = (comment, take_while(is_space)).parse(text)?;
    }
    Ok((text, ()))
}

/// Reads the next token; an error at the end of the text. Its first byte says what it is: alternatives that are tried one
/// after the other take a fifth longer over short directives.
#[inline]
pub fn token(text: &[u8]) -> IResult<&[u8], Token<'_>, ()> {
    let (text, _) = trivia(text)?;
    match text.first() {
        Some(b'[') => value(Token::Open, take(1usize)).parse(text),
        Some(b']') => value(Token::Close, take(1usize)).parse(text),
        Some(b'"') => quoted(text),
        _ => map(take_till1(is_delimiter), Token::Word).parse(text),
    }
}

/// `#` up to, not including, the line end.
fn comment(text: &[u8]) -> IResult<&[u8], &[u8], ()> {
    let (rest, _) = tag("#")(text)?;
    let length = memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
    Ok((&rest[length..], &text[..length + 1]))
}

/// A string, or what there is of one.
fn quoted(text: &[u8]) -> IResult<&[u8], Token<'_>, ()> {
    tag("\"")(text)?;
    let mut at = 1;
    loop {
        let Some(found) = memchr3(b'"', b'\\', b'\n', &text[at..]) else {
            return Ok((&text[text.len()..], Token::Unterminated(text)));
        };
        at += found;
        match text[at] {
            b'"' => return Ok((&text[at + 1..], Token::Quoted(&text[..at + 1]))),
            b'\n' => return Ok((&text[at..], Token::Unterminated(&text[..at]))),
            // The escaped byte, whatever it is, ends nothing; without one the text ends here.
            _ if at + 1 == text.len() => {
                return Ok((&text[text.len()..], Token::Unterminated(text)));
            }
            _ => at += 2,
        }
    }
}

/// Undoes the escapes between the quotes of a [`Token::Quoted`].
///
/// An escape that pbrt-v3 does not know is kept without its backslash, and its offset in `quoted` is handed to
/// `unknown`.
pub fn unescape(quoted: &[u8], mut unknown: impl FnMut(usize)) -> Vec<u8> {
    let inner = quoted.strip_prefix(b"\"").unwrap_or(quoted);
    let inner = inner.strip_suffix(b"\"").unwrap_or(inner);
    if memchr(b'\\', inner).is_none() {
        return inner.to_vec();
    }
    let mut plain = Vec::with_capacity(inner.len());
    let mut bytes = inner.iter().enumerate();
    while let Some((at, &byte)) = bytes.next() {
        if byte != b'\\' {
            plain.push(byte);
            continue;
        }
        plain.push(match bytes.next() {
            Some((_, b'b')) => 0x08,
            Some((_, b'f')) => 0x0c,
            Some((_, b'n')) => b'\n',
            Some((_, b'r')) => b'\r',
            Some((_, b't')) => b'\t',
            Some((_, &escaped @ (b'\\' | b'\'' | b'"'))) => escaped,
            Some((_, &other)) => {
                unknown(at + 1);
                other
            }
            // The lexer never ends a string behind a backslash.
            None => break,
        });
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::{Token, token, unescape};

    fn all(mut text: &[u8]) -> Vec<Token<'_>> {
        let mut tokens = Vec::new();
        while let Ok((rest, found)) = token(text) {
            tokens.push(found);
            text = rest;
        }
        tokens
    }

    #[test]
    fn separators_are_unnecessary_around_quotes_and_brackets() {
        let found = all(b"Shape\"sphere\"[1]\"float a\"2");
        let expected = [
            Token::Word(b"Shape"),
            Token::Quoted(b"\"sphere\""),
            Token::Open,
            Token::Word(b"1"),
            Token::Close,
            Token::Quoted(b"\"float a\""),
            Token::Word(b"2"),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_comment_starts_only_where_a_token_would() {
        assert_eq!(
            all(b"3e-1#x # y ] \"\r1"),
            [Token::Word(b"3e-1#x"), Token::Word(b"1")]
        );
        assert_eq!(all(b"#only"), []);
        assert_eq!(all(b"\"#a\"#b"), [Token::Quoted(b"\"#a\"")]);
    }

    #[test]
    fn form_feed_and_vertical_tab_are_no_white_space() {
        assert_eq!(all(b"a\x0cb\x0bc"), [Token::Word(b"a\x0cb\x0bc")]);
    }

    #[test]
    fn strings_end_with_their_line() {
        assert_eq!(
            all(b"\"ab\n1"),
            [Token::Unterminated(b"\"ab"), Token::Word(b"1")]
        );
        assert_eq!(all(b"\"ab\\"), [Token::Unterminated(b"\"ab\\")]);
        assert_eq!(all(b"\"a\\\"b\""), [Token::Quoted(b"\"a\\\"b\"")]);
        assert_eq!(all(b"\""), [Token::Unterminated(b"\"")]);
    }

    #[test]
    fn every_escape_of_the_format_is_undone() {
        let known = unescape(b"\"\\b\\t\\f\\\\\\n\\'\\r\\\"x\"", |_| {
            panic!("all are known")
        });
        assert_eq!(known, b"\x08\t\x0c\\\n'\r\"x");
        let mut at = Vec::new();
        assert_eq!(unescape(b"\"a\\qb\"", |offset| at.push(offset)), b"aqb");
        assert_eq!(at, [2]);
    }
}
