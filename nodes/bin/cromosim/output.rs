//! What is printed: lines on standard output whose failure is an error like any other, and remarks
//! on standard error.

use std::fmt;
use std::io::{self, ErrorKind, Write};

use anyhow::Context;
use cromosim_msgs::printable;

/// Whoever read standard output has gone away (`cromosim inspect walk.mcap | head -1`): nothing is
/// wrong, and nobody is left to be told.
#[derive(Debug)]
struct NobodyReads;

impl fmt::Display for NobodyReads {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("nobody reads it")
    }
}

impl std::error::Error for NobodyReads {}

/// Whether a command ended because nobody reads what it prints.
pub fn nobody_reads(error: &anyhow::Error) -> bool {
    let mut causes = error.chain().filter_map(|cause| cause.downcast_ref());
    causes.any(|cause: &io::Error| {
        cause
            .get_ref()
            .is_some_and(|inner| inner.is::<NobodyReads>())
    })
}

/// Standard output; a closed pipe is marked as such.
pub struct Output(io::StdoutLock<'static>);

/// Standard output, for one writer at a time.
pub fn output() -> Output {
    Output(io::stdout().lock())
}

/// Only of standard output is a closed pipe no fault: sockets and other pipes break as well.
fn marked(error: io::Error) -> io::Error {
    match error.kind() {
        ErrorKind::BrokenPipe => io::Error::new(ErrorKind::BrokenPipe, NobodyReads),
        _ => error,
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes).map_err(marked)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush().map_err(marked)
    }
}

/// Text as a terminal may show it, line by line: names in it may come from files and other nodes.
pub fn safe(text: fmt::Arguments<'_>) -> String {
    let text = text.to_string();
    let lines: Vec<_> = text.split('\n').map(printable).collect();
    lines.join("\n")
}

/// Prints, at once, what a terminal may show.
///
/// # Errors
/// One line that names standard output; [`nobody_reads`] knows a closed pipe.
pub fn print(text: fmt::Arguments<'_>) -> anyhow::Result<()> {
    let mut output = output();
    output
        .write_all(safe(text).as_bytes())
        .and_then(|()| output.flush())
        .context("standard output: cannot be written")
}

/// Prints a line, formatted as by `println!`; an error where that fails, rather than a panic.
macro_rules! say {
    ($($text:tt)*) => {
        $crate::output::print(format_args!("{}\n", format_args!($($text)*)))
    };
}
pub(crate) use say;

/// A line on standard error, beside what a command is for: where it cannot be written, work goes on.
macro_rules! remark {
    ($($text:tt)*) => {{
        let text = $crate::output::safe(format_args!("{}\n", format_args!($($text)*)));
        let _ = std::io::Write::write_all(&mut std::io::stderr().lock(), text.as_bytes());
    }};
}
pub(crate) use remark;
