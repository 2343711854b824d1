//! Results of rigid bodies as tables and pictures.

use cromosim_charts::{Bar, BarChart, Block, Chart, Column, Group, Level, Section, Table};
use cromosim_imu::Scheme;

use super::method::{JUDGED, RigidMethod};
use super::picture::PictureResults;
use super::results::{RigidMethodResults, RigidStudyResults};

/// Names, units and digits of the two numbers of each pair.
const QUANTITIES: [(&str, &str, usize); 2] = [
    ("specific force", "m/s²", 2),
    ("angular velocity", "rad/s", 3),
];

/// All tables as Markdown.
pub(in crate::fidelity) fn rigid_markdown(studies: &[RigidStudyResults]) -> String {
    let own = |study: &RigidStudyResults| {
        format!(
            "\n**{}**: {}\n\n{}\n{}",
            study.name,
            about(study),
            by_method(study).markdown(),
            by_part(study).markdown()
        ) + &failures(study)
            .iter()
            .map(|failure| format!("\n- {failure}"))
            .collect::<String>()
    };
    format!(
        "\n{}\n{}",
        errors(studies).markdown(),
        verdict(studies).markdown()
    ) + &studies.iter().map(own).collect::<String>()
}

/// The page's sections: all studies at a glance, then each.
pub(in crate::fidelity) fn rigid_sections(studies: &[RigidStudyResults]) -> Vec<Section> {
    if studies.is_empty() {
        return Vec::new();
    }
    let lead = "Poses of rigid bodies against a physics engine's exact readings, closed forms and real IMUs. The practice is a Butterworth low-pass of second order, \
                forward and back, then differences; best in hindsight is its cutoff with the least error for the study and channel. Squared errors over what the \
                readings' covariances state are 1 where they err as much as they say.";
    let glance = Section {
        title: "Rigid bodies, at a glance".to_owned(),
        blocks: vec![
            Block::Text(lead.to_owned()),
            Block::Table(errors(studies)),
            Block::Table(verdict(studies)),
            Block::Charts(
                rigid_charts(studies)
                    .into_iter()
                    .map(|(_, chart)| chart)
                    .collect(),
            ),
        ],
    };
    let own = |study: &RigidStudyResults| Section {
        title: study.name.clone(),
        blocks: [
            Block::Text(about(study)),
            Block::Charts(pictures(study).map(|(_, chart)| chart).collect()),
            Block::Table(by_method(study)),
            Block::Table(by_part(study)),
        ]
        .into_iter()
        .chain(failures(study).into_iter().map(Block::Text))
        .collect(),
    };
    [glance]
        .into_iter()
        .chain(studies.iter().map(own))
        .collect()
}

/// The splines over the practice in hindsight, by their file's names.
pub(in crate::fidelity) fn rigid_charts(studies: &[RigidStudyResults]) -> Vec<(String, Chart)> {
    if studies.is_empty() {
        return Vec::new();
    }
    let shown = [RigidMethod::Scheme(Scheme::Spline), JUDGED].map(RigidMethod::title);
    let chart = |(index, (quantity, ..)): (usize, &(&str, &str, usize))| {
        let bar = |own: &RigidMethodResults| Bar {
            series: own.method.clone(),
            value: own.ratio[index],
            interval: own
                .ratio_interval
                .map(|ratio| (ratio[index][0], ratio[index][1])),
        };
        let group = |study: &RigidStudyResults| Group {
            label: study.name.clone(),
            bars: study
                .methods
                .iter()
                .filter(|own| shown.contains(&own.method))
                .map(bar)
                .collect(),
        };
        let chart = BarChart {
            title: format!("{quantity}: error over that of the best practice in hindsight"),
            y_label: "ratio of RMSE".to_owned(),
            groups: studies.iter().map(group).collect(),
            level: Some(Level {
                value: 1.0,
                label: "practice, best in hindsight".to_owned(),
            }),
        };
        let name = format!("rigid_{}.png", quantity.replace(' ', "_"));
        (name, Chart::Bars(chart))
    };
    QUANTITIES.iter().enumerate().map(chart).collect()
}

/// Some seconds of a study's IMUs over time, by their file's names.
pub(in crate::fidelity) fn pictures(
    study: &RigidStudyResults,
) -> impl Iterator<Item = (String, Chart)> {
    let charts = |picture: &PictureResults| picture.charts(&study.name);
    study.picture.iter().flat_map(charts)
}

/// What a study's measured side is.
fn about(study: &RigidStudyResults) -> String {
    format!(
        "{} (truth: {}); {} motions, {} IMUs, {:.0} s; what was measured has {:.2} m/s² and {:.3} rad/s.",
        study.measured,
        study.truth.title(),
        study.motions,
        study.bodies,
        study.seconds,
        study.signal[0],
        study.signal[1]
    )
}

/// Where a method gave no readings, a sentence each.
fn failures(study: &RigidStudyResults) -> Vec<String> {
    let sentence = |failure: &String| format!("No readings: {failure}.");
    study.failures.iter().map(sentence).collect()
}

