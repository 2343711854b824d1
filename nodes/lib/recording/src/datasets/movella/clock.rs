//! When each row was measured: by the device's own time, or by its count of packets.

use cromosim_spatial::Stamp;

use super::about::{About, COUNTER, DEVICE_TIME, is_empty};
use crate::datasets::capture::content;
use crate::rigid::RigidError;
use crate::rigid::table::Row;

/// Ticks of SampleTimeFine a second.
const DOT_TICKS: u32 = 1_000_000;
const MT_TICKS: u32 = 10_000;
/// Counts of SampleTimeFine before it begins again, and of MT Manager's PacketCounter.
const TICKS_A_TURN: u64 = 1 << 32;
const PACKETS_A_TURN: u64 = 1 << 16;

/// Each row's time; none where it has none.
pub(super) fn stamps(rows: &[Row<'_>], file: &About<'_>) -> Result<Vec<Option<Stamp>>, RigidError> {
    let whole = |row: &Row<'_>, column: usize| {
        let whole = row.cell(column)?.parse::<u64>();
        whole.map_err(|_| row.error(column, "a whole number"))
    };
    if let Some([column]) = file
        .find([DEVICE_TIME])
        .filter(|[at]| !is_empty(&rows[0], *at))
    {
        let mut ticks = Vec::new();
        let mut clock = Counter::of(TICKS_A_TURN);
        for row in rows {
            let tick = match is_empty(row, column) {
                true => None,
                false => clock.next(whole(row, column)?),
            };
            ticks.push(tick);
        }
        let nanos = 1_000_000_000 / i64::from(ticks_per_second(&ticks, file));
        let stamp = |tick: Option<u64>| {
            let tick = i64::try_from(tick?).ok()?;
            Some(Stamp::from_nanos(tick.checked_mul(nanos)?))
        };
        return Ok(ticks.into_iter().map(stamp).collect());
    }
    let (Some([column]), Some(rate_hz)) = (file.find([COUNTER]), file.rate_hz) else {
        let problem = "neither SampleTimeFine nor a rate (OutputRate, Update Rate) in it, so that nothing says when; export with one of them";
        return Err(content(rows[0].name, "header", problem));
    };
    let mut counter = Counter::of(PACKETS_A_TURN);
    let mut first = None;
    let mut stamps = Vec::new();
    for row in rows {
        let packet = counter.next(whole(row, column)?);
        let stamp = packet.map(|packet| {
            let first = *first.get_or_insert(packet);
            Stamp::from_seconds((packet - first) as f64 / rate_hz)
        });
        stamps.push(stamp);
    }
    Ok(stamps)
}

/// How fine SampleTimeFine is: as the rate says where it is known, else as the device's kind has
/// it.
fn ticks_per_second(ticks: &[Option<u64>], file: &About<'_>) -> u32 {
    let known: Vec<u64> = ticks.iter().copied().flatten().collect();
    let mut steps: Vec<u64> = known.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable();
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0);
    match file.rate_hz.filter(|_| step > 0) {
        // In the middle between the two, of which one is a hundred times the other.
        Some(rate_hz) if step as f64 * rate_hz > 10.0 * f64::from(MT_TICKS) => DOT_TICKS,
        Some(_) => MT_TICKS,
        None if file.is_mt => MT_TICKS,
        None => DOT_TICKS,
    }
}

/// A counter that begins again at 0, as one that goes on.
struct Counter {
    /// Counts before it begins again.
    turn: u64,
    /// As it stood, and as it would stand.
    last: Option<(u64, u64)>,
}

impl Counter {
    fn of(turn: u64) -> Self {
        Self { turn, last: None }
    }

    /// None where it goes back by less than half a turn: the row is out of order.
    fn next(&mut self, raw: u64) -> Option<u64> {
        let Some((last_raw, last)) = self.last else {
            self.last = Some((raw, raw));
            return Some(raw);
        };
        let step = match raw.checked_sub(last_raw) {
            Some(step) => step,
            None if last_raw - raw > self.turn / 2 => {
                raw.checked_add(self.turn)?.checked_sub(last_raw)?
            }
            None => return None,
        };
        let unwrapped = last.checked_add(step)?;
        self.last = Some((raw, unwrapped));
        Some(unwrapped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_go_on() {
        let mut counter = Counter::of(PACKETS_A_TURN);
        let seen = [65534, 65535, 0, 1, 0, 5].map(|raw| counter.next(raw));
        let expected = [65534, 65535, 65536, 65537, 0, 65541].map(Some);
        assert_eq!(seen[..4], expected[..4]);
        assert_eq!((seen[4], seen[5]), (None, expected[5]));
    }
}
