//! Whether what is left is noise.

use cromosim_imu::{Channel, Dependence, EffectKind, PerChannel, ReadOff, Reading};

use crate::axes::{any, axes_of_channel, larger, value_on_axis};
use crate::confounding::{Standing, Standings, confounded_effects, is_calibration};
use crate::findings::{Findings, ResidualDependence, Unknown};
use crate::fit::{Fit, FitModel};
use crate::gram::dot;
use crate::location::{Loudness, bands, locate};
use crate::mistaken_noise::loudest_beside_noise;
use crate::noise_updates::behind_wider_filters;
use crate::policy::probability::{MOST_UNKNOWN, NATS_PER_BAND, UNKNOWN_GAIN_NATS};
use crate::policy::report::{COARSE_STEPS, EXCESS_NOISE_BESIDE_UNKNOWN};
use crate::policy::unknown::{
    AXIS_SHARE, BAND, BURST, FROZEN, JITTER, MOST_GROWTH, MUCH_WIDER_HZ, ORDINARY_BAND, OUTLIERS,
    REGRESSION_NATS, STAYS, UNDONE_SMOOTHING_FACTOR, USUAL_S, WIDER_HZ,
};
use crate::prepared::PreparedPlacement;
use crate::residual_regressions::{
    ResidualRegression, dependence_name, gain_by_measured, residual_regression,
    residual_regressions,
};
use crate::search::excess;
use crate::trace::trace;

/// What is shown of what the rest depends on.
const MOST_DEPENDENCES: usize = 4;

/// Which fitted effects may be found to be confounded with what is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Suspects {
    /// All but the calibrations: these stand in for each other and for filters, and are judged once
    /// the others are gone.
    Others,
    /// Calibrations too; what stood beside the unknown before is not judged anew.
    All,
}

/// What the residual of a fit looks like.
#[derive(Clone, Debug)]
struct ResidualDiagnostics {
    /// Largest mean square of the whitened residual in a band.
    band: PerChannel<f64>,
    /// Share of values beyond five standard deviations.
    outliers: PerChannel<f64>,
    /// Largest mean square of two seconds over the median one.
    burst: PerChannel<f64>,
    /// Share of readings that repeat the one before in all axes.
    frozen: PerChannel<f64>,
    /// Standard deviation of the stamps' intervals over their median.
    jitter: f64,
}

/// What stands out of the residual.
struct Structure<'a> {
    diagnostics: &'a ResidualDiagnostics,
    /// Regressions that gain enough, the strongest first.
    strong: Vec<&'a ResidualRegression>,
    /// Channels with readings that stand still.
    stuck: PerChannel<bool>,
    /// Channels with any structure.
    in_channel: PerChannel<bool>,
    /// Whether the stamps scatter.
    in_stamps: bool,
}

/// What is left of a fit, and what was judged beside it. It holds for as long as the fit does.
pub(crate) struct Rest {
    seen: Seen,
    /// Of the fit's members.
    standings: Standings,
}

/// What is left of a fit.
struct Seen {
    diagnostics: ResidualDiagnostics,
    /// The strongest first.
    regressions: Vec<ResidualRegression>,
    /// Regressions on the prediction whose gain the readings themselves do not keep.
    of_prediction_alone: Vec<(Dependence, Channel)>,
}

impl Rest {
    /// Of the fit that was found.
    pub fn of(findings: &Findings) -> Self {
        let diagnostics = ResidualDiagnostics::new(&findings.model, &findings.scored.fit);
        let mut regressions = residual_regressions(findings);
        regressions.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        trace_regressions(&diagnostics, &regressions);
        let of_prediction_alone = of_prediction_alone(findings, &regressions);
        Self {
            seen: Seen {
                diagnostics,
                regressions,
                of_prediction_alone,
            },
            standings: Standings::new(),
        }
    }

    /// Whether a band or a burst stands out of the noise.
    pub fn is_loud(&self, model: &FitModel) -> bool {
        self.seen.diagnostics.are_loud(model)
    }
}

