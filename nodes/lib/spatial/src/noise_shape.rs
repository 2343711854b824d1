//! The density of poses' noise over the frequency.

use std::f64::consts::PI;

use crate::Spectrum;

/// A third of an octave, about (2^(1/3) = 1.26): the bands in which a spectrum's fall is measured.
const THIRD_OCTAVE: f64 = 1.3;
/// Slowest plateau that may be noise, Hz: below, the fall of motion itself may slow down. No source.
const LEAST_PLATEAU_HZ: f64 = 12.0;
/// The search for a knee ends at this part of the Nyquist frequency; no source.
const LAST_PLATEAU: f64 = 0.9;
/// Factor from one candidate for a knee to the next; no source.
const PLATEAU_STEP: f64 = 1.05;
/// Parts of the Nyquist frequency between which the median density is the white floor; no source.
const TOP: (f64, f64) = (0.70, 0.97);
/// The same in parts: lines (of the frames that were resampled) lift some of them, not all.
const TOP_PARTS: [(f64, f64); 4] = [(0.6, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.97)];
/// Parts of the Nyquist frequency that the top is compared with, to see whether it is level; no
/// source.
const BELOW_TOP: (f64, f64) = (0.45, 0.6);
/// Fall from the middle of the band to its top, as a factor, up to which the top counts as level. No
/// source.
const LEVEL_TOP: f64 = 1.35;
/// What of the density a third of an octave leaves of motion at most: f^-3.3, a little less steep
/// than the fourth power with which displacements of bodies fall. No source for the exponent.
const MOTION_THIRD: f64 = 0.42;
/// The same where a clear knee lies before it, f^-5.3; no source.
const MOTION_THIRD_AFTER_KNEE: f64 = 0.25;
/// A knee is clear where the third of an octave before it left less than this part of what the one
/// after it leaves; no source.
const CLEAR_KNEE: f64 = 0.45;
/// From one third of an octave to the next, noise rises at most by this factor: more is a line. No
/// source.
const LARGEST_THIRD_RISE: f64 = 1.7;
/// A knee lies this far above the least of the top, as a factor: else the top is as good a floor. Noise with a memory
/// of some 10 ms at 100 Hz is 4 to 8 times as dense at 12 Hz as at the top: at a factor of 4 it was level in one recording
/// and not in the next (tests/withheld/other_origin.py, seed 6).
const LEAST_KNEE: f64 = 2.0;
/// Part of the Nyquist frequency from which on motion that folds back from beyond it is told from noise; no source.
const FOLDED_FROM: f64 = 0.5;
/// Entries of the spectrum there below which nothing is told.
const FEWEST_TO_FOLD: usize = 6;
/// Powers of the frequency with which motion may fall there: those of a displacement, up to what a filter leaves.
const FALLS: [f64; 6] = [3.0, 4.0, 6.0, 8.0, 10.0, 12.0];
/// How much of an error is left in the next, of noise with a memory: the longest is where the upper band no longer tells.
const MEMORIES: [f64; 15] = [
    0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8,
];
/// Powers with which motion falls beside it: a displacement's, no flatter, since noise with a memory falls with 2.
const FALLS_BESIDE_MEMORY: [f64; 5] = [4.0, 6.0, 8.0, 10.0, 12.0];
/// A memory is told from this frequency on, Hz, but from no less and no more than these parts of the Nyquist frequency, or, where
/// motion is no power law there, from the last part. No source.
const MEMORY_FROM_HZ: f64 = 15.0;
const MEMORY_FROM: (f64, f64) = (0.1, 0.3);
const MEMORY_FROM_AT_LAST: f64 = 0.5;
/// Entries of the spectrum below which no memory is told.
const FEWEST_FOR_MEMORY: usize = 20;
/// Parts in which the density is averaged for it.
const MEMORY_PARTS: usize = 60;
/// Mean square misfit in parts of the density up to which such noise and a motion are all that is there: 176 spectra of noise
/// with a memory had 0.0004 to 0.039 (tests/withheld, fourth and fifth generator, seeds 1035 and 1036), those of ten BROAD
/// trials, whose optical system filters its poses, 0.13 to 0.42.
const MEMORY_MISFIT: f64 = 0.06;
/// And the part of the misfit without a memory that is left at most. No source.
const MEMORY_LEFT: f64 = 0.9;
/// Below this frequency, Hz, the noise is held, since a power law grows without bound; no source.
const HELD_BELOW_HZ: f64 = 0.1;

