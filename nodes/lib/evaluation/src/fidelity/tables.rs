//! Results as tables and pictures.

use cromosim_charts::{Bar, BarChart, Block, Chart, Column, Group, Page, Section, Table};

use super::method::Method;
use super::results::{FidelityResults, MethodResults, PositionResults, StudyResults};
use super::rigid::{pictures, rigid_charts, rigid_markdown, rigid_sections};
use super::truth_source::{MARK_EXPLAINED, TruthSource};
use crate::EvaluationError;
use crate::report::{Report, json};

/// A quantity as tables say it.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    digits: usize,
}

/// In the order of the results' pairs of numbers.
const QUANTITIES: [Quantity; 2] = [
    Quantity {
        name: "specific force",
        unit: "m/s²",
        digits: 2,
    },
    Quantity {
        name: "angular velocity",
        unit: "rad/s",
        digits: 3,
    },
];

impl FidelityResults {
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

/// All studies at a glance, then one table a study: per axis and against the analytic simulator.
fn markdown(results: &FidelityResults) -> String {
    let table = |study: &StudyResults| {
        let rows = summary(study).markdown();
        format!("\n**{}**: {}\n\n{rows}", study.name, about(study))
    };
    let mut text = String::new();
    if !results.studies.is_empty() {
        text += &overview(results).markdown();
    }
    if let Some(explained) = mark_explained(results) {
        text += &format!("\n{explained}\n");
    }
    text.extend(results.studies.iter().map(table));
    if !results.rigid.is_empty() {
        text += &rigid_markdown(&results.rigid);
    }
    if !results.skipped.is_empty() {
        text += &format!("\n{}\n", results.skipped.join("\n"));
    }
    text
}

/// Pictures by their file's name.
fn charts(results: &FidelityResults) -> Vec<(String, Chart)> {
    let mut charts = Vec::new();
    for study in &results.studies {
        for (index, quantity) in QUANTITIES.iter().enumerate() {
            let name = format!("{}_{}.png", study.name, quantity.name).replace([' ', ','], "_");
            charts.push((name, Chart::Bars(chart(study, index))));
        }
    }
    charts.extend(rigid_charts(&results.rigid));
    charts.extend(results.rigid.iter().flat_map(pictures));
    charts
}

/// The page, report.html.
fn page(results: &FidelityResults) -> Page {
    let lead = format!(
        "Root mean square errors against the measured IMU in the sensor's axes, gravity included; in brackets 95 % of the ratios when recordings are \
         drawn anew. Made by cromosim {}, `cromosim evaluate fidelity{}`, seed {}.",
        results.version,
        if results.quick { " --quick" } else { "" },
        results.seed
    );
    let glance = (!results.studies.is_empty()).then(|| Section {
        title: "At a glance".to_owned(),
        blocks: [Block::Table(overview(results))]
            .into_iter()
            .chain(mark_explained(results).map(|text| Block::Text(text.to_owned())))
            .collect(),
    });
    let skipped = (!results.skipped.is_empty()).then(|| Section {
        title: "Left out".to_owned(),
        blocks: results.skipped.iter().cloned().map(Block::Text).collect(),
    });
    Page {
        title: "Fidelity of simulated IMUs".to_owned(),
        lead,
        sections: glance
            .into_iter()
            .chain(results.studies.iter().map(section))
            .chain(rigid_sections(&results.rigid))
            .chain(skipped)
            .collect(),
    }
}

/// A study's section of the page.
fn section(study: &StudyResults) -> Section {
    let charts = (0..QUANTITIES.len()).map(|index| Chart::Bars(chart(study, index)));
    Section {
        title: study.name.clone(),
        blocks: vec![
            Block::Text(about(study)),
            Block::Charts(charts.collect()),
            Block::Table(summary(study)),
            Block::Table(by_channel(study)),
        ],
    }
}

/// All positions of a study together.
fn overview(results: &FidelityResults) -> Table {
    let mut columns = vec![Column::text("RMSE, m/s² and rad/s"), Column::text("truth")];
    columns.extend(Method::ALL.map(|method| Column::numbers(method.title())));
    let cells = |study: &StudyResults| {
        let all = study.positions.last();
        let find = |method: Method| all?.methods.iter().find(|own| own.method == method);
        let cell = |own: &MethodResults| {
            let mark = mark(study, own.method);
            format!("{:.2}, {:.3}{mark}", own.rmse[0], own.rmse[1])
        };
        let own = Method::ALL.map(|method| find(method).map_or_else(String::new, cell));
        let named = vec![study.name.clone(), study.truth.title().to_owned()];
        [named, own.to_vec()].concat()
    };
    Table {
        columns,
        rows: results.studies.iter().map(cells).collect(),
    }
}

/// What a study's measured side and networks are.
fn about(study: &StudyResults) -> String {
    let truth = study.truth.title();
    format!(
        "{} (truth: {truth}); networks `{}`.",
        study.measured, study.model
    )
}

/// Whether the suite's own spline made a study's truth.
fn is_marked(study: &StudyResults) -> bool {
    study.truth == TruthSource::OwnSpline
}

/// What the mark means, where a study has it.
fn mark_explained(results: &FidelityResults) -> Option<&'static str> {
    let is_any = results.studies.iter().any(is_marked);
    is_any.then_some(MARK_EXPLAINED)
}

