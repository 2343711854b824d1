//! Numbers in the byte orders of the processors that C3D files come from.

/// Who wrote the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Processor {
    /// Little end first, IEEE floats.
    Intel,
    /// Little end first, VAX F floats.
    Dec,
    /// Big end first, IEEE floats.
    Mips,
}

impl Processor {
    pub fn from_code(code: u8) -> Option<Self> {
        match code {
            84 => Some(Self::Intel),
            85 => Some(Self::Dec),
            86 => Some(Self::Mips),
            _ => None,
        }
    }
}

/// A file's bytes; every read beyond the end is `None`.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub bytes: &'a [u8],
    pub processor: Processor,
}

impl<'a> Bytes<'a> {
    pub fn slice(&self, offset: usize, length: usize) -> Option<&'a [u8]> {
        self.bytes.get(offset..offset.checked_add(length)?)
    }

    pub fn byte(&self, offset: usize) -> Option<u8> {
        self.bytes.get(offset).copied()
    }

    pub fn unsigned(&self, offset: usize) -> Option<u16> {
        let bytes: [u8; 2] = self.slice(offset, 2)?.try_into().ok()?;
        Some(if self.processor == Processor::Mips {
            u16::from_be_bytes(bytes)
        } else {
            u16::from_le_bytes(bytes)
        })
    }

    pub fn integer(&self, offset: usize) -> Option<i16> {
        self.unsigned(offset).map(u16::cast_signed)
    }

    /// A VAX F float has its halves exchanged and stands for a quarter of the IEEE float with the
    /// same bits; 0 where its exponent is 0.
    pub fn float(&self, offset: usize) -> Option<f32> {
        let bytes: [u8; 4] = self.slice(offset, 4)?.try_into().ok()?;
        Some(match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Mips => f32::from_be_bytes(bytes),
            Processor::Dec => {
                let [a, b, c, d] = bytes;
                let value = f32::from_le_bytes([c, d, a, b]) / 4.0;
                if value.is_finite() { value } else { 0.0 }
            }
        })
    }
}
