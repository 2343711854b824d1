//! Tables, for a page and for a README.

use std::fmt::Write;

use crate::text::inline;

/// A column's head.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Column {
    /// Above the column.
    pub head: String,
    /// Whether it holds numbers, which stand at the right.
    pub is_numbers: bool,
}

impl Column {
    /// A column of words.
    pub fn text(head: impl Into<String>) -> Self {
        Self {
            head: head.into(),
            is_numbers: false,
        }
    }

    /// A column of numbers.
    pub fn numbers(head: impl Into<String>) -> Self {
        Self {
            head: head.into(),
            is_numbers: true,
        }
    }
}

/// A table. Cells may hold `**bold**` and `` `code` ``. Rows that are too short end in empty cells;
/// columns that lack a head have an empty one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// From left to right.
    pub columns: Vec<Column>,
    /// From top to bottom, each from left to right.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn width(&self) -> usize {
        self.rows
            .iter()
            .map(Vec::len)
            .chain([self.columns.len()])
            .max()
            .unwrap_or(0)
    }

    fn column(&self, index: usize) -> Column {
        self.columns.get(index).cloned().unwrap_or_default()
    }

    /// As HTML, in a frame that scrolls where the page is narrow.
    pub fn html(&self) -> String {
        let mut html = "<div class=\"scroll\"><table><thead><tr>".to_owned();
        let class = |index| {
            if self.column(index).is_numbers {
                " class=\"r\""
            } else {
                ""
            }
        };
        for index in 0..self.width() {
            let _ = write!(
                html,
                "<th{}>{}</th>",
                class(index),
                inline(&self.column(index).head)
            );
        }
        html.push_str("</tr></thead><tbody>\n");
        for row in &self.rows {
            html.push_str("<tr>");
            for index in 0..self.width() {
                let _ = write!(
                    html,
                    "<td{}>{}</td>",
                    class(index),
                    inline(row.get(index).map_or("", String::as_str))
                );
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody></table></div>\n");
        html
    }

    /// As Markdown (GitHub's tables).
    pub fn markdown(&self) -> String {
        let cell = |text: &str| text.replace('|', "\\|").replace(['\n', '\r'], " ");
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let all = 0..self.width();
        let mut markdown = line(
            all.clone()
                .map(|index| cell(&self.column(index).head))
                .collect(),
        );
        let rule = |index| {
            if self.column(index).is_numbers {
                "---:"
            } else {
                "---"
            }
        };
        let _ = writeln!(
            markdown,
            "|{}|",
            all.clone().map(rule).collect::<Vec<_>>().join("|")
        );
        for row in &self.rows {
            markdown.push_str(&line(
                all.clone()
                    .map(|index| cell(row.get(index).map_or("", String::as_str)))
                    .collect(),
            ));
        }
        markdown
    }
}
