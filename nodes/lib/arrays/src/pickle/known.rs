//! The names that a pickle may refer to.

use crate::dtype::{DType, Kind};
use crate::value::SparseKind;

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// numpy's `_reconstruct(ndarray, (0,), b'b')`; the array follows as state.
    ArrayReconstruct,
    /// numpy's `scalar(dtype, bytes)`.
    Scalar,
    /// numpy's `_frombuffer(bytes, dtype, shape, order)`.
    FromBuffer,
    Ndarray,
    DTypeClass,
    /// `copyreg._reconstructor(class, object, None)`.
    Reconstructor,
    Object,
    List,
    Dict,
    Tuple,
    ByteArray,
    Bytes,
    Complex,
    DefaultDict,
    /// `_codecs.encode(text, 'latin1')`: bytes in protocols 0 to 2.
    Encode,
    Sparse(SparseKind),
    /// A chumpy array: its attribute `x`.
    ChumpyArray,
    /// chumpy's reordering: elements `idxs` of `a` in shape `preferred_shape`.
    ChumpySelect,
    RebuildTensor,
    RebuildParameter,
    LoadFromBytes,
    Storage(DType),
    UntypedStorage,
    TensorType(DType),
    Device,
    JoblibArray,
    /// May be named, not called.
    Inert,
}

/// What `module.name` stands for; `None` for whatever is refused.
pub(super) fn known(module: &str, name: &str) -> Option<Known> {
    match module {
        "builtins" | "__builtin__" => builtin(name),
        "copyreg" | "copy_reg" => (name == "_reconstructor").then_some(Known::Reconstructor),
        "_codecs" => (name == "encode").then_some(Known::Encode),
        "collections" => match name {
            "OrderedDict" => Some(Known::Dict),
            "defaultdict" => Some(Known::DefaultDict),
            _ => None,
        },
        "numpy.core.multiarray" | "numpy._core.multiarray" => match name {
            "_reconstruct" => Some(Known::ArrayReconstruct),
            "scalar" => Some(Known::Scalar),
            _ => None,
        },
        "numpy.core.numeric" | "numpy._core.numeric" => {
            (name == "_frombuffer").then_some(Known::FromBuffer)
        }
        "numpy" => numpy_name(name),
        "numpy.matrixlib.defmatrix" => (name == "matrix").then_some(Known::Ndarray),
        "numpy.core.memmap" | "numpy._core.memmap" => (name == "memmap").then_some(Known::Ndarray),
        "joblib.numpy_pickle" | "sklearn.externals.joblib.numpy_pickle" => {
            (name == "NumpyArrayWrapper").then_some(Known::JoblibArray)
        }
        "chumpy.ch" | "chumpy" if name == "Ch" => Some(Known::ChumpyArray),
        "chumpy.reordering" if name == "Select" => Some(Known::ChumpySelect),
        _ if module.starts_with("scipy.sparse.") || module == "scipy.sparse" => {
            sparse(module, name)
        }
        _ if module == "torch" || module.starts_with("torch.") => torch(module, name),
        _ => None,
    }
}

fn builtin(name: &str) -> Option<Known> {
    Some(match name {
        "list" | "set" | "frozenset" => Known::List,
        "dict" => Known::Dict,
        "tuple" => Known::Tuple,
        "bytearray" => Known::ByteArray,
        "bytes" => Known::Bytes,
        "complex" => Known::Complex,
        "object" => Known::Object,
        "int" | "long" | "float" | "bool" | "str" | "unicode" => Known::Inert,
        _ => return None,
    })
}

fn numpy_name(name: &str) -> Option<Known> {
    Some(match name {
        "ndarray" | "matrix" | "memmap" => Known::Ndarray,
        "dtype" => Known::DTypeClass,
        "bool_" | "bool" | "int8" | "int16" | "int32" | "int64" | "uint8" | "uint16" | "uint32"
        | "uint64" | "float16" | "float32" | "float64" | "complex64" | "complex128" | "str_"
        | "bytes_" | "object_" => Known::Inert,
        _ => return None,
    })
}

fn sparse(module: &str, name: &str) -> Option<Known> {
    let module = module
        .strip_prefix("scipy.sparse")
        .unwrap_or(module)
        .trim_start_matches(['.', '_']);
    match (module, name) {
        ("" | "csc", "csc_matrix" | "csc_array") => Some(Known::Sparse(SparseKind::Columns)),
        ("" | "csr", "csr_matrix" | "csr_array") => Some(Known::Sparse(SparseKind::Rows)),
        _ => None,
    }
}

fn torch(module: &str, name: &str) -> Option<Known> {
    let storage = || {
        let dtype = match name.strip_suffix("Storage")? {
            "Double" => "f8",
            "Float" => "f4",
            "Half" => "f2",
            "Long" => "i8",
            "Int" => "i4",
            "Short" => "i2",
            "Char" => "i1",
            "Byte" => "u1",
            "Bool" => "b1",
            "ComplexFloat" => "c8",
            "ComplexDouble" => "c16",
            "BFloat16" => return Some(Known::Storage(DType::new(Kind::Bfloat, 2))),
            "Untyped" => return Some(Known::UntypedStorage),
            _ => return None,
        };
        DType::parse(dtype).map(Known::Storage)
    };
    match (module, name) {
        ("torch._utils", "_rebuild_tensor" | "_rebuild_tensor_v2" | "_rebuild_tensor_v3") => {
            Some(Known::RebuildTensor)
        }
        ("torch._utils", "_rebuild_parameter") => Some(Known::RebuildParameter),
        ("torch.storage", "_load_from_bytes") => Some(Known::LoadFromBytes),
        ("torch", "Size") => Some(Known::Tuple),
        ("torch", "device") => Some(Known::Device),
        ("torch", "Tensor") | ("torch._tensor", "Tensor") | ("torch.nn.parameter", "Parameter") => {
            Some(Known::Inert)
        }
        ("torch", _) => tensor_type(name).map(Known::TensorType).or_else(storage),
        ("torch.storage" | "torch.cuda", _) => storage(),
        _ => None,
    }
}

fn tensor_type(name: &str) -> Option<DType> {
    let description = match name {
        "float64" => "f8",
        "float32" => "f4",
        "float16" => "f2",
        "int64" => "i8",
        "int32" => "i4",
        "int16" => "i2",
        "int8" => "i1",
        "uint8" => "u1",
        "bool" => "b1",
        "complex64" => "c8",
        "complex128" => "c16",
        "bfloat16" => return Some(DType::new(Kind::Bfloat, 2)),
        _ => return None,
    };
    DType::parse(description)
}
