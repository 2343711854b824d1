//! Axes: where a value stands, and round numbers beside them.

use crate::text::{decimals, significant};

/// How values become lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where it stands, in the axis' unit.
    pub value: f64,
    /// The number beside it; empty for a mark between others.
    pub label: String,
}

impl Axis {
    /// From the least to the greatest of the values, and a little beyond on both sides.
    pub fn linear(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values).unwrap_or((0.0, 1.0));
        // A flat series is no picture of its rounding errors.
        let margin = (0.06 * (high - low))
            .max(1e-3 * low.abs().max(high.abs()))
            .max(1e-9);
        Self {
            low: low - margin,
            high: high + margin,
            logarithmic: false,
        }
    }

    /// Between exactly these values.
    pub fn exact(low: f64, high: f64) -> Self {
        let high = if high > low { high } else { low + 1.0 };
        Self {
            low,
            high,
            logarithmic: false,
        }
    }

    /// From the least to the greatest of the values and of nothing: for bars, whose lengths are
    /// compared.
    pub fn from_zero(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values.chain([0.0])).unwrap_or((0.0, 1.0));
        let margin = 0.06 * (high - low);
        match (low < 0.0, high > 0.0) {
            (false, false) => Self::exact(0.0, 1.0),
            (below, above) => Self {
                low: if below { low - margin } else { 0.0 },
                high: if above { high + margin } else { 0.0 },
                logarithmic: false,
            },
        }
    }

    /// Logarithmic, over at most `decades` below the greatest value; values that are not positive
    /// are left out.
    pub fn logarithmic(values: impl Iterator<Item = f64>, decades: f64) -> Self {
        let (low, high) = extent(values.filter(|value| *value > 0.0)).unwrap_or((0.1, 10.0));
        let low = low.max(high * 10_f64.powf(-decades));
        Self {
            low: low * 0.8,
            high: high * 1.25,
            logarithmic: true,
        }
    }

    /// Where a value stands: 0 at the lower end, 1 at the upper; held within; none for what cannot
    /// be drawn.
    pub fn place(&self, value: f64) -> Option<f64> {
        let place = if self.logarithmic {
            if value.is_nan() {
                return None;
            }
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        place.is_finite().then(|| place.clamp(-0.02, 1.02))
    }

    /// Whether a value lies between the ends.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Whether equal ratios are equally long.
    pub fn is_logarithmic(&self) -> bool {
        self.logarithmic
    }

    /// Marks at round numbers, about `count` of them with labels.
    pub fn ticks(&self, count: usize) -> Vec<Tick> {
        if self.logarithmic {
            return self.decades(count);
        }
        // One number alone says no scale.
        let ticks = self.steps(count);
        if ticks.len() < 2 {
            self.steps(2 * count)
        } else {
            ticks
        }
    }

    fn steps(&self, count: usize) -> Vec<Tick> {
        let rough = (self.high - self.low) / count.max(1) as f64;
        let power = 10_f64.powf(rough.log10().floor());
        let off = |step: f64| (step / rough).ln().abs();
        let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
        let step = steps
            .into_iter()
            .min_by(|one, other| off(*one).total_cmp(&off(*other)))
            .unwrap_or(rough);
        let places = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
        let (first, last) = (
            (self.low / step).ceil() as i64,
            (self.high / step).floor() as i64,
        );
        let tick = |k: i64| Tick {
            value: k as f64 * step,
            label: decimals(k as f64 * step, places),
        };
        (first..=last).map(tick).collect()
    }

    fn decades(&self, count: usize) -> Vec<Tick> {
        let (low, high) = (self.low.log10(), self.high.log10());
        let (first, last) = (low.floor() as i32, high.ceil() as i32);
        let whole = (low.ceil() as i32..=high.floor() as i32).count();
        let every = whole.div_ceil(count.max(1)).max(1) as i32;
        let mut ticks = Vec::new();
        for decade in first..=last {
            for factor in 1..10 {
                let value = f64::from(factor) * 10_f64.powi(decade);
                if !self.contains(value) {
                    continue;
                }
                let is_labelled = match factor {
                    1 => decade.rem_euclid(every) == 0,
                    // Where there is hardly a decade, its parts are named too.
                    2 | 5 => whole < 2,
                    3 => whole < 1,
                    _ => false,
                };
                ticks.push(Tick {
                    value,
                    label: if is_labelled {
                        power_label(value, factor, decade)
                    } else {
                        String::new()
                    },
                });
            }
        }
        ticks
    }
}

/// 0.01, 1, 100 as they are; 10⁻⁴ beyond.
fn power_label(value: f64, factor: i32, decade: i32) -> String {
    if (-2..=3).contains(&decade) || factor != 1 {
        return significant(value, 1);
    }
    let superscript = |character: char| match character {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹']
            [digit.to_digit(10).unwrap_or(0) as usize],
    };
    format!(
        "10{}",
        decade
            .to_string()
            .chars()
            .map(superscript)
            .collect::<String>()
    )
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|value| value.is_finite())
        .fold(None, |extent: Option<(f64, f64)>, value| {
            Some(extent.map_or((value, value), |(low, high)| {
                (low.min(value), high.max(value))
            }))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: Axis, count: usize) -> Vec<String> {
        axis.ticks(count)
            .into_iter()
            .map(|tick| tick.label)
            .filter(|label| !label.is_empty())
            .collect()
    }

    #[test]
    fn ticks_stand_at_round_numbers() {
        assert_eq!(
            labels(Axis::exact(-1.3, 2.9), 4),
            ["−1", "0", "1", "2"].map(str::to_owned).to_vec()
        );
        assert_eq!(
            labels(Axis::exact(31.2, 39.1), 4),
            ["32", "34", "36", "38"].map(str::to_owned).to_vec()
        );
        assert_eq!(
            labels(Axis::exact(0.0, 0.031), 4),
            ["0.00", "0.01", "0.02", "0.03"].map(str::to_owned).to_vec()
        );
        assert_eq!(
            labels(Axis::logarithmic([0.02, 300.0].into_iter(), 9.0), 6),
            ["0.1", "1", "10", "100"].map(str::to_owned).to_vec()
        );
        assert_eq!(
            labels(Axis::logarithmic([1e-7, 1e-1].into_iter(), 9.0), 4),
            ["10⁻⁶", "10⁻⁴", "0.01"].map(str::to_owned).to_vec()
        );
    }

    #[test]
    fn nothing_and_nonsense_still_make_an_axis() {
        for axis in [
            Axis::linear([].into_iter()),
            Axis::linear([f64::NAN, 3.0].into_iter()),
            Axis::logarithmic([0.0].into_iter(), 4.0),
        ] {
            assert!(!axis.ticks(4).is_empty());
            assert_eq!(axis.place(f64::NAN), None);
        }
        assert_eq!(
            Axis::logarithmic([1.0, 100.0].into_iter(), 4.0).place(0.0),
            Some(-0.02)
        );
    }
}
