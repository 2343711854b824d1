//! Bags that were cut, killed, damaged or met a full disk.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

use cromosim_bag::{
    BagError, BagOptions, BagReader, BagWriter, Compression, Selection, StreamWriter, recover,
};

use common::{Numbers, bag, check_samples, fill, imu, stamp};

const PLAIN: BagOptions = BagOptions {
    compression: Compression::None,
    live: false,
    replace: true,
};
const ZSTD: BagOptions = BagOptions {
    compression: Compression::Zstd,
    ..PLAIN
};
const LIVE: BagOptions = BagOptions {
    live: true,
    ..PLAIN
};

/// Bytes of one sample in an unpacked chunk: record header 9, message header 22, CDR header 4,
/// header 8 + 4 + 15 + 5 (padding), 37 numbers.
const SAMPLE_BYTES: u64 = 9 + 22 + 4 + 32 + 37 * 8;

#[test]
fn a_bag_cut_anywhere_gives_back_what_lay_before_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, cut, mended) = (
        folder.path().join("whole.mcap"),
        folder.path().join("cut.mcap"),
        folder.path().join("mended.mcap"),
    );
    for options in [PLAIN, ZSTD] {
        let mut writer = BagWriter::create(&whole, options).unwrap();
        fill(&mut writer, 60);
        writer.flush().unwrap();
        (60..100).for_each(|index| {
            writer
                .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
                .unwrap()
        });
        writer.finish().unwrap();
        let bytes = fs::read(&whole).unwrap();
        let mut kept_before = 0;
        for length in (8..bytes.len()).step_by(97) {
            fs::write(&cut, &bytes[..length]).unwrap();
            match BagReader::open(&cut) {
                Err(error @ BagError::Unfinished { .. }) => {
                    assert!(
                        error.to_string().contains("cromosim bag recover"),
                        "{error}"
                    );
                }
                other => panic!("{length} bytes: {other:?}"),
            }
            let _ = fs::remove_file(&mended);
            let recovery = recover(&cut, &mended).unwrap();
            let kept = check_samples(&mended);
            assert!(
                kept >= kept_before,
                "{length} bytes: {kept} samples kept, with fewer bytes {kept_before}"
            );
            assert_eq!(
                BagReader::open(&mended).unwrap().summary(),
                &recovery.summary
            );
            kept_before = kept;
        }
        assert_eq!(kept_before, 100);
    }
}

#[test]
fn of_a_cut_chunk_every_whole_message_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, cut) = (
        folder.path().join("whole.mcap"),
        folder.path().join("cut.mcap"),
    );
    let mut writer = BagWriter::create(&whole, PLAIN).unwrap();
    (0..100).for_each(|index| {
        writer
            .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
            .unwrap()
    });
    writer.finish().unwrap();
    let bytes = fs::read(&whole).unwrap();
    let kept_at = |length: u64| {
        fs::write(&cut, &bytes[..length as usize]).unwrap();
        let recovery = recover(&cut, &cut).unwrap();
        (check_samples(&cut), recovery)
    };
    let (kept, recovery) = kept_at(20_000);
    assert!(
        recovery.bytes_lost > 0 && recovery.bytes_lost < SAMPLE_BYTES,
        "{recovery:?}"
    );
    assert_eq!(recovery.damages.len(), 1);
    // Where the lost bytes begin, the last sample ends: one byte less, and one sample less.
    let end = 20_000 - recovery.bytes_lost;
    assert_eq!(kept_at(end).0, kept);
    assert_eq!(kept_at(end - 1).0, kept - 1);
    assert_eq!(kept_at(end + SAMPLE_BYTES).0, kept + 1);
}

