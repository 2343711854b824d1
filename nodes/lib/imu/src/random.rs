//! Random numbers by seed, placement and channel.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

/// Two independent standard normal numbers (Box and Muller 1958).
///
/// Written out rather than taken from `rand_distr`, whose ziggurat draws other numbers from the same
/// stream: with it every seed would give other bytes than it did before.
pub fn normal_pair(random: &mut ChaCha12Rng) -> [f64; 2] {
    let radius = (-2.0 * uniform(random).ln()).sqrt();
    let (sine, cosine) = (std::f64::consts::TAU * uniform(random)).sin_cos();
    [radius * cosine, radius * sine]
}

/// A number between 0 and 1, neither of them.
pub(crate) fn uniform(random: &mut ChaCha12Rng) -> f64 {
    ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// The stream of lost samples; 0 to 2 are the channels of [`crate::NoiseSource`].
pub(crate) const DROPOUT_CHANNEL: u64 = 3;
/// The first stream of [`crate::effects::DrawnBiases`]: turn-on bias, instability and walk, of two
/// channels each.
pub(crate) const DRAWN_BIAS_CHANNEL: u64 = 4;
/// The first stream of a magnetometer: its noise, then its hard iron.
pub(crate) const MAGNETOMETER_CHANNEL: u64 = 10;

/// A key of 32 bytes: seed, two hashes of the name, channel.
pub(crate) fn stream(seed: u64, placement: &str, channel: u64) -> ChaCha12Rng {
    let words = [
        seed,
        fnv1a(placement, 0xcbf2_9ce4_8422_2325),
        fnv1a(placement, 0x9e37_79b9_7f4a_7c15),
        channel,
    ];
    let mut key = [0; 32];
    for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    ChaCha12Rng::from_seed(key)
}

/// Fowler, Noll and Vo's hash, which no version of a compiler or library changes.
fn fnv1a(text: &str, start: u64) -> u64 {
    text.bytes().fold(start, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
