//! Sources of a network's inputs, and the meaning of its outputs.

use orchard_network::{Kind, Network, Port, Tensor, Values as Numbers};
use orchard_policy::{Field, Interface, Values};

use crate::error::PolicyError;

/// Name of the output that is carried out.
const ACTION: &str = "action";
/// Names of a recurrent state's inputs and outputs begin with these; the same ending belongs together.
const STATE: [&str; 2] = ["state_in", "state_out"];

/// Source of an input.
enum Source {
    /// An array of the observation, and the shape that the input has.
    Field(usize, Vec<usize>),
    /// A state, by its place among the states.
    State(usize),
}

/// Connections of a network.
pub(crate) struct Wiring {
    sources: Vec<Source>,
    /// Place of the action among the outputs, and of each state's next value.
    action: usize,
    states: Vec<usize>,
    /// The states at the start of an episode.
    start: Vec<Tensor>,
    /// Numbers of an action.
    size: usize,
}

impl Wiring {
    /// Connects a network with an interface, and runs it once on zeros.
    pub fn of(network: &Network, interface: &Interface) -> Result<Self, PolicyError> {
        let output = |name: &str| network.outputs().iter().position(|port| port.name == name);
        let names =
            |ports: &[Port]| ports.iter().map(|p| format!("`{}`", p.name)).collect::<Vec<_>>().join(", ");
        let action = output(ACTION).ok_or_else(|| {
            PolicyError::Wiring(format!(
                "the network has no output `{ACTION}`; its outputs are {}",
                names(network.outputs())
            ))
        })?;
        let (mut sources, mut states, mut start) = (Vec::new(), Vec::new(), Vec::new());
        for port in network.inputs() {
            let bad = |problem: String| PolicyError::Wiring(format!("input `{}`: {problem}", port.name));
            if let Some(i) = interface.observation.iter().position(|field| field.key == port.name) {
                let shape = shape_of(port, &interface.observation[i]).map_err(bad)?;
                sources.push(Source::Field(i, shape));
            } else if let Some(ending) = port.name.strip_prefix(STATE[0]) {
                let name = format!("{}{ending}", STATE[1]);
                let next = output(&name).ok_or_else(|| bad(format!("the network has no output `{name}`")))?;
                sources.push(Source::State(states.len()));
                states.push(next);
                start.push(port.zeros()?);
            } else {
                let keys: Vec<&str> = interface.observation.iter().map(|field| field.key).collect();
                return Err(bad(format!(
                    "the policy's observations have no such array; they have {}, and the names of a state begin with `{}`",
                    keys.join(", "),
                    STATE[0]
                )));
            }
        }
        let wiring = Self { sources, action, states, start, size: interface.action.len() };
        wiring.try_out(network, interface)?;
        Ok(wiring)
    }

    /// The states at the start of an episode.
    pub fn start(&self) -> Vec<Tensor> {
        self.start.clone()
    }

    /// Runs the network on an observation of zeros.
    fn try_out(&self, network: &Network, interface: &Interface) -> Result<(), PolicyError> {
        let zeros = |field: &Field| {
            let n = field.shape.iter().product();
            if field.dtype == "uint8" { Values::U8(vec![0; n]) } else { Values::F32(vec![0.0; n]) }
        };
        let observation: Vec<Values> = interface.observation.iter().map(zeros).collect();
        let mut states = self.start();
        let actions = self.run(network, &observation, &mut states)?;
        for (state, start) in states.iter().zip(&self.start) {
            if state.shape() != start.shape() || state.values().kind() != start.values().kind() {
                let (given, taken) = (state.shape(), start.shape());
                return Err(PolicyError::Wiring(format!(
                    "a state of shape {taken:?} becomes one of {given:?}"
                )));
            }
        }
        match actions.iter().find(|x| !x.is_finite()) {
            None => Ok(()),
            Some(x) => Err(PolicyError::Wiring(format!("for an observation of zeros the action holds {x}"))),
        }
    }

    /// Computes the next actions, one after another, and the next states.
    pub fn run(
        &self,
        network: &Network,
        observation: &[Values],
        states: &mut Vec<Tensor>,
    ) -> Result<Vec<f32>, PolicyError> {
        let inputs = self.sources.iter().zip(network.inputs()).map(|(source, port)| match source {
            Source::State(i) => states.get(*i).cloned(),
            Source::Field(i, shape) => {
                observation.get(*i).and_then(|values| tensor(values, shape, port.kind))
            }
        });
        let inputs = inputs.collect::<Option<Vec<_>>>();
        let inputs =
            inputs.ok_or_else(|| PolicyError::Wiring("an observation does not fit its input".to_owned()))?;
        let mut outputs: Vec<Option<Tensor>> = network.run(inputs)?.into_iter().map(Some).collect();
        let action = outputs[self.action].clone();
        *states = self.states.iter().filter_map(|&i| outputs[i].take()).collect();
        let shape = action.as_ref().map(|action| action.shape().to_vec()).unwrap_or_default();
        let numbers = action.as_ref().and_then(Tensor::as_f32).filter(|_| shape.last() == Some(&self.size));
        let whole = numbers.filter(|numbers| !numbers.is_empty());
        let wrong = || {
            let size = self.size;
            PolicyError::Wiring(format!(
                "output `{ACTION}` has shape {shape:?}; its last dimension must be the {size} numbers (FLOAT) of an action"
            ))
        };
        whole.map(<[f32]>::to_vec).ok_or_else(wrong)
    }
}

/// The shape that a field has as an input: its own, with dimensions of length 1 before it.
fn shape_of(port: &Port, field: &Field) -> Result<Vec<usize>, String> {
    let more = port.shape.len().checked_sub(field.shape.len());
    let shape: Vec<usize> =
        std::iter::repeat_n(1, more.unwrap_or(0)).chain(field.shape.iter().copied()).collect();
    let fits = more.is_some() && port.shape.iter().zip(&shape).all(|(p, s)| p.is_none_or(|p| p == *s));
    if !fits {
        return Err(format!(
            "it has shape {}, but the observation's is {:?}",
            port.shape_text(),
            field.shape
        ));
    }
    match (port.kind, field.dtype) {
        (Kind::F32, _) | (Kind::U8, "uint8") => Ok(shape),
        (kind, dtype) => Err(format!("it takes {}, but the observation's numbers are {dtype}", kind.name())),
    }
}

fn tensor(values: &Values, shape: &[usize], kind: Kind) -> Option<Tensor> {
    let numbers = match (values, kind) {
        (Values::F32(v), Kind::F32) => Numbers::F32(v.clone()),
        (Values::U8(v), Kind::U8) => Numbers::U8(v.clone()),
        (Values::U8(v), Kind::F32) => Numbers::F32(v.iter().map(|&x| f32::from(x)).collect()),
        _ => return None,
    };
    Tensor::new(shape.to_vec(), numbers)
}
