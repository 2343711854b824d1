//! When a smoothing of the reference is looked for, and when it is believed.

/// Held-out mean square of a whitened residual from which on it is looked for; beside an effect that passes for one, always.
pub const SUSPICIOUS: f64 = 1.3;
/// The same from which on Gaussians are tried where Butterworth's filter of the second order explains nothing: a knee's at 50 Hz
/// and a rate table's left 5.4 and 203. No source for the number.
pub const SUSPICIOUS_OF_GAUSSIAN: f64 = 3.0;
/// What undoing it has to gain, nats.
pub const LEAST_GAIN_NATS: f64 = 30.0;
/// And as a share of what is still to be explained.
pub const LEAST_SHARE: f64 = 0.05;
/// Held-out mean square of a whitened residual below which no fit beside a cutoff is taken to fall (or to as much
/// as without one, where that is less): a cutoff whose noise leaves it too little evidence even so is not tried.
/// Beside those that explained most it was 0.85 to 1.1 (tests/withheld, seed 71).
pub const BEST_RATIO: f64 = 0.8;
/// Most Gauss-Newton steps of a fit beside a cutoff: from the values beside the one before it takes few where the
/// cutoff is nearly right.
pub const TRIAL_STEPS: usize = 4;
/// Part of what undoing a Gaussian gains by which Butterworth's filter of the first order has to gain more: the two differ where little
/// is left. A Gaussian of a test motion loses 0.001 to 0.006 against it. No source.
pub const SOFTER: f64 = 0.01;
/// Delay from which on a filter may be what makes readings late, s: that of 45 Hz, the fastest that counts.
pub const SHORTEST_DELAY_S: f64 = 0.005;
/// Effects that may be added beside it when it is judged.
pub const BESIDE: usize = 2;
/// How often at most its cutoff is looked for again beside what was found with it.
pub const SHARPENINGS: usize = 3;
/// Ratio of the residuals' root mean squares (undone to plain) that one channel has to fall
/// below.
pub const CLOSER: f64 = 0.95;
/// And that neither channel may exceed.
pub const NOT_FARTHER: f64 = 1.05;
/// Part of what undoing a smoothing gains that cutoffs an eighth lower and higher have to lose, for it to be believed though the
/// simulation comes hardly closer: true ones of the fourth generator (seeds 1031 to 1033) lost 0.06 to 0.18, those that other effects
/// imitate 0.001 and 0.003.
pub const SHARP: f64 = 0.04;
/// Part of the power that undoing it takes off the residual, in both channels, from which on it is noise when factors of at
/// most one on the simulation take that off as well: 0.63 to 0.97 of noise with a memory (fifth_origin.py, seed 1), 0 of eight true
/// smoothings (the same, and fourth_origin.py, seed 1034). And the part of what these factors leave that undoing it has to leave then:
/// 0.72 to 0.96 there, 0.03 of a reference that was interpolated.
pub const PART_OF_ATTENUATION: f64 = 0.5;
/// Product of both channels' distances, over those of what passes for a smoothing, up to which one that the readings show is believed
/// where it has more evidence: what passes for it has parameters of its own for what is left. 1.10 of a true one, 1.25 of a gyroscope
/// whose error goes with the square of its rate.
pub const HARDLY_FARTHER: f64 = 1.15;
/// Or that neither may exceed where the product of both channels' is below the second. Two of 36 recordings made of the third
/// generator's effects (seed 3) had 1.13 and 1.23 beside 0.51 and 0.41 with the true smoothing.
pub const FARTHER_FOR_CLOSER: f64 = 1.3;
/// See [`FARTHER_FOR_CLOSER`].
pub const MUCH_CLOSER: f64 = 0.7;
/// And that neither channel may exceed before effects are looked for beside it. After that search, cutoffs that came
/// of nothing had 1.4 to 16, smoothed references 0.09 to 1.0 (tests/withheld, seed 71; other_origin.py, seed 7).
pub const MUCH_FARTHER: f64 = 1.3;
