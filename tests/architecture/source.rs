//! Rust source as tokens: enough of the language to find items, paths and the ends of functions.
//! A parser (`syn`) would have to be built with line numbers, a feature that every derive macro of
//! the workspace would then be built with again.

/// A word, a literal (its text is of no interest) or a symbol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Word,
    Literal,
    Symbol,
}

#[derive(Clone, Debug)]
pub struct Token {
    pub kind: Kind,
    pub text: String,
    /// From 1 on.
    pub line: usize,
}

impl Token {
    pub fn is(&self, text: &str) -> bool {
        self.kind != Kind::Literal && self.text == text
    }
}

/// Tokens without comments. Symbols are single characters, but for `::`, `->` and `=>`.
pub fn tokens(source: &str) -> Vec<Token> {
    let text: Vec<char> = source.chars().collect();
    let mut tokens = Vec::new();
    let (mut at, mut line) = (0, 1);
    while at < text.len() {
        let (end, kind) = next(&text, at);
        let content: String = text[at..end].iter().collect();
        let lines = content.matches('\n').count();
        if let Some(kind) = kind {
            let text = content.trim_start_matches("r#").to_owned();
            tokens.push(Token { kind, text, line });
        }
        line += lines;
        at = end;
    }
    tokens
}

/// Where the token that begins here ends; no kind for comments and blanks.
fn next(text: &[char], at: usize) -> (usize, Option<Kind>) {
    let ahead = |offset: usize| text.get(at + offset).copied().unwrap_or('\0');
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let while_from = |mut end: usize, test: &dyn Fn(char) -> bool| {
        while end < text.len() && test(text[end]) {
            end += 1;
        }
        end
    };
    match (text[at], ahead(1)) {
        (c, _) if c.is_whitespace() => (at + 1, None),
        ('/', '/') => (while_from(at, &|c| c != '\n'), None),
        ('/', '*') => (block_comment(text, at), None),
        ('"', _) => (string(text, at + 1), Some(Kind::Literal)),
        ('\'', '\\') => (while_from(at + 3, &|c| c != '\'') + 1, Some(Kind::Literal)),
        ('\'', _) if ahead(2) == '\'' => (at + 3, Some(Kind::Literal)),
        // A lifetime.
        ('\'', _) => (while_from(at + 1, &word), Some(Kind::Literal)),
        ('b', '\'') => (next(text, at + 1).0, Some(Kind::Literal)),
        ('b' | 'c', '"') => (string(text, at + 2), Some(Kind::Literal)),
        ('r', '"' | '#') | ('b' | 'c', 'r') => raw_string_or_word(text, at, &while_from),
        (c, _) if word(c) => {
            let kind = if c.is_numeric() {
                Kind::Literal
            } else {
                Kind::Word
            };
            (while_from(at, &word), Some(kind))
        }
        (':', ':') | ('-' | '=', '>') => (at + 2, Some(Kind::Symbol)),
        _ => (at + 1, Some(Kind::Symbol)),
    }
}

fn block_comment(text: &[char], begin: usize) -> usize {
    let (mut at, mut depth) = (begin, 0);
    while at + 1 < text.len() {
        match (text[at], text[at + 1]) {
            ('/', '*') => (depth, at) = (depth + 1, at + 2),
            ('*', '/') => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            return at;
        }
    }
    text.len()
}

/// Behind the closing quote of a string whose content begins here.
fn string(text: &[char], mut at: usize) -> usize {
    while at < text.len() && text[at] != '"' {
        at += if text[at] == '\\' { 2 } else { 1 };
    }
    at + 1
}

/// Where the characters from a place on stop to be of a kind.
type WhileFrom<'a> = &'a dyn Fn(usize, &dyn Fn(char) -> bool) -> usize;

