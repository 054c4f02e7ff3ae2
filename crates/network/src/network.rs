//! Networks: graphs of nodes, computed one after another.

use std::mem::take;
use std::sync::Mutex;

use crate::call::{Call, Run};
use crate::error::NetworkError;
use crate::read::{Graph, Node, Port, Slot, read};
use crate::spare::Spare;
use crate::tensor::{Kind, Tensor, Values};

/// Most numbers that are alive at a time. Our own choice: four of the largest arrays.
const LIVE_MAX: usize = 4 * crate::tensor::ELEMENTS_MAX;

/// A network that is ready to be computed.
///
/// The order of all sums is fixed, no product is fused with a sum, and functions such as the exponential are those of
/// `orchard_geometry::math`: so the outputs have the same bits on every processor.
pub struct Network {
    /// The nodes that depend on inputs, in order.
    nodes: Vec<Step>,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    /// Constant arrays, by slot.
    constants: Vec<Option<Tensor>>,
    /// Memory of the last run, for the next: up to twice the numbers that were alive at a time.
    spare: Mutex<Spare>,
}

/// A node with the slots that nobody uses after it.
struct Step {
    node: Node,
    last_used: Vec<Slot>,
}

impl std::fmt::Debug for Network {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "network of {} nodes", self.nodes.len())
    }
}

impl Network {
    /// Reads the bytes of an ONNX file. What depends on no input is computed here, once.
    ///
    /// # Errors
    /// Not an ONNX file, operators or numbers that are not supported, or nodes that do not fit together as far as they depend on no input.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NetworkError> {
        let Graph { nodes, inputs, outputs, stored, slots } = read(bytes)?;
        let mut constants: Vec<Option<Tensor>> = vec![None; slots];
        for (slot, tensor) in stored {
            constants[slot] = Some(tensor);
        }
        let (mut open, run) = (Vec::new(), Run::new(Spare::default()));
        for mut node in nodes {
            if node.inputs.iter().flatten().all(|&slot| constants[slot].is_some()) {
                let given = compute(&node, &run, |slot| constants[slot].as_ref())?;
                for (slot, tensor) in node.outputs.iter().zip(given) {
                    if let Some(slot) = slot {
                        constants[*slot] = Some(tensor);
                    }
                }
                check_live(&node, constants.iter().flatten().map(|t| t.values().len()).sum())?;
                continue;
            }
            turn_weights(&mut node, &mut constants);
            open.push(node);
        }
        let open = join_relus(open, &outputs, constants.len());
        let mut last = vec![None; constants.len()];
        for (i, node) in open.iter().enumerate() {
            for &slot in node.inputs.iter().chain(&node.outputs).flatten() {
                last[slot] = Some(i);
            }
        }
        for port in &outputs {
            last[port.slot] = None;
        }
        let mut steps: Vec<Step> =
            open.into_iter().map(|node| Step { node, last_used: Vec::new() }).collect();
        for (slot, last) in last.into_iter().enumerate() {
            match last {
                Some(i) if constants[slot].is_none() => steps[i].last_used.push(slot),
                Some(_) => {}
                // Only nodes that are done used it.
                None if outputs.iter().all(|port| port.slot != slot) => constants[slot] = None,
                None => {}
            }
        }
        Ok(Self { nodes: steps, inputs, outputs, constants, spare: Mutex::default() })
    }

    /// The inputs, in the order of the file.
    pub fn inputs(&self) -> &[Port] {
        &self.inputs
    }

    /// The outputs, in the order of the file.
    pub fn outputs(&self) -> &[Port] {
        &self.outputs
    }

    /// Number of nodes that a run computes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// True if no node depends on an input.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Computes the outputs for one array an input, in the order of [`Self::inputs`].
    ///
    /// # Errors
    /// An array of another type or shape than the input has, or a node that does not take the shapes that it meets.
    pub fn run(&self, inputs: Vec<Tensor>) -> Result<Vec<Tensor>, NetworkError> {
        if inputs.len() != self.inputs.len() {
            let problem = format!("{} arrays are given for {} inputs", inputs.len(), self.inputs.len());
            return Err(NetworkError::Graph(problem));
        }
        let mut values: Vec<Option<Tensor>> = vec![None; self.constants.len()];
        let spare = self.spare.lock().map(|mut spare| take(&mut *spare)).unwrap_or_default();
        let (mut live, run) = (0, Run::new(spare));
        for (port, tensor) in self.inputs.iter().zip(inputs) {
            port.check(&tensor)?;
            live += tensor.values().len();
            values[port.slot] = Some(tensor);
        }
        for Step { node, last_used } in &self.nodes {
            let value = |slot: Slot| self.constants[slot].as_ref().or(values[slot].as_ref());
            let given = compute(node, &run, value)?;
            for (slot, tensor) in node.outputs.iter().zip(given) {
                if let Some(slot) = slot {
                    live += tensor.values().len();
                    values[*slot] = Some(tensor);
                }
            }
            check_live(node, live)?;
            run.spare.borrow_mut().alive(live);
            for &slot in last_used {
                live -= values[slot].as_ref().map_or(0, |tensor| tensor.values().len());
                self.keep(slot, &mut values, &run);
            }
        }
        let output = |port: &Port| {
            let missing = || NetworkError::Graph(format!("output `{}` is not computed", port.name));
            self.constants[port.slot].clone().or_else(|| values[port.slot].clone()).ok_or_else(missing)
        };
        let given = self.outputs.iter().map(output).collect();
        self.outputs.iter().for_each(|port| self.keep(port.slot, &mut values, &run));
        if let Ok(mut spare) = self.spare.lock() {
            *spare = run.spare.into_inner();
        }
        given
    }

    /// Ends the life of a value, whose memory the run keeps. That of inputs is the caller's: what comes in at each run would pile up.
    fn keep(&self, slot: Slot, values: &mut [Option<Tensor>], run: &Run) {
        let tensor = values[slot].take().filter(|_| self.inputs.iter().all(|port| port.slot != slot));
        if let Some(Values::F32(numbers)) = tensor.map(Tensor::into_values) {
            run.spare.borrow_mut().give(numbers);
        }
    }
}

