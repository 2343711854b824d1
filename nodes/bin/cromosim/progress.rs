//! Progress on work that takes longer than a second, and its end by a signal.

use std::io::{IsTerminal, stderr};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::bail;
use cromosim_evaluation::Observer;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, WeakProgressBar};

use crate::output::{remark, say};

/// Work that is done within this time shows no progress.
const SHORT: Duration = Duration::from_secs(1);
/// How often a line tells of the work where standard error is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// From so many seconds on a time is told in minutes.
const IN_MINUTES_S: f64 = 120.0;
/// Steps of a bar for each work that tells shares.
const SHARE_STEPS: u64 = 1000;

/// Says of how many steps how many are done.
type Count = fn(u64, u64) -> String;

fn of_steps(done: u64, steps: u64) -> String {
    format!("{done} of {steps}")
}

fn percent(done: u64, steps: u64) -> String {
    format!("{} %", 100 * done / steps.max(1))
}

/// A bar of `steps` steps on standard error, with the time left; a line every ten seconds where that
/// is no terminal. Shown once the work has taken a second.
pub fn bar(steps: u64, doing: &str) -> ProgressBar {
    shown(
        ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::hidden()),
        doing,
        "{msg:24} {wide_bar:.cyan} {pos}/{len}, {eta} left",
        of_steps,
    )
}

/// A bar for so many works that tell which share of them is done; else as [`bar`].
pub fn shares(works: usize, doing: &str) -> Shares {
    Shares(shown(
        ProgressBar::with_draw_target(
            Some(SHARE_STEPS * works as u64),
            ProgressDrawTarget::hidden(),
        ),
        doing,
        "{msg:24} {wide_bar:.cyan} {percent} %, {eta} left",
        percent,
    ))
}

/// A bar of shares.
pub struct Shares(ProgressBar);

impl Shares {
    /// One of its works.
    pub fn of_one(&self) -> OneOf {
        OneOf {
            bar: self.0.clone(),
            reached: AtomicU64::new(0),
        }
    }

    /// The works are done.
    pub fn finish(self) {
        self.0.finish_and_clear();
    }
}

/// One of the works of [`Shares`].
pub struct OneOf {
    bar: ProgressBar,
    reached: AtomicU64,
}

impl OneOf {
    /// So much of it is done, from 0 to 1.
    pub fn reached(&self, share: f64) {
        let steps = (share * SHARE_STEPS as f64) as u64;
        let before = self.reached.fetch_max(steps, Ordering::Relaxed);
        self.bar.inc(steps.saturating_sub(before));
    }
}

/// Does work whose length nobody knows; as [`bar`], with the time gone.
pub fn working<T>(doing: &str, work: impl FnOnce() -> T) -> T {
    let spinner = shown(
        ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()),
        doing,
        "{spinner} {msg}, {elapsed}",
        of_steps,
    );
    let done = work();
    spinner.finish_and_clear();
    done
}

fn shown(bar: ProgressBar, doing: &str, template: &str, count: Count) -> ProgressBar {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.set_message(doing.to_owned());
    let watched = bar.downgrade();
    if stderr().is_terminal() {
        thread::spawn(move || draw(&watched));
    } else {
        thread::spawn(move || tell(&watched, count, LINE_EVERY, |line| remark!("{line}")));
    }
    bar
}

/// Shows the bar where the work goes on after a second.
fn draw(bar: &WeakProgressBar) {
    thread::sleep(SHORT);
    if let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) {
        bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(8));
        bar.enable_steady_tick(Duration::from_millis(500));
    }
}

/// Tells of the work, again and again, until it is done.
fn tell(bar: &WeakProgressBar, count: Count, every: Duration, say: impl Fn(String)) {
    loop {
        thread::sleep(every);
        let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) else {
            return;
        };
        let gone = bar.elapsed().as_secs_f64();
        say(line(
            &bar.message(),
            bar.position(),
            bar.length(),
            count,
            gone,
        ));
    }
}

/// `simulating, placements: 3 of 17, 12 s gone, about 56 s left`.
fn line(doing: &str, done: u64, steps: Option<u64>, count: Count, gone_s: f64) -> String {
    let gone = format!("{} gone", time(gone_s));
    let Some(steps) = steps else {
        return format!("{doing}: {gone}");
    };
    let left = if done == 0 {
        "time left not known yet".to_owned()
    } else {
        let left = gone_s / done as f64 * steps.saturating_sub(done) as f64;
        format!("about {} left", time(left))
    };
    format!("{doing}: {}, {gone}, {left}", count(done, steps))
}

fn time(seconds: f64) -> String {
    if seconds < IN_MINUTES_S {
        format!("{seconds:.0} s")
    } else {
        format!("{:.0} min", seconds / 60.0)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_tell_what_is_done_and_how_long_it_takes() {
        let told = |done, gone_s| line("simulating, files", done, Some(17), of_steps, gone_s);
        assert_eq!(
            told(3, 12.0),
            "simulating, files: 3 of 17, 12 s gone, about 56 s left"
        );
        assert_eq!(
            told(0, 10.0),
            "simulating, files: 0 of 17, 10 s gone, time left not known yet"
        );
        assert_eq!(
            told(2, 60.0),
            "simulating, files: 2 of 17, 60 s gone, about 8 min left"
        );
        assert_eq!(
            line("diagnosing", 350, Some(1000), percent, 14.0),
            "diagnosing: 35 %, 14 s gone, about 26 s left"
        );
        assert_eq!(
            line("fitting", 0, None, of_steps, 130.0),
            "fitting: 2 min gone"
        );
    }

    #[test]
    fn shares_of_several_works_add_up() {
        let shares = shares(2, "working");
        let (first, second) = (shares.of_one(), shares.of_one());
        for share in [0.1, 0.5, 0.4, 1.0, 1.0] {
            first.reached(share);
        }
        second.reached(0.25);
        assert_eq!(shares.0.position(), 1250);
        assert_eq!(shares.0.length(), Some(2000));
        shares.finish();
    }

    #[test]
    fn work_is_told_of_until_it_is_done() {
        let bar = ProgressBar::with_draw_target(Some(4), ProgressDrawTarget::hidden());
        bar.set_message("working");
        bar.inc(2);
        let watched = bar.downgrade();
        let (sender, told) = std::sync::mpsc::channel();
        let teller = thread::spawn(move || {
            tell(&watched, of_steps, Duration::from_millis(20), |line| {
                let _ = sender.send(line);
            });
        });
        for _ in 0..2 {
            let line = told.recv().unwrap_or_default();
            assert!(line.starts_with("working: 2 of 4, "), "{line}");
        }
        bar.finish_and_clear();
        assert!(teller.join().is_ok());
    }
}
