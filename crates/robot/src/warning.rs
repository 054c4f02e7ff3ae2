//! Warnings: what a description leaves open or gets wrong, and what is assumed instead.

use serde::Serialize;

/// A fault of a robot description that does not stop it from being used, with what is assumed instead.
#[derive(Debug, Clone, PartialEq, PartialOrd, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Warning {
    /// A moving joint has no usable limits of these kinds, and is taken as unlimited.
    NoLimit {
        /// The joint.
        joint: String,
        /// Kinds of limits: position, velocity, effort.
        lacks: Vec<&'static str>,
    },
    /// A joint whose lowest position is its highest is taken as fixed there.
    Locked {
        /// The joint.
        joint: String,
        /// The position [rad or m].
        position: f64,
    },
    /// A joint that moves neither mass nor shapes is taken as fixed.
    MovesNothing {
        /// The joint.
        joint: String,
    },
    /// A joint that mimics a fixed one is taken as fixed.
    MimicsFixed {
        /// The joint.
        joint: String,
        /// The joint that it mimics.
        leader: String,
    },
    /// A link that moves has no mass, and gets the least.
    NoMass {
        /// The link.
        link: String,
        /// Mass that it gets \[kg\].
        assumed: f64,
    },
    /// A link has an inertia and no mass; the inertia is left out.
    InertiaWithoutMass {
        /// The link.
        link: String,
    },
    /// A link's mass or inertia is incomplete; what lacks is taken as zero.
    IncompleteInertial {
        /// The link.
        link: String,
    },
    /// A link's inertia is that of no body; the nearest one that is replaces it.
    ImpossibleInertia {
        /// The link.
        link: String,
        /// Principal moments in the description, the smallest first [kg m^2].
        moments: [f64; 3],
        /// Principal moments that replace them [kg m^2].
        replaced_by: [f64; 3],
    },
    /// A collision shape has no size and is left out.
    EmptyShape {
        /// The link.
        link: String,
    },
    /// A collision mesh is flat, or its hull cannot be computed; a box at least 1 mm thick stands for it.
    FlatMesh {
        /// The link.
        link: String,
        /// Name of the file in the description.
        file: String,
    },
    /// The file of a visual mesh cannot be found; looks are never needed.
    NoVisual {
        /// The link.
        link: String,
        /// Name of the file in the description.
        file: String,
    },
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoLimit { joint, lacks } => {
                write!(
                    f,
                    "joint `{joint}` has no usable limit of {}: taken as unlimited",
                    lacks.join(" and ")
                )
            }
            Self::Locked { joint, position } => {
                write!(f, "joint `{joint}` has one position as its lowest and highest: fixed at {position}")
            }
            Self::MovesNothing { joint } => {
                write!(f, "joint `{joint}` moves neither mass nor collision shapes: taken as fixed")
            }
            Self::MimicsFixed { joint, leader } => {
                write!(f, "joint `{joint}` mimics `{leader}`, which is fixed: taken as fixed")
            }
            Self::NoMass { link, assumed } => {
                write!(f, "link `{link}` moves and has no mass: it gets {assumed} kg")
            }
            Self::InertiaWithoutMass { link } => {
                write!(f, "link `{link}` has an inertia and no mass: the inertia is left out")
            }
            Self::IncompleteInertial { link } => {
                write!(f, "link `{link}` has an incomplete inertial element: what it lacks is taken as zero")
            }
            Self::ImpossibleInertia { link, moments, replaced_by } => {
                let line = |m: &[f64; 3]| format!("{:.3e}, {:.3e}, {:.3e}", m[0], m[1], m[2]);
                write!(
                    f,
                    "link `{link}` has the inertia of no body (principal moments {} kg m2): replaced by {} kg m2",
                    line(moments),
                    line(replaced_by)
                )
            }
            Self::EmptyShape { link } => {
                write!(f, "link `{link}` has a collision shape of no size: left out")
            }
            Self::FlatMesh { link, file } => {
                write!(
                    f,
                    "link `{link}`: mesh `{file}` is flat, or its hull fails: a box at least 1 mm thick stands for it"
                )
            }
            Self::NoVisual { link, file } => {
                write!(f, "link `{link}`: visual mesh `{file}` cannot be found; it is not needed")
            }
        }
    }
}

/// Sorts warnings by kind, then by names, and drops repeated ones.
pub(crate) fn sorted(mut warnings: Vec<Warning>) -> Vec<Warning> {
    warnings.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    warnings.dedup();
    warnings
}
