//! The stack machine: its state, and what its opcodes do to it.

use super::fault::{Fault, Reason};
use super::known::known;
use super::node::{Id, Node, Opaque};
use crate::blob::Blob;
use crate::limits::Budget;

/// How deep pickles may lie within pickles: arrays of objects in joblib files, torch storages in
/// plain pickles.
const NESTING_LIMIT: usize = 4;

/// What a node and its place on the stack take, about.
const NODE_BYTES: u64 = 96;

pub(super) struct Machine<'a> {
    pub bytes: Blob,
    pub position: usize,
    pub nodes: Vec<Node>,
    pub budget: &'a mut Budget,
    pub nesting: usize,
    /// Where the opcode stands that is carried out.
    opcode_at: usize,
    stack: Vec<Id>,
    marks: Vec<usize>,
    memo: Vec<Option<Id>>,
    memo_count: usize,
    opcodes: usize,
}

impl<'a> Machine<'a> {
    pub fn new(bytes: Blob, budget: &'a mut Budget, nesting: usize) -> Result<Self, Fault> {
        if nesting > NESTING_LIMIT {
            return Err(Fault::new(
                0,
                format!("pickles lie within pickles more than {NESTING_LIMIT} levels deep"),
            ));
        }
        let (nodes, stack, marks, memo) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Ok(Self {
            bytes,
            position: 0,
            nodes,
            budget,
            nesting,
            opcode_at: 0,
            stack,
            marks,
            memo,
            memo_count: 0,
            opcodes: 0,
        })
    }

    /// Forgets all but the nodes: one machine reads the pickles of a legacy torch file one after
    /// another.
    pub fn restart(&mut self) {
        (self.memo_count, self.opcodes) = (0, 0);
        self.memo.clear();
        self.stack.clear();
        self.marks.clear();
    }

    /// Takes the next opcode and counts it.
    pub fn next_opcode(&mut self) -> Result<u8, Reason> {
        self.opcode_at = self.position;
        self.opcodes += 1;
        self.budget.opcodes = self.budget.opcodes.checked_sub(1).ok_or_else(|| {
            format!(
                "more than {} opcodes, which no sound file of arrays needs; the file may be damaged",
                self.budget.limits.opcodes
            )
        })?;
        let opcode = self.take(1)?;
        Ok(opcode.first().copied().unwrap_or_default())
    }

    /// The stack's height is a mark.
    pub fn mark(&mut self) {
        self.marks.push(self.stack.len());
    }

    pub fn push(&mut self, node: Node) -> Result<(), Reason> {
        let id = self.add(node)?;
        self.stack.push(id);
        Ok(())
    }

    pub fn add(&mut self, node: Node) -> Result<Id, Reason> {
        self.budget.take(NODE_BYTES)?;
        let id =
            Id::try_from(self.nodes.len()).map_err(|_| "more objects than this reader numbers")?;
        self.nodes.push(node);
        Ok(id)
    }

    pub fn push_id(&mut self, id: Id) {
        self.stack.push(id);
    }

    pub fn node(&self, id: Id) -> &Node {
        self.nodes.get(id as usize).unwrap_or(&Node::None)
    }

    pub fn replace(&mut self, id: Id, node: Node) {
        if let Some(place) = self.nodes.get_mut(id as usize) {
            *place = node;
        }
    }

    fn floor(&self) -> usize {
        self.marks.last().copied().unwrap_or(0)
    }

    pub fn pop(&mut self) -> Result<Id, Reason> {
        if self.stack.len() <= self.floor() {
            return Err("the stack is empty; the file may be damaged".into());
        }
        self.stack.pop().ok_or_else(|| "the stack is empty".into())
    }

    pub fn top(&self) -> Result<Id, Reason> {
        let top = if self.stack.len() > self.floor() {
            self.stack.last()
        } else {
            None
        };
        top.copied()
            .ok_or_else(|| "the stack is empty; the file may be damaged".into())
    }

    /// `POP` also takes a mark off.
    pub fn drop_top(&mut self) -> Result<(), Reason> {
        if self.marks.last() == Some(&self.stack.len()) {
            self.marks.pop();
            return Ok(());
        }
        self.pop().map(drop)
    }

    pub fn pop_several(&mut self, count: usize) -> Result<Vec<Id>, Reason> {
        let start = self
            .stack
            .len()
            .checked_sub(count)
            .filter(|&start| start >= self.floor());
        Ok(self
            .stack
            .split_off(start.ok_or("the stack is empty; the file may be damaged")?))
    }

    pub fn pop_mark(&mut self) -> Result<Vec<Id>, Reason> {
        let mark = self
            .marks
            .pop()
            .ok_or("a mark is missing; the file may be damaged")?;
        Ok(self.stack.split_off(mark.min(self.stack.len())))
    }

    pub fn push_mark(&mut self, node: impl FnOnce(Vec<Id>) -> Node) -> Result<(), Reason> {
        let items = self.pop_mark()?;
        self.push(node(items))
    }

    pub fn take(&mut self, count: usize) -> Result<Blob, Reason> {
        let left = self.bytes.len() - self.position;
        let part = self.bytes.part(self.position, count);
        let part = part.ok_or_else(|| {
            format!(
                "{count} more bytes expected, but {left} are left; the file is cut short or damaged"
            )
        })?;
        self.position += count;
        Ok(part)
    }

    fn fixed<const N: usize>(&mut self) -> Result<[u8; N], Reason> {
        let part = self.take(N)?;
        part.first_chunk()
            .copied()
            .ok_or_else(|| "cut short".into())
    }

