//! Files as the tools before us write them.

/// Robust CVD's raw form of a map: header, then float32 row by row.
pub fn raw_depth(width: usize, height: usize, numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    let mut bytes = Vec::new();
    // OpenCV's type 5: float32, one channel.
    for value in [height as i32, width as i32, 5] {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(4_u64.to_le_bytes());
    bytes.extend(numbers.flat_map(f32::to_le_bytes));
    bytes
}

/// 1 / depth; 0 where the depth is unknown.
pub fn disparity(depth: f32) -> f32 {
    if depth > 0.0 { depth.recip() } else { 0.0 }
}
