//! Progress on work that takes longer than a second, and its end by a signal.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::bail;
use cromosim_evaluation::Observer;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output::say;

/// A bar of `steps` steps on standard error; invisible where that is no terminal.
pub fn bar(steps: u64, doing: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr_with_hz(8));
    if let Ok(style) = ProgressStyle::with_template("{msg:24} {wide_bar:.cyan} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    bar.set_message(doing.to_owned());
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

/// Set by SIGINT and SIGTERM, so that work can stop where nothing is left half-written.
#[derive(Clone)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watches for the signals; a second one ends the process at once.
    pub fn watch() -> anyhow::Result<Self> {
        let flag = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            // In this order: the first signal finds the flag unset and sets it, the second finds it
            // set.
            signal_hook::flag::register_conditional_default(signal, flag.clone())?;
            signal_hook::flag::register(signal, flag.clone())?;
        }
        Ok(Self(flag))
    }

    /// Whether a signal has come.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// An error once a signal has come: whoever writes a file gives it up.
    pub fn check(&self) -> anyhow::Result<()> {
        if self.is_set() {
            bail!("interrupted; what was being written is given up");
        }
        Ok(())
    }
}

/// A user at a terminal, who waits for an evaluation or a training and may interrupt it.
pub struct Terminal {
    interrupt: Interrupt,
    bar: Mutex<Option<ProgressBar>>,
}

impl Terminal {
    /// Watches for signals as [`Interrupt::watch`].
    pub fn watch() -> anyhow::Result<Self> {
        Ok(Self {
            interrupt: Interrupt::watch()?,
            bar: Mutex::new(None),
        })
    }

    fn bar(&self) -> MutexGuard<'_, Option<ProgressBar>> {
        self.bar.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Terminal {
    fn begin(&self, work: &str, steps: u64) {
        *self.bar() = Some(bar(steps, work));
    }

    fn advance(&self, steps: u64) {
        if let Some(bar) = self.bar().as_ref() {
            bar.inc(steps);
        }
    }

    fn describe(&self, work: &str) {
        if let Some(bar) = self.bar().as_ref() {
            bar.set_message(work.to_owned());
        }
    }

    fn end(&self) {
        if let Some(bar) = self.bar().take() {
            bar.finish_and_clear();
        }
    }

    fn note(&self, line: &str) {
        // What it says in the end tells of an output that cannot be written.
        let _ = say!("{line}");
    }

    fn interrupted(&self) -> bool {
        self.interrupt.is_set()
    }
}
