//! Libraries that panic on damaged files.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// Whether a panic of this thread is caught and needs no words.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// What the work gives; none where it panics, of which nothing is printed.
pub(crate) fn caught<V>(work: impl FnOnce() -> V) -> Option<V> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |info| {
            if !CAUGHT.get() {
                before(info);
            }
        }));
    });
    let outer = CAUGHT.replace(true);
    // What the work leaves behind is dropped with it.
    let found = catch_unwind(AssertUnwindSafe(work));
    CAUGHT.set(outer);
    found.ok()
}

#[cfg(test)]
mod tests {
    use super::caught;

    #[test]
    fn a_panic_is_none_and_the_next_one_is_heard_again() {
        assert_eq!(caught(|| 3), Some(3));
        let is_damaged = std::hint::black_box(true);
        let found = caught(|| {
            if is_damaged {
                panic!("nobody hears this")
            } else {
                3
            }
        });
        assert_eq!(found, None);
        assert!(!super::CAUGHT.get());
    }
}