/// Looks for structure in the whitened residual that no named effect explains.
pub(crate) fn detect_unmodelled_structure(
    findings: &Findings,
    rest: &mut Rest,
    suspects: Suspects,
) -> Option<Unknown> {
    let structure = Structure::new(findings, &rest.seen);
    let regressions = &rest.seen.regressions;
    if !structure.stands_out(findings) {
        return None;
    }
    let location = locate(
        &findings.scored.fit.residual,
        findings.model.prepared,
        &findings.model.whitener,
    );
    let axes = location
        .axes
        .iter()
        .filter(|(_, share)| **share > AXIS_SHARE)
        .map(|(name, _)| name.clone())
        .collect();
    let excess = excess(&findings.model, &findings.scored.fit).max(1.0);
    let dependences = structure.dependences(excess);
    let predictable = dependences
        .first()
        .map_or(0.5, |dependence| dependence.share);
    let stood = |kind: EffectKind| {
        let before = findings.unknown.as_ref();
        before.is_some_and(|unknown| unknown.sound_effects.contains(&kind))
    };
    let is_suspect = |kind: EffectKind| match suspects {
        Suspects::Others => !is_calibration(kind),
        Suspects::All => is_calibration(kind) || !stood(kind),
    };
    let standings = &mut rest.standings;
    let mut confounded = confounded_effects(
        findings,
        &structure.strong,
        regressions,
        is_suspect,
        standings,
    );
    confounded.extend(structure.confounded_read_off(findings));
    let sound = standings.iter().filter(|(_, of)| **of == Standing::Sound);
    Some(Unknown {
        predictable,
        location,
        channel: structure.channel(),
        axes,
        depends_on: structure.depends_on(),
        dependences,
        probability: structure.probability(),
        confounded_effects: confounded,
        sound_effects: sound.map(|(kind, _)| *kind).collect(),
    })
}

impl<'a> Structure<'a> {
    fn new(findings: &Findings, seen: &'a Seen) -> Self {
        let (diagnostics, regressions) = (&seen.diagnostics, &seen.regressions);
        let model = &findings.model;
        let factor = bar_factor(model);
        let strong: Vec<&ResidualRegression> = regressions
            .iter()
            .filter(|regression| {
                let needed = REGRESSION_NATS * factor * longer_than_usual(findings);
                regression.gain > needed
                    && !is_coarse(model, regression.channel)
                    && !may_be_references(seen, regression)
            })
            .collect();
        let stuck = PerChannel::from_fn(|channel| {
            diagnostics.frozen[channel] > FROZEN && findings.digital[channel].lsb.is_none()
        });
        let in_channel = PerChannel::from_fn(|channel| {
            diagnostics.is_loud(model, channel)
                || stuck[channel]
                || strong
                    .iter()
                    .any(|regression| regression.channel == channel)
        });
        let in_stamps = diagnostics.jitter > JITTER
            || (!findings.library.allows_read_off(ReadOff::MissingMessages)
                && findings.model.prepared.missing.fraction > FROZEN);
        Self {
            diagnostics,
            strong,
            stuck,
            in_channel,
            in_stamps,
        }
    }

    /// Whether it is more than the reference's errors and its filters leave.
    fn stands_out(&self, findings: &Findings) -> bool {
        self.tells_by_messages()
            || (self.diagnostics.are_loud(&findings.model)
                && is_loud_behind_wider_filters(findings, self.diagnostics)
                && is_loud_beside_noise(findings, self.diagnostics))
            || (!self.strong.is_empty() && self.stays_behind_wider_filters(findings))
    }

    /// Whether stamps or repeated readings tell.
    fn tells_by_messages(&self) -> bool {
        self.in_stamps || any(self.stuck)
    }