#[test]
fn a_killed_recorder_loses_what_came_after_the_last_flush_alone() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["killed.mcap", "killed"] {
        let path = folder.path().join(name);
        let mut writer = BagWriter::create(&path, LIVE).unwrap();
        fill(&mut writer, 1000);
        writer.flush().unwrap();
        (1000..1020).for_each(|index| {
            writer
                .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
                .unwrap()
        });
        // Killed: no destructor runs.
        std::mem::forget(writer);
        let error = BagReader::open(&path).unwrap_err();
        assert!(
            error.to_string().contains("cromosim bag recover"),
            "{error}"
        );
        let recovery = recover(&path, &path).unwrap();
        assert_eq!(
            (
                check_samples(&path),
                recovery.messages_kept(),
                recovery.bytes_lost
            ),
            (1000, 1100, 0),
            "{name}"
        );
        let reader = BagReader::open(&path).unwrap();
        assert_eq!(
            reader.attachment("placements.yaml"),
            Some(b"placements: []\n".as_slice())
        );
        assert!(
            reader.metadata("rosbag2").unwrap()["serialized_metadata"]
                .contains("message_count: 1100")
        );
    }
}

#[test]
fn a_directory_is_mended_into_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (folder.path().join("old"), folder.path().join("new"));
    bag(&old, 200, PLAIN);
    fs::copy(old.join("old_0.mcap"), old.join("old_1.mcap")).unwrap();
    fs::remove_file(old.join("metadata.yaml")).unwrap();
    assert!(matches!(
        BagReader::open(&old),
        Err(BagError::NoMetadata { .. })
    ));
    assert_eq!(recover(&old, &new).unwrap().messages_kept(), 440);
    let reader = BagReader::open(&new).unwrap();
    let times: Vec<_> = reader
        .messages(&Selection::default())
        .unwrap()
        .map(|message| message.unwrap().log_time)
        .collect();
    assert!(times.is_sorted() && times.len() == 440);
    assert!(matches!(recover(&old, &new), Err(BagError::Exists { .. })));
    assert!(matches!(
        recover(folder.path(), &folder.path().join("none")),
        Err(BagError::NoMetadata { .. })
    ));
}

#[test]
fn a_chunk_that_fails_its_checksum_is_left_out_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mended) = (
        folder.path().join("bad.mcap"),
        folder.path().join("mended.mcap"),
    );
    let mut writer = BagWriter::create(&path, PLAIN).unwrap();
    for index in 0..100 {
        writer
            .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
            .unwrap();
        if index % 25 == 24 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    let mut bytes = fs::read(&path).unwrap();
    bytes[5000] ^= 0x10;
    fs::write(&path, &bytes).unwrap();
    let reader = BagReader::open(&path).unwrap();
    let error = reader
        .messages(&Selection::default())
        .unwrap()
        .find_map(Result::err)
        .unwrap();
    assert!(
        matches!(error, BagError::Corrupt { .. }) && error.to_string().contains("checksum"),
        "{error}"
    );
    let recovery = recover(&path, &mended).unwrap();
    assert_eq!((recovery.messages_kept(), recovery.damages.len()), (75, 1));
    assert!(recovery.bytes_lost > 25 * SAMPLE_BYTES);
}

/// Takes a number of bytes and then is full, as a disk is. What it took stays readable after the
/// writer is gone.
struct SmallDisk {
    stored: Arc<Mutex<Cursor<Vec<u8>>>>,
    capacity: usize,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut stored = self.stored.lock().unwrap();
        let free = self.capacity - (stored.position() as usize).min(self.capacity);
        if free == 0 {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        stored.write(&bytes[..bytes.len().min(free)])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.stored.lock().unwrap().seek(to)
    }
}

