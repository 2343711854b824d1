//! Results as tables and pictures.

use cromosim_charts::{
    Bar, BarChart, Block, Chart, Column, Group, Level, Line, LineChart, Page, Point, Section, Table,
};

use super::results::{Cell, Comparison, Results, Training, Variant};
use super::simulated::Simulator;

/// The tables of a README.
pub fn markdown(results: &Results) -> String {
    let notes: String = notes(results).into_iter().map(|note| note + "\n").collect();
    [
        head(results) + "\n",
        ways(results).markdown(),
        curve(results).markdown(),
        classes(results).markdown(),
        notes,
    ]
    .join("\n")
}

/// Pictures by their file's name.
pub fn charts(results: &Results) -> Vec<(String, Chart)> {
    let name = |name: &str| format!("{name}.png");
    vec![
        (name("learned_from"), Chart::Bars(ways_chart(results))),
        (name("learning_curve"), Chart::Lines(curve_chart(results))),
        (name("classes"), Chart::Bars(classes_chart(results))),
    ]
}

/// The report.
pub fn page(results: &Results) -> Page {
    let section = |title: &str, chart: Chart, table: Table| Section {
        title: title.to_owned(),
        blocks: vec![Block::Charts(vec![chart]), Block::Table(table)],
    };
    let sections = vec![
        section(
            "What is learned from",
            Chart::Bars(ways_chart(results)),
            ways(results),
        ),
        section(
            "How much real data",
            Chart::Lines(curve_chart(results)),
            curve(results),
        ),
        section(
            "By class",
            Chart::Bars(classes_chart(results)),
            classes(results),
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

fn percent(value: f64) -> String {
    format!("{:.1}", 100.0 * value)
}

fn score(cell: Option<&Cell>) -> String {
    cell.map_or("-".to_owned(), |cell| {
        format!(
            "{} [{}, {}]",
            percent(cell.mean),
            percent(cell.interval[0]),
            percent(cell.interval[1])
        )
    })
}

fn gain(comparison: Option<&Comparison>) -> String {
    comparison.map_or("-".to_owned(), |found| {
        format!(
            "{:+.1} [{:+.1}, {:+.1}]",
            100.0 * found.gain,
            100.0 * found.interval[0],
            100.0 * found.interval[1]
        )
    })
}

fn compared<'a>(
    results: &'a Results,
    of: Option<&Cell>,
    over: Option<&Cell>,
) -> Option<&'a Comparison> {
    let (of, over) = (of?.name(), over?.name());
    results
        .comparisons
        .iter()
        .find(|found| found.of == of && found.over == over)
}

fn head(results: &Results) -> String {
    let settings = &results.settings;
    let windows: usize = results
        .subjects
        .iter()
        .flat_map(|subject| &subject.windows)
        .sum();
    format!(
        "Recordings: {}, {} people, {windows} windows of 1 s of {} at {} Hz; classes {}. Macro F1 in %, mean over the people held out one \
         by one, with a 95 % interval over people; {} seed{}. DeepConvLSTM of {} maps and {} units, {} steps of {} windows.",
        results.dataset,
        results.subjects.len(),
        results.placements.join(" and "),
        settings.rate_hz,
        results.classes.join(", "),
        settings.seeds,
        if settings.seeds == 1 { "" } else { "s" },
        settings.maps,
        settings.hidden,
        settings.training.steps,
        settings.training.batch
    )
}

/// Variants that were tried: virtual alone, and mixed.
fn tried(results: &Results) -> Vec<(Variant, Option<&Cell>, Option<&Cell>)> {
    let of = |training, variant| results.cell(training, Some(variant), false, 1.0);
    let all = Simulator::ALL.into_iter().flat_map(Variant::all_of);
    let both = all.map(|variant| {
        (
            variant,
            of(Training::Virtual, variant),
            of(Training::Mixed, variant),
        )
    });
    both.filter(|(_, alone, mixed)| alone.or(*mixed).is_some())
        .collect()
}

fn ways(results: &Results) -> Table {
    let real = results.cell(Training::Real, None, false, 1.0);
    let columns = [
        Column::text("learned from"),
        Column::text("simulator"),
        Column::text("with"),
    ];
    let scores = [
        "alone (R2R, V2R)",
        "real and virtual (Mix2R)",
        "Mix2R over R2R",
    ]
    .map(Column::numbers);
    let alone = |name: &str, cell| {
        [name, "", "", &score(cell), "", ""]
            .map(str::to_owned)
            .to_vec()
    };
    let turned = results.cell(Training::Turned, None, false, 1.0);
    let first = [
        alone("real (R2R)", real),
        alone("real, turned copies", turned),
    ];
    let row = |(variant, alone, mixed): (Variant, Option<&Cell>, Option<&Cell>)| {
        let (simulator, further) = (
            variant.simulator.name().to_owned(),
            variant.further().to_owned(),
        );
        vec![
            "virtual".to_owned(),
            simulator,
            further,
            score(alone),
            score(mixed),
            gain(compared(results, mixed, real)),
        ]
    };
    let rows = first
        .into_iter()
        .chain(tried(results).into_iter().map(row))
        .collect();
    Table {
        columns: columns.into_iter().chain(scores).collect(),
        rows,
    }
}

fn ways_chart(results: &Results) -> BarChart {
    let bar = |cell: Option<&Cell>| cell.map(|cell| bar(cell.training.name(), cell));
    let group = |(variant, alone, mixed): (Variant, Option<&Cell>, Option<&Cell>)| Group {
        label: variant.name(),
        bars: [bar(alone), bar(mixed)].into_iter().flatten().collect(),
    };
    let real = results.cell(Training::Real, None, false, 1.0);
    BarChart {
        title: "Macro F1 on people held out".to_owned(),
        y_label: "macro F1, %".to_owned(),
        groups: tried(results).into_iter().map(group).collect(),
        level: real.map(|cell| Level {
            value: 100.0 * cell.mean,
            label: "R2R".to_owned(),
        }),
    }
}

fn bar(series: &str, cell: &Cell) -> Bar {
    Bar {
        series: series.to_owned(),
        value: 100.0 * cell.mean,
        interval: Some((100.0 * cell.interval[0], 100.0 * cell.interval[1])),
    }
}

/// Share, real alone, real with turned copies, and mixed by the chosen variant.
type Share<'a> = (f64, [Option<&'a Cell>; 3]);

