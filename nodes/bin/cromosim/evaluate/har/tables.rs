//! Results as Markdown.

use std::fmt::Write;

use super::results::{Cell, Comparison, Results, Skipped, Training, Variant};
use super::simulated::Simulator;

/// The tables of a README.
pub fn markdown(results: &Results) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = head(results, &mut text);
    let _ = ways(results, &mut text);
    let _ = curve(results, &mut text);
    let _ = classes(results, &mut text);
    let _ = notes(results, &mut text);
    text
}

fn percent(value: f64) -> String {
    format!("{:.1}", 100.0 * value)
}

fn score(cell: Option<&Cell>) -> String {
    cell.map_or("-".to_owned(), |cell| format!("{} [{}, {}]", percent(cell.mean), percent(cell.interval[0]), percent(cell.interval[1])))
}

fn gain(comparison: Option<&Comparison>) -> String {
    comparison.map_or("-".to_owned(), |found| {
        format!("{:+.1} [{:+.1}, {:+.1}]", 100.0 * found.gain, 100.0 * found.interval[0], 100.0 * found.interval[1])
    })
}

fn compared<'a>(results: &'a Results, of: Option<&Cell>, over: Option<&Cell>) -> Option<&'a Comparison> {
    let (of, over) = (of?.name(), over?.name());
    results.comparisons.iter().find(|found| found.of == of && found.over == over)
}

fn head(results: &Results, text: &mut String) -> std::fmt::Result {
    let settings = &results.settings;
    let windows: usize = results.subjects.iter().flat_map(|subject| &subject.windows).sum();
    writeln!(
        text,
        "Recordings: {}, {} people, {windows} windows of 1 s of {} at {} Hz; classes {}. Macro F1 in %, mean over the people held out one \
         by one, with a 95 % interval over people; {} seed{}. DeepConvLSTM of {} maps and {} units, {} steps of {} windows.\n",
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

fn ways(results: &Results, text: &mut String) -> std::fmt::Result {
    let real = results.cell(Training::Real, None, false, 1.0);
    writeln!(text, "| learned from | simulator | with | virtual alone (V2R) | real and virtual (Mix2R) | Mix2R over R2R |")?;
    writeln!(text, "|---|---|---|---|---|---|")?;
    writeln!(text, "| real (R2R) | | | {} | | |", score(real))?;
    for variant in Simulator::ALL.into_iter().flat_map(Variant::all_of) {
        let of = |training| results.cell(training, Some(variant), false, 1.0);
        let (alone, mixed) = (of(Training::Virtual), of(Training::Mixed));
        if alone.or(mixed).is_some() {
            let (simulator, further) = (variant.simulator.name(), variant.further());
            let gained = gain(compared(results, mixed, real));
            writeln!(text, "| virtual | {simulator} | {further} | {} | {} | {gained} |", score(alone), score(mixed))?;
        }
    }
    writeln!(text)
}

fn curve(results: &Results, text: &mut String) -> std::fmt::Result {
    writeln!(text, "| training subjects | R2R | Mix2R, variant chosen by the other people's scores | Mix2R over R2R |")?;
    writeln!(text, "|---|---|---|---|")?;
    for share in &results.settings.shares {
        let real = results.cell(Training::Real, None, false, *share);
        let mixed = results.cell(Training::Mixed, None, true, *share);
        let known = real.or(mixed).and_then(|cell| cell.runs.first()).map_or(0, |run| run.known.len());
        let gained = gain(compared(results, mixed, real));
        writeln!(text, "| {:.0} % ({known}) | {} | {} | {gained} |", 100.0 * share, score(real), score(mixed))?;
    }
    writeln!(text)
}

fn classes(results: &Results, text: &mut String) -> std::fmt::Result {
    let cells = [
        ("R2R", results.cell(Training::Real, None, false, 1.0)),
        ("Mix2R (chosen)", results.cell(Training::Mixed, None, true, 1.0)),
        ("V2R (analytic, distribution mapping)", results.cell(Training::Virtual, Some(mapped(Simulator::Analytic)), false, 1.0)),
        ("V2R (learned, distribution mapping)", results.cell(Training::Virtual, Some(mapped(Simulator::Learned)), false, 1.0)),
    ];
    writeln!(text, "| F1 of a class | {} |", results.classes.join(" | "))?;
    writeln!(text, "|---{}|", "|---".repeat(results.classes.len()))?;
    for (name, cell) in cells.into_iter().filter_map(|(name, cell)| Some((name, cell?))) {
        let scores: Vec<String> = cell.class_f1.iter().map(|f1| f1.map_or("-".to_owned(), percent)).collect();
        writeln!(text, "| {name} | {} |", scores.join(" | "))?;
    }
    writeln!(text)
}

fn mapped(simulator: Simulator) -> Variant {
    Variant { mapped: true, ..Variant::plain(simulator) }
}

fn notes(results: &Results, text: &mut String) -> std::fmt::Result {
    let side = &results.virtual_side;
    let draws: Vec<String> = side.draws.iter().map(usize::to_string).collect();
    writeln!(
        text,
        "Virtual side: {} clips, played by drawn people {} times (seed by seed) until every class has {} windows; scarce classes come from \
         more draws of the same few clips. {} clips named atypical are left out.",
        side.clips,
        draws.join(", "),
        results.settings.virtual_windows,
        side.left_out.len()
    )?;
    for Skipped { what, reason } in &results.skipped {
        writeln!(text, "Not tried: {what}: {reason}.")?;
    }
    Ok(())
}
