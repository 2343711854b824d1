//! Results as tables.

use cromosim_charts::{Column, Table};

use super::condition::TrainingData;
use super::results::{ActivityResults, Comparison, ConditionResults};
use super::selections::{CurvePoint, TriedVariant, compared_by_class, learning_curve, tried};

fn percent(value: f64) -> String {
    format!("{:.1}", 100.0 * value)
}

/// A mean score with its interval, %; a dash without one.
fn score(found: Option<&ConditionResults>) -> String {
    found.map_or("-".to_owned(), |found| {
        format!(
            "{} [{}, {}]",
            percent(found.mean),
            percent(found.interval[0]),
            percent(found.interval[1])
        )
    })
}

/// A gain with its interval, points; a dash without one.
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

/// What a condition gains over another, where both were tried and compared.
fn comparison<'a>(
    results: &'a ActivityResults,
    one: Option<&ConditionResults>,
    over: Option<&ConditionResults>,
) -> Option<&'a Comparison> {
    let (one, over) = (one?.name(), over?.name());
    results
        .comparisons
        .iter()
        .find(|found| found.one == one && found.over == over)
}

/// Data, scores and classifier, in a sentence each.
pub(super) fn head(results: &ActivityResults) -> String {
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

/// What is learned from: real windows, and every variant alone and mixed.
pub(super) fn conditions_table(results: &ActivityResults) -> Table {
    let real = results.condition(TrainingData::Real, None, 1.0);
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
    let alone = |name: &str, found| {
        [name, "", "", &score(found), "", ""]
            .map(str::to_owned)
            .to_vec()
    };
    let turned = results.condition(TrainingData::Turned, None, 1.0);
    let first = [
        alone("real (R2R)", real),
        alone("real, turned copies", turned),
    ];
    let row = |tried: TriedVariant<'_>| {
        vec![
            "virtual".to_owned(),
            tried.variant.simulator.name().to_owned(),
            tried.variant.addition().to_owned(),
            score(tried.alone),
            score(tried.mixed),
            gain(comparison(results, tried.mixed, real)),
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

/// How much real data is needed, at each share of the training subjects.
pub(super) fn curve_table(results: &ActivityResults) -> Table {
    let scores = [
        "R2R",
        "R2R, turned",
        "Mix2R, variant chosen by the other people's scores",
    ];
    let heads = scores
        .into_iter()
        .chain(["Mix2R over R2R", "over R2R, turned"])
        .map(Column::numbers);
    let row = |point: CurvePoint<'_>| {
        let [real, turned, mixed] = point.conditions;
        let known = real
            .or(mixed)
            .and_then(|found| found.runs.first())
            .map_or(0, |run| run.known.len());
        let share = format!("{:.0} % ({known})", 100.0 * point.share);
        let gains = [real, turned].map(|other| gain(comparison(results, mixed, other)));
        [share]
            .into_iter()
            .chain(point.conditions.map(score))
            .chain(gains)
            .collect()
    };
    let columns = [Column::text("training subjects")]
        .into_iter()
        .chain(heads)
        .collect();
    Table {
        columns,
        rows: learning_curve(results).map(row).collect(),
    }
}

/// F1 of each class.
pub(super) fn classes_table(results: &ActivityResults) -> Table {
    let columns = [Column::text("F1 of a class, %")]
        .into_iter()
        .chain(results.classes.iter().map(Column::numbers))
        .collect();
    let row = |(name, found): (&str, &ConditionResults)| {
        let scores = found
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

/// What to mind when reading the scores.
pub(super) fn notes(results: &ActivityResults) -> Vec<String> {
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