fn shares(results: &Results) -> impl Iterator<Item = Share<'_>> {
    let ways = [
        (Training::Real, false),
        (Training::Turned, false),
        (Training::Mixed, true),
    ];
    let of = move |share| {
        (
            share,
            ways.map(|(training, chosen)| results.cell(training, None, chosen, share)),
        )
    };
    results.settings.shares.iter().copied().map(of)
}

fn curve(results: &Results) -> Table {
    let scores = [
        "R2R",
        "R2R, turned",
        "Mix2R, variant chosen by the other people's scores",
    ];
    let heads = scores
        .into_iter()
        .chain(["Mix2R over R2R", "over R2R, turned"])
        .map(Column::numbers);
    let row = |(share, cells): Share<'_>| {
        let [real, turned, mixed] = cells;
        let known = real
            .or(mixed)
            .and_then(|cell| cell.runs.first())
            .map_or(0, |run| run.known.len());
        let share = format!("{:.0} % ({known})", 100.0 * share);
        let gains = [real, turned].map(|other| gain(compared(results, mixed, other)));
        [share]
            .into_iter()
            .chain(cells.map(score))
            .chain(gains)
            .collect()
    };
    let columns = [Column::text("training subjects")]
        .into_iter()
        .chain(heads)
        .collect();
    Table {
        columns,
        rows: shares(results).map(row).collect(),
    }
}