impl Port {
    /// Checks that an array fits.
    fn check(&self, tensor: &Tensor) -> Result<(), NetworkError> {
        let (kind, shape) = (tensor.values().kind(), tensor.shape());
        let fits = self.shape.len() == shape.len()
            && self.shape.iter().zip(shape).all(|(own, given)| own.is_none_or(|own| own == *given));
        if fits && kind == self.kind {
            return Ok(());
        }
        let problem = format!(
            "{} {shape:?} is given, but it takes {} {}",
            kind.name(),
            self.kind.name(),
            self.shape_text()
        );
        Err(NetworkError::Input { name: self.name.clone(), problem })
    }

    /// The shape for people: `[?, 3]`.
    pub fn shape_text(&self) -> String {
        let lengths = self.shape.iter().map(|d| d.map_or_else(|| "?".to_owned(), |d| d.to_string()));
        format!("[{}]", lengths.collect::<Vec<_>>().join(", "))
    }

    /// An array of zeros (or false) of its type and shape; open lengths are 1.
    ///
    /// # Errors
    /// The shape is too large.
    pub fn zeros(&self) -> Result<Tensor, NetworkError> {
        let shape = self.shape.iter().map(|d| d.unwrap_or(1)).collect();
        Tensor::zeros(shape, self.kind)
            .map_err(|problem| NetworkError::Input { name: self.name.clone(), problem })
    }
}

/// Computes a node.
fn compute<'a>(
    node: &Node,
    run: &'a Run,
    value: impl Fn(Slot) -> Option<&'a Tensor>,
) -> Result<Vec<Tensor>, NetworkError> {
    let bad = |problem| NetworkError::Node {
        name: node.name.clone(),
        kind: node.operator.name.to_owned(),
        problem,
    };
    let input = |slot: &Option<Slot>| match slot {
        None => Ok(None),
        Some(slot) => value(*slot).map(Some).ok_or_else(|| bad("an input is not computed".to_owned())),
    };
    let inputs = node.inputs.iter().map(input).collect::<Result<_, _>>()?;
    let outputs = node.outputs.len();
    let call = Call { inputs, attributes: &node.attributes, outputs, run, positive: node.positive };
    let given = (node.operator.run)(&call).map_err(bad)?;
    call.spend(&[given.iter().map(|tensor| tensor.values().len()).sum()]).map_err(bad)?;
    // Outputs that are asked for and not given would stay empty.
    match given.len() < node.outputs.iter().rposition(Option::is_some).map_or(0, |last| last + 1) {
        true => Err(bad(format!("only its first {} outputs are supported", given.len()))),
        false => Ok(given),
    }
}

fn check_live(node: &Node, live: usize) -> Result<(), NetworkError> {
    if live <= LIVE_MAX {
        return Ok(());
    }
    let problem = format!("more than {LIVE_MAX} numbers are held at a time");
    Err(NetworkError::Node { name: node.name.clone(), kind: node.operator.name.to_owned(), problem })
}

/// Turns stored weights of a `Gemm` once that each run would turn: rows of inputs are read faster than columns.
fn turn_weights(node: &mut Node, constants: &mut Vec<Option<Tensor>>) {
    let turns = |a: &crate::proto::Attribute| a.name == "transB" && a.i != 0;
    let Some(at) = node.attributes.iter().position(turns).filter(|_| node.operator.name == "Gemm") else {
        return;
    };
    let Some(weights) = node.inputs.get(1).copied().flatten().and_then(|slot| constants[slot].as_ref())
    else {
        return;
    };
    let &[rows, columns] = weights.shape() else { return };
    if weights.values().kind() != Kind::F32 {
        return;
    }
    if let Ok(turned) = weights.strided(vec![columns, rows], 0, &[1, columns as isize]) {
        node.attributes[at].i = 0;
        node.inputs[1] = Some(constants.len());
        constants.push(Some(turned));
    }
}

/// Joins each `Relu` to the `Conv` before it if nothing else uses what that gives.
fn join_relus(nodes: Vec<Node>, outputs: &[Port], slots: usize) -> Vec<Node> {
    let mut uses = vec![0; slots];
    let used = nodes.iter().flat_map(|node| node.inputs.iter().flatten().copied());
    used.chain(outputs.iter().map(|port| port.slot)).for_each(|slot| uses[slot] += 1);
    let (mut joined, mut giver) = (Vec::<Node>::new(), vec![None; slots]);
    for node in nodes {
        let from = node.inputs.first().copied().flatten().filter(|&slot| uses[slot] == 1);
        let conv = from.and_then(|slot| giver[slot]).filter(|_| node.operator.name == "Relu");
        match conv.and_then(|i: usize| joined.get_mut(i)).filter(|conv| conv.operator.name == "Conv") {
            Some(conv) => (conv.outputs, conv.positive) = (node.outputs, true),
            None => {
                node.outputs.iter().flatten().for_each(|&slot| giver[slot] = Some(joined.len()));
                joined.push(node);
            }
        }
    }
    joined
}

#[cfg(test)]
#[path = "network_tests.rs"]
mod tests;