/// Density of the noise over the frequency: level, or a power law around a knee.
///
/// White noise shows as a level top of the spectrum. Where the top falls, the poses were resampled
/// from fewer frames, filtered, or come from a tracker whose errors wander: then noise begins at
/// the knee where the spectrum first falls slower than motion does (displacement of bodies falls
/// with the fourth power of the frequency and more; f^-3.3 is the border here), and rises a little
/// below the knee.
///
/// Poses that are too slow for a knee to be looked for may be too slow for the motion: then the top is motion, and what of
/// it folds back from beyond the Nyquist frequency acts as noise. With S(f) = A f^-p, the spectrum shows
/// S(f) + S(rate - f) + N.
///
/// Noise with a memory of the first order, `e_k = m e_(k-1) + w_k`, has the density
/// `N (1 - m^2) / (1 + m^2 - 2 m cos(2 pi f / rate))`, with N its mean: where that and such a motion explain the spectrum,
/// they tell of the noise beneath the motion too.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoiseShape {
    /// Density at the knee, or everywhere, unit^2/Hz.
    pub level: f64,
    knee_hz: f64,
    /// Negative exponent below the knee.
    below: f64,
    /// Negative exponent above the knee; 0 for white noise.
    pub above: f64,
    /// Density at the top of the spectrum: of white noise and of motion that is too fast for the poses.
    pub top: f64,
    /// Density of the motion at the Nyquist frequency, where it folds back; 0 where it does not.
    folded: f64,
    /// Its negative exponent.
    fall: f64,
    /// Of the first order; then the level is the mean density. 0 without one.
    memory: f64,
}

impl NoiseShape {
    /// The shape of the noise under a spectrum of poses at `rate_hz`; below the knee it rises by at
    /// most the power `largest_rise` of the frequency.
    pub fn learn(spectrum: &Spectrum, rate_hz: f64, largest_rise: f64) -> Self {
        let nyquist_hz = rate_hz / 2.0;
        let level = |from_hz: f64, to_hz: f64| spectrum.median(from_hz, to_hz).unwrap_or(0.0);
        let part = |(from, to): (f64, f64)| level(from * nyquist_hz, to * nyquist_hz);
        let white = Self {
            level: part(TOP),
            top: part(TOP),
            knee_hz: nyquist_hz,
            below: 0.0,
            above: 0.0,
            folded: 0.0,
            fall: 0.0,
            memory: 0.0,
        };
        let least = TOP_PARTS
            .map(part)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        if part(BELOW_TOP) < LEVEL_TOP * least {
            return white;
        }
        let is_searched = |hz: f64| hz * THIRD_OCTAVE.powi(3) < LAST_PLATEAU * nyquist_hz;
        let mut from_hz = LEAST_PLATEAU_HZ;
        if let Some(shape) = white.with_memory(spectrum) {
            // Poses that are fast enough show all motion.
            let folded = if is_searched(from_hz) {
                0.0
            } else {
                shape.folded
            };
            return Self { folded, ..shape };
        }
        if !is_searched(from_hz) {
            return white.with_folded_motion(spectrum);
        }
        while is_searched(from_hz) {
            let thirds = [-2, -1, 0, 1, 2].map(|k| {
                level(
                    THIRD_OCTAVE.powi(k) * from_hz,
                    THIRD_OCTAVE.powi(k + 1) * from_hz,
                )
            });
            if falls_slower_than_motion(&thirds) && thirds[2] > LEAST_KNEE * least {
                return Self::from_knee(&thirds, from_hz, largest_rise);
            }
            from_hz *= PLATEAU_STEP;
        }
        white
    }

