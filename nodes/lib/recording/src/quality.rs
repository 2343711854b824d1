//! What simulated samples are good for.

use std::ops::RangeInclusive;

use cromosim_imu::{Bandwidth, DrawnTexture, KinematicSample, Trim, median_bandwidth};
use cromosim_spatial::Stamp;

/// What the samples of one placement are good for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Up to which frequency they resolve the motion, median; none from schemes that do not smooth.
    pub bandwidth: Option<Bandwidth>,
    /// What was left out at the beginning and at the end, s.
    pub trimmed_s: [f64; 2],
    /// What was drawn above the bandwidth; none unless asked for.
    pub texture: Option<DrawnTexture>,
}

impl Quality {
    /// Of a motion's samples, and the stamps that are left of it; none where nothing is.
    pub fn of(motion: &[KinematicSample], trim: Trim) -> Option<(Self, RangeInclusive<Stamp>)> {
        let span = trim.span(motion)?;
        let (first, last) = (motion.first()?.stamp, motion.last()?.stamp);
        let quality = Self {
            bandwidth: median_bandwidth(motion),
            trimmed_s: [*span.start() - first, last - *span.end()],
            texture: None,
        };
        Some((quality, span))
    }
}
