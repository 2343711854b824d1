//! Pages in one file: a frame with the house's style, sections of words, tables and charts.

use std::fmt::Write;

use crate::style::{CHARTS, STYLE};
use crate::text::{escape, inline};
use crate::{BarChart, LineChart, Panel, Table};

/// A whole document: the title (as plain text) stands in the head and above the body, which is
/// markup. `further` is CSS beside the house's own.
pub fn document(title: &str, further: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>{title}</title><style>\n{STYLE}{further}</style></head><body><main>\n<h1>{title}</h1>\n{body}</main></body></html>\n"
    )
}

/// An `svg` element of this crate as a file of its own, with its style.
pub fn standalone(svg: &str) -> String {
    let (tag, rest) = svg.split_once('>').unwrap_or((svg, ""));
    format!("{tag}><style>\n{STYLE}{CHARTS}</style>{rest}\n")
}

/// Panels of curves, two in a row.
pub fn write_panels(page: &mut String, panels: &[Panel]) {
    page.push_str("<div class=\"panels\">\n");
    for panel in panels {
        page.push_str(&panel.svg());
        page.push('\n');
    }
    page.push_str("</div>\n");
}

/// Any chart.
#[derive(Clone, Debug, PartialEq)]
pub enum Chart {
    /// Groups of bars with intervals.
    Bars(BarChart),
    /// Points with intervals, joined by lines.
    Lines(LineChart),
    /// A panel of curves.
    Panel(Panel),
}

impl Chart {
    /// The picture as an `svg` element.
    pub fn svg(&self) -> String {
        match self {
            Self::Bars(chart) => chart.svg(),
            Self::Lines(chart) => chart.svg(),
            Self::Panel(panel) => panel.svg(),
        }
    }

    /// The picture as PNG, so many pixels wide, in light colours.
    ///
    /// # Errors
    /// A width that is not between 16 and 8192.
    #[cfg(feature = "png")]
    pub fn png(&self, width_px: u32) -> Result<Vec<u8>, crate::ChartsError> {
        crate::png(&self.svg(), width_px)
    }

    fn width(&self) -> f64 {
        match self {
            Self::Bars(chart) => chart.width(),
            Self::Lines(chart) => chart.width(),
            Self::Panel(panel) => panel.width,
        }
    }
}

/// A part of a section. Words may hold `**bold**` and `` `code` ``.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A paragraph of running text.
    Text(String),
    /// A paragraph in small letters: how something was measured, what to mind.
    Note(String),
    /// A list with bullets, one text a point.
    List(Vec<String>),
    /// A table, which scrolls where the page is narrow.
    Table(Table),
    /// Charts, side by side where they fit.
    Charts(Vec<Chart>),
    /// Blocks that are folded away under a line, which says what they are.
    Details(String, Vec<Block>),
}

/// A section of a page: a heading and what stands below it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// The heading.
    pub title: String,
    /// What stands below the heading, from top to bottom.
    pub blocks: Vec<Block>,
}

/// A page in one HTML file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Plain text, in the window's bar and at the top.
    pub title: String,
    /// Below the title: what this is, in a sentence or two.
    pub lead: String,
    /// What the page consists of, from top to bottom.
    pub sections: Vec<Section>,
}

impl Page {
    /// The whole document, with nothing to load.
    pub fn html(&self) -> String {
        let mut body = String::new();
        if !self.lead.is_empty() {
            let _ = writeln!(body, "<p class=\"soft\">{}</p>", inline(&self.lead));
        }
        for (number, section) in self.sections.iter().enumerate() {
            let _ = writeln!(
                body,
                "<section id=\"section-{number}\"><h2>{}</h2>",
                inline(&section.title)
            );
            section
                .blocks
                .iter()
                .for_each(|block| write_block(&mut body, block));
            body.push_str("</section>\n");
        }
        document(&self.title, CHARTS, &body)
    }
}

fn write_block(body: &mut String, block: &Block) {
    match block {
        Block::Text(text) => {
            let _ = writeln!(body, "<p>{}</p>", inline(text));
        }
        Block::Note(text) => {
            let _ = writeln!(body, "<p class=\"note\">{}</p>", inline(text));
        }
        Block::List(points) => {
            body.push_str("<ul class=\"plain\">\n");
            for point in points {
                let _ = writeln!(body, "<li>{}</li>", inline(point));
            }
            body.push_str("</ul>\n");
        }
        Block::Table(table) => body.push_str(&table.html()),
        Block::Charts(charts) => {
            body.push_str("<div class=\"charts\">\n");
            for chart in charts {
                // Wider, the letters would outgrow those of the page.
                let _ = writeln!(
                    body,
                    "<figure style=\"max-width:{}px\">{}</figure>",
                    chart.width(),
                    chart.svg()
                );
            }
            body.push_str("</div>\n");
        }
        Block::Details(summary, blocks) => {
            let _ = writeln!(body, "<details><summary>{}</summary>", inline(summary));
            blocks.iter().for_each(|block| write_block(body, block));
            body.push_str("</details>\n");
        }
    }
}