    /// The power law from the densities of five thirds of an octave, the middle one from `from_hz` on.
    fn from_knee(thirds: &[f64; 5], from_hz: f64, largest_rise: f64) -> Self {
        let above = ((thirds[2] / thirds[4]).ln() / THIRD_OCTAVE.powi(2).ln()).max(0.0);
        // At the knee itself some motion is left.
        let level = thirds[2].min(thirds[3] * THIRD_OCTAVE.powf(above));
        Self {
            level,
            top: level,
            knee_hz: THIRD_OCTAVE.sqrt() * from_hz,
            below: above.min(largest_rise),
            above,
            folded: 0.0,
            fall: 0.0,
            memory: 0.0,
        }
    }

    /// Noise with a memory beside motion, where they explain the spectrum and white noise does not.
    fn with_memory(self, spectrum: &Spectrum) -> Option<Self> {
        let from = (MEMORY_FROM_HZ / self.knee_hz).clamp(MEMORY_FROM.0, MEMORY_FROM.1);
        [from, MEMORY_FROM_AT_LAST]
            .into_iter()
            .find_map(|from| self.with_memory_from(spectrum, from))
    }

    /// The same from a part of the Nyquist frequency on.
    fn with_memory_from(self, spectrum: &Spectrum, from: f64) -> Option<Self> {
        let nyquist_hz = self.knee_hz;
        let entries: Vec<(f64, f64)> = (0..spectrum.density.len())
            .map(|k| (spectrum.frequency(k) / nyquist_hz, spectrum.density[k]))
            .filter(|(part, density)| (from..TOP.1).contains(part) && *density > 0.0)
            .collect();
        if entries.len() < FEWEST_FOR_MEMORY {
            return None;
        }
        let length = (entries.len() / MEMORY_PARTS).max(1);
        let mean = |own: &[(f64, f64)]| {
            let count = own.len() as f64;
            let [part, density] = [|e: &(f64, f64)| e.0, |e: &(f64, f64)| e.1]
                .map(|of| own.iter().map(of).sum::<f64>() / count);
            (part, density)
        };
        let parts: Vec<(f64, f64)> = entries.chunks_exact(length).map(mean).collect();
        let fitted = |memory: f64, fall: f64| {
            let rows = parts.iter().map(|(part, density)| {
                let motion = part.powf(-fall) + (2.0 - part).powf(-fall);
                [motion / density, first_order(memory, *part) / density]
            });
            let (misfit, [folded, level]) = least_squares(rows);
            let shape = Self {
                level,
                folded,
                fall,
                memory,
                ..self
            };
            (misfit / parts.len() as f64, shape)
        };
        let white = FALLS.map(|fall| fitted(0.0, fall).0);
        let white = white.into_iter().fold(f64::INFINITY, f64::min);
        let falls = FALLS_BESIDE_MEMORY.into_iter();
        let (misfit, shape) = falls
            .flat_map(|fall| MEMORIES.map(|memory| fitted(memory, fall)))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (misfit < MEMORY_MISFIT.min(MEMORY_LEFT * white) && shape.level > 0.0).then_some(shape)
    }

    /// White noise beside motion that folds back, by least squares in parts of the density.
    fn with_folded_motion(self, spectrum: &Spectrum) -> Self {
        let nyquist_hz = self.knee_hz;
        let top = (0..spectrum.density.len())
            .map(|k| (spectrum.frequency(k) / nyquist_hz, spectrum.density[k]))
            .filter(|(part, density)| (FOLDED_FROM..TOP.1).contains(part) && *density > 0.0);
        let top: Vec<(f64, f64)> = top.collect();
        if top.len() < FEWEST_TO_FOLD {
            return self;
        }
        let tried = FALLS.into_iter().map(|fall| {
            // Of motion of one at the Nyquist frequency and of noise of one, in parts of the density.
            let rows = top.iter().map(|(part, density)| {
                let motion = part.powf(-fall) + (2.0 - part).powf(-fall);
                [motion / density, density.recip()]
            });
            let (misfit, [folded, level]) = least_squares(rows);
            let shape = Self {
                level,
                folded,
                fall,
                ..self
            };
            (misfit, shape)
        });
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(self, |(_, shape)| shape)
    }

    /// Whether the noise falls with the frequency: then motion goes on falling beneath it, where white noise ends its band.
    pub fn falls(&self) -> bool {
        self.above > 0.0 || self.memory > 0.0
    }

    /// Whether it falls by a power law, which is read off a knee of the spectrum itself.
    pub fn is_wandering(&self) -> bool {
        self.above > 0.0
    }

