//! Results as pictures.

use cromosim_charts::{Bar, BarChart, Group, Level, Line, LineChart, Point};

use super::condition::TrainingData;
use super::results::{ActivityResults, ConditionResults};
use super::selections::{CurvePoint, TriedVariant, compared_by_class, learning_curve, tried};

/// Every variant, alone and mixed.
pub(super) fn conditions_chart(results: &ActivityResults) -> BarChart {
    let bars =
        |found: Option<&ConditionResults>| found.map(|found| bar(found.training.name(), found));
    let group = |tried: TriedVariant<'_>| Group {
        label: tried.variant.name(),
        bars: [bars(tried.alone), bars(tried.mixed)]
            .into_iter()
            .flatten()
            .collect(),
    };
    let real = results.condition(TrainingData::Real, None, 1.0);
    BarChart {
        title: "Macro F1 on people held out".to_owned(),
        y_label: "macro F1, %".to_owned(),
        groups: tried(results).into_iter().map(group).collect(),
        level: real.map(|found| Level {
            value: 100.0 * found.mean,
            label: "R2R".to_owned(),
        }),
    }
}

/// A mean score with its interval, %.
fn bar(series: &str, found: &ConditionResults) -> Bar {
    Bar {
        series: series.to_owned(),
        value: 100.0 * found.mean,
        interval: Some((100.0 * found.interval[0], 100.0 * found.interval[1])),
    }
}

/// Scores by the share of the training subjects.
pub(super) fn curve_chart(results: &ActivityResults) -> LineChart {
    let line = |(index, label): (usize, &str)| {
        let point = |point: CurvePoint<'_>| {
            let Bar {
                value, interval, ..
            } = bar("", point.conditions[index]?);
            Some(Point {
                x: 100.0 * point.share,
                y: value,
                interval,
            })
        };
        Line {
            label: label.to_owned(),
            points: learning_curve(results).filter_map(point).collect(),
            is_reference: false,
        }
    };
    LineChart {
        title: "Macro F1 on people held out, by how many people's real data are learned from"
            .to_owned(),
        x_label: "training subjects, %".to_owned(),
        y_label: "macro F1, %".to_owned(),
        logarithmic_x: true,
        logarithmic_y: false,
        lines: ["R2R", "R2R, turned", "Mix2R (chosen)"]
            .into_iter()
            .enumerate()
            .map(line)
            .collect(),
        level: None,
    }
}

/// F1 of each class.
pub(super) fn classes_chart(results: &ActivityResults) -> BarChart {
    let group = |(class, label): (usize, &String)| Group {
        label: label.clone(),
        bars: compared_by_class(results)
            .into_iter()
            .filter_map(|(name, found)| {
                let value = 100.0 * found.class_f1.get(class).copied().flatten()?;
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
