//! The style sheets.

/// The style of every page: light and dark, tables, panels of curves, the parts of a diagnosis.
pub(crate) const STYLE: &str = include_str!("style.css");
/// The style of charts, beside it.
pub(crate) const CHARTS: &str = include_str!("charts.css");
