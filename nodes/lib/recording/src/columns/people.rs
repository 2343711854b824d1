//! Simulated people as columns.

use std::path::Path;

use super::write::MAX_GROUP;
use super::{ColumnsGroup, ColumnsHeader, ColumnsWriter};
use crate::{PlayedPerson, RecordingError, SimulatedPerson, write_file_with};

/// People and what was simulated of them, of one draw.
pub struct PeopleColumns<'a> {
    /// Which of several simulations.
    pub draw: i32,
    /// Who.
    pub people: &'a [PlayedPerson],
    /// Of each what is to be written; it is taken.
    pub simulated: &'a mut [SimulatedPerson],
}

/// Writes the readings of people, placement after placement, and gives the number of rows. Between
/// groups `check` is called.
///
/// # Errors
/// Of `check`, [`RecordingError::WriteColumns`], and [`RecordingError::PutAside`] where what was put
/// aside is lost.
pub fn write_people_columns<E: From<RecordingError>>(
    path: &Path,
    replace: bool,
    header: &ColumnsHeader,
    draws: &mut [PeopleColumns<'_>],
    check: impl Fn() -> Result<(), E>,
) -> Result<u64, E> {
    write_file_with(path, replace, |file| {
        let mut writer = ColumnsWriter::new(file, path, header)?;
        for draw in draws {
            for (person, simulated) in draw.people.iter().zip(draw.simulated.iter_mut()) {
                write_person(&mut writer, draw.draw, person, simulated, &check)?;
            }
        }
        Ok(writer.finish()?)
    })
}

fn write_person<E: From<RecordingError>>(
    writer: &mut ColumnsWriter<'_>,
    draw: i32,
    person: &PlayedPerson,
    simulated: &mut SimulatedPerson,
    check: &impl Fn() -> Result<(), E>,
) -> Result<(), E> {
    for placement in &mut simulated.placements {
        let mut group = ColumnsGroup {
            person: person.body_id.clone(),
            placement: placement.name.clone(),
            draw,
            ..ColumnsGroup::default()
        };
        check()?;
        while let Some(messages) = placement.next_messages()? {
            let message = &messages.data_raw;
            let (f, w) = (message.linear_acceleration, message.angular_velocity);
            let values = [f.x, f.y, f.z, w.x, w.y, w.z];
            group.push(message.header.stamp.nanos(), values);
            if group.stamps.len() == MAX_GROUP {
                check()?;
                writer.write(&mut group)?;
            }
        }
        writer.write(&mut group)?;
    }
    Ok(())
}
