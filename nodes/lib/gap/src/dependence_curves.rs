//! What the rest that no effect explains goes with, for pictures.

use cromosim_imu::{AXES, Channel, Dependence, Reading};

use crate::axes::{axes_of_channel, channel_of_axis, value_on_axis};
use crate::findings::{Findings, ResidualDependence};
use crate::metrics::Comparison;
use crate::residual_regressions::{dependence_name, other, up_in_segment};

/// Parts of equally many readings of which each has its mean.
const BINS: usize = 16;
/// Readings shown beside the means.
const POINTS: usize = 600;
/// Readings that means are of, about; more of a long recording change no picture.
const READINGS: usize = 20_000;

/// The residual of one axis against what it depends on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DependenceCurve {
    /// Channel and axis, such as `accel_x`.
    pub axis: String,
    /// As in `depends_on` of diagnosis.json.
    pub depends_on: String,
    /// Of what is left beyond noise in both channels, what a regression on it predicts on held-out time.
    pub share: f64,
    /// What runs to the right, with its unit.
    pub x_label: String,
    /// What runs upwards, with its unit.
    pub y_label: String,
    /// Some of the readings; none where y is no reading but a slope.
    pub points: Vec<(f64, f64)>,
    /// The mean of each sixteenth of the readings.
    pub means: Vec<(f64, f64)>,
}

/// A candidate for x, and what the residual is divided by.
struct Candidate {
    axis: usize,
    x: Vec<f64>,
    x_label: String,
    /// The residual is a slope times this; without, it is shown as it is.
    slope_of: Option<Slope>,
}

/// A residual that is proportional to something whose factor changes with time.
struct Slope {
    regressor: Vec<f64>,
    label: &'static str,
    /// From the slope to what the label says.
    factor: f64,
}

/// Of each dependence the axis, and the quantity to the right, that show it best.
pub(crate) fn dependence_curves(
    findings: &Findings,
    comparison: &Comparison,
    after: &[Reading],
) -> Vec<DependenceCurve> {
    let dependences = findings
        .unknown
        .iter()
        .flat_map(|unknown| &unknown.dependences);
    let scene = Scene {
        findings,
        comparison,
        after,
    };
    dependences
        .filter_map(|dependence| scene.curve(dependence))
        .collect()
}

struct Scene<'a> {
    findings: &'a Findings<'a>,
    comparison: &'a Comparison<'a>,
    after: &'a [Reading],
}

