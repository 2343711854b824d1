//! Names and other words that came from elsewhere, for a terminal.

use std::borrow::Cow;
use std::fmt::Write;

/// Whether a character steers the terminal, or the order in which others are shown.
fn steers(character: char) -> bool {
    const ORDER: [std::ops::RangeInclusive<char>; 5] = [
        '\u{61c}'..='\u{61c}',
        '\u{200e}'..='\u{200f}',
        '\u{2028}'..='\u{202e}',
        '\u{2066}'..='\u{2069}',
        '\u{feff}'..='\u{feff}',
    ];
    character.is_control() && character != '\t'
        || ORDER.iter().any(|range| range.contains(&character))
}

/// The text as a terminal may show it, on one line: a name from a file or another node could else
/// move the cursor, or rewrite what stands there. What steers is written as Rust does, `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.chars().any(steers) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        if steers(character) {
            // Writing to a string does not fail.
            let _ = write!(shown, "{}", character.escape_default());
        } else {
            shown.push(character);
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_steers_a_terminal_is_left() {
        let hostile = "/imu\u{1b}[2J\u{1b}]0;title\u{7}\r\nx\u{9b}31m\u{7f}\u{202e}\u{2066}";
        assert_eq!(
            printable(hostile),
            r"/imu\u{1b}[2J\u{1b}]0;title\u{7}\r\nx\u{9b}31m\u{7f}\u{202e}\u{2066}"
        );
        let (every, all) = ('\0'..=char::MAX, "Zoë Ω\t人 \\u{1b}");
        let every: String = every.collect();
        assert!(!printable(&every).chars().any(steers));
        assert!(matches!(printable(all), Cow::Borrowed(text) if text == all));
    }
}
