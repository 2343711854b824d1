use super::*;

#[path = "../tests/shot/files.rs"]
mod files;

fn sample() -> DepthMap {
    DepthMap::new(3, 2, vec![1.0, 2.0, 4.0, 0.0, f32::NAN, 0.5]).unwrap()
}

fn raw(map: &DepthMap, encoding: DepthEncoding) -> Vec<u8> {
    let encoded = |depth: &f32| match encoding {
        DepthEncoding::Depth => *depth,
        DepthEncoding::Disparity => files::disparity(*depth),
    };
    files::raw_depth(map.width(), map.height(), map.depths().iter().map(encoded))
}

#[test]
fn raw_maps_come_back_in_either_encoding() {
    for encoding in [DepthEncoding::Depth, DepthEncoding::Disparity] {
        let bytes = raw(&sample(), encoding);
        assert_eq!(bytes.len(), 20 + 24);
        assert_eq!(parse_depth(&bytes, encoding, "a.raw").unwrap(), sample());
    }
    let disparities = parse_raw_depth(
        &raw(&sample(), DepthEncoding::Depth),
        DepthEncoding::Disparity,
        "a.raw",
    )
    .unwrap();
    assert_eq!(disparities.at(2, 0), Some(0.25));
    assert_eq!(
        (
            sample().at(0, 1),
            sample().at(3, 0),
            sample().at(0, 2),
            sample().at(2, 1)
        ),
        (None, None, None, Some(0.5))
    );
}

#[test]
fn damaged_raw_maps_are_refused_by_name_and_byte() {
    let bytes = raw(&sample(), DepthEncoding::Depth);
    let message = |bytes: &[u8]| {
        parse_raw_depth(bytes, DepthEncoding::Depth, "a.raw")
            .unwrap_err()
            .to_string()
    };
    assert!(message(&bytes[..19]).contains("a.raw, byte 19"));
    assert!(message(&bytes[..40]).contains("take 24 bytes, found 20"));
    let mut three_channels = bytes.clone();
    three_channels[8] = 21;
    assert!(message(&three_channels).contains("found type 21"));
    let mut huge = bytes.clone();
    huge[..8].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]);
    assert!(message(&huge).contains("pixels"));
    let mut negative = bytes;
    negative[3] = 0xff;
    assert!(message(&negative).contains("pixels"));
}

#[test]
fn plain_npy_and_png_maps_are_read() {
    let plain: Vec<u8> = [1.0_f32, 2.0]
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let map = parse_plain_depth(&plain, 2, 1, DepthEncoding::Depth, "a").unwrap();
    assert_eq!(map.depths(), [1.0, 2.0]);
    assert!(parse_plain_depth(&plain, 3, 1, DepthEncoding::Depth, "a").is_err());

    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2), }\n";
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.as_bytes());
    npy.extend([1.5_f64, 2.5].iter().flat_map(|value| value.to_le_bytes()));
    assert_eq!(
        parse_depth(&npy, DepthEncoding::Depth, "a.npy")
            .unwrap()
            .depths(),
        [1.5, 2.5]
    );
    assert!(parse_npy_depth(&npy[..npy.len() - 1], DepthEncoding::Depth, "a.npy").is_err());

    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&[0x0f, 0xa0, 0, 0])
        .unwrap();
    let map = parse_depth(&bytes, DepthEncoding::Depth, "a.png").unwrap();
    assert_eq!(
        (map.at(0, 0), map.at(1, 0)),
        (Some(f64::from(4000.0_f32 * 1e-3)), None)
    );
    let cut = parse_png_depth(&bytes[..bytes.len() - 20], "a.png")
        .unwrap_err()
        .to_string();
    assert!(cut.starts_with("a.png"), "{cut}");
}