/// How many IMUs a method's errors are about, where it failed on some.
fn without_failed(text: String, own: &RigidMethodResults, study: &RigidStudyResults) -> String {
    match own.failed {
        0 => text,
        failed => format!("{text} ({} of {})", study.bodies - failed, study.bodies),
    }
}

fn pair(rmse: [f64; 2]) -> String {
    format!("{:.2}, {:.3}", rmse[0], rmse[1])
}

/// Errors of all methods in all studies.
fn errors(studies: &[RigidStudyResults]) -> Table {
    let usual: Vec<String> = RigidMethod::usual()
        .into_iter()
        .map(RigidMethod::title)
        .collect();
    let mut columns = vec![
        Column::text("rigid bodies, RMSE, m/s² and rad/s"),
        Column::text("truth"),
    ];
    columns.extend(usual.iter().map(Column::numbers));
    columns.push(Column::numbers("practice, best in hindsight"));
    let row = |study: &RigidStudyResults| {
        let cell = |title: &String| {
            let own = study.methods.iter().find(|own| own.method == *title);
            own.map_or_else(String::new, |own| {
                without_failed(pair(own.rmse), own, study)
            })
        };
        let [force, rate] = study.practice.cutoff_hz;
        let best = format!("{} ({force:.0}, {rate:.0} Hz)", pair(study.practice.rmse));
        let mut cells = vec![study.name.clone(), study.truth.title().to_owned()];
        cells.extend(usual.iter().map(cell));
        cells.push(best);
        cells
    };
    Table {
        columns,
        rows: studies.iter().map(row).collect(),
    }
}

/// A value with its interval.
fn within(value: f64, interval: Option<[f64; 2]>) -> String {
    match interval {
        Some([low, high]) => format!("{value:.2} ({low:.2} to {high:.2})"),
        None => format!("{value:.2}"),
    }
}

/// The judged scheme over the practice in hindsight, and its squared errors over what it states.
fn verdict(studies: &[RigidStudyResults]) -> Table {
    let name = JUDGED.title();
    let mut columns = vec![Column::text(format!("`{name}`"))];
    for (quantity, ..) in QUANTITIES {
        columns.push(Column::numbers(format!("{quantity} over best practice")));
    }
    for place in ["middle", "ends"] {
        for (quantity, ..) in QUANTITIES {
            columns.push(Column::numbers(format!("{quantity}, stated, {place}")));
        }
    }
    let row = |study: &RigidStudyResults| {
        let own = study.methods.iter().find(|own| own.method == name);
        let ratio = |index: usize| {
            own.map_or_else(String::new, |own| {
                let interval = own.ratio_interval.map(|ratio| ratio[index]);
                within(own.ratio[index], interval)
            })
        };
        let places = [study.stated.middle, study.stated.ends];
        let stated = |place: usize, index: usize| {
            let interval = study.stated.intervals.map(|stated| stated[place][index]);
            places[place][index].map_or_else(String::new, |value| within(value, interval))
        };
        let mut cells = vec![study.name.clone(), ratio(0), ratio(1)];
        cells.extend([(0, 0), (0, 1), (1, 0), (1, 1)].map(|(place, index)| stated(place, index)));
        cells
    };
    Table {
        columns,
        rows: studies.iter().map(row).collect(),
    }
}

/// All methods of a study.
fn by_method(study: &RigidStudyResults) -> Table {
    let mut columns = vec![Column::text("method")];
    for (quantity, unit, _) in QUANTITIES {
        columns.extend([
            Column::numbers(format!("{quantity}, {unit}")),
            Column::numbers("over best practice"),
            Column::numbers("within 0.1 s of the ends"),
        ]);
    }
    let row = |own: &RigidMethodResults| {
        let mut cells = vec![without_failed(own.method.clone(), own, study)];
        for (index, (.., digits)) in QUANTITIES.iter().enumerate() {
            let interval = own.ratio_interval.map(|ratio| ratio[index]);
            cells.extend([
                format!("{:.digits$}", own.rmse[index]),
                within(own.ratio[index], interval),
                format!("{:.digits$}", own.ends_rmse[index]),
            ]);
        }
        cells
    };
    Table {
        columns,
        rows: study.methods.iter().map(row).collect(),
    }
}

/// The judged scheme by motion and position.
fn by_part(study: &RigidStudyResults) -> Table {
    let mut columns = vec![Column::text(format!("`{}`", JUDGED.title()))];
    for (quantity, unit, _) in QUANTITIES {
        columns.extend([
            Column::numbers(format!("{quantity}, {unit}")),
            Column::numbers("over best practice"),
            Column::numbers("stated, middle"),
        ]);
    }
    let rows = study.parts.iter().map(|part| {
        let mut cells = vec![part.part.replace('_', " ")];
        for (index, (.., digits)) in QUANTITIES.iter().enumerate() {
            let stated = part.stated[index].map_or_else(String::new, |value| format!("{value:.2}"));
            cells.extend([
                format!("{:.digits$}", part.rmse[index]),
                format!("{:.2}", part.ratio[index]),
                stated,
            ]);
        }
        cells
    });
    Table {
        columns,
        rows: rows.collect(),
    }
}
