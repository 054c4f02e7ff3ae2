//! Networks that cannot be read or computed.

/// A file that cannot be read, or a network that cannot be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// Not an ONNX file.
    #[error("not a model in ONNX format: {problem}")]
    NotOnnx {
        /// Problem.
        problem: String,
    },
    /// A graph that cannot be used.
    #[error("{0}")]
    Graph(String),
    /// A node that cannot be computed.
    #[error("node {name} ({kind}): {problem}")]
    Node {
        /// Name of the node, or its number.
        name: String,
        /// Operator of the node.
        kind: String,
        /// Problem.
        problem: String,
    },
    /// An input that does not fit.
    #[error("input `{name}`: {problem}")]
    Input {
        /// Name.
        name: String,
        /// Problem.
        problem: String,
    },
}
