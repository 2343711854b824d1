//! Messages as bytes: the one type that crosses DDS here. Typed publishers and subscriptions encode
//! and decode around it.

use std::sync::atomic::{AtomicBool, Ordering};

use byteorder::{BigEndian, LittleEndian};
use rustdds::bytes::Bytes;
use rustdds::no_key::{
    DataWriter, Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter, SimpleDataReader,
};
use rustdds::{RepresentationIdentifier, Timestamp};
use serde::Serialize;
use serde::de::DeserializeOwned;

use cromosim_spatial::Stamp;

use crate::error::{RosError, RosResult};

pub(crate) type RawReader = SimpleDataReader<RawMessage, RawAdapter>;
pub(crate) type RawWriter = DataWriter<RawMessage, RawAdapter>;

const HEADER_LENGTH: usize = 4;
const LITTLE_ENDIAN_CDR: [u8; HEADER_LENGTH] = [0, 1, 0, 0];

/// A message of any type as it travels: four bytes that name the encoding (`00 01 00 00`:
/// little-endian CDR), then the encoded fields. These are the bytes that rosbag2 keeps.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct RawMessage {
    bytes: Vec<u8>,
}

impl RawMessage {
    /// From the bytes of a bag or a subscription, the four of the encoding included.
    ///
    /// # Errors
    /// Where the four bytes are missing.
    pub fn from_cdr(bytes: Vec<u8>) -> RosResult<Self> {
        if bytes.len() < HEADER_LENGTH {
            let problem = format!(
                "expected at least {HEADER_LENGTH} bytes of encoding header, found {}",
                bytes.len()
            );
            return Err(RosError::Encoding {
                place: "raw message".into(),
                action: "decode",
                type_name: "CDR".into(),
                problem,
            });
        }
        Ok(Self { bytes })
    }

    /// Encodes a message as little-endian CDR.
    ///
    /// # Errors
    /// Where serde meets something that CDR does not have, such as a map.
    pub fn encode<M: Serialize>(message: &M) -> Result<Self, String> {
        let mut bytes = LITTLE_ENDIAN_CDR.to_vec();
        // A writer of its own: the encoder aligns by its count of bytes, which must start behind
        // the header.
        cdr_encoding::to_writer::<M, LittleEndian, _>(&mut bytes, message)
            .map_err(|error| error.to_string())?;
        Ok(Self { bytes })
    }

    /// Decodes a message.
    ///
    /// # Errors
    /// Where the encoding is not plain CDR, or the bytes end too early.
    pub fn decode<M: DeserializeOwned>(&self) -> Result<M, String> {
        let fields = &self.bytes[HEADER_LENGTH..];
        match self.bytes[..2] {
            [0, 1] => cdr_encoding::from_bytes::<M, LittleEndian>(fields),
            [0, 0] => cdr_encoding::from_bytes::<M, BigEndian>(fields),
            [high, low] => {
                return Err(format!(
                    "encoding {high:02x}{low:02x} is not plain CDR (0000 or 0001)"
                ));
            }
            _ => return Err("no encoding header".into()),
        }
        .map(|(message, _)| message)
        .map_err(|error| error.to_string())
    }

    /// All bytes, the four of the encoding included.
    pub fn cdr(&self) -> &[u8] {
        &self.bytes
    }

    pub(crate) fn is_little_endian_cdr(&self) -> bool {
        self.bytes[..2] == LITTLE_ENDIAN_CDR[..2]
    }
}

/// A message as it came in.
#[derive(Clone, Debug)]
pub struct Received<M> {
    /// Decoded, or as bytes from a raw subscription.
    pub message: M,
    /// When the publisher sent it, by the system clock of the publisher's machine; none where it
    /// does not say.
    pub source_stamp: Option<Stamp>,
    /// When it arrived here, by the system clock.
    pub received_stamp: Stamp,
    /// The publisher's own count, from 1: gaps are losses.
    pub sequence_number: i64,
    /// Which publisher sent it.
    pub publisher: Gid,
}

/// The 16 bytes by which DDS knows a publisher, a subscription or a participant.
#[derive(
    Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub struct Gid([u8; 16]);

impl Gid {
    /// GUID prefix (12 bytes: the participant), then entity id (4).
    pub fn bytes(&self) -> &[u8; 16] {
        &self.0
    }
}

impl std::fmt::Debug for Gid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl From<rustdds::GUID> for Gid {
    fn from(guid: rustdds::GUID) -> Self {
        Self(guid.to_bytes())
    }
}

impl From<Gid> for ros2_client::Gid {
    fn from(gid: Gid) -> Self {
        gid.0.into()
    }
}

