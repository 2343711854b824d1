//! Messages as CDR payloads: four bytes that say the encoding, then the data.

use byteorder::{BigEndian, LittleEndian};
use cromosim_msgs::RosMessage;

/// The first four bytes of a plain CDR payload: second byte 1 for little endian, 0 for big endian
/// (OMG DDSI-RTPS 2.5, 10.2).
pub const LITTLE_ENDIAN_HEADER: [u8; 4] = [0, 1, 0, 0];

/// Bytes of padding that DDS may leave behind a message.
const MOST_PADDING: usize = 7;

/// A message as payload: [`LITTLE_ENDIAN_HEADER`] and little-endian CDR.
///
/// # Errors
/// The encoder's reason, for types that CDR cannot hold; no [`RosMessage`] of cromosim_msgs is one.
pub fn encode<M: RosMessage>(message: &M) -> Result<Vec<u8>, String> {
    let mut payload = Vec::with_capacity(2 * size_of::<M>() + 64);
    payload.extend_from_slice(&LITTLE_ENDIAN_HEADER);
    cdr_encoding::to_writer::<M, LittleEndian, _>(&mut payload, message)
        .map_err(|error| error.to_string())?;
    Ok(payload)
}

/// The message in a payload, of either byte order.
///
/// # Errors
/// What is wrong: an encoding that is not plain CDR, too few bytes, too many bytes, or values that
/// the type does not have.
pub fn decode<M: RosMessage>(payload: &[u8]) -> Result<M, String> {
    let Some((header, body)) = payload.split_at_checked(LITTLE_ENDIAN_HEADER.len()) else {
        return Err(format!(
            "expected at least 4 bytes of CDR, found {}",
            payload.len()
        ));
    };
    let decoded = match header[..2] {
        [0, 1] => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        [0, 0] => cdr_encoding::from_bytes::<M, BigEndian>(body),
        _ => {
            return Err(format!(
                "expected plain CDR (0000 or 0001), found encoding {:02x}{:02x}",
                header[0], header[1]
            ));
        }
    };
    let (message, used) = decoded
        .map_err(|error| format!("not a {} of {} bytes: {error}", M::TYPE_NAME, body.len()))?;
    if body.len() - used > MOST_PADDING {
        return Err(format!(
            "not a {}: {} bytes are left over",
            M::TYPE_NAME,
            body.len() - used
        ));
    }
    Ok(message)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use cromosim_msgs::sensor_msgs::Imu;
    use cromosim_msgs::std_msgs::{Header, String as Text};

    #[test]
    fn both_byte_orders_are_read_and_others_refused() {
        let text = Text {
            data: "lever arm".to_owned(),
        };
        let mut payload = encode(&text).unwrap();
        assert_eq!(decode::<Text>(&payload).unwrap(), text);
        let mut swapped = vec![0, 0, 0, 0];
        swapped.extend(cdr_encoding::to_vec::<_, BigEndian>(&text).unwrap());
        assert_eq!(decode::<Text>(&swapped).unwrap(), text);
        payload[1] = 3;
        assert_eq!(
            decode::<Text>(&payload).unwrap_err(),
            "expected plain CDR (0000 or 0001), found encoding 0003"
        );
    }

    #[test]
    fn every_cut_is_refused_and_nothing_is_made_up() {
        let imu = Imu {
            header: Header::new(1, "left_wrist_imu"),
            ..Imu::default()
        };
        let payload = encode(&imu).unwrap();
        for length in 0..payload.len() {
            assert!(decode::<Imu>(&payload[..length]).is_err(), "{length} bytes");
        }
        let padded = [payload.as_slice(), &[0; 3]].concat();
        assert_eq!(decode::<Imu>(&padded).unwrap(), imu);
        let two = [payload.as_slice(), &payload].concat();
        assert!(decode::<Imu>(&two).unwrap_err().contains("left over"));
    }

    #[test]
    fn a_length_beyond_the_payload_is_refused() {
        let payload = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0x7f, b'a', 0];
        assert!(decode::<Text>(&payload).is_err());
        assert!(decode::<cromosim_msgs::tf2_msgs::TFMessage>(&payload).is_err());
    }
}
