//! The report of an evaluation.

use cromosim_charts::{Block, Chart, Page, Section, Table};

use super::charts::{classes_chart, conditions_chart, curve_chart};
use super::results::ActivityResults;
use super::tables::{classes_table, conditions_table, curve_table, head, notes};
use crate::EvaluationError;
use crate::report::{Report, json};

impl ActivityResults {
    /// The results as tables, page and pictures.
    ///
    /// # Errors
    /// None but what JSON refuses.
    pub fn report(&self) -> Result<Report, EvaluationError> {
        Ok(Report {
            tables: markdown(self),
            texts: vec![("results.json", json(self)?)],
            page: page(self),
            charts: charts(self),
        })
    }
}

/// All tables with what to mind, as a README has them.
fn markdown(results: &ActivityResults) -> String {
    let notes: String = notes(results).into_iter().map(|note| note + "\n").collect();
    [
        head(results) + "\n",
        conditions_table(results).markdown(),
        curve_table(results).markdown(),
        classes_table(results).markdown(),
        notes,
    ]
    .join("\n")
}

/// Pictures by their file's name.
fn charts(results: &ActivityResults) -> Vec<(String, Chart)> {
    let name = |name: &str| format!("{name}.png");
    vec![
        (name("learned_from"), Chart::Bars(conditions_chart(results))),
        (name("learning_curve"), Chart::Lines(curve_chart(results))),
        (name("classes"), Chart::Bars(classes_chart(results))),
    ]
}

/// The page, report.html.
fn page(results: &ActivityResults) -> Page {
    let section = |title: &str, chart: Chart, table: Table| Section {
        title: title.to_owned(),
        blocks: vec![Block::Charts(vec![chart]), Block::Table(table)],
    };
    let sections = vec![
        section(
            "What is learned from",
            Chart::Bars(conditions_chart(results)),
            conditions_table(results),
        ),
        section(
            "How much real data",
            Chart::Lines(curve_chart(results)),
            curve_table(results),
        ),
        section(
            "By class",
            Chart::Bars(classes_chart(results)),
            classes_table(results),
        ),
        Section {
            title: "To mind".to_owned(),
            blocks: vec![Block::List(notes(results))],
        },
    ];
    Page {
        title: "Activities from virtual IMUs".to_owned(),
        lead: head(results),
        sections,
    }
}
