//! What can be wrong with a robot description.

/// A robot that cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RobotError {
    /// Not XML, or not URDF.
    #[error("URDF cannot be read: {0}")]
    Parse(String),
    /// Two links or two joints share a name.
    #[error("two {kind}s are named `{name}`")]
    Duplicate {
        /// `link` or `joint`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A joint or the config names a link that does not exist.
    #[error("{by}: there is no link `{link}`")]
    MissingLink {
        /// Who names it.
        by: String,
        /// The link.
        link: String,
    },
    /// The config names a joint that does not exist or has no freedom of the needed kind.
    #[error("{by}: there is no {kind} joint `{joint}`")]
    MissingJoint {
        /// Who names it.
        by: String,
        /// What kind of joint is needed.
        kind: &'static str,
        /// The joint.
        joint: String,
    },
    /// A link has two parents.
    #[error("link `{0}` has two parent joints")]
    TwoParents(String),
    /// No link without a parent, or links that hang on themselves.
    #[error("the joints form a cycle through link `{0}`")]
    Cyclic(String),
    /// More than one link without a parent.
    #[error("links `{0}` and `{1}` are not connected")]
    Disconnected(String, String),
    /// The robot has no link.
    #[error("the robot has no link")]
    Empty,
    /// A joint type that is not supported.
    #[error("joint `{joint}`: type {kind} is not supported")]
    JointType {
        /// The joint.
        joint: String,
        /// Its type.
        kind: String,
    },
    /// An axis that is no direction, or that the joint type cannot have.
    #[error("joint `{joint}`: axis {axis:?} {problem}")]
    Axis {
        /// The joint.
        joint: String,
        /// The axis, as text.
        axis: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A revolute or prismatic joint without limits.
    #[error("joint `{joint}`: {problem}")]
    Limit {
        /// The joint.
        joint: String,
        /// What is wrong with them.
        problem: &'static str,
    },
    /// A moving part without mass or with an inertia that no body has.
    #[error("link `{link}`: {problem}")]
    Inertia {
        /// The link.
        link: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// A collision shape that is not supported.
    #[error("link `{link}`: collision geometry {kind} is not supported")]
    Geometry {
        /// The link.
        link: String,
        /// The geometry.
        kind: &'static str,
    },
    /// A number that no robot has.
    #[error("{place}: {number} is larger than the allowed {limit}")]
    TooLarge {
        /// Where.
        place: String,
        /// The number, as text.
        number: String,
        /// The bound on its magnitude, as text.
        limit: String,
    },
    /// A number that is not finite.
    #[error("{place}: a number is not finite")]
    NotFinite {
        /// Where.
        place: String,
    },
}