    /// Whether any of the regressions keeps its gain where the reference is filtered much less: what its filters
    /// keep out of the motion depends on the motion as well, and comes back then; and noise that comes in can
    /// depend on itself.
    fn stays_behind_wider_filters(&self, findings: &Findings) -> bool {
        let set = &findings.scored.fit.set;
        let model = behind_wider_filters(&findings.model, MUCH_WIDER_HZ, set, &findings.library);
        let fit = model.fit_steps(set.clone(), 0);
        self.strong.iter().any(|before| {
            let after = residual_regression(&model, &fit, before.dependence, before.channel);
            let gain = after.map_or(0.0, |after| after.gain);
            trace(|| eprintln!("behind much wider filters {gain:.0} of {:.0}", before.gain));
            gain > STAYS * before.gain && gain < MOST_GROWTH * before.gain
        })
    }

    fn depends_on(&self) -> &'static str {
        if self.in_stamps {
            "time stamps"
        } else if any(self.stuck) {
            "repeated readings"
        } else if let Some(regression) = self.strong.first() {
            dependence_name(regression.dependence, regression.channel)
        } else {
            "time"
        }
    }

    /// What the strongest regressions are on, and what each predicts of the excess, nats.
    fn dependences(&self, excess: f64) -> Vec<ResidualDependence> {
        self.strong
            .iter()
            .take(MOST_DEPENDENCES)
            .map(|regression| ResidualDependence {
                dependence: regression.dependence,
                channel: regression.channel,
                share: (regression.gain / excess).clamp(0.05, 1.0),
            })
            .collect()
    }

    fn channel(&self) -> &'static str {
        let mut channels = Channel::ALL
            .into_iter()
            .filter(|channel| self.in_channel[*channel]);
        match (channels.next(), channels.next()) {
            (Some(channel), None) => channel.prefix(),
            _ => "both",
        }
    }

    fn probability(&self) -> f64 {
        let gain = self
            .strong
            .first()
            .map_or(0.0, |regression| regression.gain)
            .max(larger(self.diagnostics.band) * NATS_PER_BAND);
        MOST_UNKNOWN * (1.0 - 1.0 / (2.0 + gain / UNKNOWN_GAIN_NATS))
    }

    /// Effects read off readings and stamps that are part of the structure; noise is not that is far beyond the
    /// declared.
    fn confounded_read_off(&self, findings: &Findings) -> Vec<EffectKind> {
        let is_sure = |channel: Channel| {
            let declared = findings.declared_sigma(channel).powi(2);
            let beyond = findings.found_noise[channel].powi(2) - declared;
            beyond > EXCESS_NOISE_BESIDE_UNKNOWN * declared
        };
        let noise = Channel::ALL
            .into_iter()
            .filter(|channel| (self.in_channel[*channel] && !is_sure(*channel)) || self.in_stamps)
            .map(ReadOff::ExcessNoise);
        let stamps = self.in_stamps.then_some(ReadOff::MissingMessages);
        noise
            .chain(stamps)
            .filter_map(EffectKind::read_off)
            .collect()
    }
}

/// Length of a recording over [`USUAL_S`], at least 1: what every model leaves gains in proportion to
/// the time, however small it is.
fn longer_than_usual(findings: &Findings) -> f64 {
    let prepared = findings.model.prepared;
    (prepared.length as f64 / prepared.rate_hz / USUAL_S).max(1.0)
}

/// Factor on the bars beside a smoothing that is undone.
fn bar_factor(model: &FitModel) -> f64 {
    if model.basis.undone_smoothing.is_some() {
        UNDONE_SMOOTHING_FACTOR
    } else {
        1.0
    }
}

/// Whether a regression may be on errors of the reference: what its filters keep out of the motion goes with
/// the motion's rate of change as what a delay leaves does, and is no louder than is expected of it; what they
/// let through is in the prediction, and not in the readings.
fn may_be_references(seen: &Seen, regression: &ResidualRegression) -> bool {
    let (dependence, channel) = (regression.dependence, regression.channel);
    let is_ordinary =
        dependence == Dependence::RateOfChange && seen.diagnostics.band[channel] < ORDINARY_BAND;
    is_ordinary || seen.of_prediction_alone.contains(&(dependence, channel))
}