/// Ours, since ros2-client's conversion rounds down and loses a nanosecond. DDS counts fractions of
/// 2^-32 s, rounded down; rounding up gives back the very nanosecond.
pub(crate) fn stamp_from_dds(timestamp: Timestamp) -> Option<Stamp> {
    if timestamp == Timestamp::INVALID || timestamp == Timestamp::INFINITE {
        return None;
    }
    let ticks = timestamp.to_ticks();
    let (seconds, fraction) = ((ticks >> 32) as i64, ticks & 0xffff_ffff);
    let nanos = (fraction * 1_000_000_000).div_ceil(1 << 32) as i64;
    Some(Stamp::from_nanos(seconds * 1_000_000_000 + nanos))
}

/// RustDDS 0.15.1 cannot take apart an encrypted payload whose length is no multiple of four, so a
/// process that encrypts fills its own up with zeros. Readers of CDR do not look behind the fields.
pub(crate) static FILLED_UP: AtomicBool = AtomicBool::new(false);

/// Passes bytes through DDS untouched.
pub(crate) struct RawAdapter;

#[derive(Clone)]
pub(crate) struct RawDecoder;

/// Nothing can go wrong: there is nothing to decode.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Never {}

const ENCODINGS: [(RepresentationIdentifier, u8); 6] = [
    (RepresentationIdentifier::CDR_LE, 0x01),
    (RepresentationIdentifier::CDR_BE, 0x00),
    (RepresentationIdentifier::CDR2_LE, 0x11),
    (RepresentationIdentifier::CDR2_BE, 0x10),
    (RepresentationIdentifier::PL_CDR_LE, 0x03),
    (RepresentationIdentifier::D_CDR_LE, 0x15),
];

impl DeserializerAdapter<RawMessage> for RawAdapter {
    type Error = Never;
    type Decoded = RawMessage;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        const SUPPORTED: [RepresentationIdentifier; 6] = [
            ENCODINGS[0].0,
            ENCODINGS[1].0,
            ENCODINGS[2].0,
            ENCODINGS[3].0,
            ENCODINGS[4].0,
            ENCODINGS[5].0,
        ];
        &SUPPORTED
    }

    fn transform_decoded(decoded: RawMessage) -> RawMessage {
        decoded
    }
}

impl DefaultDecoder<RawMessage> for RawAdapter {
    type Decoder = RawDecoder;
    const DECODER: RawDecoder = RawDecoder;
}

impl<'de> Decode<'de, RawMessage> for RawDecoder {
    type Error = Never;

    fn decode_bytes(
        self,
        fields: &'de [u8],
        encoding: RepresentationIdentifier,
    ) -> Result<RawMessage, Never> {
        let low = ENCODINGS
            .iter()
            .find(|(known, _)| *known == encoding)
            .map_or(LITTLE_ENDIAN_CDR[1], |(_, low)| *low);
        let mut bytes = Vec::with_capacity(HEADER_LENGTH + fields.len());
        bytes.extend_from_slice(&[0, low, 0, 0]);
        bytes.extend_from_slice(fields);
        Ok(RawMessage { bytes })
    }
}

impl SerializerAdapter<RawMessage> for RawAdapter {
    type Error = Never;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(value: &RawMessage) -> Result<Bytes, Never> {
        let mut bytes = value.bytes[HEADER_LENGTH..].to_vec();
        if FILLED_UP.load(Ordering::Relaxed) {
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
        Ok(bytes.into())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn fields_are_aligned_behind_the_header() {
        #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        struct Mixed {
            small: u8,
            large: f64,
        }
        let raw = RawMessage::encode(&Mixed {
            small: 7,
            large: 1.0,
        })
        .unwrap();
        assert_eq!(
            raw.cdr(),
            [
                0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f
            ]
        );
        assert_eq!(
            raw.decode::<Mixed>().unwrap(),
            Mixed {
                small: 7,
                large: 1.0
            }
        );
        let big = RawMessage::from_cdr(vec![
            0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0x3f, 0xf0, 0, 0, 0, 0, 0, 0,
        ])
        .unwrap();
        assert_eq!(
            big.decode::<Mixed>().unwrap(),
            Mixed {
                small: 7,
                large: 1.0
            }
        );
        assert!(
            RawMessage::from_cdr(vec![0, 1, 0, 0, 7])
                .unwrap()
                .decode::<Mixed>()
                .is_err()
        );
        assert!(
            RawMessage::from_cdr(vec![0, 0x11, 0, 0, 7])
                .unwrap()
                .decode::<u8>()
                .unwrap_err()
                .contains("0011")
        );
        assert!(RawMessage::from_cdr(vec![0, 1]).is_err());
    }

    #[test]
    fn stamps_keep_their_nanoseconds() {
        for nanos in [0_u64, 1, 2, 999_999_999, 123_456_789, 333_333_333] {
            let fraction = (nanos << 32) / 1_000_000_000;
            let timestamp = Timestamp::from_ticks((1_700_000_000_u64 << 32) | fraction);
            assert_eq!(
                stamp_from_dds(timestamp),
                Some(Stamp::from_nanos(1_700_000_000_000_000_000 + nanos as i64))
            );
        }
        assert_eq!(stamp_from_dds(Timestamp::INVALID), None);
    }
}
