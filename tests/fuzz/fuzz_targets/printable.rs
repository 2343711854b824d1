//! What is printed of names: nothing that steers a terminal, and the same when it is printed again.
#![no_main]

use cromosim_msgs::printable;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let printed = printable(text).to_string();
    assert!(printed.chars().all(|c| !c.is_control() || c == '\t'), "{printed:?}");
    assert_eq!(printable(&printed).to_string(), printed);
});
