//! From ROS 1's serialisation (little-endian, packed) to CDR (aligned; OMG DDSI-RTPS 2.5, 10).

use super::definition::{Arity, Field, Kind};

/// CDR, little-endian: what stands before the content.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message of these fields as CDR.
pub(crate) fn to_cdr(fields: &[Field], message: &[u8]) -> Result<Vec<u8>, String> {
    let mut transfer = Transfer {
        left: message,
        out: Vec::with_capacity(message.len() + 64),
    };
    transfer.out.extend(ENCAPSULATION);
    transfer.message(fields)?;
    if transfer.left.is_empty() {
        Ok(transfer.out)
    } else {
        Err(format!(
            "{} bytes are left behind its last field",
            transfer.left.len()
        ))
    }
}

struct Transfer<'a> {
    left: &'a [u8],
    out: Vec<u8>,
}

impl<'a> Transfer<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, left) = self
            .left
            .split_at_checked(count)
            .ok_or_else(|| "it ends within a field".to_owned())?;
        self.left = left;
        Ok(taken)
    }

    fn count(&mut self) -> Result<usize, String> {
        let bytes = self.take(4)?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    }

    fn align(&mut self, to: usize) {
        let content = self.out.len() - ENCAPSULATION.len();
        let padded = content.next_multiple_of(to);
        self.out.resize(ENCAPSULATION.len() + padded, 0);
    }

    fn push_count(&mut self, count: usize) -> Result<(), String> {
        let count = u32::try_from(count).map_err(|_| "a field is too long".to_owned())?;
        self.align(4);
        self.out.extend(count.to_le_bytes());
        Ok(())
    }

    fn message(&mut self, fields: &[Field]) -> Result<(), String> {
        if fields.is_empty() {
            // ROS 2 gives messages without fields one byte.
            self.out.push(0);
        }
        fields.iter().try_for_each(|field| self.field(field))
    }

    fn field(&mut self, field: &Field) -> Result<(), String> {
        let count = match field.arity {
            Arity::One => 1,
            Arity::Array(count) => count,
            Arity::Sequence => {
                let count = self.count()?;
                self.push_count(count)?;
                count
            }
        };
        if let Kind::Number(size) = field.kind {
            let bytes = count
                .checked_mul(size)
                .ok_or_else(|| "it ends within a field".to_owned())?;
            let taken = self.take(bytes)?;
            if count > 0 {
                self.align(size);
            }
            self.out.extend_from_slice(taken);
            return Ok(());
        }
        // Even a message without fields takes a byte of CDR: no count may run away.
        if count > self.left.len() && !matches!(field.arity, Arity::One) {
            return Err("it ends within a field".to_owned());
        }
        (0..count).try_for_each(|_| self.value(&field.kind))
    }

    fn value(&mut self, kind: &Kind) -> Result<(), String> {
        match kind {
            Kind::Number(size) => {
                let taken = self.take(*size)?;
                self.align(*size);
                self.out.extend_from_slice(taken);
            }
            Kind::Text => {
                let count = self.count()?;
                let taken = self.take(count)?;
                self.push_count(count + 1)?;
                self.out.extend_from_slice(taken);
                self.out.push(0);
            }
            Kind::Time => {
                let taken = self.take(8)?;
                self.align(4);
                self.out.extend_from_slice(taken);
            }
            Kind::Header => {
                self.take(4)?;
                self.value(&Kind::Time)?;
                self.value(&Kind::Text)?;
            }
            Kind::Message(fields) => self.message(fields)?,
        }
        Ok(())
    }
}
