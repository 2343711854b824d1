//! Correlations of two series over the offset between them.

use std::ops::Range;

use cromosim_spatial::{Complex64, FourierPair};

/// Correlations of two series at every offset, by one Fourier transform.
pub(crate) struct Correlations {
    /// `sum measured[k] reference[k - offset]`, means taken out, circular.
    products: Vec<Complex64>,
    /// Sum of squares of the measured series where the reference is known, at every offset; none where it is
    /// known everywhere.
    energy_where_known: Option<Vec<Complex64>>,
    energy_measured: Vec<f64>,
    energy_reference: Vec<f64>,
    /// Entries that have to overlap.
    least: usize,
}

/// Where two series correlate best.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peak {
    /// Of the measured series behind the reference, in entries; refined by a parabola.
    pub offset: f64,
    /// At the whole offset next to it.
    pub correlation: f64,
}

impl Correlations {
    pub fn new(measured: &[f64], reference: &[f64]) -> Self {
        Self::of_known(measured, reference, &vec![true; reference.len()])
    }

    /// Of the entries at which the reference is known: what is filled in elsewhere is not its motion.
    pub fn of_known(measured: &[f64], reference: &[f64], is_known: &[bool]) -> Self {
        let length = FourierPair::good_length(measured.len() + reference.len());
        let transform = FourierPair::new(length);
        let mean_of = |series: &[f64]| series.iter().sum::<f64>() / series.len().max(1) as f64;
        let spectrum = |values: &mut dyn Iterator<Item = f64>| {
            let mut values: Vec<Complex64> =
                values.map(|value| Complex64::new(value, 0.0)).collect();
            values.resize(length, Complex64::default());
            transform.forward(&mut values);
            values
        };
        let product = |reference: Vec<Complex64>, measured: Vec<Complex64>| {
            let pairs = reference.iter().zip(measured);
            let mut products: Vec<Complex64> = pairs.map(|(a, b)| a.conj() * b).collect();
            transform.inverse(&mut products);
            products
        };
        let known = || reference.iter().zip(is_known);
        let of_known: Vec<f64> = known().filter(|(_, is)| **is).map(|(x, _)| *x).collect();
        let (mean, mean_of_known) = (mean_of(measured), mean_of(&of_known));
        let kept: Vec<f64> = known()
            .map(|(value, is)| if *is { value - mean_of_known } else { 0.0 })
            .collect();
        let centred = || measured.iter().map(|value| value - mean);
        let energy_measured = (of_known.len() < reference.len()).then(|| {
            let mask = spectrum(&mut is_known.iter().map(|is| f64::from(u8::from(*is))));
            product(mask, spectrum(&mut centred().map(|value| value * value)))
        });
        Self {
            products: product(
                spectrum(&mut kept.iter().copied()),
                spectrum(&mut centred()),
            ),
            energy_where_known: energy_measured,
            energy_measured: cumulated_energy(centred()),
            energy_reference: cumulated_energy(kept.iter().copied()),
            least: measured.len().min(reference.len()) / 2,
        }
    }

    /// Of `measured[k]` with `reference[k - offset]`; minus infinity where too little overlaps.
    fn at(&self, offset: i64) -> f64 {
        let (measured, reference) = (
            self.energy_measured.len() as i64 - 1,
            self.energy_reference.len() as i64 - 1,
        );
        let from = offset.max(0);
        let to = measured.min(reference + offset);
        if to - from < self.least as i64 {
            return f64::NEG_INFINITY;
        }
        let between = |energy: &[f64], a: i64, b: i64| energy[b as usize] - energy[a as usize];
        let place = offset.rem_euclid(self.products.len() as i64) as usize;
        let of_measured = match &self.energy_where_known {
            Some(energy) => energy[place].re.max(0.0),
            None => between(&self.energy_measured, from, to),
        };
        let scale =
            (of_measured * between(&self.energy_reference, from - offset, to - offset)).sqrt();
        if scale > 0.0 {
            self.products[place].re / scale
        } else {
            f64::NEG_INFINITY
        }
    }

    /// The offset with the greatest sum of correlation and `bonus`; none in an empty range. At an
    /// end of the range it is not refined.
    pub fn peak(&self, offsets: Range<i64>, bonus: impl Fn(i64) -> f64) -> Option<Peak> {
        let score = |offset: i64| self.at(offset) + bonus(offset);
        let best = offsets
            .clone()
            .max_by(|&a, &b| score(a).total_cmp(&score(b)))?;
        let (before, here, after) = (self.at(best - 1), self.at(best), self.at(best + 1));
        let bend = before - 2.0 * here + after;
        let is_inside = offsets.start < best && best + 1 < offsets.end;
        let fraction = if is_inside && bend < 0.0 && bend.is_finite() {
            (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
        } else {
            0.0
        };
        Some(Peak {
            offset: best as f64 + fraction,
            correlation: here,
        })
    }
}

/// Sums of the squares of the first 0, 1, 2, ... entries.
fn cumulated_energy(series: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(series.map(|value| {
            sum += value.powi(2);
            sum
        }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pulse around entry `middle` of a hundred.
    fn pulse(middle: f64) -> Vec<f64> {
        let value = |k: i32| (-0.02 * (f64::from(k) - middle).powi(2)).exp();
        (0..100).map(value).collect()
    }

    #[test]
    fn what_was_filled_in_does_not_hide_the_offset() {
        // The same motion twice, of which one time the reference was lost.
        let twice = |middle: f64| -> Vec<f64> {
            let halves = pulse(middle).into_iter().zip(pulse(middle + 45.0));
            halves.map(|(a, b)| a + b).collect()
        };
        let (measured, mut reference) = (twice(27.0), twice(20.0));
        let is_known: Vec<bool> = (0..100).map(|k| !(8..32).contains(&k)).collect();
        // Filled in badly.
        let filled: Vec<f64> = pulse(12.0)[8..32].iter().map(|value| 3.0 * value).collect();
        reference[8..32].copy_from_slice(&filled);
        let offset = |correlations: Correlations| {
            correlations.peak(-20..20, |_| 0.0).map(|peak| peak.offset)
        };
        assert!(
            offset(Correlations::new(&measured, &reference))
                .is_some_and(|at| (at - 7.0).abs() > 1.0)
        );
        let known = offset(Correlations::of_known(&measured, &reference, &is_known));
        assert!(known.is_some_and(|at| (at - 7.0).abs() < 0.1), "{known:?}");
    }

    #[test]
    fn a_peak_between_entries_is_found_within_the_range_alone() {
        let correlations = Correlations::new(&pulse(52.3), &pulse(45.0));
        let peak = |range: Range<i64>| correlations.peak(range, |_| 0.0);
        assert!(
            peak(-30..31)
                .is_some_and(|peak| (peak.offset - 7.3).abs() < 0.05 && peak.correlation > 0.99)
        );
        // Too narrow: the end, as it is.
        assert!(peak(-5..6).is_some_and(|peak| peak.offset == 5.0));
        assert!(peak(3..3).is_none());
    }
}
