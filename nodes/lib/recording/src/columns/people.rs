//! Simulated people as columns.

use super::write::MAX_GROUP;
use super::{ColumnsGroup, ColumnsWriter};
use crate::{PlayedPerson, RecordingError, SimulatedPerson};

impl ColumnsWriter<'_> {
    /// Adds the readings of a person, which are taken, placement after placement; `draw` says which
    /// of several simulations they are of. Between groups `check` is called.
    ///
    /// # Errors
    /// Of `check`, [`RecordingError::WriteColumns`], and [`RecordingError::PutAside`] where what
    /// was put aside is lost.
    pub fn write_person<E: From<RecordingError>>(
        &mut self,
        draw: i32,
        person: &PlayedPerson,
        simulated: &mut SimulatedPerson,
        check: impl Fn() -> Result<(), E>,
    ) -> Result<(), E> {
        for placement in &mut simulated.placements {
            let mut group = ColumnsGroup {
                person: person.body_id.clone(),
                placement: placement.name.clone(),
                draw,
                ..ColumnsGroup::default()
            };
            check()?;
            while let Some((stamp, reading)) = placement.next_channels()? {
                let (f, w) = (reading.specific_force, reading.angular_velocity);
                group.push(stamp.nanos, [f.x, f.y, f.z, w.x, w.y, w.z]);
                if group.stamps.len() == MAX_GROUP {
                    check()?;
                    self.write(&mut group)?;
                }
            }
            self.write(&mut group)?;
        }
        Ok(())
    }
}
