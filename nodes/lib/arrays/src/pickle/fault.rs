//! What is wrong with a pickle.

use std::path::Path;

use crate::ArraysError;

/// Why a pickle is not read.
#[derive(Debug)]
pub(crate) enum Reason {
    /// It is damaged, or does what this reader does not know: a message.
    Unsound(String),
    /// It refers to this Python name, which is not rebuilt.
    Refused(String),
}

impl From<String> for Reason {
    fn from(message: String) -> Self {
        Self::Unsound(message)
    }
}

impl From<&str> for Reason {
    fn from(message: &str) -> Self {
        Self::Unsound(message.to_owned())
    }
}

/// Why a pickle is not read, and where.
#[derive(Debug)]
pub(crate) struct Fault {
    /// Byte within the pickle.
    pub offset: usize,
    pub reason: Reason,
}

impl Fault {
    pub fn new(offset: usize, reason: impl Into<Reason>) -> Self {
        Self {
            offset,
            reason: reason.into(),
        }
    }

    /// The same fault, in a file in which the pickle begins at `start`.
    pub fn after(self, start: usize) -> Self {
        Self {
            offset: self.offset + start,
            ..self
        }
    }

    /// As an error of the file at `path`, in which the pickle stands under `key`.
    pub fn into_error(self, path: &Path, key: &str) -> ArraysError {
        let (path, key, offset) = (path.to_owned(), key.to_owned(), self.offset);
        match self.reason {
            Reason::Unsound(reason) => ArraysError::Pickle {
                path,
                key,
                offset,
                reason,
            },
            Reason::Refused(name) => ArraysError::Refused {
                path,
                key,
                offset,
                name,
            },
        }
    }

    /// As the reason of an opcode in which a pickle was nested.
    pub fn nested(self) -> Reason {
        match self.reason {
            Reason::Unsound(message) => Reason::Unsound(format!(
                "in the pickle within, byte {}: {message}",
                self.offset
            )),
            refused @ Reason::Refused(_) => refused,
        }
    }
}
