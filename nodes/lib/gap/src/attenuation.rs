//! Which smoothing, if any, explains what a reference keeps of the motion.

use cromosim_imu::EffectSet;
use cromosim_spatial::{SmoothingKernel, ZeroPhaseSmoothing};

use crate::fit::FitModel;
use crate::kept_motion::{KeptInBand, kept_motion};
use crate::policy::attenuation::{
    CLEAR, CLEAR_PART, CUTOFFS_HZ, CUTOFFS_IN_TURN, FAR, FASTEST_CUTOFF_HZ, FEWEST_BANDS, HINT,
    HINT_PART, LEAKED,
};
use crate::trace::trace;

/// Kernels that are told apart.
const KERNELS: [SmoothingKernel; 5] = [
    SmoothingKernel::SECOND_ORDER,
    SmoothingKernel::Butterworth { order: 4 },
    SmoothingKernel::Butterworth { order: 3 },
    SmoothingKernel::Butterworth { order: 1 },
    SmoothingKernel::Gaussian,
];

/// What the readings show of a smoothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shown {
    /// That of each kernel that is not far behind, the nearest first; empty where they show none.
    pub smoothings: Vec<ZeroPhaseSmoothing>,
    /// Whether there clearly is one.
    pub is_clear: bool,
    /// Whether there clearly is none.
    pub is_excluded: bool,
}

impl Shown {
    /// By the readings of a model's recording under a set of effects; nothing where too few bands hold motion.
    pub fn by_readings(model: &FitModel, set: &EffectSet) -> Self {
        let mut bands = kept_motion(model, set);
        let all = bands.clone();
        bands.retain(|band| {
            let of_axis = all.iter().filter(|other| other.axis == band.axis);
            of_axis.count() >= FEWEST_BANDS
        });
        Self::of(&Attenuation {
            rate_hz: model.prepared.estimate.rate_hz(),
            bands,
        })
    }

    fn of(attenuation: &Attenuation) -> Self {
        if attenuation.bands.is_empty() {
            return Self::default();
        }
        let none = attenuation.misfit(|_| 1.0);
        let mut nearest: Vec<Nearest> = KERNELS
            .into_iter()
            .filter_map(|kernel| attenuation.nearest(kernel))
            .collect();
        nearest.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        trace(|| eprintln!("attenuation {none:.1} without, {nearest:.2?}"));
        let first = nearest[0];
        let nearer = none - first.misfit;
        let reaches_motion = first.smoothing.cutoff_hz < FASTEST_CUTOFF_HZ;
        let is_nearer_by =
            |least: f64, part: f64| reaches_motion && nearer > least.max(part * none);
        let is_hinted = is_nearer_by(HINT, HINT_PART);
        let is_far = |own: &Nearest| own.misfit > FAR * first.misfit + CLEAR;
        Self {
            is_clear: is_nearer_by(CLEAR, CLEAR_PART),
            is_excluded: attenuation.excludes_all(none),
            smoothings: nearest
                .iter()
                .filter(|own| is_hinted && !is_far(own))
                .map(|own| own.smoothing)
                .collect(),
        }
    }

    /// That of a kernel.
    pub fn of_kernel(&self, kernel: SmoothingKernel) -> Option<ZeroPhaseSmoothing> {
        let mut all = self.smoothings.iter();
        all.find(|own| own.kernel == kernel).copied()
    }
}

/// What the reference keeps of the motion.
struct Attenuation {
    bands: Vec<KeptInBand>,
    /// Of the poses, Hz.
    rate_hz: f64,
}

/// A smoothing, and how near it comes to what the reference keeps: the sum of squared distances in standard errors.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    smoothing: ZeroPhaseSmoothing,
    misfit: f64,
}

impl Attenuation {
    /// The smoothing of a kernel that comes nearest.
    fn nearest(&self, kernel: SmoothingKernel) -> Option<Nearest> {
        let tried = smoothings(kernel).map(|smoothing| Nearest {
            misfit: self.misfit_of(&smoothing),
            smoothing,
        });
        tried.min_by(|a, b| a.misfit.total_cmp(&b.misfit))
    }

    /// Whether each smoothing that could be undone is clearly farther than none.
    fn excludes_all(&self, none: f64) -> bool {
        KERNELS.into_iter().all(|kernel| {
            let mut cutoffs = smoothings(kernel).filter(|own| own.cutoff_hz <= FASTEST_CUTOFF_HZ);
            cutoffs.all(|own| self.misfit_of(&own) > none + CLEAR)
        })
    }

