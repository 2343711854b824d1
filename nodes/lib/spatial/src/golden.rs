//! The greatest value of a function near a coarse peak.

/// Where `value` is greatest within `width` of `peak`, to `precision`, by golden sections; it has to
/// have one peak there.
pub fn greatest_near(value: impl Fn(f64) -> f64, peak: f64, width: f64, precision: f64) -> f64 {
    let golden = 0.618_033_988_749_895;
    let (mut low, mut high) = (peak - width, peak + width);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_a, mut at_b) = (value(a), value(b));
    while high - low > precision {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = value(b);
        }
    }
    0.5 * (low + high)
}