    /// Up to the end of the line, which is taken too.
    pub fn line(&mut self) -> Result<Blob, Reason> {
        let rest = self.bytes.get(self.position..).unwrap_or_default();
        let length = rest
            .iter()
            .position(|&byte| byte == b'\n')
            .ok_or("a line has no end; the file is cut short or damaged")?;
        let line = self.take(length)?;
        self.position += 1;
        Ok(line)
    }

    pub fn push_line(
        &mut self,
        what: &str,
        node: impl FnOnce(&[u8]) -> Option<Node>,
    ) -> Result<(), Reason> {
        let line = self.line()?;
        self.budget.take(line.len() as u64)?;
        self.push(node(&line).ok_or_else(|| format!("`{}` is not {what}", shortened(&line)))?)
    }

    pub fn push_fixed<const N: usize>(
        &mut self,
        node: impl FnOnce([u8; N]) -> Node,
    ) -> Result<(), Reason> {
        let bytes = self.fixed::<N>()?;
        self.push(node(bytes))
    }

    /// A length of N bytes, least significant first, and as many bytes.
    pub fn sized<const N: usize>(
        &mut self,
        node: impl FnOnce(Blob) -> Result<Node, Reason>,
    ) -> Result<(), Reason> {
        let length = little_endian(self.fixed::<N>()?);
        let bytes = self.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        self.budget.take(bytes.len() as u64)?;
        self.push(node(bytes)?)
    }

    pub fn append(&mut self, count: usize) -> Result<(), Reason> {
        let items = self.pop_several(count)?;
        self.extend_top(items)
    }

    pub fn append_mark(&mut self) -> Result<(), Reason> {
        let items = self.pop_mark()?;
        self.extend_top(items)
    }

    fn extend_top(&mut self, items: Vec<Id>) -> Result<(), Reason> {
        let list = self.top()?;
        match self.nodes.get_mut(list as usize) {
            Some(Node::List(list)) => list.extend(items),
            Some(Node::Opaque(opaque)) => opaque.parts.extend(items),
            _ => return Err("items are added to what is no list".into()),
        }
        Ok(())
    }

    pub fn set_items(&mut self, many: bool) -> Result<(), Reason> {
        let items = if many {
            self.pop_mark()?
        } else {
            self.pop_several(2)?
        };
        let (dict, pairs) = (self.top()?, pairs(&items)?);
        match self.nodes.get_mut(dict as usize) {
            Some(Node::Dict(dict)) => dict.extend(pairs),
            Some(Node::Opaque(opaque)) => opaque.parts.extend(items),
            _ => return Err("keys are set in what is no dictionary".into()),
        }
        Ok(())
    }

    pub fn memo_by_line(&mut self, get: bool) -> Result<(), Reason> {
        let line = self.line()?;
        let index = std::str::from_utf8(&line)
            .ok()
            .and_then(|text| text.trim().parse().ok());
        self.memo(index.ok_or("a memo number is no number")?, get)
    }

    pub fn memo_by_bytes<const N: usize>(&mut self, get: bool) -> Result<(), Reason> {
        let index = little_endian(self.fixed::<N>()?);
        self.memo(usize::try_from(index).unwrap_or(usize::MAX), get)
    }

    fn memo(&mut self, index: usize, get: bool) -> Result<(), Reason> {
        if get {
            let id = self
                .memo
                .get(index)
                .copied()
                .flatten()
                .ok_or_else(|| format!("memo {index} is empty"))?;
            self.stack.push(id);
            return Ok(());
        }
        let id = self.top()?;
        // Python numbers them one by one; a table may not grow faster than the file.
        if index > self.opcodes {
            return Err(format!("memo {index} is numbered out of turn").into());
        }
        if index >= self.memo.len() {
            self.memo.resize(index + 1, None);
        }
        if let Some(place) = self.memo.get_mut(index) {
            self.memo_count += usize::from(place.is_none());
            *place = Some(id);
        }
        Ok(())
    }

    pub fn memoize(&mut self) -> Result<(), Reason> {
        self.memo(self.memo_count, false)
    }

    pub fn global_by_lines(&mut self) -> Result<(), Reason> {
        let (module, name) = (self.line()?, self.line()?);
        self.global(
            &String::from_utf8_lossy(&module),
            &String::from_utf8_lossy(&name),
        )
    }

    pub fn global(&mut self, module: &str, name: &str) -> Result<(), Reason> {
        let full = format!(
            "{}.{}",
            shortened(module.as_bytes()),
            shortened(name.as_bytes())
        );
        match known(module, name) {
            Some(known) => self.push(Node::Known(known, full.into())),
            // Whether it lies under a key that is skipped shows at the end.
            None if self.skips() => self.push(Node::Opaque(Box::new(Opaque {
                name: full.into(),
                offset: self.opcode_at,
                parts: Vec::new(),
            }))),
            None => Err(Reason::Refused(full)),
        }
    }

    /// Whether some of this pickle may be skipped; a pickle within has no keys of the file.
    pub fn skips(&self) -> bool {
        self.nesting == 0 && !self.budget.skipped.is_empty()
    }
}

pub(super) fn pairs(items: &[Id]) -> Result<Vec<(Id, Id)>, Reason> {
    let (pairs, rest) = items.as_chunks::<2>();
    if rest.is_empty() {
        Ok(pairs.iter().map(|&[key, value]| (key, value)).collect())
    } else {
        Err("a key has no value".into())
    }
}

fn little_endian<const N: usize>(bytes: [u8; N]) -> u64 {
    bytes
        .iter()
        .rev()
        .fold(0, |sum, &byte| sum << 8 | u64::from(byte))
}

/// For messages: one line, not endless.
pub(super) fn shortened(bytes: &[u8]) -> String {
    let start = bytes.get(..100).unwrap_or(bytes);
    String::from_utf8_lossy(start)
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect()
}
