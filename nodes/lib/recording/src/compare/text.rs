//! Lines and numbers of a comparison.

/// Adds a line, formatted as by `println!`.
macro_rules! line {
    ($text:ident, $($argument:tt)*) => {{
        $text.push_str(&format!($($argument)*));
        $text.push('\n');
    }};
}
pub(super) use line;

/// A number with so many significant digits; `-` where it is not finite.
pub(super) fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-5..=6).contains(&exponent) {
        return format!("{value:.*e}", digits.max(1) as usize - 1);
    }
    format!("{value:.*}", (digits - 1 - exponent).max(0) as usize)
}

/// Adds a line with the names that only one side has; none for no names.
pub(super) fn only_in(text: &mut String, side: &str, names: &[String]) {
    if !names.is_empty() {
        line!(text, "\nonly in {side}: {}", names.join(", "));
    }
}
