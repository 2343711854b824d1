//! Motion beyond the quiet frequencies of a window's spectrum: harmonics of what is shaken or stepped, tremor, motors.

use crate::Spectrum;
use crate::pose_spectra::LINE_SMOOTHED;

/// Multiple of the noise that a run of frequencies reaches somewhere where there is motion. By chance (17 degrees of freedom:
/// three axes, five neighbours) one entry in 10^7 reaches half as much. No source for the number.
const LINE: f64 = 8.0;
/// Evidence that motion leaves in a run that is wide rather than high: log-likelihood of its entries, each chi-square with two
/// degrees of freedom, under their own densities less that under the noise's, nats. No source for the number.
const EVIDENCE: f64 = 25.0;
/// Largest width of a steady frequency, Hz: a window resolves 0.75, its five neighbours as much again.
const STEADY_HZ: f64 = 3.0;
/// Fastest steady frequency that is motion, Hz: what people shake and step at lies below, with its first harmonics. No source
/// for the number.
const FASTEST_STEADY_HZ: f64 = 15.0;
/// Part of the height over a window's that a frequency must have in the whole series' spectrum to be the same throughout: one
/// whose phase runs on has all of it, one that changes from window to window next to nothing. No source for the number.
const STEADY: f64 = 1.0 / 3.0;

/// At which entries of the windows' spectra a machine runs: faster than people, in the same phase throughout the series, so
/// that a `vibration` describes what it does to both better than poses show it. The spectrum of a sine in the whole series
/// (T long) stands T / W above that in windows (W long).
pub(crate) fn steady_machines(local: &[Spectrum], whole: &Spectrum) -> Vec<bool> {
    let Some(window) = local.first() else {
        return Vec::new();
    };
    let finer = window.spacing_hz / whole.spacing_hz;
    let rise = STEADY * finer / LINE_SMOOTHED;
    (0..window.density.len())
        .map(|k| {
            let loudest = |own: f64, spectrum: &Spectrum| own.max(spectrum.density[k]);
            let most = rise * local.iter().fold(0.0, loudest);
            let last = whole.density.len() - 1;
            let [from, to] = [-0.5, 0.5].map(|half| ((k as f64 + half) * finer).max(0.0) as usize);
            let around = &whole.density[from.min(last)..=to.min(last)];
            window.frequency(k) > FASTEST_STEADY_HZ && around.iter().any(|density| *density > most)
        })
        .collect()
}

/// Takes from the entries of motion those around the frequency of a machine that is known of, where that is faster than people.
pub(crate) fn leave_out_machine(motion: &mut [bool], spacing_hz: f64, hz: f64) {
    if hz > FASTEST_STEADY_HZ {
        let at = |hz: f64| ((hz / spacing_hz).round() as usize).min(motion.len());
        let around = at(hz - 0.5 * STEADY_HZ)..at(hz + 0.5 * STEADY_HZ);
        motion[around].fill(false);
    }
}

/// Which entries from one on belong to motion, by their densities over the noise's: runs above `edge` that reach [`LINE`] or
/// [`EVIDENCE`], but for those that are narrow and a machine's.
pub(crate) fn motion_beyond(
    ratio: &[f64],
    (edge, from): (f64, usize),
    spacing_hz: f64,
    machines: &[bool],
) -> Vec<bool> {
    let mut motion = vec![false; ratio.len()];
    let mut start = from;
    for run in ratio[from..].split(|value| *value < edge) {
        let end = start + run.len();
        let stands_out = run.iter().any(|value| *value > LINE)
            || run
                .iter()
                .map(|value| value - 1.0 - value.ln())
                .sum::<f64>()
                > EVIDENCE;
        let is_machine =
            run.len() as f64 * spacing_hz <= STEADY_HZ && machines[start..end].contains(&true);
        if stands_out && !is_machine {
            motion[start..end].fill(true);
        }
        start = end + 1;
    }
    motion
}

#[cfg(test)]
mod tests {
    use super::motion_beyond;

    /// Densities over the noise, 0.25 Hz apart, with so many entries of one height amid noise.
    fn run(entries: usize, height: f64) -> Vec<f64> {
        let mut ratio = vec![1.0; 100];
        ratio[60..60 + entries].fill(height);
        ratio
    }

    #[test]
    fn a_run_is_motion_that_is_high_or_wide() {
        let none = [false; 100];
        let kept = |ratio: &[f64]| motion_beyond(ratio, (2.2, 40), 0.25, &none).contains(&true);
        assert!(kept(&run(2, 9.0)), "high");
        assert!(kept(&run(12, 5.0)), "wide");
        assert!(!kept(&run(6, 5.0)), "neither");
    }
}
