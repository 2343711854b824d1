//! Numbers and words for people.

/// Text with the five characters of markup replaced.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // Not allowed in XML, in any form.
            control if control.is_control() && !matches!(control, '\n' | '\t') => {
                escaped.push('\u{FFFD}')
            }
            other => escaped.push(other),
        }
    }
    escaped
}

/// A number with so many significant digits; `–` for none.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-5..=6).contains(&exponent) {
        return minus(&format!("{value:.*e}", digits.saturating_sub(1)));
    }
    decimals(value, (digits as i32 - 1 - exponent).max(0) as usize)
}

/// As [`significant`], without zeros at the end of its fraction.
pub fn trimmed(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    match text.split_once('.') {
        Some((whole, fraction)) if !text.contains('e') => {
            let fraction = fraction.trim_end_matches('0');
            if fraction.is_empty() {
                whole.to_owned()
            } else {
                format!("{whole}.{fraction}")
            }
        }
        _ => text,
    }
}

/// A number with so many decimals; `–` for none, a typographic minus, no `-0.00`.
pub fn decimals(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{value:.decimals$}");
    // -0.00 is 0.00.
    let is_zero = text
        .chars()
        .all(|character| matches!(character, '-' | '0' | '.'));
    minus(text.strip_prefix('-').filter(|_| is_zero).unwrap_or(&text))
}

/// The typographic minus, as wide as a digit.
fn minus(text: &str) -> String {
    text.replacen('-', "−", 1)
}

/// `62 %`; small shares are not rounded to nothing.
pub fn percent(share: f64) -> String {
    match 100.0 * share {
        value if !value.is_finite() => "–".to_owned(),
        value if value > 0.0 && value < 1.0 => "&lt; 1 %".to_owned(),
        value if value < 100.0 && value > 99.0 => "&gt; 99 %".to_owned(),
        value => format!("{} %", decimals(value, 0)),
    }
}

/// Running text as markup: escaped, with `**bold**` and `` `code` `` as in Markdown; marks without
/// a partner stay as they are.
pub fn inline(text: &str) -> String {
    let escaped = escape(text);
    paired(&paired(&escaped, "**", "b"), "`", "code")
}

fn paired(text: &str, mark: &str, tag: &str) -> String {
    let parts: Vec<&str> = text.split(mark).collect();
    let mut marked = String::with_capacity(text.len());
    for (index, part) in parts.iter().enumerate() {
        match index {
            0 => {}
            // The last mark of an odd number opens nothing.
            odd if odd % 2 == 1 && odd + 1 == parts.len() => marked.push_str(mark),
            odd if odd % 2 == 1 => marked.push_str(&format!("<{tag}>")),
            _ => marked.push_str(&format!("</{tag}>")),
        }
        marked.push_str(part);
    }
    marked
}

/// About how wide a line of text is drawn, in the unit of `size`: for DejaVu Sans Condensed; most
/// system fonts are a little narrower.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    let em = |character: char| match character {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '|' | '!' | '\'' | ' ' => 0.31,
        't' | 'f' | 'r' | '(' | ')' | '-' | '/' => 0.38,
        'm' | 'M' | 'W' | 'w' | '%' | '@' | '→' | '±' | '−' => 0.86,
        upper if upper.is_uppercase() => 0.64,
        _ => 0.57,
    };
    size * text.chars().map(em).sum::<f64>()
}

/// Text broken after spaces, underscores and slashes into lines of about this width; a longer word
/// stays whole.
pub(crate) fn wrapped(text: &str, most: f64, size: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_inclusive([' ', '_', '/']) {
        match lines.last_mut() {
            Some(line) if width(line, size) + width(word.trim_end(), size) <= most => {
                line.push_str(word)
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
        .into_iter()
        .map(|line| line.trim_end().to_owned())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_cannot_come_in() {
        assert_eq!(
            escape("<a href='x'>&\"\u{1}"),
            "&lt;a href=&#39;x&#39;&gt;&amp;&quot;\u{FFFD}"
        );
    }

    #[test]
    fn numbers_keep_what_they_say() {
        assert_eq!(
            (
                percent(0.004).as_str(),
                percent(0.62).as_str(),
                percent(1.0).as_str()
            ),
            ("&lt; 1 %", "62 %", "100 %")
        );
        assert_eq!(decimals(-0.0001, 2), "0.00");
        assert_eq!(
            (
                significant(0.012_34, 2).as_str(),
                significant(-1.7e-7, 2).as_str(),
                significant(f64::NAN, 2).as_str()
            ),
            ("0.012", "−1.7e-7", "–")
        );
        assert_eq!(
            (trimmed(1200.0, 4).as_str(), trimmed(0.250, 3).as_str()),
            ("1200", "0.25")
        );
    }

    #[test]
    fn running_text_knows_bold_and_code() {
        assert_eq!(
            inline("a **b** `c<d>` e"),
            "a <b>b</b> <code>c&lt;d&gt;</code> e"
        );
        assert_eq!(inline("2 ** 3 and `x"), "2 ** 3 and `x");
        assert_eq!(inline("**a** ** b"), "<b>a</b> ** b");
    }

    #[test]
    fn lines_break_where_words_end() {
        assert_eq!(
            wrapped("left_wrist held out", 60.0, 11.0),
            ["left_wrist", "held out"]
        );
        assert_eq!(wrapped("left_wrist", 30.0, 11.0), ["left_", "wrist"]);
        assert_eq!(wrapped("", 30.0, 11.0), Vec::<String>::new());
    }
}
