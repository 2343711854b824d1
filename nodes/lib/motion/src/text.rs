//! Words and lines of a text file, with the line they stand on: what BVH, ASF, AMC and TRC have in
//! common.

use crate::MotionError;

/// The largest size of any number in a file: a million kilometres in the smallest unit, and far
/// more turns than any clip has.
pub(crate) const MAX_VALUE: f64 = 1e9;

/// The text of a file without the mark that some editors put before it.
pub(crate) fn without_byte_order_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// Reads words and lines one after the other.
pub(crate) struct Cursor<'a> {
    rest: &'a str,
    line: usize,
    name: &'a str,
}

/// A word or line and the 1-based line it stands on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token<'a> {
    pub text: &'a str,
    pub line: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(text: &'a str, name: &'a str) -> Self {
        Self {
            rest: text,
            line: 1,
            name,
        }
    }

    /// Bytes that are still to be read: bounds every allocation.
    pub fn remaining(&self) -> usize {
        self.rest.len()
    }

    /// The next word; a brace is a word of its own. `None` at the end.
    pub fn next_word(&mut self) -> Option<Token<'a>> {
        self.skip(|character| character.is_whitespace());
        let line = self.line;
        let mut characters = self.rest.char_indices();
        let (_, first) = characters.next()?;
        let end = if first == '{' || first == '}' {
            1
        } else {
            characters
                .find(|(_, character)| character.is_whitespace() || "{}".contains(*character))
                .map_or(self.rest.len(), |(at, _)| at)
        };
        Some(Token {
            text: self.take(end),
            line,
        })
    }

    /// The rest of the current line up to a brace, without spaces around it.
    pub fn rest_of_line(&mut self) -> Token<'a> {
        let line = self.line;
        let end = self
            .rest
            .find(['\n', '\r', '{', '}'])
            .unwrap_or(self.rest.len());
        Token {
            text: self.take(end).trim(),
            line,
        }
    }

    /// The next line that is not blank, without spaces around it. `None` at the end.
    pub fn next_line(&mut self) -> Option<Token<'a>> {
        self.skip(|character| character.is_whitespace());
        let line = self.line;
        let end = self.rest.find(['\n', '\r']).unwrap_or(self.rest.len());
        if self.rest.is_empty() {
            None
        } else {
            Some(Token {
                text: self.take(end).trim_end(),
                line,
            })
        }
    }

    /// The line that the last thing read ends on.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The next word, which must be `keyword` in any case.
    pub fn expect(&mut self, keyword: &str) -> Result<Token<'a>, MotionError> {
        match self.next_word() {
            Some(word) if word.text.eq_ignore_ascii_case(keyword) => Ok(word),
            other => Err(self.unexpected(keyword, other)),
        }
    }

    /// The next word as a finite number.
    pub fn number(&mut self, what: &str, column: usize) -> Result<f64, MotionError> {
        match self.next_word() {
            Some(word) if !"{}".contains(word.text) => self.parse_number(word, what, column),
            other => Err(self.unexpected(what, other)),
        }
    }

    /// `word` as a finite number below [`MAX_VALUE`] in size.
    pub fn parse_number(
        &self,
        word: Token<'_>,
        what: &str,
        column: usize,
    ) -> Result<f64, MotionError> {
        let number: f64 = word
            .text
            .parse()
            .map_err(|_| self.unexpected(what, Some(word)))?;
        if number.abs() < MAX_VALUE {
            return Ok(number);
        }
        Err(MotionError::Value {
            name: self.name.to_owned(),
            line: word.line,
            column,
            found: shortened(word.text),
            limit: MAX_VALUE,
        })
    }

    /// The error for `found` (the end of the file where `None`) in the place of `expected`.
    pub fn unexpected(&self, expected: &str, found: Option<Token<'_>>) -> MotionError {
        MotionError::Syntax {
            name: self.name.to_owned(),
            line: found.map_or(self.line, |token| token.line),
            expected: expected.to_owned(),
            found: found.map_or_else(
                || "the end of the file".to_owned(),
                |token| format!("\"{}\"", shortened(token.text)),
            ),
        }
    }

    pub fn name(&self) -> &'a str {
        self.name
    }

    fn skip(&mut self, unwanted: impl Fn(char) -> bool) {
        let end = self
            .rest
            .find(|character| !unwanted(character))
            .unwrap_or(self.rest.len());
        self.take(end);
    }

    fn take(&mut self, end: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(end);
        self.line += taken.bytes().filter(|&byte| byte == b'\n').count();
        self.rest = rest;
        taken
    }
}

/// A text cut to what fits on a line of an error, control characters made visible.
pub(crate) fn shortened(text: &str) -> String {
    let visible: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().nth(40).is_some() {
        format!("{visible}…")
    } else {
        visible
    }
}
