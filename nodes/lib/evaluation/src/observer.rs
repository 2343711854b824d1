//! What a long computation tells whoever waits for it, and how it is ended early.

use crate::EvaluationError;

/// Whoever waits for a long computation: it is told of progress, and may ask for the end. Calls
/// come from several threads.
pub trait Observer: Sync {
    /// A stretch of work of `steps` steps begins; `work` says what is done.
    fn begin(&self, work: &str, steps: u64);

    /// Further steps of the stretch are done.
    fn advance(&self, steps: u64);

    /// The stretch's description changes, to a loss for example.
    fn describe(&self, work: &str);

    /// The stretch is over.
    fn end(&self);

    /// A line for the user about what follows.
    fn note(&self, line: &str);

    /// Whether the computation is to stop.
    fn interrupted(&self) -> bool;
}

/// Nobody waits.
pub struct Unobserved;

impl Observer for Unobserved {
    fn begin(&self, _work: &str, _steps: u64) {}
    fn advance(&self, _steps: u64) {}
    fn describe(&self, _work: &str) {}
    fn end(&self) {}
    fn note(&self, _line: &str) {}
    fn interrupted(&self) -> bool {
        false
    }
}

/// An error once the observer has asked for the end.
pub(crate) fn check(observer: &dyn Observer) -> Result<(), EvaluationError> {
    if observer.interrupted() {
        Err(EvaluationError::Interrupted)
    } else {
        Ok(())
    }
}
