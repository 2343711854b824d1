//! Seeds that do not collide.

/// One seed that depends on every one of several numbers and on their order (SplitMix64, Steele et
/// al. 2014).
pub fn mixed_seed(numbers: &[u64]) -> u64 {
    numbers
        .iter()
        .fold(0x9E37_79B9_7F4A_7C15, |state: u64, number| {
            let mut z = (state ^ number).wrapping_add(0x9E37_79B9_7F4A_7C15);
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        })
}