#[test]
fn a_full_disk_is_an_error_and_what_was_written_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mended) = (
        folder.path().join("full.mcap"),
        folder.path().join("mended.mcap"),
    );
    for capacity in (600..40_000).step_by(1777) {
        let stored = Arc::new(Mutex::new(Cursor::new(Vec::new())));
        let disk = SmallDisk {
            stored: Arc::clone(&stored),
            capacity,
        };
        let mut writer =
            StreamWriter::new(disk, Path::new("full.mcap"), Compression::None).unwrap();
        let mut flushed = 0;
        let error = (0..200).find_map(|index| {
            let written = writer
                .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
                .and_then(|()| match index % 10 {
                    9 => writer.flush().map(|()| flushed = index + 1),
                    _ => Ok(()),
                });
            written.err()
        });
        assert!(
            matches!(&error, Some(BagError::Io { source, .. }) if source.kind() == io::ErrorKind::StorageFull),
            "{error:?}"
        );
        assert!(
            writer
                .write("/imu/left_wrist/data_raw", stamp(0), &imu(0))
                .and_then(|()| writer.flush())
                .is_err(),
            "no second try"
        );
        drop(writer);
        fs::write(&path, stored.lock().unwrap().get_ref()).unwrap();
        let _ = fs::remove_file(&mended);
        recover(&path, &mended).unwrap();
        let kept = check_samples(&mended);
        assert!(
            kept >= flushed && kept < flushed + 10,
            "capacity {capacity}: {flushed} flushed, {kept} kept"
        );
    }
}

/// The kernel's own full disk: the error reaches the user with the name of the bag.
#[cfg(target_os = "linux")]
#[test]
fn a_live_recording_on_a_full_device_says_so() {
    let full = Path::new("/dev/full");
    if !full.exists() {
        println!("skipped: no /dev/full");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("full.mcap");
    std::os::unix::fs::symlink(full, &path).unwrap();
    let mut writer = BagWriter::create(&path, LIVE).unwrap();
    let error = writer
        .write("/imu/left_wrist/data_raw", stamp(0), &imu(0))
        .and_then(|()| writer.flush())
        .unwrap_err();
    assert!(
        matches!(error, BagError::RecordingStopped { .. }),
        "{error:?}"
    );
    assert!(
        error.to_string().contains("full.mcap") && error.to_string().contains("No space left"),
        "{error}"
    );
}

#[test]
fn no_damage_makes_reading_or_mending_panic() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mended) = (
        folder.path().join("bag.mcap"),
        folder.path().join("mended.mcap"),
    );
    let mut numbers = Numbers(20_240_607);
    for options in [PLAIN, ZSTD] {
        bag(&path, 40, options);
        let whole = fs::read(&path).unwrap();
        for _ in 0..250 {
            let mut bytes = whole.clone();
            for _ in 0..=numbers.below(4) {
                let at = numbers.below(bytes.len());
                match numbers.below(3) {
                    0 => bytes[at] = numbers.below(256) as u8,
                    1 => bytes[at..(at + 8).min(whole.len())].fill(0xff),
                    _ => bytes.truncate(at.max(8)),
                }
                if bytes.len() < whole.len() {
                    break;
                }
            }
            fs::write(&path, &bytes).unwrap();
            if let Ok(reader) = BagReader::open(&path) {
                let _ = reader
                    .messages(&Selection::default())
                    .unwrap()
                    .map(|message| message.map(|_| ()))
                    .collect::<Result<Vec<()>, _>>();
            }
            let _ = fs::remove_file(&mended);
            match recover(&path, &mended) {
                Ok(recovery) => assert_eq!(
                    BagReader::open(&mended).unwrap().summary(),
                    &recovery.summary
                ),
                Err(error) => assert!(matches!(error, BagError::NotRecoverable { .. }), "{error}"),
            }
        }
    }
}