impl Scene<'_> {
    fn curve(&self, dependence: &ResidualDependence) -> Option<DependenceCurve> {
        let shown = |candidate: Candidate| {
            let curve = self.binned(&candidate);
            (curve.0, candidate, curve.1)
        };
        let (_, candidate, means) = self
            .candidates(dependence.dependence, dependence.channel)
            .into_iter()
            .map(shown)
            .reduce(|best, other| if other.0 > best.0 { other } else { best })?;
        let unit = unit(candidate.axis);
        Some(DependenceCurve {
            axis: AXES[candidate.axis].to_owned(),
            depends_on: dependence_name(dependence.dependence, dependence.channel).to_owned(),
            share: dependence.share,
            points: self.points(&candidate),
            y_label: candidate.slope_of.map_or_else(
                || format!("residual, {unit}"),
                |slope| slope.label.to_owned(),
            ),
            x_label: candidate.x_label,
            means,
        })
    }

    /// Numbers of readings that are compared on an axis, evenly spread.
    fn used(&self, axis: usize) -> impl Iterator<Item = usize> + '_ {
        let usable = &self.comparison.prepared.usable;
        let step = self.after.len().div_ceil(READINGS).max(1);
        (0..self.after.len())
            .step_by(step)
            .filter(move |k| usable[*k][axis])
    }

    fn residual(&self, axis: usize, k: usize) -> f64 {
        value_on_axis(&self.comparison.measured[k], axis) - value_on_axis(&self.after[k], axis)
    }

    /// How much of the residual's square the means of bins explain, and these.
    fn binned(&self, candidate: &Candidate) -> (f64, Vec<(f64, f64)>) {
        let axis = candidate.axis;
        let mut order: Vec<usize> = self.used(axis).collect();
        order.sort_by(|a, b| candidate.x[*a].total_cmp(&candidate.x[*b]));
        let total: f64 = order.iter().map(|k| self.residual(axis, *k).powi(2)).sum();
        let mean_of_all =
            order.iter().map(|k| self.residual(axis, *k)).sum::<f64>() / order.len().max(1) as f64;
        let (mut explained, mut means) = (0.0, Vec::new());
        for bin in order.chunks(order.len().div_ceil(BINS).max(1)) {
            let count = bin.len() as f64;
            let x = bin.iter().map(|k| candidate.x[*k]).sum::<f64>() / count;
            let weight = |k: usize| candidate.slope_of.as_ref().map_or(1.0, |s| s.regressor[k]);
            let cross: f64 = bin
                .iter()
                .map(|k| weight(*k) * self.residual(axis, *k))
                .sum();
            let square: f64 = bin.iter().map(|k| weight(*k).powi(2)).sum();
            if square <= 0.0 {
                continue;
            }
            let slope = cross / square;
            match &candidate.slope_of {
                Some(of) => {
                    explained += slope * slope * square;
                    means.push((x, of.factor * slope));
                }
                None => {
                    explained += count * (slope - mean_of_all).powi(2);
                    means.push((x, slope));
                }
            }
        }
        (explained / total.max(f64::MIN_POSITIVE), means)
    }

    /// Evenly spread readings.
    fn points(&self, candidate: &Candidate) -> Vec<(f64, f64)> {
        if candidate.slope_of.is_some() {
            return Vec::new();
        }
        let used: Vec<usize> = self.used(candidate.axis).collect();
        let step = used.len().div_ceil(POINTS).max(1);
        let point = |k: &usize| (candidate.x[*k], self.residual(candidate.axis, *k));
        used.iter().step_by(step).map(point).collect()
    }

    fn candidates(&self, dependence: Dependence, channel: Channel) -> Vec<Candidate> {
        let axes = axes_of_channel(channel);
        let others = axes_of_channel(other(channel));
        let pairs = |list: std::ops::Range<usize>| {
            axes.clone()
                .flat_map(move |axis| list.clone().map(move |of| (axis, of)))
        };
        match dependence {
            Dependence::OwnReading => axes.map(|axis| self.against(axis, axis)).collect(),
            Dependence::OtherAxes => pairs(axes.clone())
                .filter(|(axis, of)| axis != of)
                .map(|(axis, of)| self.against(axis, of))
                .collect(),
            Dependence::OtherChannel => pairs(others)
                .map(|(axis, of)| self.against(axis, of))
                .collect(),
            Dependence::OtherChannelSquared => self.against_squares(channel),
            Dependence::Orientation => self.against_up(channel),
            Dependence::RateOfChange => axes.map(|axis| self.against_change(axis)).collect(),
            Dependence::Time => axes.map(|axis| self.over_time(axis, None)).collect(),
            Dependence::GainOverTime => axes
                .map(|axis| {
                    let slope =
                        self.slope(|k| value_on_axis(&self.after[k], axis), "gain less 1", 1.0);
                    self.over_time(axis, Some(slope))
                })
                .collect(),
            Dependence::DelayOverTime => axes
                .map(|axis| {
                    let slope = self.slope(|k| self.change(axis, k), "delay, ms", -1e3);
                    self.over_time(axis, Some(slope))
                })
                .collect(),
            Dependence::MountOverTime => pairs(axes.clone())
                .filter(|(axis, of)| axis != of)
                .map(|(axis, of)| {
                    let turned = |k: usize| value_on_axis(&self.after[k], of);
                    let slope = self.slope(turned, "small turn, degrees", 1f64.to_degrees());
                    self.over_time(axis, Some(slope))
                })
                .collect(),
        }
    }

    fn quantity(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.after.len()).map(of).collect()
    }

    fn against(&self, axis: usize, of: usize) -> Candidate {
        Candidate {
            axis,
            x: self.quantity(|k| value_on_axis(&self.after[k], of)),
            x_label: format!("simulated {}, {}", quantity_name(of), unit(of)),
            slope_of: None,
        }
    }

    /// Products of two components of the other channel.
    fn against_squares(&self, channel: Channel) -> Vec<Candidate> {
        let first = axes_of_channel(other(channel)).start;
        let mut list = Vec::new();
        for axis in axes_of_channel(channel) {
            for i in 0..3 {
                for j in i..3 {
                    let product = |k: usize| {
                        let at = |i: usize| value_on_axis(&self.after[k], first + i);
                        at(i) * at(j)
                    };
                    let (a, b) = (
                        quantity_name(first + i),
                        &AXES[first + j][AXES[first + j].len() - 1..],
                    );
                    list.push(Candidate {
                        axis,
                        x: self.quantity(product),
                        x_label: format!("simulated {a} times {b}, ({})²", unit(first)),
                        slope_of: None,
                    });
                }
            }
        }
        list
    }

    /// Components of up as the segment sees it.
    fn against_up(&self, channel: Channel) -> Vec<Candidate> {
        let up = up_in_segment(&self.findings.model, &self.comparison.prepared.stamps);
        axes_of_channel(channel)
            .flat_map(|axis| (0..3).map(move |i| (axis, i)))
            .map(|(axis, i)| Candidate {
                axis,
                x: up.iter().map(|up| up[i]).collect(),
                x_label: format!(
                    "{} component of up, in the reference's axes",
                    ["x", "y", "z"][i]
                ),
                slope_of: None,
            })
            .collect()
    }

    /// Change of the simulated reading, 1/s.
    fn change(&self, axis: usize, k: usize) -> f64 {
        let stamps = &self.comparison.prepared.stamps;
        let (from, to) = (k.saturating_sub(1), (k + 1).min(self.after.len() - 1));
        let at = |k: usize| value_on_axis(&self.after[k], axis);
        (at(to) - at(from)) / (stamps[to] - stamps[from]).max(1e-6)
    }

    fn against_change(&self, axis: usize) -> Candidate {
        Candidate {
            axis,
            x: self.quantity(|k| self.change(axis, k)),
            x_label: format!(
                "change of simulated {}, {} per s",
                quantity_name(axis),
                unit(axis)
            ),
            slope_of: None,
        }
    }

    fn slope(&self, of: impl Fn(usize) -> f64, label: &'static str, factor: f64) -> Slope {
        Slope {
            regressor: self.quantity(of),
            label,
            factor,
        }
    }

    fn over_time(&self, axis: usize, slope_of: Option<Slope>) -> Candidate {
        let stamps = &self.comparison.prepared.stamps;
        Candidate {
            axis,
            x: stamps.iter().map(|stamp| *stamp - stamps[0]).collect(),
            x_label: "time since the first IMU message, s".to_owned(),
            slope_of,
        }
    }
}

fn unit(axis: usize) -> &'static str {
    match channel_of_axis(axis) {
        Channel::Accelerometer => "m/s²",
        Channel::Gyroscope => "rad/s",
    }
}

/// `specific force x`.
fn quantity_name(axis: usize) -> String {
    let name = match channel_of_axis(axis) {
        Channel::Accelerometer => "specific force",
        Channel::Gyroscope => "angular velocity",
    };
    format!("{name} {}", ["x", "y", "z"][axis % 3])
}