/// Strong regressions on the prediction's rate of change and on the other channel that keep less of their gain on the
/// readings' own: an error of the rotation turns gravity in one channel and is a rate in the other.
fn of_prediction_alone(
    findings: &Findings,
    regressions: &[ResidualRegression],
) -> Vec<(Dependence, Channel)> {
    let (model, fit) = (&findings.model, &findings.scored.fit);
    let asked = [
        Dependence::RateOfChange,
        Dependence::OtherChannel,
        Dependence::OtherChannelSquared,
    ];
    let strong = regressions.iter().filter(|regression| {
        asked.contains(&regression.dependence) && regression.gain > REGRESSION_NATS
    });
    let alone = strong.filter(|regression| {
        let (dependence, channel) = (regression.dependence, regression.channel);
        let gain = gain_by_measured(model, fit, dependence, channel);
        trace(|| {
            let of_prediction = regression.gain;
            eprintln!("{dependence:?} by the readings {gain:.0} of {of_prediction:.0}");
        });
        gain <= STAYS * regression.gain
    });
    alone
        .map(|regression| (regression.dependence, regression.channel))
        .collect()
}

/// Rounding errors of slow motion are no noise at all.
fn is_coarse(model: &FitModel, channel: Channel) -> bool {
    model.basis.steps[channel] > COARSE_STEPS
}

/// Whether the residual stays loud where the reference is filtered less: what does not is the filters'
/// own, which cut bursts off and ring where motion ends.
fn is_loud_behind_wider_filters(findings: &Findings, before: &ResidualDiagnostics) -> bool {
    let set = &findings.scored.fit.set;
    let model = behind_wider_filters(&findings.model, WIDER_HZ, set, &findings.library);
    let fit = model.fit_steps(set.clone(), 0);
    let after = ResidualDiagnostics::new(&model, &fit);
    trace(|| eprintln!("behind wider filters {after:.3?}"));
    Channel::ALL.into_iter().any(|channel| {
        let stays = |of: fn(&ResidualDiagnostics) -> PerChannel<f64>| {
            of(&after)[channel] > STAYS * of(before)[channel]
        };
        after.is_loud(&model, channel) && (stays(|own| own.band) || stays(|own| own.burst))
    })
}

/// Whether the residual is louder than noise that the reference's filters take for motion makes it.
fn is_loud_beside_noise(findings: &Findings, before: &ResidualDiagnostics) -> bool {
    let (model, fit) = (&findings.model, &findings.scored.fit);
    let factor = bar_factor(model);
    Channel::ALL.into_iter().any(|channel| {
        let stays = || {
            let loudest = loudest_beside_noise(model, fit, channel);
            loudest.is_none_or(|loudest| loudest > BAND * factor)
        };
        before.is_loud(model, channel) && (before.bursts_out(model, channel) || stays())
    })
}

impl ResidualDiagnostics {
    fn new(model: &FitModel, fit: &Fit) -> Self {
        let prepared = model.prepared;
        let count = model.whitener.count;
        Self {
            band: PerChannel::from_fn(|channel| largest_band(model, fit, channel)),
            outliers: PerChannel::from_fn(|channel| {
                outliers(fit, prepared, channel, count[channel])
            }),
            burst: PerChannel::from_fn(|channel| burst(model, fit, channel)),
            frozen: PerChannel::from_fn(|channel| frozen(prepared, channel)),
            jitter: jitter(prepared),
        }
    }

    fn are_loud(&self, model: &FitModel) -> bool {
        let is_loud = |channel| self.is_loud(model, channel);
        Channel::ALL.into_iter().any(is_loud)
    }

    /// Whether a band or a burst of a channel stands out of the noise.
    fn is_loud(&self, model: &FitModel, channel: Channel) -> bool {
        let by_band = self.band[channel] > BAND * bar_factor(model);
        !is_coarse(model, channel) && (by_band || self.bursts_out(model, channel))
    }

