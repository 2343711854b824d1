//! Whether fitted effects look like what they are named after.

use cromosim_imu::{Channel, EffectKind, EffectSet, PerChannel, Search, SpectralLine, Stage};
use cromosim_spatial::{PoseLine, Spectrum};

use crate::fit::{Fit, FitModel};
use crate::lever_arm_by_readings;
use crate::policy::vibration::{
    ABOVE_HZ, BELOW_HZ, CLEARLY_IN_REFERENCE_HEIGHT, CLEARLY_IN_REFERENCE_PART,
    FASTEST_STEADY_MOTION_HZ, IN_REFERENCE_HEIGHT, IN_REFERENCE_PART, LEAST_HEIGHT, LEAST_HZ,
    LEAST_POWER, MOST_HEIGHT_LEFT, MOST_LEFT, SURROUNDINGS_HZ,
};
use crate::trace::trace;

/// Whether fitted effects are what they are named after.
pub(crate) fn is_sound(model: &FitModel, fit: &Fit) -> bool {
    is_plausible(&fit.set)
        && fit
            .set
            .iter()
            .all(|effect| may_be_told(model, effect.kind()))
        && is_true_vibration(model, fit)
        && lever_arm_by_readings::is_in_readings(model, fit)
}

/// Whether the fitted values are what such effects have: a filter that passes all motion, or a
/// tissue stiffer than any, are no causes but the reference's own smoothing error in their disguise.
fn is_plausible(set: &EffectSet) -> bool {
    plausible_members(set) == *set
}

/// The effects of a set whose values are.
pub(crate) fn plausible_members(set: &EffectSet) -> EffectSet {
    set.filtered(|effect| match effect.kind().spec().search {
        Search::Fitted(search) => (search.is_plausible)(effect, set),
        Search::Choice | Search::ReadOff(_) | Search::Given => true,
    })
}

/// Whether an effect can be told from the shape of a smoothing of the reference, where one is undone.
pub(crate) fn may_be_told(model: &FitModel, kind: EffectKind) -> bool {
    model.basis.undone_smoothing.is_none() || is_told_from_smoothing(kind)
}

/// The effects that can be told from the shape of a smoothing that is undone.
pub(crate) fn told_from_smoothing(set: &EffectSet) -> EffectSet {
    set.filtered(|effect| is_told_from_smoothing(effect.kind()))
}

/// The shape of a smoothing is only guessed, and what is left of it looks like a tissue under the sensor.
fn is_told_from_smoothing(kind: EffectKind) -> bool {
    kind.spec().stage != Stage::Tissue
}

/// Whether a vibration in the set is more than motion that the reference does not resolve: strong
/// against the white noise of a channel, faster than gait, a line there, and one sinusoid that takes
/// most of the line away in each channel that has it.
fn is_true_vibration(model: &FitModel, fit: &Fit) -> bool {
    let Some((kind, line)) = fit
        .set
        .iter()
        .find_map(|effect| Some((effect.kind(), effect.spectral_line()?)))
    else {
        return true;
    };
    if !is_strong(&line, model.basis.sigma) || line.hz < LEAST_HZ {
        return false;
    }
    let prepared = model.prepared;
    let excluded = prepared.predict(&model.track, &fit.set.without(kind));
    let before = prepared.residual(&excluded.readings);
    let after = prepared.residual(&fit.prediction.readings);
    let line_of = |series: &[Vec<f64>], channel: Channel| {
        LineInSpectrum::at(&prepared.channel_spectrum(series, channel), line.hz)
    };
    let mut stands_out = false;
    for channel in Channel::ALL {
        let (before, left) = (line_of(&before, channel), line_of(&after, channel));
        let is_high = before.height > LEAST_HEIGHT;
        trace(|| {
            eprintln!(
                "  line of {:.3} Hz in {channel:?}: height {:.1} -> {:.1}, power {:.2e} -> {:.2e}",
                line.hz, before.height, left.height, before.power, left.power
            )
        });
        let is_taken_away = left.power < MOST_LEFT * before.power;
        if !is_taken_away && (is_high || left.height > MOST_HEIGHT_LEFT) {
            return false;
        }
        stands_out |= is_high;
    }
    stands_out && !is_in_reference(model, &line)
}

/// Whether the reference has the line too, if below its noise: what goes on for minutes at one frequency shows in all
/// of its poses together where no filter passes it. A gait is motion then, of which the reference resolves too little, or
/// a smoothing has left little;
/// faster than any, it is a machine that shakes what the reference is of as well, and a vibration to the sensor.
fn is_in_reference(model: &FitModel, line: &SpectralLine) -> bool {
    if line.hz > FASTEST_STEADY_MOTION_HZ {
        return false;
    }
    let Some(lines) = model.prepared.estimate.lines_at(line.hz) else {
        return false;
    };
    let has_it = |(channel, own): (Channel, &PoseLine)| {
        let power = line.power(channel);
        let is_there = |height: f64, part: f64| own.height > height && own.power > part * power;
        power > 0.0
            && (is_there(IN_REFERENCE_HEIGHT, IN_REFERENCE_PART)
                || is_there(CLEARLY_IN_REFERENCE_HEIGHT, CLEARLY_IN_REFERENCE_PART))
    };
    trace(|| eprintln!("  line of {:.3} Hz, of the reference {lines:?}", line.hz));
    Channel::ALL.into_iter().zip(&lines).any(has_it)
}

/// Whether a line is strong against the white noise (per sample) of either channel.
pub(crate) fn is_strong(line: &SpectralLine, sigma: PerChannel<f64>) -> bool {
    Channel::ALL
        .into_iter()
        .any(|channel| line.power(channel) > LEAST_POWER * sigma[channel].powi(2))
}

/// A line of a spectrum against its surroundings.
struct LineInSpectrum {
    /// Of its peak over the median of the surroundings.
    height: f64,
    /// Beyond the surroundings, summed over its bins.
    power: f64,
}

impl LineInSpectrum {
    fn at(spectrum: &Spectrum, hz: f64) -> Self {
        let around = spectrum
            .median(hz - SURROUNDINGS_HZ, hz + SURROUNDINGS_HZ)
            .unwrap_or(0.0)
            .max(1e-30);
        let band = spectrum.band(hz - BELOW_HZ, hz + ABOVE_HZ);
        Self {
            height: band.iter().copied().fold(0.0, f64::max) / around,
            power: band.iter().sum::<f64>() - around * band.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use cromosim_imu::{Effect, EffectKind};

    #[test]
    fn a_filter_that_passes_all_leaves_what_stands_beside_it() {
        let set = |cutoff_hz: f64| {
            let mut set = EffectSet::new();
            for (kind, value) in [
                (EffectKind::LowPass, cutoff_hz),
                (EffectKind::ClockDrift, -1300.0),
            ] {
                set.insert(Effect::new(kind, vec![value]).unwrap());
            }
            set
        };
        assert_eq!(plausible_members(&set(8.0)), set(8.0));
        let rest = plausible_members(&set(60.0));
        assert_eq!(rest, set(60.0).without(EffectKind::LowPass));
        assert!(!is_plausible(&set(60.0)) && is_plausible(&rest));
    }
}
