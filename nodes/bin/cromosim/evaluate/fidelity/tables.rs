//! Results as tables and pictures.

use cromosim_charts::{Bar, BarChart, Block, Chart, Column, Group, Page, Section, Table};

use super::cases::Simulator;
use super::score::{PositionResults, Results, SimulatorResults, StudyResults};

/// Quantities: name, unit, digits.
const QUANTITIES: [(&str, &str, usize); 2] = [
    ("specific force", "m/s²", 2),
    ("angular velocity", "rad/s", 3),
];

/// All studies at a glance, then one table a study: per axis and against the analytic simulator.
pub fn markdown(results: &Results) -> String {
    let of = |study: &StudyResults| {
        format!(
            "\n**{}**: {}\n\n{}",
            study.name,
            about(study),
            summary(study).markdown()
        )
    };
    overview(results).markdown() + &results.studies.iter().map(of).collect::<String>()
}

/// Pictures by their file's name.
pub fn charts(results: &Results) -> Vec<(String, Chart)> {
    let mut charts = Vec::new();
    for study in &results.studies {
        for (which, (quantity, ..)) in QUANTITIES.iter().enumerate() {
            let name = format!("{}_{quantity}.png", study.name).replace([' ', ','], "_");
            charts.push((name, Chart::Bars(chart(study, which))));
        }
    }
    charts
}

/// The report.
pub fn page(results: &Results) -> Page {
    let section = |study: &StudyResults| Section {
        title: study.name.clone(),
        blocks: vec![
            Block::Text(about(study)),
            Block::Charts(
                (0..2)
                    .map(|which| Chart::Bars(chart(study, which)))
                    .collect(),
            ),
            Block::Table(summary(study)),
            Block::Table(by_channel(study)),
        ],
    };
    let lead = format!(
        "Root mean square errors against the measured IMU in the sensor's axes, gravity included; in brackets 95 % of the ratios when recordings are \
         drawn anew. Made by cromosim {}, `cromosim evaluate fidelity{}`, seed {}.",
        results.version,
        if results.quick { " --quick" } else { "" },
        results.seed
    );
    let glance = Section {
        title: "At a glance".to_owned(),
        blocks: vec![Block::Table(overview(results))],
    };
    let sections = [glance]
        .into_iter()
        .chain(results.studies.iter().map(section))
        .collect();
    Page {
        title: "Fidelity of simulated IMUs".to_owned(),
        lead,
        sections,
    }
}

/// All positions of a study together.
fn overview(results: &Results) -> Table {
    let mut columns = vec![Column::text("RMSE, m/s² and rad/s")];
    columns.extend(Simulator::ALL.map(|simulator| Column::numbers(simulator.title())));
    let cells = |study: &StudyResults| {
        let all = study.positions.last();
        let of = |simulator: Simulator| {
            all?.simulators
                .iter()
                .find(|own| own.simulator == simulator)
        };
        let cell = |own: &SimulatorResults| format!("{:.2}, {:.3}", own.rmse[0], own.rmse[1]);
        let own = Simulator::ALL.map(|simulator| of(simulator).map_or_else(String::new, cell));
        [vec![study.name.clone()], own.to_vec()].concat()
    };
    Table {
        columns,
        rows: results.studies.iter().map(cells).collect(),
    }
}

fn about(study: &StudyResults) -> String {
    format!("{}; networks `{}`.", study.measured, study.model)
}

fn place(position: &PositionResults) -> String {
    format!(
        "{} ({} recordings, {:.0} s)",
        position.position.replace('_', " "),
        position.recordings,
        position.seconds
    )
}

/// Position and simulator, then what `cells` says.
fn rows(
    study: &StudyResults,
    cells: impl Fn(&SimulatorResults) -> Vec<String>,
) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for position in &study.positions {
        for (index, own) in position.simulators.iter().enumerate() {
            let named = if index == 0 {
                place(position)
            } else {
                String::new()
            };
            rows.push([vec![named, own.simulator.title().to_owned()], cells(own)].concat());
        }
    }
    rows
}

fn summary(study: &StudyResults) -> Table {
    let mut columns = vec![Column::text("position"), Column::text("simulator")];
    for (name, unit, _) in QUANTITIES {
        columns.extend([
            Column::numbers(format!("{name}, {unit}")),
            Column::numbers("of analytic"),
        ]);
    }
    let cells = |own: &SimulatorResults| {
        let both = |which: usize| {
            let ([low, high], digits) = (own.ratio_interval[which], QUANTITIES[which].2);
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

fn by_channel(study: &StudyResults) -> Table {
    let mut columns = vec![Column::text("position"), Column::text("simulator")];
    for (name, unit, _) in QUANTITIES {
        columns
            .extend(["x", "y", "z"].map(|axis| Column::numbers(format!("{name} {axis}, {unit}"))));
    }
    let cells = |own: &SimulatorResults| {
        let cell =
            |(channel, value): (usize, &f64)| format!("{value:.*}", QUANTITIES[channel / 3].2);
        own.channels.iter().enumerate().map(cell).collect()
    };
    Table {
        columns,
        rows: rows(study, cells),
    }
}

fn chart(study: &StudyResults, which: usize) -> BarChart {
    let (name, unit, _) = QUANTITIES[which];
    let bar = |own: &SimulatorResults| {
        let [low, high] = own.rmse_interval[which];
        Bar {
            series: own.simulator.title().to_owned(),
            value: own.rmse[which],
            interval: Some((low, high)),
        }
    };
    let group = |position: &PositionResults| Group {
        label: position.position.replace('_', " "),
        bars: position.simulators.iter().map(bar).collect(),
    };
    BarChart {
        title: format!("{}: {name}", study.name),
        y_label: format!("RMSE per axis, {unit}"),
        groups: study.positions.iter().map(group).collect(),
        level: None,
    }
}
