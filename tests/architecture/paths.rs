//! What stands in a module: its `use` declarations, its paths and its implementations.

use std::collections::BTreeSet;
use std::ops::Range;

use crate::source::{Kind, Token, behind_bracket, behind_item};

/// One name that a `use` declaration brings into a module.
#[derive(Clone, Debug)]
pub struct Import {
    pub path: Vec<String>,
    /// `None`: all names (`*`).
    pub name: Option<String>,
    /// `pub use` of any reach: it says where an item is to be had, and needs nothing itself.
    pub reexport: bool,
    pub line: usize,
}

/// `impl T` or `impl Trait for T`.
#[derive(Debug)]
pub struct Implementation {
    pub of_type: Vec<String>,
    /// Of an inherent implementation.
    pub methods: BTreeSet<String>,
    pub body: Range<usize>,
}

/// The index behind `pub`, `pub(crate)` and the like.
pub fn behind_visibility(item: &[Token]) -> usize {
    match item {
        [first, second, ..] if first.is("pub") && second.is("(") => behind_bracket(item, 1),
        [first, ..] if first.is("pub") => 1,
        _ => 0,
    }
}

/// Reads `impl<...> A for B where ... { ... }`, whose `impl` stands at `at`; `begin`: where the
/// item stands in its module.
pub fn implementation(item: &[Token], at: usize, begin: usize) -> Option<Implementation> {
    let open = item.iter().position(|token| token.is("{"))?;
    let mut header = &item[at + 1..open];
    if header.first().is_some_and(|token| token.is("<")) {
        let mut depth = 0;
        let end = header.iter().position(|token| {
            depth += i32::from(token.is("<")) - i32::from(token.is(">"));
            depth == 0
        })?;
        header = &header[end + 1..];
    }
    let end = header.iter().position(|token| token.is("where"));
    header = &header[..end.unwrap_or(header.len())];
    let of_trait = header.iter().position(|token| token.is("for"));
    let name = &header[of_trait.map_or(0, |at| at + 1)..];
    let words = name.iter().skip_while(|token| token.kind != Kind::Word);
    let mut of_type = Vec::new();
    for token in words {
        if token.kind == Kind::Word {
            of_type.push(token.text.clone());
        } else if !token.is("::") {
            break;
        }
    }
    let mut methods = BTreeSet::new();
    if of_trait.is_none() {
        let body = &item[open + 1..];
        for (index, token) in body.iter().enumerate() {
            if token.is("fn") || token.is("const") {
                methods.insert(body[index + 1].text.clone());
            }
        }
    }
    let body = begin + open..begin + item.len();
    Some(Implementation {
        of_type,
        methods,
        body,
    })
}

/// Every `use` of a module, also those in functions.
pub fn imports(tokens: &[Token]) -> Vec<Import> {
    let mut found = Vec::new();
    for (index, token) in tokens.iter().enumerate() {
        // `impl Trait + use<'a>`.
        if !token.is("use") || tokens.get(index + 1).is_none_or(|next| next.is("<")) {
            continue;
        }
        let before = index.checked_sub(1).map(|before| &tokens[before]);
        let reexport = before.is_some_and(|before| before.is("pub") || before.is(")"));
        let mut at = index + 1;
        tree(tokens, &mut at, &[], reexport, &mut found);
    }
    found
}

/// One tree of a `use` declaration: `a::b::{c, d as e, f::*}`.
fn tree(
    tokens: &[Token],
    at: &mut usize,
    prefix: &[String],
    reexport: bool,
    found: &mut Vec<Import>,
) {
    let mut path = prefix.to_vec();
    let line = tokens[*at].line;
    let mut name = None;
    while *at < tokens.len() {
        let token = &tokens[*at];
        if token.is("{") {
            *at += 1;
            while !tokens[*at].is("}") {
                tree(tokens, at, &path, reexport, found);
                if tokens[*at].is(",") {
                    *at += 1;
                }
            }
            *at += 1;
            return;
        } else if token.is("*") {
            *at += 1;
            found.push(Import {
                path,
                name: None,
                reexport,
                line,
            });
            return;
        } else if token.is("as") {
            name = Some(tokens[*at + 1].text.clone());
            *at += 1;
        } else if token.is("self") && !path.is_empty() || token.is("::") {
            // `{self}` is the path before it.
        } else if token.kind == Kind::Word {
            path.push(token.text.clone());
        } else {
            break;
        }
        *at += 1;
    }
    let name = name.or_else(|| path.last().cloned());
    found.push(Import {
        path,
        name,
        reexport,
        line,
    });
}

/// Paths of two segments or more outside `use` declarations: `crate::a::B`, `module::function`.
pub fn paths(tokens: &[Token]) -> Vec<(Vec<String>, usize)> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at].is("use") {
            at = behind_item(tokens, at);
            continue;
        }
        let begins = tokens[at].kind == Kind::Word
            && (at == 0 || !tokens[at - 1].is("::") && !tokens[at - 1].is("."));
        let mut path = Vec::new();
        let line = tokens[at].line;
        if begins {
            path.push(tokens[at].text.clone());
            while tokens.get(at + 1).is_some_and(|token| token.is("::"))
                && tokens
                    .get(at + 2)
                    .is_some_and(|token| token.kind == Kind::Word)
            {
                path.push(tokens[at + 2].text.clone());
                at += 2;
            }
        }
        // A macro of the crate is called by its name alone.
        let call = tokens.get(at + 1).is_some_and(|token| token.is("!"));
        if path.len() > 1 || path.len() == 1 && call {
            found.push((path, line));
        }
        at += 1;
    }
    found
}
