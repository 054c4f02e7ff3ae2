//! ONNX files as graphs of nodes that this crate can compute.

use std::collections::BTreeMap;

use prost::Message;

use crate::error::NetworkError;
use crate::ops::Operator;
use crate::proto;
use crate::tensor::{Kind, Tensor, Values, count};

/// Oldest and newest version of ONNX's operators that are read: the operators of this crate have not changed in between, but for how some
/// parameters are given.
pub const OPSETS: [i64; 2] = [13, 26];

/// Largest number of nodes. Our own choice: detectors of images have about a thousand.
const NODES_MAX: usize = 20_000;

/// Value of `data_location` if the bytes of an array stand outside the file.
const EXTERNAL: i32 = 1;

/// Place of a value that nodes give and use.
pub(crate) type Slot = usize;

/// A node.
pub(crate) struct Node {
    /// Name for people: its own, or its number.
    pub name: String,
    pub operator: &'static Operator,
    pub inputs: Vec<Option<Slot>>,
    pub outputs: Vec<Option<Slot>>,
    pub attributes: Vec<proto::Attribute>,
    /// True if it takes the positive parts of what it gives: a `Relu` is joined to it.
    pub positive: bool,
}

/// An input or output of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Name.
    pub name: String,
    /// Type of its numbers.
    pub kind: Kind,
    /// Lengths of its dimensions; `None` for a length that the file leaves open.
    pub shape: Vec<Option<usize>>,
    pub(crate) slot: Slot,
}

/// A file as nodes between slots.
pub(crate) struct Graph {
    pub nodes: Vec<Node>,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
    /// The stored arrays, by slot.
    pub stored: BTreeMap<Slot, Tensor>,
    /// Number of slots.
    pub slots: usize,
}

/// Reads the bytes of a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Graph, NetworkError> {
    let model = proto::Model::decode(bytes).map_err(|e| NetworkError::NotOnnx { problem: e.to_string() })?;
    let graph = model.graph.ok_or(NetworkError::NotOnnx { problem: "there is no graph".to_owned() })?;
    let own = |domain: &str| domain.is_empty() || domain == "ai.onnx";
    let opset = model.opset_import.iter().find(|set| own(&set.domain)).map(|set| set.version);
    if !opset.is_some_and(|version| (OPSETS[0]..=OPSETS[1]).contains(&version)) {
        let found = opset.map_or_else(|| "no version".to_owned(), |version| format!("version {version}"));
        let [oldest, newest] = OPSETS;
        return Err(NetworkError::Graph(format!(
            "{found} of ONNX's operators (opset) is asked for; {oldest} to {newest} are supported"
        )));
    }
    if graph.node.len() > NODES_MAX {
        return Err(NetworkError::Graph(format!("it has more than {NODES_MAX} nodes")));
    }
    let mut slots = Slots::default();
    let mut stored = BTreeMap::new();
    for array in graph.initializer {
        let name = array.name.clone();
        let tensor = tensor(array).map_err(|e| NetworkError::Graph(format!("array `{name}`: {e}")))?;
        stored.insert(slots.add(&name)?, tensor);
    }
    let mut inputs = Vec::new();
    // Files of old versions list stored arrays among the inputs, too.
    for info in graph.input.iter().filter(|info| !slots.0.contains_key(&info.name)).collect::<Vec<_>>() {
        let slot = slots.add(&info.name)?;
        inputs
            .push(port(info, slot).map_err(|e| NetworkError::Graph(format!("input `{}`: {e}", info.name)))?);
    }
    let mut nodes = Vec::new();
    for (i, node) in graph.node.into_iter().enumerate() {
        let name = if node.name.is_empty() { format!("#{i}") } else { node.name.clone() };
        let bad =
            |problem: String| NetworkError::Node { name: name.clone(), kind: node.op_type.clone(), problem };
        if !own(&node.domain) {
            return Err(bad(format!("operators of domain `{}` are not supported", node.domain)));
        }
        let operator = Operator::named(&node.op_type).ok_or_else(|| {
            bad("this operator is not supported; docs/computation/networks.md lists those that are"
                .to_owned())
        })?;
        operator.check(&node.attribute).map_err(bad)?;
        let used = |name: &String| match name.is_empty() {
            true => Ok(None),
            false => slots
                .0
                .get(name)
                .copied()
                .map(Some)
                .ok_or_else(|| bad(format!("its input `{name}` is not given by any node before it"))),
        };
        let inputs = node.input.iter().map(used).collect::<Result<Vec<_>, _>>()?;
        let mut given = |name: &String| if name.is_empty() { Ok(None) } else { slots.add(name).map(Some) };
        let outputs = node.output.iter().map(&mut given).collect::<Result<Vec<_>, _>>()?;
        nodes.push(Node { name, operator, inputs, outputs, attributes: node.attribute, positive: false });
    }
    let outputs = graph.output.iter().map(|info| {
        let bad = |e: String| NetworkError::Graph(format!("output `{}`: {e}", info.name));
        let slot = slots.0.get(&info.name).copied().ok_or_else(|| bad("no node gives it".to_owned()))?;
        port(info, slot).map_err(bad)
    });
    let outputs = outputs.collect::<Result<_, _>>()?;
    Ok(Graph { nodes, inputs, outputs, stored, slots: slots.0.len() })
}