    fn bursts_out(&self, model: &FitModel, channel: Channel) -> bool {
        self.burst[channel] > BURST * bar_factor(model) && self.outliers[channel] > OUTLIERS
    }
}

/// Largest mean square of a channel's whitened residual in a band; the lowest band is motion.
fn largest_band(model: &FitModel, fit: &Fit, channel: Channel) -> f64 {
    let prepared = model.prepared;
    let loudness = Loudness::new(&fit.residual, prepared, &model.whitener, channel);
    bands(prepared.rate_hz / 2.0)
        .into_iter()
        .skip(1)
        .map(|(from_hz, to_hz)| loudness.between(from_hz, to_hz))
        .fold(0.0, f64::max)
}

/// Scatter of the intervals between neighbouring stamps, in units of their median.
fn jitter(prepared: &PreparedPlacement) -> f64 {
    let period = 1.0 / prepared.rate_hz;
    let mut intervals: Vec<f64> = (1..prepared.stamps.len())
        .filter(|&k| prepared.grid_index[k] == prepared.grid_index[k - 1] + 1)
        .map(|k| ((prepared.stamps[k] - prepared.stamps[k - 1]) / period - 1.0).abs())
        .collect();
    intervals.sort_unstable_by(f64::total_cmp);
    intervals
        .get(intervals.len() / 2)
        .map_or(0.0, |median| median / 0.6745)
}

/// Share of a channel's whitened residual beyond five standard deviations of it.
fn outliers(fit: &Fit, prepared: &PreparedPlacement, channel: Channel, count: f64) -> f64 {
    let axes = axes_of_channel(channel);
    let part = &fit.residual[axes.start * prepared.length..axes.end * prepared.length];
    let sigma = (dot(part, part) / count.max(1.0)).sqrt().clamp(1.0, 1.5);
    part.iter().filter(|e| e.abs() > 5.0 * sigma).count() as f64 / count.max(1.0)
}

/// Mean square of the loudest two seconds of a channel over that of the median ones.
fn burst(model: &FitModel, fit: &Fit, channel: Channel) -> f64 {
    let prepared = model.prepared;
    let step = ((2.0 * prepared.rate_hz) as usize).max(1);
    let mut blocks: Vec<f64> = (0..prepared.length / step)
        .filter_map(|block| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for axis in axes_of_channel(channel) {
                let range = axis * prepared.length + block * step
                    ..axis * prepared.length + (block + 1) * step;
                sum += fit.residual[range].iter().map(|e| e * e).sum::<f64>();
                weight += model.whitener.weight[axis][block * step..(block + 1) * step]
                    .iter()
                    .map(|w| w * w)
                    .sum::<f64>();
            }
            (weight > step as f64).then(|| sum / weight)
        })
        .collect();
    blocks.sort_unstable_by(f64::total_cmp);
    let median = blocks
        .get(blocks.len() / 2)
        .copied()
        .unwrap_or(1.0)
        .max(1.0);
    blocks.last().copied().unwrap_or(1.0) / median
}

/// Readings equal to the one before in all three axes: a live sensor's noise forbids it, unless it
/// rounds coarsely.
fn frozen(prepared: &PreparedPlacement, channel: Channel) -> f64 {
    let same = |a: &Reading, b: &Reading| {
        axes_of_channel(channel).all(|axis| value_on_axis(a, axis) == value_on_axis(b, axis))
    };
    prepared
        .measured
        .windows(2)
        .filter(|pair| same(&pair[0], &pair[1]))
        .count() as f64
        / prepared.measured.len() as f64
}

fn trace_regressions(diagnostics: &ResidualDiagnostics, regressions: &[ResidualRegression]) {
    trace(|| {
        let list: Vec<String> = regressions
            .iter()
            .take(4)
            .map(|regression| {
                let name = dependence_name(regression.dependence, regression.channel);
                let channel = regression.channel.prefix();
                format!("{name}/{channel}:{:.0}", regression.gain)
            })
            .collect();
        eprintln!("RESIDUAL {diagnostics:.3?} {}", list.join(" "));
    });
}