    /// Density of the motion beyond the Nyquist frequency that the spectrum tells of, unit^2/Hz.
    pub fn motion_beyond(&self, frequency_hz: f64) -> f64 {
        if self.folded > 0.0 {
            self.folded * (self.knee_hz / frequency_hz).powf(self.fall)
        } else {
            0.0
        }
    }

    /// Variance of the noise per sample, unit^2: the density's integral up to the Nyquist frequency, where it falls from the knee on.
    /// Below the knee motion hides it, and it counts as dense as there.
    pub fn variance(&self, nyquist_hz: f64) -> f64 {
        if self.above == 0.0 || self.knee_hz >= nyquist_hz {
            return self.level * nyquist_hz;
        }
        let (ratio, power) = (nyquist_hz / self.knee_hz, 1.0 - self.above);
        let falling = if power.abs() < 1e-6 {
            ratio.ln()
        } else {
            (ratio.powf(power) - 1.0) / power
        };
        self.level * self.knee_hz * (1.0 + falling)
    }

    /// Density at a frequency, unit^2/Hz.
    pub fn at(&self, frequency_hz: f64) -> f64 {
        let ratio = self.knee_hz / frequency_hz.max(HELD_BELOW_HZ);
        let own = if self.memory > 0.0 {
            self.level * first_order(self.memory, (frequency_hz / self.knee_hz).min(1.0))
        } else {
            self.level * ratio.powf(if ratio > 1.0 { self.below } else { self.above })
        };
        if self.folded > 0.0 {
            let from_beyond = 2.0 - (frequency_hz / self.knee_hz).min(1.0);
            own + self.folded * from_beyond.powf(-self.fall)
        } else {
            own
        }
    }
}

/// Density of noise with a memory of the first order over its mean, at a part of the Nyquist frequency.
pub(crate) fn first_order(memory: f64, part: f64) -> f64 {
    let square = memory * memory;
    (1.0 - square) / (1.0 + square - 2.0 * memory * (PI * part).cos())
}

/// Coefficients, none below zero, with which two columns come nearest to one, and the sum of the squares that they leave.
fn least_squares(rows: impl Iterator<Item = [f64; 2]>) -> (f64, [f64; 2]) {
    let (mut squares, mut product, mut sums, mut count) = ([0.0; 2], 0.0, [0.0; 2], 0.0);
    for row in rows {
        for of in 0..2 {
            squares[of] += row[of] * row[of];
            sums[of] += row[of];
        }
        product += row[0] * row[1];
        count += 1.0;
    }
    let alone = |of: usize| {
        let mut own = [0.0; 2];
        own[of] = sums[of] / squares[of].max(f64::MIN_POSITIVE);
        own
    };
    let determinant = squares[0] * squares[1] - product * product;
    let both = [
        (sums[0] * squares[1] - sums[1] * product) / determinant,
        (sums[1] * squares[0] - sums[0] * product) / determinant,
    ];
    let left = |[a, b]: [f64; 2]| {
        count - 2.0 * (a * sums[0] + b * sums[1])
            + a * a * squares[0]
            + b * b * squares[1]
            + 2.0 * a * b * product
    };
    [alone(0), alone(1), both]
        .into_iter()
        .filter(|own| own.iter().all(|value| *value >= 0.0))
        .map(|own| (left(own), own))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((f64::INFINITY, [0.0; 2]))
}

/// Whether the spectrum falls slower than motion from the middle one of five thirds of an octave on.
fn falls_slower_than_motion(thirds: &[f64; 5]) -> bool {
    let before = thirds[1] / thirds[0];
    [thirds[3] / thirds[2], thirds[4] / thirds[3]]
        .iter()
        .all(|&ratio| {
            ratio < LARGEST_THIRD_RISE
                && (ratio > MOTION_THIRD
                    || ratio > MOTION_THIRD_AFTER_KNEE && before < CLEAR_KNEE * ratio)
        })
}

#[cfg(test)]
mod tests {
    use super::NoiseShape;
    use crate::Spectrum;

    const RATE_HZ: f64 = 20.0;