fn curve_chart(results: &Results) -> LineChart {
    let point = |share: f64, cell: Option<&Cell>| {
        let Bar {
            value, interval, ..
        } = bar("", cell?);
        Some(Point {
            x: 100.0 * share,
            y: value,
            interval,
        })
    };
    let line = |(way, label): (usize, &str)| {
        let points = shares(results)
            .filter_map(|(share, cells)| point(share, cells[way]))
            .collect();
        Line {
            label: label.to_owned(),
            points,
        }
    };
    LineChart {
        title: "Macro F1 on people held out, by how many people's real data are learned from"
            .to_owned(),
        x_label: "training subjects, %".to_owned(),
        y_label: "macro F1, %".to_owned(),
        logarithmic_x: true,
        lines: ["R2R", "R2R, turned", "Mix2R (chosen)"]
            .into_iter()
            .enumerate()
            .map(line)
            .collect(),
        level: None,
    }
}

/// Ways of learning whose classes are compared.
fn compared_by_class(results: &Results) -> Vec<(&'static str, &Cell)> {
    let mapped = |simulator| {
        Some(Variant {
            mapped: true,
            ..Variant::plain(simulator)
        })
    };
    let cells = [
        ("R2R", results.cell(Training::Real, None, false, 1.0)),
        (
            "Mix2R (chosen)",
            results.cell(Training::Mixed, None, true, 1.0),
        ),
        (
            "V2R (analytic, plain)",
            results.cell(
                Training::Virtual,
                Some(Variant::plain(Simulator::Analytic)),
                false,
                1.0,
            ),
        ),
        (
            "V2R (learned, plain)",
            results.cell(
                Training::Virtual,
                Some(Variant::plain(Simulator::Learned)),
                false,
                1.0,
            ),
        ),
        (
            "V2R (learned, distribution mapping)",
            results.cell(Training::Virtual, mapped(Simulator::Learned), false, 1.0),
        ),
    ];
    cells
        .into_iter()
        .filter_map(|(name, cell)| Some((name, cell?)))
        .collect()
}

fn classes(results: &Results) -> Table {
    let columns = [Column::text("F1 of a class, %")]
        .into_iter()
        .chain(results.classes.iter().map(Column::numbers))
        .collect();
    let row = |(name, cell): (&str, &Cell)| {
        let scores = cell
            .class_f1
            .iter()
            .map(|f1| f1.map_or("-".to_owned(), percent));
        [name.to_owned()].into_iter().chain(scores).collect()
    };
    Table {
        columns,
        rows: compared_by_class(results).into_iter().map(row).collect(),
    }
}

fn classes_chart(results: &Results) -> BarChart {
    let group = |(class, label): (usize, &String)| Group {
        label: label.clone(),
        bars: compared_by_class(results)
            .into_iter()
            .filter_map(|(name, cell)| {
                let value = 100.0 * cell.class_f1.get(class).copied().flatten()?;
                Some(Bar {
                    series: name.to_owned(),
                    value,
                    interval: None,
                })
            })
            .collect(),
    };
    BarChart {
        title: "F1 of each class".to_owned(),
        y_label: "F1, %".to_owned(),
        groups: results.classes.iter().enumerate().map(group).collect(),
        level: None,
    }
}

fn notes(results: &Results) -> Vec<String> {
    let side = &results.virtual_side;
    let draws: Vec<String> = side.draws.iter().map(usize::to_string).collect();
    let virtual_side = format!(
        "Virtual side: {} clips, played by drawn people {} times (seed by seed) until every class has {} windows; scarce classes come from \
         more draws of the same few clips. {} clips named atypical are left out.",
        side.clips,
        draws.join(", "),
        results.settings.virtual_windows,
        side.left_out.len()
    );
    let skipped = results
        .skipped
        .iter()
        .map(|skipped| format!("Not tried: {}: {}.", skipped.what, skipped.reason));
    [virtual_side].into_iter().chain(skipped).collect()
}
