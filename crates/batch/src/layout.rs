//! Where the numbers of a tile stand in memory: `[row][field][lane]`.

/// Numbers of a link. Constants of a world first, then what breaking changes, then the state.
pub(crate) mod link {
    /// First two columns of the rotation from the link's joint frame to its parent's frame (6).
    pub const REST: usize = 0;
    /// From the joint to the tip, where all children sit [m].
    pub const LENGTH: usize = 6;
    /// Mass [kg].
    pub const MASS: usize = 7;
    /// Inertia across the link about the centre of mass [kg m^2].
    pub const ACROSS: usize = 8;
    /// Inertia about the link's axis less that across it [kg m^2].
    pub const AXIAL_EXCESS: usize = 9;
    /// Drag of translation [1/s].
    pub const LINEAR_DRAG: usize = 10;
    /// Drag of rotation [1/s].
    pub const ANGULAR_DRAG: usize = 11;
    /// Joint stiffness [N m/rad].
    pub const STIFFNESS: usize = 12;
    /// Joint damping [N m s/rad].
    pub const DAMPING: usize = 13;
    /// Joint angles [rad] (2).
    pub const Q: usize = 14;
    /// Joint rates [rad/s] (2).
    pub const V: usize = 16;
    /// Fields.
    pub const FIELDS: usize = 18;
}

/// What the passes over the links leave for each other.
pub(crate) mod work {
    /// First and second joint axis (3 each).
    pub const AXES: usize = 0;
    /// The link's own axis, unit (3).
    pub const Z: usize = 6;
    /// Impulse on the link at its origin: torque, force (6). The factor takes its place.
    pub const IMPULSE: usize = 9;
    /// G = U / D of both axes, torque and force each (12).
    pub const G: usize = 9;
    /// y / D of both axes (2).
    pub const X: usize = 21;
    /// Fields.
    pub const FIELDS: usize = 23;
}

/// Numbers of a fruit. Constants first, then what detachment changes, then the state.
pub(crate) mod fruit {
    /// Mass [kg].
    pub const MASS: usize = 0;
    /// Weight [N]; 0 on a padding row.
    pub const WEIGHT: usize = 1;
    /// Where the stem is fixed, in the link's frame [m] (3).
    pub const ANCHOR: usize = 2;
    /// Height of the hang point above the anchor [m].
    pub const DROP: usize = 5;
    /// Largest reaction on the anchor [N].
    pub const CAP: usize = 6;
    /// Stiffness of the stem [N/m]; 0 off the stem.
    pub const STIFFNESS: usize = 7;
    /// Damping of the stem [N s/m]; 0 off the stem.
    pub const DAMPING: usize = 8;
    /// Upward force that takes the weight off the anchor [N]; 0 off the stem.
    pub const BIAS: usize = 9;
    /// Coefficient of air drag [N s^2/m^2]; 0 on the stem.
    pub const AIR_DRAG: usize = 10;
    /// Applied force [N] (3).
    pub const FORCE: usize = 11;
    /// Position [m] (3).
    pub const P: usize = 14;
    /// Velocity [m/s] (3).
    pub const V: usize = 17;
    /// Fields.
    pub const FIELDS: usize = 20;
}

/// What the passes leave for each other at a fruit.
pub(crate) mod fruit_work {
    /// Mass that the fruit adds to its link at the anchor [kg].
    pub const ADDED_MASS: usize = 0;
    /// What the stem adds to the fruit's inertia, h (c + h k) [kg].
    pub const KAPPA: usize = 1;
    /// 1 / (mass + h drag + kappa) [1/kg].
    pub const INVERSE_MASS: usize = 2;
    /// From the link's origin to the anchor [m] (3).
    pub const R_ANCHOR: usize = 3;
    /// Impulse on the fruit with the anchor's velocity unchanged [N s] (3).
    pub const IMPULSE: usize = 6;
    /// Stretch of the stem spring [m] (3).
    pub const STRETCH: usize = 9;
    /// Fields.
    pub const FIELDS: usize = 12;
}

/// What a link passes on to its children: everything at the link's tip.
pub(crate) mod pose {
    /// Axes of the link (9).
    pub const AXES: usize = 0;
    /// Angular velocity (3).
    pub const W: usize = 9;
    /// Velocity (3).
    pub const V: usize = 12;
    /// Angular bias acceleration (3).
    pub const B_W: usize = 15;
    /// Linear bias acceleration (3).
    pub const B_V: usize = 18;
    /// Position (3).
    pub const P: usize = 21;
    /// Fields.
    pub const FIELDS: usize = 24;
}

/// What children pass on to their parent, at its tip.
pub(crate) mod load {
    /// Angular block: xx, xy, xz, yy, yz, zz (6).
    pub const ANGULAR: usize = 0;
    /// Coupling block, column after column (9).
    pub const COUPLING: usize = 6;
    /// Linear block, like the angular one (6).
    pub const LINEAR: usize = 15;
    /// Torque (3).
    pub const TORQUE: usize = 21;
    /// Force (3).
    pub const FORCE: usize = 24;
    /// Fields.
    pub const FIELDS: usize = 27;
}

/// Velocity change of a link's tip: angular, linear.
pub(crate) mod change {
    /// Fields.
    pub const FIELDS: usize = 6;
}

/// Floats of a cache line, and of the widest vector.
const LINE: usize = 16;

/// Floats that start on a cache line, so that no vector straddles two.
#[derive(Debug)]
pub(crate) struct Aligned {
    storage: Vec<f32>,
    start: usize,
    len: usize,
}

impl Aligned {
    pub fn zeros(len: usize) -> Self {
        let storage = vec![0.0; len + LINE];
        let start = storage.as_ptr().align_offset(LINE * size_of::<f32>());
        // `align_offset` may give up (it does not in practice): a straddling vector is slower, not wrong.
        Self { storage, start: if start < LINE { start } else { 0 }, len }
    }

    pub fn as_slice(&self) -> &[f32] {
        &self.storage[self.start..self.start + self.len]
    }

    pub fn as_mut_slice(&mut self) -> &mut [f32] {
        &mut self.storage[self.start..self.start + self.len]
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut copy = Self::zeros(self.len);
        copy.as_mut_slice().copy_from_slice(self.as_slice());
        copy
    }
}
