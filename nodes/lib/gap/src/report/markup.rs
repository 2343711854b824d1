//! Pieces of markup that several sections use.

use cromosim_charts::text::significant;

/// A value before and after, with three digits.
pub(super) fn change(before: f64, after: f64) -> String {
    format!(
        "{}<span class=\"to\">→</span>{}",
        significant(before, 3),
        significant(after, 3)
    )
}

/// A bar as wide as a share.
pub(super) fn bar(share: f64) -> String {
    let width = if share.is_finite() {
        100.0 * share.clamp(0.0, 1.0)
    } else {
        0.0
    };
    format!("<span class=\"bar\"><i style=\"width:{width:.1}%\"></i></span>")
}
