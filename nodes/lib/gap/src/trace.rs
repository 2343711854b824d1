//! What developers see of a running diagnosis, on standard error where CROMOSIM_DEBUG is set.

use cromosim_imu::EffectSet;

/// Calls `print` where the developers' view is switched on.
pub(crate) fn trace(print: impl Fn()) {
    if std::env::var_os("CROMOSIM_DEBUG").is_some() {
        print();
    }
}

/// Names of the members of a set, in the set's order.
pub(crate) fn names(set: &EffectSet) -> Vec<&'static str> {
    set.iter().map(|effect| effect.kind().name()).collect()
}