/// Slots by the names of the file.
#[derive(Default)]
struct Slots(BTreeMap<String, Slot>);

impl Slots {
    fn add(&mut self, name: &str) -> Result<Slot, NetworkError> {
        let slot = self.0.len();
        match self.0.insert(name.to_owned(), slot) {
            None => Ok(slot),
            Some(_) => Err(NetworkError::Graph(format!("the name `{name}` is given twice"))),
        }
    }
}

fn port(info: &proto::ValueInfo, slot: Slot) -> Result<Port, String> {
    let array = info.kind.as_ref().and_then(|kind| kind.tensor.as_ref());
    let array = array.ok_or("it is no array (tensor)")?;
    let dimensions = array.shape.as_ref().map_or(&[][..], |shape| &shape.dim);
    let shape = dimensions.iter().map(|d| d.value.and_then(|v| usize::try_from(v).ok()));
    Ok(Port { name: info.name.clone(), kind: Kind::of(array.element)?, shape: shape.collect(), slot })
}

/// Reads a stored array.
pub(crate) fn tensor(array: proto::Tensor) -> Result<Tensor, String> {
    let shape = array.dims.iter().map(|&d| usize::try_from(d).map_err(|_| format!("length {d} is negative")));
    let shape = shape.collect::<Result<Vec<_>, _>>()?;
    if array.data_location == EXTERNAL {
        return Err("its numbers stand in another file; save the model as one file".to_owned());
    }
    let wanted = count(&shape)?;
    let raw = &array.raw_data;
    let kind = Kind::of(array.data_type)?;
    let values = match (kind, raw.is_empty()) {
        (Kind::F32, false) => Values::F32(numbers(raw, f32::from_le_bytes)),
        (Kind::F32, true) => Values::F32(array.float_data),
        (Kind::I64, false) if array.data_type == INT32 => {
            Values::I64(numbers(raw, i32::from_le_bytes).into_iter().map(i64::from).collect())
        }
        (Kind::I64, false) => Values::I64(numbers(raw, i64::from_le_bytes)),
        (Kind::I64, true) if array.data_type == INT32 => {
            Values::I64(array.int32_data.into_iter().map(i64::from).collect())
        }
        (Kind::I64, true) => Values::I64(array.int64_data),
        (Kind::U8, false) => Values::U8(array.raw_data),
        (Kind::U8, true) => Values::U8(array.int32_data.iter().map(|&x| x as u8).collect()),
        (Kind::Bool, false) => Values::Bool(raw.iter().map(|&x| x != 0).collect()),
        (Kind::Bool, true) => Values::Bool(array.int32_data.iter().map(|&x| x != 0).collect()),
    };
    if let Values::F32(v) = &values
        && let Some(x) = v.iter().find(|x| x.is_nan())
    {
        return Err(format!("it holds {x}"));
    }
    let found = values.len();
    Tensor::new(shape, values).ok_or_else(|| format!("it holds {found} numbers, but its shape has {wanted}"))
}

/// Number of ONNX's data type INT32.
const INT32: i32 = 6;

/// Numbers of `N` bytes, least significant first; an incomplete last one is left out, so that their count is wrong.
fn numbers<T, const N: usize>(bytes: &[u8], of: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|chunk| of(*chunk)).collect()
}