    fn misfit_of(&self, smoothing: &ZeroPhaseSmoothing) -> f64 {
        self.misfit(|hz| smoothing.undoing_gain(hz, self.rate_hz).recip())
    }

    /// Sum of squared distances from a shape, in standard errors, by the factor of each axis with which it comes nearest: units and
    /// scales are in that.
    fn misfit(&self, shape: impl Fn(f64) -> f64) -> f64 {
        let of_axis = |axis: usize| {
            let own = self.bands.iter().filter(|band| band.axis == axis);
            let most = own.clone().map(|band| band.kept.abs()).fold(0.0, f64::max);
            let (mut kept, mut both, mut shaped) = (0.0, 0.0, 0.0);
            for band in own {
                let weight = band
                    .error
                    .hypot(LEAKED * most)
                    .max(f64::MIN_POSITIVE)
                    .powi(-2);
                let shape = shape(band.hz);
                kept += weight * band.kept * band.kept;
                both += weight * band.kept * shape;
                shaped += weight * shape * shape;
            }
            // Of an axis without bands nothing.
            kept - both * both / shaped.max(f64::MIN_POSITIVE)
        };
        [0, 1, 2].map(of_axis).iter().sum()
    }
}

/// The smoothings of a kernel that are compared.
fn smoothings(kernel: SmoothingKernel) -> impl Iterator<Item = ZeroPhaseSmoothing> {
    let (first, last) = CUTOFFS_HZ;
    let ratio: f64 = (last / first).powf(1.0 / f64::from(CUTOFFS_IN_TURN - 1));
    (0..CUTOFFS_IN_TURN).map(move |k| ZeroPhaseSmoothing {
        cutoff_hz: first * ratio.powi(k),
        kernel,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bands each half of a hertz up to 10 Hz about two axes of different scales, with errors that grow with the frequency, and off by
    /// about as much.
    fn kept(shape: impl Fn(f64) -> f64, error_at_10_hz: f64) -> Attenuation {
        let band = |k: usize| {
            let (hz, axis) = (0.5 * (k / 2 + 1) as f64, k % 2);
            let error = error_at_10_hz * (hz / 10.0).powi(2);
            let off = error * (2.4 * k as f64).sin();
            KeptInBand {
                axis,
                hz,
                kept: [1.0, 0.94][axis] * (shape(hz) + off),
                error,
            }
        };
        Attenuation {
            bands: (0..40).map(band).collect(),
            rate_hz: 120.0,
        }
    }

    #[test]
    fn kernel_and_cutoff_show_in_what_is_kept() {
        for kernel in KERNELS {
            for cutoff_hz in [2.5, 4.0, 7.0] {
                let smoothing = ZeroPhaseSmoothing { cutoff_hz, kernel };
                let part = |hz: f64| smoothing.undoing_gain(hz, 120.0).recip();
                let shown = Shown::of(&kept(part, 0.05));
                assert!(shown.is_clear && !shown.is_excluded, "{smoothing:?}");
                let found = shown.smoothings[0];
                assert_eq!(found.kernel, kernel, "{cutoff_hz} Hz");
                let off = (found.cutoff_hz / cutoff_hz).ln();
                assert!(off.abs() < 0.02, "{smoothing:?}: {found:?}");
            }
        }
    }

    #[test]
    fn where_all_is_kept_no_smoothing_was() {
        let shown = Shown::of(&kept(|_| 1.0, 0.02));
        assert!(shown.is_excluded && !shown.is_clear, "{shown:?}");
        assert!(shown.smoothings.is_empty(), "{shown:?}");
    }

    #[test]
    fn errors_that_would_cover_a_smoothing_exclude_none() {
        let shown = Shown::of(&kept(|_| 1.0, 2.0));
        assert!(!shown.is_excluded && !shown.is_clear, "{shown:?}");
        let nothing = Shown::of(&Attenuation {
            bands: Vec::new(),
            rate_hz: 120.0,
        });
        assert!(!nothing.is_excluded && nothing.smoothings.is_empty());
    }

    /// An axis that is not quite the sensor's keeps more and less by turns.
    #[test]
    fn what_no_smoothing_describes_is_none() {
        let uneven = |hz: f64| 1.0 + 0.3 * (2.2 * hz).sin() - 0.02 * hz;
        let shown = Shown::of(&kept(uneven, 0.02));
        assert!(shown.smoothings.is_empty(), "{shown:?}");
    }
}
