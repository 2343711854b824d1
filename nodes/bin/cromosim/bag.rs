//! `cromosim bag`: mend bags, export from them.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use cromosim_bag::{BagReader, Recovery, recover_over, write_imu_csv};

use crate::files::{refuse_existing, write_whole};
use crate::output::{output, remark, say};
use crate::progress::working;

/// Commands on bags.
#[derive(Subcommand)]
pub enum Command {
    /// Mend a bag whose recorder was killed, or a file that was cut
    ///
    /// All that is sound is kept, and what is missing is said
    Recover {
        /// The unfinished .mcap file or rosbag2 directory; it is left as it is
        bag: PathBuf,
        /// The mended copy; default: the name with `_recovered`
        #[arg(long)]
        out: Option<PathBuf>,
        /// Replace OUT where it exists
        #[arg(long)]
        force: bool,
    },
    /// Write the samples of an Imu topic as CSV
    ///
    /// Stamp, orientation, angular velocity (rad/s), specific force (m/s2)
    Csv {
        /// A .mcap file or a rosbag2 directory
        bag: PathBuf,
        /// The topic, as /imu/left_wrist/data_raw
        topic: String,
        /// Where to; default: standard output
        #[arg(long)]
        out: Option<PathBuf>,
        /// Replace OUT where it exists
        #[arg(long)]
        force: bool,
    },
}

/// Runs the command.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Recover { bag, out, force } => {
            let out = out.clone().unwrap_or_else(|| recovered_name(bag));
            if !in_place(bag, &out) {
                refuse_existing(&out, *force)?;
            }
            let recovery = working("mending", || recover_over(bag, &out, *force))?;
            print_recovery(&out, &recovery)?;
        }
        Command::Csv {
            bag,
            topic,
            out,
            force,
        } => {
            let reader = BagReader::open(bag)?;
            match out {
                Some(path) => {
                    let rows = write_whole(path, *force, |file| {
                        Ok(write_imu_csv(&reader, topic, file, path)?)
                    })?;
                    remark!("{}: {rows} rows", path.display());
                }
                None => drop(write_imu_csv(
                    &reader,
                    topic,
                    output(),
                    Path::new("standard output"),
                )?),
            }
        }
    }
    Ok(())
}

/// Whether a bag is mended where it is.
fn in_place(bag: &Path, out: &Path) -> bool {
    let both = bag.canonicalize().ok().zip(out.canonicalize().ok());
    both.is_some_and(|(bag, out)| bag == out)
}

fn print_recovery(out: &Path, recovery: &Recovery) -> anyhow::Result<()> {
    let missing = match recovery.messages_lost {
        Some(count) => format!("{count} messages missing"),
        None => "no index says how many are missing".to_owned(),
    };
    say!(
        "{}: {} messages kept, {missing}, {} bytes lost",
        out.display(),
        recovery.messages_kept(),
        recovery.bytes_lost
    )?;
    for damage in &recovery.damages {
        let span = damage.span.map_or_else(String::new, |[from, to]| {
            format!(
                ", recorded from {:.3} to {:.3} s ({:.3} s)",
                from.as_seconds(),
                to.as_seconds(),
                to - from
            )
        });
        say!(
            "  {}, byte {}: {}; {} bytes{span}",
            damage.path.display(),
            damage.at,
            damage.reason,
            damage.bytes
        )?;
    }
    Ok(())
}

/// `walk.mcap` -> `walk_recovered.mcap`; `bag` -> `bag_recovered`.
fn recovered_name(bag: &Path) -> PathBuf {
    let stem = bag.file_stem().unwrap_or_default().to_string_lossy();
    match bag.extension() {
        Some(ending) if !bag.is_dir() => {
            bag.with_file_name(format!("{stem}_recovered.{}", ending.to_string_lossy()))
        }
        _ => bag.with_file_name(format!("{stem}_recovered")),
    }
}