/// Four chunks of 25 samples each, and where each chunk's record begins.
fn four_chunks(path: &Path, options: BagOptions) -> Vec<usize> {
    let mut writer = BagWriter::create(path, options).unwrap();
    for index in 0..100 {
        writer
            .write("/imu/left_wrist/data_raw", stamp(index), &imu(index))
            .unwrap();
        if index % 25 == 24 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    let (bytes, mut at, mut chunks) = (fs::read(path).unwrap(), 8, Vec::new());
    while bytes[at] != 0x0f {
        if bytes[at] == 0x06 {
            chunks.push(at);
        }
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    assert_eq!(chunks.len(), 4);
    chunks
}

/// How many samples a bag holds; each is what was written at its time.
fn sound_samples(path: &Path) -> i64 {
    let reader = BagReader::open(path).unwrap();
    let messages = reader.messages(&Selection::default()).unwrap();
    let mut count = 0;
    for message in messages {
        let message = message.unwrap();
        let index = (message.log_time.nanos - stamp(0).nanos) / 10_000_000;
        let found: cromosim_msgs::sensor_msgs::Imu = message.decode().unwrap();
        assert_eq!(found, imu(index));
        count += 1;
    }
    count
}

#[test]
fn whatever_byte_of_a_chunks_header_is_flipped_the_other_chunks_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mended) = (
        folder.path().join("bad.mcap"),
        folder.path().join("mended.mcap"),
    );
    for options in [PLAIN, ZSTD] {
        let chunks = four_chunks(&path, options);
        let whole = fs::read(&path).unwrap();
        for (chunk, &start) in chunks.iter().enumerate() {
            // Kind and length of the record, times, sizes, checksum and compression of the chunk.
            for place in 0..9 + 40 {
                for flipped in [0x01, 0x40, 0xff] {
                    let mut bytes = whole.clone();
                    bytes[start + place] ^= flipped;
                    fs::write(&path, &bytes).unwrap();
                    let _ = fs::remove_file(&mended);
                    let recovery = recover(&path, &mended).unwrap();
                    let case = format!("chunk {chunk}, byte {place}, {flipped:#x}: {recovery:?}");
                    let kept = sound_samples(&mended);
                    assert!(kept == 75 || kept == 100, "{kept}, {case}");
                    assert_eq!(recovery.messages_lost, Some(100 - kept as u64), "{case}");
                    assert_eq!(recovery.damages.is_empty(), kept == 100, "{case}");
                    if let Some(damage) = recovery.damages.first() {
                        assert_eq!(damage.at, start as u64, "{case}");
                        assert!(damage.bytes > 25, "{case}");
                        let span = [25 * chunk, 25 * chunk + 24].map(|index| stamp(index as i64));
                        assert_eq!(damage.span, Some(span), "{case}");
                    }
                }
            }
        }
    }
}

#[test]
fn without_an_index_the_way_is_found_again_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mended) = (
        folder.path().join("killed.mcap"),
        folder.path().join("mended.mcap"),
    );
    let chunks = four_chunks(&path, PLAIN);
    let mut bytes = fs::read(&path).unwrap();
    // Killed in the last chunk; and a length in the second is damaged.
    bytes.truncate(chunks[3] + 10 * SAMPLE_BYTES as usize);
    bytes[chunks[1] + 5] ^= 0x08;
    fs::write(&path, &bytes).unwrap();
    let recovery = recover(&path, &mended).unwrap();
    let kept = sound_samples(&mended);
    assert!((84..=85).contains(&kept), "{kept}: {recovery:?}");
    assert_eq!(recovery.messages_lost, None);
    assert_eq!(recovery.damages.len(), 1, "{recovery:?}");
    // Of a chunk whose content is damaged too, the others are kept.
    bytes[chunks[1] + 3000] ^= 0x08;
    fs::write(&path, &bytes).unwrap();
    fs::remove_file(&mended).unwrap();
    let recovery = recover(&path, &mended).unwrap();
    assert_eq!(sound_samples(&mended), kept - 25, "{recovery:?}");
    assert_eq!(recovery.damages[0].at, chunks[1] as u64);
    let lost = (chunks[2] - chunks[1]) as u64;
    assert!(
        recovery.damages[0].bytes.abs_diff(lost) < 2000,
        "{recovery:?}"
    );
}