/// What stands behind the errors of a simulator that the study's truth does not rank.
fn mark(study: &StudyResults, method: Method) -> &'static str {
    if is_marked(study) && method.is_of_spline() {
        " †"
    } else {
        ""
    }
}

/// A simulator's name, marked where the study's truth does not rank it.
fn title(study: &StudyResults, method: Method) -> String {
    format!("{}{}", method.title(), mark(study, method))
}

/// A position with the size of its data.
fn position_name(position: &PositionResults) -> String {
    format!(
        "{} ({} recordings, {:.0} s)",
        position.position.replace('_', " "),
        position.recordings,
        position.seconds
    )
}

/// A row for each position and simulator: their names, then `cells`.
fn rows(study: &StudyResults, cells: impl Fn(&MethodResults) -> Vec<String>) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for position in &study.positions {
        for (index, own) in position.methods.iter().enumerate() {
            let named = if index == 0 {
                position_name(position)
            } else {
                String::new()
            };
            rows.push([vec![named, title(study, own.method)], cells(own)].concat());
        }
    }
    rows
}

/// Errors per axis, and their ratios to the analytic simulator's.
fn summary(study: &StudyResults) -> Table {
    let mut columns = vec![Column::text("position"), Column::text("simulator")];
    for Quantity { name, unit, .. } in QUANTITIES {
        columns.extend([
            Column::numbers(format!("{name}, {unit}")),
            Column::numbers("of analytic"),
        ]);
    }
    let cells = |own: &MethodResults| {
        let both = |which: usize| {
            let ([low, high], digits) = (own.ratio_interval[which], QUANTITIES[which].digits);
            [
                format!("{:.digits$}", own.rmse[which]),
                format!("{:.2} ({low:.2} to {high:.2})", own.ratio[which]),
            ]
        };
        [both(0), both(1)].concat()
    };
    Table {
        columns,
        rows: rows(study, cells),
    }
}

/// Errors of each channel.
fn by_channel(study: &StudyResults) -> Table {
    let mut columns = vec![Column::text("position"), Column::text("simulator")];
    for Quantity { name, unit, .. } in QUANTITIES {
        columns
            .extend(["x", "y", "z"].map(|axis| Column::numbers(format!("{name} {axis}, {unit}"))));
    }
    let cells = |own: &MethodResults| {
        let cell =
            |(channel, value): (usize, &f64)| format!("{value:.*}", QUANTITIES[channel / 3].digits);
        own.channels.iter().enumerate().map(cell).collect()
    };
    Table {
        columns,
        rows: rows(study, cells),
    }
}

/// The errors of one of [`QUANTITIES`] by position.
fn chart(study: &StudyResults, index: usize) -> BarChart {
    let Quantity { name, unit, .. } = QUANTITIES[index];
    let bar = |own: &MethodResults| {
        let [low, high] = own.rmse_interval[index];
        Bar {
            series: title(study, own.method),
            value: own.rmse[index],
            interval: Some((low, high)),
        }
    };
    let group = |position: &PositionResults| Group {
        label: position.position.replace('_', " "),
        bars: position.methods.iter().map(bar).collect(),
    };
    BarChart {
        title: format!("{}: {name} (truth: {})", study.name, study.truth.title()),
        y_label: format!("RMSE per axis, {unit}"),
        groups: study.positions.iter().map(group).collect(),
        level: None,
    }
}
