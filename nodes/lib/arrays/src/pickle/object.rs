//! Opcodes that make objects and give them their state.

use super::arguments::ITEM_BYTES;
use super::fault::Reason;
use super::known::Known;
use super::machine::{Machine, shortened};
use super::node::{Id, Node, Opaque};

impl Machine<'_> {
    /// `REDUCE`: calls a known name with a tuple of arguments.
    pub(super) fn reduce(&mut self) -> Result<(), Reason> {
        let (arguments, callable) = (self.pop()?, self.pop()?);
        let arguments = self.items(arguments)?;
        self.call(callable, &arguments)
    }

    /// `NEWOBJ`: makes an object of a known class.
    pub(super) fn new_object(&mut self) -> Result<(), Reason> {
        self.reduce()
    }

    /// `INST` and `OBJ`: objects of Python 2's old classes.
    pub(super) fn old_instance(&mut self, named: bool) -> Result<(), Reason> {
        if named {
            let (module, name) = (self.line()?, self.line()?);
            let arguments = self.pop_mark()?;
            self.global(
                &String::from_utf8_lossy(&module),
                &String::from_utf8_lossy(&name),
            )?;
            let class = self.pop()?;
            return self.call(class, &arguments);
        }
        let items = self.pop_mark()?;
        let (&class, arguments) = items.split_first().ok_or("an object has no class")?;
        self.call(class, arguments)
    }

    fn call(&mut self, callable: Id, arguments: &[Id]) -> Result<(), Reason> {
        if let Node::Opaque(class) = self.node(callable) {
            let made = Opaque {
                parts: [&[callable], arguments].concat(),
                ..Opaque::clone(class)
            };
            return self.push(Node::Opaque(Box::new(made)));
        }
        let Node::Known(known, name) = self.node(callable).clone() else {
            return Err("what is called is no name".into());
        };
        let made = self.called(known, arguments)?;
        // The argument itself is handed on where nothing is to be made of it.
        match made {
            Made::Node(node) => self.push(node),
            Made::Same(id) => {
                self.push_id(id);
                Ok(())
            }
            Made::Unsuitable => Err(format!(
                "`{name}` is called with arguments that this reader does not know"
            )
            .into()),
        }
    }

    fn called(&mut self, known: Known, arguments: &[Id]) -> Result<Made, Reason> {
        Ok(Made::Node(match (known, arguments) {
            (Known::ArrayReconstruct, _) | (Known::Ndarray, _) => Node::NewArray,
            (Known::Scalar, &[dtype, content]) => self.numpy_scalar(dtype, content)?,
            (Known::FromBuffer, &[content, dtype, shape, order]) => {
                self.numpy_from_buffer(content, dtype, shape, order)?
            }
            (Known::DTypeClass, &[description, ..]) => self.numpy_dtype(description)?,
            (Known::Reconstructor, &[class, _, start]) => return self.reconstructed(class, start),
            (Known::List | Known::Dict | Known::Tuple, &[]) => empty(known),
            (Known::List, &[items]) => Node::List(self.items(items)?),
            (Known::Tuple, &[items]) => Node::Tuple(self.items(items)?),
            (Known::Dict, &[items]) => self.dictionary(items)?,
            (Known::DefaultDict, &[] | &[_]) => Node::Dict(Vec::new()),
            (Known::DefaultDict, &[_, items]) => self.dictionary(items)?,
            (Known::Bytes | Known::ByteArray, &[]) => Node::Bytes(Vec::new().into()),
            (Known::Bytes | Known::ByteArray, &[content]) => {
                Node::Bytes(self.blob(content).ok_or("bytes were expected")?)
            }
            (Known::Encode, &[text])
            | (Known::Encode | Known::ByteArray | Known::Bytes, &[text, _]) => {
                self.encoded(text, arguments)?
            }
            (Known::Complex, &[real, imaginary]) => {
                Node::Complex(self.float(real)?, self.float(imaginary)?)
            }
            (Known::Sparse(kind), _) => Node::Sparse(kind, None),
            (Known::ChumpyArray, _) => Node::ChumpyArray(None),
            (Known::ChumpySelect, _) => Node::ChumpySelect(None),
            (Known::JoblibArray, _) => Node::JoblibArray,
            (Known::RebuildTensor, &[storage, first, shape, strides, ..]) => {
                self.tensor(storage, first, shape, strides, arguments.get(6))?
            }
            (Known::RebuildParameter, &[tensor, ..]) => return Ok(Made::Same(tensor)),
            (Known::LoadFromBytes, &[content]) => self.loaded_storage(content)?,
            (Known::Device, &[name, ..]) => return Ok(Made::Same(name)),
            _ => return Ok(Made::Unsuitable),
        }))
    }

    /// `copyreg._reconstructor(class, base, start)`: an empty object, or a subclass of a builtin
    /// with its content.
    fn reconstructed(&mut self, class: Id, start: Id) -> Result<Made, Reason> {
        if let Node::Opaque(class) = self.node(class) {
            return Ok(Made::Node(Node::Opaque(class.clone())));
        }
        let Node::Known(known, _) = self.node(class).clone() else {
            return Ok(Made::Unsuitable);
        };
        match (known, self.node(start)) {
            (Known::List | Known::Dict | Known::Tuple, Node::None) => Ok(Made::Node(empty(known))),
            (Known::Dict, Node::Dict(_))
            | (Known::List, Node::List(_))
            | (Known::Tuple, Node::Tuple(_)) => Ok(Made::Same(start)),
            (
                Known::Sparse(_) | Known::ChumpyArray | Known::ChumpySelect | Known::JoblibArray,
                _,
            ) => self.called(known, &[]),
            _ => Ok(Made::Unsuitable),
        }
    }

    /// Of a dictionary, or of a list of pairs.
    fn dictionary(&mut self, items: Id) -> Result<Node, Reason> {
        if let Node::Dict(pairs) = self.node(items) {
            let pairs = pairs.clone();
            self.budget.take(ITEM_BYTES * pairs.len() as u64)?;
            return Ok(Node::Dict(pairs));
        }
        let mut pairs = Vec::new();
        for pair in self.items(items)? {
            let &[key, value] = self.items(pair)?.as_slice() else {
                return Err("a dictionary's item is no pair".into());
            };
            pairs.push((key, value));
        }
        Ok(Node::Dict(pairs))
    }

    /// Bytes that were written as text, one character a byte.
    fn encoded(&mut self, text: Id, arguments: &[Id]) -> Result<Node, Reason> {
        let text = self.text(text).ok_or("text to encode was expected")?;
        let encoding = match arguments.get(1) {
            Some(&encoding) => self
                .text(encoding)
                .ok_or("an encoding's name was expected")?,
            None => "utf-8".into(),
        };
        self.budget.take(text.len() as u64)?;
        let bytes: Option<Vec<u8>> = match &*encoding {
            "latin1" | "latin-1" | "iso-8859-1" => text
                .chars()
                .map(|c| u8::try_from(u32::from(c)).ok())
                .collect(),
            "utf-8" | "utf8" | "ascii" => Some(text.as_bytes().to_vec()),
            other => {
                return Err(
                    format!("encoding `{}` is unknown", shortened(other.as_bytes())).into(),
                );
            }
        };
        Ok(Node::Bytes(
            bytes.ok_or("text is not of single bytes")?.into(),
        ))
    }

    /// `BUILD`: gives an object its state.
    pub(super) fn build(&mut self) -> Result<(), Reason> {
        let state = self.pop()?;
        let object = self.top()?;
        if let Node::Dict(pairs) = self.node(state) {
            // It is searched through, and one dictionary can be the state of many objects.
            let searched = pairs.len() as u64;
            self.budget.opcodes = self
                .budget
                .opcodes
                .checked_sub(searched)
                .ok_or("more attributes of an object than are read; the file may be damaged")?;
        }
        let built = match self.node(object).clone() {
            Node::NewArray => self.numpy_array(state)?,
            Node::DType(dtype) => self.numpy_dtype_state(dtype, state)?,
            Node::JoblibArray => self.joblib_array(state)?,
            Node::Sparse(kind, None) => Node::Sparse(kind, Some(state)),
            Node::ChumpyArray(None) => Node::ChumpyArray(Some(state)),
            Node::ChumpySelect(None) => Node::ChumpySelect(Some(state)),
            Node::Opaque(mut opaque) => {
                opaque.parts.push(state);
                Node::Opaque(opaque)
            }
            // Attributes of a subclass, such as torch's `_metadata` of an OrderedDict.
            Node::Dict(_) | Node::List(_) | Node::Tensor(_) => return Ok(()),
            _ => return Err("state is given to what has none".into()),
        };
        self.replace(object, built);
        Ok(())
    }
}

/// What a call makes.
enum Made {
    Node(Node),
    Same(Id),
    Unsuitable,
}

fn empty(known: Known) -> Node {
    match known {
        Known::Dict => Node::Dict(Vec::new()),
        Known::Tuple => Node::Tuple(Vec::new()),
        _ => Node::List(Vec::new()),
    }
}
