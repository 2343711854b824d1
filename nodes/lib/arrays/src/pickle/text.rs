//! Numbers and strings as pickles write them in text (protocol 0).

use std::sync::Arc;

use super::node::Node;

/// Python's `repr` of a `str` of Python 2: quotes and backslashes.
pub(super) fn quoted(line: &[u8]) -> Option<Vec<u8>> {
    let (first, last) = (*line.first()?, *line.last()?);
    if line.len() < 2 || first != last || !matches!(first, b'\'' | b'"') {
        return None;
    }
    let mut rest = line.get(1..line.len() - 1)?.iter().copied();
    let mut bytes = Vec::with_capacity(line.len());
    let digit = |byte: u8| (byte as char).to_digit(16).map(|digit| digit as u8);
    while let Some(byte) = rest.next() {
        if byte != b'\\' {
            bytes.push(byte);
            continue;
        }
        bytes.push(match rest.next()? {
            b'n' => b'\n',
            b'r' => b'\r',
            b't' => b'\t',
            b'a' => 7,
            b'b' => 8,
            b'f' => 12,
            b'v' => 11,
            b'x' => digit(rest.next()?)? << 4 | digit(rest.next()?)?,
            octal @ b'0'..=b'3' => {
                let (second, third) = (digit(rest.next()?)?, digit(rest.next()?)?);
                (octal - b'0') << 6 | (second & 7) << 3 | third & 7
            }
            other => other,
        });
    }
    Some(bytes)
}

/// Latin-1 with `\uXXXX` and `\UXXXXXXXX`.
pub(super) fn raw_unicode(line: &[u8]) -> Option<String> {
    let mut text = String::with_capacity(line.len());
    let mut rest = line;
    while let Some((&byte, after)) = rest.split_first() {
        let digits = match (byte, after.first()) {
            (b'\\', Some(b'u')) => 4,
            (b'\\', Some(b'U')) => 8,
            _ => {
                text.push(char::from(byte));
                rest = after;
                continue;
            }
        };
        let code = std::str::from_utf8(after.get(1..1 + digits)?).ok()?;
        text.push(
            char::from_u32(u32::from_str_radix(code, 16).ok()?)
                .unwrap_or(char::REPLACEMENT_CHARACTER),
        );
        rest = after.get(1 + digits..)?;
    }
    Some(text)
}

/// A decimal integer, with Python 2's `L`.
pub(super) fn integer(line: &[u8]) -> Option<Node> {
    let text = std::str::from_utf8(line).ok()?.trim();
    match text {
        "01" => return Some(Node::Bool(true)),
        "00" => return Some(Node::Bool(false)),
        _ => {}
    }
    let text = text.trim_end_matches('L');
    match text.parse() {
        Ok(value) => Some(Node::Int(value)),
        Err(_) => {
            let digits = text.strip_prefix('-').unwrap_or(text);
            let sound = !digits.is_empty()
                && digits.len() <= 1024
                && digits.bytes().all(|byte| byte.is_ascii_digit());
            sound.then(|| Node::BigInt(Arc::from(text)))
        }
    }
}

/// A float in Python's notation.
pub(super) fn float(line: &[u8]) -> Option<f64> {
    std::str::from_utf8(line).ok()?.trim().parse().ok()
}

/// Two's complement, least significant byte first.
pub(super) fn long(bytes: &[u8]) -> Option<Node> {
    let negative = bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    if bytes.len() <= 8 {
        let mut wide = if negative { [0xff; 8] } else { [0; 8] };
        wide.iter_mut()
            .zip(bytes)
            .for_each(|(to, from)| *to = *from);
        return Some(Node::Int(i64::from_le_bytes(wide)));
    }
    let digits: String = bytes
        .iter()
        .rev()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    (bytes.len() <= 1024).then(|| Node::BigInt(Arc::from(format!("0x{digits}"))))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn text_as_python_writes_it() {
        assert_eq!(quoted(br"'a\x00\377\n\'\\'").unwrap(), b"a\x00\xff\n'\\");
        assert!(quoted(b"'a").is_none() && quoted(br"'\x0'").is_none() && quoted(b"'").is_none());
        assert_eq!(raw_unicode(b"\\u20ac\xe9\\n").unwrap(), "€é\\n");
        assert!(raw_unicode(br"\u20").is_none());
        assert!(
            matches!(long(&[0xff, 0x7f]), Some(Node::Int(32767)))
                && matches!(long(&[0xff]), Some(Node::Int(-1)))
        );
        assert!(
            matches!(integer(b"-12L"), Some(Node::Int(-12)))
                && integer(b"12x").is_none()
                && integer(b"").is_none()
        );
        assert!(matches!(
            integer(b"123456789012345678901"),
            Some(Node::BigInt(_))
        ));
    }
}
