use std::fs;

use super::*;
use crate::Direction;

fn network() -> Network {
    let shape = NetworkShape {
        inputs: 3,
        channels: 4,
        kernel: 3,
        convolutions: 2,
        hidden: 5,
        layers: 2,
        direction: Direction::Both,
        outputs: 2,
    };
    Network::new(shape, 1).unwrap()
}

fn notes() -> BTreeMap<String, String> {
    BTreeMap::from([
        ("trained_on".to_owned(), "walks".to_owned()),
        ("seed".to_owned(), "7".to_owned()),
    ])
}

fn name() -> &'static Path {
    Path::new("net.safetensors")
}

/// Changes the JSON header of a file, the data as they are.
fn with_header(bytes: &[u8], change: impl Fn(String) -> String) -> Vec<u8> {
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let header = change(String::from_utf8(bytes[8..8 + length].to_vec()).unwrap());
    let mut changed = (header.len() as u64).to_le_bytes().to_vec();
    changed.extend_from_slice(header.as_bytes());
    changed.extend_from_slice(&bytes[8 + length..]);
    changed
}

fn message(bytes: &[u8]) -> String {
    Network::from_bytes(bytes, name()).unwrap_err().to_string()
}

#[test]
fn round_trip_through_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.safetensors");
    network().write(&path, &notes()).unwrap();
    assert_eq!(Network::read(&path).unwrap(), (network(), notes()));
    assert_eq!(
        fs::read(&path).unwrap(),
        network().to_bytes(&notes(), &path).unwrap()
    );
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        1,
        "nothing is left beside it"
    );
}

#[test]
fn errors_name_file_tensor_and_shapes() {
    let bytes = network().to_bytes(&notes(), name()).unwrap();
    let renamed = message(&with_header(&bytes, |header| {
        header.replace("conv.1.bias", "conv.9.bias")
    }));
    assert!(
        renamed.starts_with("net.safetensors: tensor conv.9.bias is none of the network's"),
        "{renamed}"
    );
    let reshaped = message(&with_header(&bytes, |header| {
        header.replace(r#"\"inputs\":3"#, r#"\"inputs\":2"#)
    }));
    assert_eq!(
        reshaped,
        "net.safetensors: tensor conv.0.weight: expected F32 of shape [4, 2, 3], found F32 of shape [4, 3, 3]"
    );
    let deeper = message(&with_header(&bytes, |header| {
        header.replace(r#"\"layers\":2"#, r#"\"layers\":3"#)
    }));
    assert!(
        deeper.starts_with("net.safetensors: tensor lstm.weight_ih_l2 is missing; there are: conv.0.bias, conv.0.weight, "),
        "{deeper}"
    );
    let typed = message(&with_header(&bytes, |header| header.replace("F32", "I32")));
    assert!(
        typed.contains("tensor conv.0.weight: expected F32 of shape [4, 3, 3], found I32"),
        "{typed}"
    );
    let misspelt = message(&with_header(&bytes, |header| {
        header.replace("kernel", "colonel")
    }));
    assert!(
        misspelt.starts_with("net.safetensors: metadata `cromosim`: unknown field `colonel`"),
        "{misspelt}"
    );
    let bare = message(&with_header(&bytes, |header| {
        header.replace("cromosim", "somebody")
    }));
    assert!(
        bare.contains("missing, so that it is unknown what the tensors are"),
        "{bare}"
    );
    let missing = Network::read(Path::new("nowhere/net.safetensors"))
        .unwrap_err()
        .to_string();
    assert!(
        missing.starts_with("nowhere/net.safetensors: cannot be read"),
        "{missing}"
    );
    let unwritable = network()
        .write(Path::new("nowhere/net.safetensors"), &notes())
        .unwrap_err()
        .to_string();
    assert!(
        unwritable.starts_with("nowhere/net.safetensors: cannot be written"),
        "{unwritable}"
    );
}

#[test]
fn a_shape_that_claims_too_much_takes_no_memory() {
    let bytes = network().to_bytes(&notes(), name()).unwrap();
    let claims = |from: &'static str, to: &'static str| {
        message(&with_header(&bytes, |header| header.replace(from, to)))
    };
    assert!(
        claims(r#"\"hidden\":5"#, r#"\"hidden\":16384"#)
            .contains("at most 268435456 are supported")
    );
    assert!(
        claims(r#"\"hidden\":5"#, r#"\"hidden\":18446744073709551615"#)
            .contains("hidden is 18446744073709551615")
    );
    assert!(
        claims(r#"\"hidden\":5"#, r#"\"hidden\":2000"#).contains("expected F32 of shape [8000, 4]")
    );
    assert!(
        claims(r#""shape":[4,3,3]"#, r#""shape":[4,3,9000000000000000000]"#)
            .contains("not a sound safetensors file")
    );
}

#[test]
fn damaged_files_are_refused() {
    let bytes = network().to_bytes(&notes(), name()).unwrap();
    for length in [0, 7, 8, 40, bytes.len() / 2, bytes.len() - 1] {
        assert!(
            message(&bytes[..length]).contains("not a sound safetensors file"),
            "{length}"
        );
    }
    let mut huge = bytes.clone();
    huge[..8].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(message(&huge).contains("not a sound safetensors file"));
    let mut infinite = bytes.clone();
    let end = infinite.len();
    infinite[end - 4..].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(
        message(&infinite).contains("is inf; weights are finite"),
        "{}",
        message(&infinite)
    );
}

#[test]
fn bytes_changed_at_random_are_read_or_refused() {
    use rand::{RngExt, SeedableRng};
    let bytes = network().to_bytes(&notes(), name()).unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..3000 {
        let mut changed = bytes.clone();
        for _ in 0..random.random_range(1..4) {
            // Most of them within the header, where a change means something.
            let end = if random.random_bool(0.9) {
                8 + header
            } else {
                bytes.len()
            };
            changed[random.random_range(0..end)] = random.random();
        }
        match Network::from_bytes(&changed, name()) {
            Ok((changed, _)) => {
                assert_eq!(changed.parameters().len(), changed.shape().parameters());
                read += 1;
            }
            Err(_) => refused += 1,
        }
    }
    assert!(
        read > 50 && refused > 1000,
        "{read} read, {refused} refused"
    );
}
