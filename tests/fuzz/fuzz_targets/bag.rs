//! Bags: reading takes what it opens to the end or says what is wrong, and what is recovered can be read.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use cromosim_bag::{BagReader, Selection, recover_over};
use libfuzzer_sys::fuzz_target;

/// A folder of this process.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("cromosim_fuzz_bag_{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder
});

/// The messages of a bag that can be opened, up to the first error.
fn read(reader: &BagReader) -> Result<u64, ()> {
    let mut count = 0;
    for message in reader.messages(&Selection::default()).map_err(|_| ())? {
        let message = message.map_err(|_| ())?;
        let _ = message.decode::<cromosim_msgs::sensor_msgs::Imu>();
        let _ = message.decode::<cromosim_msgs::cromosim_msgs::SmplState>();
        count += 1;
    }
    Ok(count)
}

fuzz_target!(|bytes: &[u8]| {
    let [path, recovered] = ["bag.mcap", "recovered.mcap"].map(|name| FOLDER.join(name));
    std::fs::write(&path, bytes).expect("a file in the temporary folder");
    let whole = BagReader::open(&path).ok().and_then(|reader| read(&reader).ok());
    if let Ok(recovery) = recover_over(&path, &recovered, true) {
        let reader = BagReader::open(&recovered).expect("what was recovered can be opened");
        let kept = read(&reader).expect("what was recovered can be read");
        assert_eq!(kept, recovery.messages_kept());
        // What is sound as it is loses nothing.
        assert!(whole.is_none_or(|whole| kept >= whole), "{whole:?} messages, {kept} kept");
    }
});
