//! Files that commands write: nothing is replaced without `--force`, and nothing half-written stays.

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, bail};
use cromosim_recording::{is_in_the_way, write_file_with};

use crate::progress::Interrupt;

/// Refuses to write what exists already, unless `force`; before the work, so that none is in vain.
pub fn refuse_existing(path: &Path, force: bool) -> anyhow::Result<()> {
    if !force && is_in_the_way(path) {
        bail!(
            "{}: exists already; give another name, or --force to replace it",
            path.display()
        );
    }
    Ok(())
}

/// A file that takes its name when it is complete; a signal gives it up.
pub fn write_whole<V>(
    path: &Path,
    force: bool,
    write: impl FnOnce(&mut dyn Write) -> anyhow::Result<V>,
) -> anyhow::Result<V> {
    refuse_existing(path, force)?;
    let interrupt = Interrupt::watch()?;
    write_file_with(path, force, |file| {
        let written = write(&mut Interruptible {
            file,
            interrupt: &interrupt,
        })?;
        interrupt.check()?;
        Ok(written)
    })
}

/// A text as a whole file.
pub fn write_text(path: &Path, force: bool, text: &str) -> anyhow::Result<()> {
    write_whole(path, force, |file| {
        file.write_all(text.as_bytes())
            .with_context(|| format!("{}: cannot be written", path.display()))
    })
}

/// Fails once a signal has come.
struct Interruptible<'a> {
    file: &'a mut dyn Write,
    interrupt: &'a Interrupt,
}

impl Write for Interruptible<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.interrupt.check().map_err(io::Error::other)?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
