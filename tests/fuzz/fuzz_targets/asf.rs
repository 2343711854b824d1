//! Any bytes to the ASF and AMC parsers.
#![no_main]

use libfuzzer_sys::fuzz_target;

/// Stands between the skeleton and the motion in one input.
const CUT: &str = "\n%AMC\n";

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    let (asf, amc) = text.split_once(CUT).unwrap_or((&text, ""));
    if let Ok(skeleton) = cromosim_motion::parse_asf(asf, "fuzz.asf") {
        let _ = cromosim_motion::parse_amc(amc, "fuzz.amc", &skeleton, cromosim_motion::AMC_RATE_HZ);
    }
});