    fn learnt(density: impl Fn(f64) -> f64) -> NoiseShape {
        let spacing_hz = 0.1;
        let density = (0..=100).map(|k| density(f64::from(k) * spacing_hz));
        let spectrum = Spectrum {
            spacing_hz,
            density: density.collect(),
            windows: 20,
        };
        NoiseShape::learn(&spectrum, RATE_HZ, 1.0)
    }

    #[test]
    fn motion_too_fast_for_poses_is_told_from_white_noise() {
        let motion = |hz: f64| 1e-6 * (hz.max(0.1) / 10.0).powi(-6);
        for level in [1e-12, 1e-6, 1e-5] {
            let shape = learnt(|hz| motion(hz) + motion(RATE_HZ - hz) + level);
            assert!(
                (shape.level - level).abs() < 1e-9 + 0.05 * level,
                "{shape:?}"
            );
            for hz in [6.0, 9.0] {
                let expected = level + motion(RATE_HZ - hz);
                assert!(
                    (shape.at(hz) / expected - 1.0).abs() < 0.05,
                    "{hz} Hz: {shape:?}"
                );
            }
            assert!((shape.motion_beyond(12.0) / motion(12.0) - 1.0).abs() < 0.05);
        }
    }

    /// What of it lies beneath the motion counts, at rates at which no knee shows.
    #[test]
    fn noise_with_a_memory_is_told_from_its_upper_band() {
        for (rate_hz, memory) in [(30.0, 0.6), (50.0, 0.75), (100.0, 0.75), (120.0, 0.4)] {
            let spacing_hz = 0.2;
            let count = (rate_hz / 2.0 / spacing_hz) as u32;
            let motion = |hz: f64| 2e-6 * (20.0 * hz / rate_hz).max(0.05).powi(-6);
            let density = (0..=count).map(|k| {
                let hz = f64::from(k) * spacing_hz;
                let noise = 1e-6 * super::first_order(memory, 2.0 * hz / rate_hz);
                noise + motion(hz) + motion(rate_hz - hz)
            });
            let spectrum = Spectrum {
                spacing_hz,
                density: density.collect(),
                windows: 20,
            };
            let shape = NoiseShape::learn(&spectrum, rate_hz, 1.0);
            let found = shape.variance(rate_hz / 2.0) / (1e-6 * rate_hz / 2.0);
            assert!((0.8..1.25).contains(&found), "{rate_hz}: {found} {shape:?}");
            let slow = shape.at(1.0) / (1e-6 * super::first_order(memory, 2.0 / rate_hz));
            assert!((0.7..1.4).contains(&slow), "{rate_hz}: {slow} {shape:?}");
        }
    }

    /// First order: its variance is the sum of its densities, and a third or less of the plateau's were that white.
    #[test]
    fn noise_with_a_memory_has_the_variance_of_its_sum() {
        for (rate_hz, pole) in [(300.0, 0.67_f64), (360.0, 0.7), (200.0, 0.58)] {
            let spacing_hz = 0.1;
            let count = (rate_hz / 2.0 / spacing_hz) as usize;
            let noise = |hz: f64| {
                let turn = std::f64::consts::TAU * hz / rate_hz;
                (1.0 - pole * pole) / (1.0 - 2.0 * pole * turn.cos() + pole * pole) * 2.0 / rate_hz
            };
            let density = (0..=count).map(|k| {
                let hz = f64::from(k as u32) * spacing_hz;
                noise(hz) + 10.0 * hz.max(0.1).powi(-6)
            });
            let spectrum = Spectrum {
                spacing_hz,
                density: density.collect(),
                windows: 20,
            };
            let shape = NoiseShape::learn(&spectrum, rate_hz, 1.0);
            let found = shape.variance(rate_hz / 2.0);
            assert!((0.6..1.4).contains(&found), "{rate_hz}: {found} {shape:?}");
        }
    }

    #[test]
    fn a_level_top_is_noise() {
        let shape = learnt(|hz| 1e-4 * hz.max(0.1).powi(-6) + 1e-5);
        assert!((shape.level / 1e-5 - 1.0).abs() < 0.01, "{shape:?}");
        assert_eq!(shape.motion_beyond(12.0), 0.0);
        assert_eq!(shape.top, shape.level);
    }
}