/// `r"..."`, `br#"..."#`, or a word: `r#type`, `break`.
fn raw_string_or_word(
    text: &[char],
    at: usize,
    while_from: WhileFrom<'_>,
) -> (usize, Option<Kind>) {
    let hashes_begin = at + if text[at] == 'r' { 1 } else { 2 };
    let hashes_end = while_from(hashes_begin, &|c| c == '#');
    let hashes = hashes_end - hashes_begin;
    if text.get(hashes_end) != Some(&'"') {
        let begin = if hashes == 1 { hashes_end } else { at };
        return (
            while_from(begin, &|c| c.is_alphanumeric() || c == '_'),
            Some(Kind::Word),
        );
    }
    let mut end = hashes_end + 1;
    while end < text.len() {
        let closed = text[end] == '"' && text[end + 1..].iter().take(hashes).all(|c| *c == '#');
        end += 1;
        if closed {
            break;
        }
    }
    (end + hashes, Some(Kind::Literal))
}

/// The index behind the bracket that closes the one at `open`.
pub fn behind_bracket(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (index, token) in tokens.iter().enumerate().skip(open) {
        if token.kind == Kind::Symbol {
            match token.text.as_str() {
                "(" | "[" | "{" => depth += 1,
                ")" | "]" | "}" => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                return index + 1;
            }
        }
    }
    tokens.len()
}

/// The index behind an item that begins at `at` (behind its attributes): its `;`, or the bracket
/// that closes its body.
pub fn behind_item(tokens: &[Token], at: usize) -> usize {
    let first = tokens[at..]
        .iter()
        .enumerate()
        .find(|(_, token)| !matches!(token.text.as_str(), "pub" | "crate" | "(" | ")" | "in"))
        .map_or(at, |(offset, _)| at + offset);
    // Of these a bracket is not the end.
    let to_semicolon = matches!(
        tokens[first].text.as_str(),
        "use" | "let" | "type" | "static"
    ) || tokens[first].is("const")
        && tokens.get(first + 2).is_some_and(|token| token.is(":"));
    let mut index = at;
    while index < tokens.len() {
        let token = &tokens[index];
        if token.is(";") {
            return index + 1;
        }
        if token.is("(") || token.is("[") || token.is("{") {
            let body = token.is("{");
            index = behind_bracket(tokens, index);
            if body && !to_semicolon {
                return index;
            }
        } else {
            index += 1;
        }
    }
    index
}

/// Without items that only tests see: `#[cfg(test)]`, `#[test]`.
pub fn without_tests(tokens: Vec<Token>) -> Vec<Token> {
    let mut kept: Vec<Token> = Vec::with_capacity(tokens.len());
    let mut at = 0;
    while at < tokens.len() {
        let attribute = tokens[at].is("#") && tokens.get(at + 1).is_some_and(|t| t.is("["));
        if !attribute {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        // All attributes of the item.
        let (mut end, mut test) = (at, false);
        while tokens.get(end).is_some_and(|token| token.is("#")) {
            let behind = behind_bracket(&tokens, end + 1);
            let inside: String = tokens[end + 2..behind - 1]
                .iter()
                .map(|token| token.text.as_str())
                .collect();
            test |= inside == "test" || inside == "cfg(test)" || inside.starts_with("cfg(all(test");
            end = behind;
        }
        if test {
            end = behind_item(&tokens, end);
        } else {
            kept.extend_from_slice(&tokens[at..end]);
        }
        at = end;
    }
    kept
}

/// A function's name, its first line (without attributes and docs) and its number of lines.
#[derive(Debug)]
pub struct Function {
    pub name: String,
    pub line: usize,
    pub lines: usize,
}

/// Every function with a body.
pub fn functions(tokens: &[Token]) -> Vec<Function> {
    let mut found = Vec::new();
    for (index, token) in tokens.iter().enumerate() {
        let named = tokens.get(index + 1).filter(|t| t.kind == Kind::Word);
        let (true, Some(name)) = (token.is("fn"), named) else {
            continue;
        };
        let end = behind_item(tokens, index);
        if tokens[end - 1].is("}") {
            found.push(Function {
                name: name.text.clone(),
                line: token.line,
                lines: tokens[end - 1].line - token.line + 1,
            });
        }
    }
    found
}
