//! The opcodes of pickles.

use super::fault::{Fault, Reason};
use super::machine::{Machine, pairs};
use super::node::{Id, Node};
use super::text;
use crate::blob::Blob;

impl Machine<'_> {
    /// Runs to the end of the pickle; the result is what is left on the stack.
    pub fn run(&mut self) -> Result<Id, Fault> {
        self.restart();
        loop {
            let offset = self.position;
            let fault = |reason: Reason| Fault { offset, reason };
            let opcode = self.next_opcode().map_err(fault)?;
            if opcode == b'.' {
                return self.pop().map_err(fault);
            }
            self.step(opcode).map_err(fault)?;
        }
    }

    /// Carries out an opcode of protocols 0 and 1.
    fn step(&mut self, opcode: u8) -> Result<(), Reason> {
        match opcode {
            b'(' => self.mark(),
            b'0' => self.drop_top()?,
            b'1' => drop(self.pop_mark()?),
            b'2' => {
                let top = self.top()?;
                self.push_id(top);
            }
            b'F' => self.push_line("a float", |line| text::float(line).map(Node::Float))?,
            b'I' | b'L' => self.push_line("an integer", text::integer)?,
            b'S' => self.push_line("a quoted string", |line| {
                text::quoted(line).map(|bytes| Node::OldText(bytes.into()))
            })?,
            b'V' => self.push_line("a string", |line| {
                text::raw_unicode(line).map(|text| Node::Text(text.into()))
            })?,
            b'G' => self.push_fixed(|bytes: [u8; 8]| Node::Float(f64::from_be_bytes(bytes)))?,
            b'J' => self.push_fixed(|bytes| Node::Int(i32::from_le_bytes(bytes).into()))?,
            b'K' => self.push_fixed(|[byte]| Node::Int(byte.into()))?,
            b'M' => self.push_fixed(|bytes| Node::Int(u16::from_le_bytes(bytes).into()))?,
            b'N' => self.push(Node::None)?,
            b'T' => self.sized::<4>(|bytes| Ok(Node::OldText(bytes)))?,
            b'U' => self.sized::<1>(|bytes| Ok(Node::OldText(bytes)))?,
            b'X' => self.sized::<4>(utf8)?,
            b']' => self.push(Node::List(Vec::new()))?,
            b'}' => self.push(Node::Dict(Vec::new()))?,
            b')' => self.push(Node::Tuple(Vec::new()))?,
            b'l' => self.push_mark(Node::List)?,
            b't' => self.push_mark(Node::Tuple)?,
            b'd' => {
                let items = self.pop_mark()?;
                self.push(Node::Dict(pairs(&items)?))?;
            }
            b'a' => self.append(1)?,
            b'e' => self.append_mark()?,
            b's' => self.set_items(false)?,
            b'u' => self.set_items(true)?,
            b'g' | b'p' => self.memo_by_line(opcode == b'g')?,
            b'h' => self.memo_by_bytes::<1>(true)?,
            b'j' => self.memo_by_bytes::<4>(true)?,
            b'q' => self.memo_by_bytes::<1>(false)?,
            b'r' => self.memo_by_bytes::<4>(false)?,
            b'c' => self.global_by_lines()?,
            b'R' => self.reduce()?,
            b'b' => self.build()?,
            b'i' | b'o' => self.old_instance(opcode == b'i')?,
            b'Q' => self.persistent()?,
            _ => self.step_newer(opcode)?,
        }
        Ok(())
    }

    /// Carries out an opcode of protocols 2 to 5.
    fn step_newer(&mut self, opcode: u8) -> Result<(), Reason> {
        match opcode {
            0x80 => drop(self.take(1)?),
            0x81 => self.new_object()?,
            0x85..=0x87 => {
                let items = self.pop_several(usize::from(opcode - 0x84))?;
                self.push(Node::Tuple(items))?;
            }
            0x88 => self.push(Node::Bool(true))?,
            0x89 => self.push(Node::Bool(false))?,
            0x8a => self.sized::<1>(|bytes| {
                text::long(&bytes).ok_or_else(|| "an integer is too long".into())
            })?,
            0x8b => self.sized::<4>(|bytes| {
                text::long(&bytes).ok_or_else(|| "an integer is too long".into())
            })?,
            b'B' => self.sized::<4>(|bytes| Ok(Node::Bytes(bytes)))?,
            b'C' => self.sized::<1>(|bytes| Ok(Node::Bytes(bytes)))?,
            0x8c => self.sized::<1>(utf8)?,
            0x8d => self.sized::<8>(utf8)?,
            0x8e | 0x96 => self.sized::<8>(|bytes| Ok(Node::Bytes(bytes)))?,
            0x8f => self.push(Node::List(Vec::new()))?,
            0x90 => self.append_mark()?,
            0x91 => self.push_mark(Node::List)?,
            0x92 => {
                let keywords = self.pop()?;
                if !matches!(self.node(keywords), Node::Dict(pairs) if pairs.is_empty()) {
                    return Err(
                        "an object is made with keywords, which this reader does not know".into(),
                    );
                }
                self.new_object()?;
            }
            0x93 => {
                let (name, module) = (self.pop()?, self.pop()?);
                let (Some(module), Some(name)) = (self.text(module), self.text(name)) else {
                    return Err("a name is no text".into());
                };
                self.global(&module, &name)?;
            }
            0x94 => self.memoize()?,
            0x95 => drop(self.take(8)?), // a frame is a hint for reading ahead
            b'P' => return Err("a persistent id in text; only torch's are known".into()),
            0x82..=0x84 => {
                return Err(
                    "a name from Python's extension registry, which is not in the file".into(),
                );
            }
            0x97 | 0x98 => {
                return Err("a buffer outside of the pickle, which is not in the file".into());
            }
            _ => {
                return Err(format!(
                    "0x{opcode:02x} is no opcode; the file may be damaged, or be no pickle"
                )
                .into());
            }
        }
        Ok(())
    }
}

fn utf8(bytes: Blob) -> Result<Node, Reason> {
    // Lone surrogates, which Python lets pass, are no text here.
    Ok(Node::Text(String::from_utf8_lossy(&bytes).into()))
}
