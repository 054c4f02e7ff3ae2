//! Errors of a robot description.

/// Reason for which a robot cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RobotError {
    /// The text is not XML or not URDF.
    #[error("URDF cannot be read: {0}")]
    Parse(String),
    /// The text is too long, nested too deep, or has too many links or joints.
    #[error("URDF cannot be read: it has more than {most} {what}")]
    TooMany {
        /// Name of the quantity that exceeds its limit.
        what: &'static str,
        /// Largest number that is read.
        most: usize,
    },
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
        /// Joint or config field that names it.
        by: String,
        /// The link.
        link: String,
    },
    /// The config names a joint that does not exist or has no freedom of the needed kind.
    #[error("{by}: there is no {kind} joint `{joint}`")]
    MissingJoint {
        /// Joint or config field that names it.
        by: String,
        /// Kind of joint that is needed.
        kind: &'static str,
        /// The joint.
        joint: String,
    },
    /// A link has two parents.
    #[error("link `{0}` has two parent joints")]
    TwoParents(String),
    /// There is no link without a parent, or links form a cycle.
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
        /// Type of the joint.
        kind: String,
    },
    /// An axis has no direction or does not suit the joint type.
    #[error("joint `{joint}`: axis {axis:?} {problem}")]
    Axis {
        /// The joint.
        joint: String,
        /// The axis, as text.
        axis: String,
        /// The problem.
        problem: &'static str,
    },
    /// A revolute or prismatic joint without limits.
    #[error("joint `{joint}`: {problem}")]
    Limit {
        /// The joint.
        joint: String,
        /// The problem.
        problem: &'static str,
    },
    /// A moving part has no mass or an impossible inertia.
    #[error("link `{link}`: {problem}")]
    Inertia {
        /// The link.
        link: String,
        /// The problem.
        problem: &'static str,
    },
    /// A file of xacro, from which URDF is made.
    #[error("{found}: this is xacro, from which URDF is made by `xacro robot.xacro > robot.urdf`")]
    Xacro {
        /// Element or attribute of xacro that was found.
        found: String,
    },
    /// A robot in another language.
    #[error("this is {0}, which is not read: a URDF file begins with the element `robot`")]
    Language(&'static str),
    /// A collision mesh that is missing or cannot be used.
    #[error("link `{link}`: mesh `{file}`: {problem}")]
    Mesh {
        /// The link.
        link: String,
        /// Name of the file in the description.
        file: String,
        /// The problem.
        problem: String,
    },
    /// A collision shape that is not supported.
    #[error("link `{link}`: collision geometry {kind} is not supported")]
    Geometry {
        /// The link.
        link: String,
        /// The geometry.
        kind: &'static str,
    },
    /// A number is implausibly large.
    #[error("{place}: {number} is larger than the allowed {limit}")]
    TooLarge {
        /// Place of the number in the description.
        place: String,
        /// The number, as text.
        number: String,
        /// The bound on its magnitude, as text.
        limit: String,
    },
    /// A number is not finite.
    #[error("{place}: a number is not finite")]
    NotFinite {
        /// Place of the number in the description.
        place: String,
    },
}
