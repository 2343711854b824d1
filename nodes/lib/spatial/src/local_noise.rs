//! Noise of poses that is louder for some seconds: markers that are hidden, seen from afar or by few cameras.

use crate::Spectrum;

/// Parts of the Nyquist frequency in each of which a window's spectrum has to stand above that of the whole
/// series: motion falls from one to the next, noise stays.
const PARTS: [(f64, f64); 3] = [(0.45, 0.6), (0.6, 0.75), (0.75, 0.95)];
/// By how much, as a factor: the median over some thirty frequencies, smoothed over neighbours and over three
/// axes, scatters by less than a tenth. No source for the number.
const LOUDER: f64 = 1.4;

/// Density of a window's noise in units of that of the whole series, at least 1, from its spectrum and the
/// mean one: whatever shape the noise has.
///
/// Without it, all frequencies of such a window stand out of the noise, pass for motion and come through
/// twice differentiated.
pub(crate) fn local_noise(spectrum: &Spectrum, rate_hz: f64, mean: &Spectrum) -> f64 {
    let louder = |(from, to): (f64, f64)| {
        let part = |hz: f64| (from..to).contains(&(2.0 * hz / rate_hz));
        let places = (0..spectrum.density.len()).filter(|k| part(spectrum.frequency(*k)));
        let mut ratios: Vec<f64> = places
            .map(|k| spectrum.density[k] / mean.at(spectrum.frequency(k)).max(f64::MIN_POSITIVE))
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).copied()
    };
    let ratios = PARTS.into_iter().filter_map(louder);
    let least = ratios.fold(f64::INFINITY, f64::min);
    if least.is_finite() && least > LOUDER {
        least
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::local_noise;
    use crate::Spectrum;

    fn found(density: impl Fn(f64) -> f64) -> f64 {
        let spacing_hz = 0.25;
        let density = (0..240).map(|k| density(f64::from(k) * spacing_hz));
        let spectrum = Spectrum {
            spacing_hz,
            density: density.collect(),
            windows: 1,
        };
        let mean = Spectrum {
            density: vec![1e-9; 240],
            ..spectrum.clone()
        };
        local_noise(&spectrum, 120.0, &mean)
    }

    #[test]
    fn noise_is_louder_where_all_of_the_upper_band_is() {
        let motion = |hz: f64| 1e-3 / (1.0 + hz.powi(8));
        assert_eq!(found(|hz| 1e-9 + motion(hz)), 1.0, "the usual noise");
        assert!((found(|hz| 5e-9 + motion(hz)) - 5.0).abs() < 0.1);
        let impact = |hz: f64| 1e-9 * (1.0 + (45.0 / hz.max(1.0)).powi(8));
        assert_eq!(found(impact), 1.0, "motion that reaches into the band");
    }
}
