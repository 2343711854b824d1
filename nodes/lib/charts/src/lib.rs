//! Charts and pages: SVG that follows the reader's light or dark theme, the same pictures as PNG,
//! tables as HTML and Markdown, and reports in one HTML file with nothing to load.
//!
//! ```
//! use cromosim_charts::{Bar, BarChart, Block, Chart, Column, Group, Page, Section, Table};
//!
//! let bar = |series: &str, value, low, high| Bar { series: series.into(), value, interval: Some((low, high)) };
//! let chart = BarChart {
//!     title: "Error by path".into(),
//!     y_label: "RMSE, m/s²".into(),
//!     groups: vec![
//!         Group { label: "left wrist".into(), bars: vec![bar("analytic", 1.21, 1.1, 1.3), bar("learned", 0.92, 0.85, 1.0)] },
//!         Group { label: "right foot".into(), bars: vec![bar("analytic", 2.4, 2.2, 2.6), bar("learned", 1.7, 1.5, 1.9)] },
//!     ],
//!     level: None,
//! };
//! let table = Table {
//!     columns: vec![Column::text("Path"), Column::numbers("RMSE, m/s²")],
//!     rows: vec![vec!["analytic".into(), "1.21".into()], vec!["**learned**".into(), "0.92".into()]],
//! };
//! # #[cfg(feature = "png")]
//! assert!(chart.png(1200).is_ok_and(|bytes| bytes.starts_with(b"\x89PNG")));
//! let section = Section { title: "Wrist and foot".into(), blocks: vec![Block::Charts(vec![Chart::Bars(chart)]), Block::Table(table)] };
//! let html = Page { title: "Fidelity".into(), lead: "Held-out trials.".into(), sections: vec![section] }.html();
//! assert!(html.contains("<svg") && html.contains("<b>learned</b>"));
//! ```
//!
//! The same input gives the same bytes: nothing of the system (fonts, time, locale) comes in.
//! Whatever text a chart is given is escaped; numbers that are not finite are left out of the
//! picture. Colours can be told apart with the common kinds of colour blindness (a test simulates
//! them), and lines differ by their marks too.
//!
//! Why no library draws or writes:
//! - `plotters` 0.3 (5 packages with its SVG backend alone) writes each colour into its element, where
//!   these pictures name a class whose colour the page's theme says.
//! - `charming` 0.6 describes charts that JavaScript draws: its pages load echarts from a network, and
//!   without a browser it takes V8 (`ssr`, 180 packages).
//! - `maud` 0.27 (9 packages) would write the pages, whose HTML stands in two files of 300 lines here;
//!   it leaves apostrophes and control characters as they are, which [`text::escape`] does not, since
//!   the same text goes into SVG, which is XML.

mod axis;
mod bars;
mod error;
mod frame;
mod lines;
mod page;
mod panel;
#[cfg(feature = "png")]
mod png;
mod style;
mod table;
#[cfg(test)]
mod tests;
pub mod text;

pub use axis::{Axis, Tick};
pub use bars::{Bar, BarChart, Group};
pub use error::ChartsError;
pub use frame::Level;
pub use lines::{Line, LineChart, Point};
pub use page::{Block, Chart, Page, Section, document, standalone, write_panels};
pub use panel::{POINTS, Panel, Series};
#[cfg(feature = "png")]
pub use png::png;
pub use table::{Column, Table};
