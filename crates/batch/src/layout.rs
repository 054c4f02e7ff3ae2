//! Memory layout of a tile's numbers: `[row][field][lane]`.

/// Numbers of a link, h the substep. Constants of a world first (those after `LINEAR_DRAG` change with breaking), then
/// the state.
pub(crate) mod link {
    /// The link's axis at rest, in its parent's frame (3): the joint frame is the parent's, turned by the smallest
    /// rotation that carries z onto it.
    pub const DIRECTION: usize = 0;
    /// 1 / (1 + z of that).
    pub const FOLD: usize = 3;
    /// From the joint to the tip, where all children sit \[m\].
    pub const LENGTH: usize = 4;
    /// h times the mass [kg s].
    pub const H_MASS: usize = 5;
    /// h times the inertia across the link about the centre of mass [kg m^2 s].
    pub const H_ACROSS: usize = 6;
    /// h times the inertia about the link's axis less that across it [kg m^2 s].
    pub const H_EXCESS: usize = 7;
    /// Drag of translation [1/s].
    pub const LINEAR_DRAG: usize = 8;
    /// Drag of rotation [1/s].
    pub const ANGULAR_DRAG: usize = 9;
    /// Half the mass, drag included \[kg\], placed at each end of the link.
    pub const HALF_MASS: usize = 10;
    /// Rest of the inertia across that the two half masses leave, drag included [kg m^2].
    pub const ACROSS: usize = 11;
    /// Rest of the inertia about the axis, less `ACROSS`, over the length squared \[kg\].
    pub const ALONG: usize = 12;
    /// h (d + h k) of the joint [kg m^2].
    pub const ARMATURE: usize = 13;
    /// h k of the joint [N m s].
    pub const H_STIFFNESS: usize = 14;
    /// Factor of the joint's rate in its impulse [kg m^2]: `ARMATURE`, or h d alone where the springs lead
    /// (`orchard_treephys::TreeBody::lead_springs`).
    pub const H_DAMPING: usize = 15;
    /// Joint angles \[rad\] (2).
    pub const Q: usize = 16;
    /// Joint rates [rad/s] (2).
    pub const V: usize = 18;
    /// Fields.
    pub const FIELDS: usize = 20;
}

/// Intermediate numbers of a link between the passes.
pub(crate) mod work {
    /// First and second joint axis (3 each).
    pub const AXES: usize = 0;
    /// From the link's origin to its tip (3).
    pub const D: usize = 6;
    /// Impulse on the link at its origin with the sign turned: torque, force (6). The factor takes its place.
    pub const RESISTANCE: usize = 9;
    /// Change of the velocity of the link's tip in the latest substep: turn, shift (6); kept from `advance` to `outward` where fruit hang on stems that bend.
    pub const CHANGE: usize = 9;
    /// U L^-T of both axes, torque and force each (12), with the pivot S^T U = L L^T.
    pub const G: usize = 9;
    /// L^-1 y (2).
    pub const Y: usize = 21;
    /// Inverse diagonal of L (2).
    pub const SCALE: usize = 23;
    /// Share of a change of the second axis that is taken off the first.
    pub const SHARE: usize = 25;
    /// Fields.
    pub const FIELDS: usize = 26;
}

/// Numbers of a fruit, h the substep. Constants first, then what detachment changes, then the state.
pub(crate) mod fruit {
    /// Mass \[kg\].
    pub const MASS: usize = 0;
    /// h times the weight [N s]; 0 on a padding row.
    pub const H_WEIGHT: usize = 1;
    /// Anchor of the stem in the link's frame \[m\] (3).
    pub const ANCHOR: usize = 2;
    /// Height of the hang point above the anchor \[m\].
    pub const DROP: usize = 5;
    /// h times the largest reaction on the anchor [N s].
    pub const H_CAP: usize = 6;
    /// h k of the stem [N s/m]; 0 off the stem.
    pub const H_STIFFNESS: usize = 7;
    /// Inertia that the stem adds to the fruit, h (c + h k) \[kg\]; 0 off the stem.
    pub const KAPPA: usize = 8;
    /// h times the upward force that takes the weight off the anchor [N s]; 0 off the stem.
    pub const H_BIAS: usize = 9;
    /// Coefficient of air drag [N s^2/m^2]; 0 on the stem.
    pub const AIR_DRAG: usize = 10;
    /// Applied force \[N\] (3).
    pub const FORCE: usize = 11;
    /// Position \[m\] (3).
    pub const P: usize = 14;
    /// Velocity [m/s] (3).
    pub const V: usize = 17;
    /// Fields.
    pub const FIELDS: usize = 20;
}

/// Intermediate numbers of a fruit between the passes.
pub(crate) mod fruit_work {
    /// Mass that the fruit adds to its link at the anchor \[kg\].
    pub const ADDED_MASS: usize = 0;
    /// 1 / (mass + h drag + kappa) [1/kg]; on stems that bend, valid in tiles with loose fruit.
    pub const INVERSE_MASS: usize = 1;
    /// From the link's tip to the anchor \[m\] (3).
    pub const R_TIP: usize = 2;
    /// Impulse on the fruit with the anchor's velocity unchanged [N s] (3).
    pub const IMPULSE: usize = 5;
    /// Stretch of the stem spring \[m\] (3); not kept on stems that bend.
    pub const STRETCH: usize = 8;
    /// Fields.
    pub const FIELDS: usize = 11;
}

/// Numbers of a stem that bends, h the substep; worlds with fruit on tethers have none. First those that every substep reads, pass by
/// pass, then those of loads that count as wear. Symbols are those of `docs/computation/batch.md`, Stems; an excess is what counts along the stem beyond what counts across it.
pub(crate) mod stem {
    /// Direction at rest in the link's axes (3).
    pub const REST: usize = 0;
    /// L, from the joint to the centre of the fruit \[m\].
    pub const LENGTH: usize = 3;
    /// J, the rotational inertia of the fruit [kg m^2].
    pub const INERTIA: usize = 4;
    /// h times the bending stiffness [N m s].
    pub const H_BENDING: usize = 5;
    /// h times the twisting stiffness [N m s].
    pub const H_TWISTING: usize = 6;
    /// a of bending, and excess of that of twist [kg m^2].
    pub const ARMATURE: usize = 7;
    pub const ARMATURE_EXCESS: usize = 8;
    /// 1 over the mass and what the tether adds to it [1/kg].
    pub const INVERSE_MASS: usize = 9;
    /// 1 / (P + a_b), and the excess of 1 / (J + a_t) [1/(kg m^2)].
    pub const INVERSE: usize = 10;
    pub const INVERSE_EXCESS: usize = 11;
    /// mu L [kg m].
    pub const LEVER: usize = 12;
    /// The stretch along the stem, and the twist, at which the load may count as wear, inverted [1/m, 1/rad]: as if the whole tension acted on what bears it
    /// least. 0 off the stem.
    pub const ALERT_STRETCH: usize = 13;
    pub const ALERT_TWIST: usize = 14;
    /// Rotation from the rest, in the link's axes (4: vector, scalar).
    pub const Q: usize = 15;
    /// Rate of the stem, in the link's axes [rad/s] (3).
    pub const V: usize = 19;
    /// Inertia that the stem adds to its link: a point mass \[kg\] at a distance along the stem \[m\], mass along the stem alone \[kg\], and what is left of the rotational inertia, across
    /// the stem and its excess [kg m^2].
    pub const MASS: usize = 22;
    pub const REACH: usize = 23;
    pub const MASS_ALONG: usize = 24;
    pub const ACROSS: usize = 25;
    pub const EXCESS: usize = 26;
    /// Stiffness along the stem [N/m]; 0 off the stem.
    pub const STIFFNESS: usize = 27;
    /// Twisting stiffness [N m/rad].
    pub const TWISTING: usize = 28;
    /// 1 over the strength against a pull along the zone's axis [1/N].
    pub const PER_PULL: usize = 29;
    /// 1 over the strength against a pull across it [1/N].
    pub const PER_BEND: usize = 30;
    /// 1 over the strength against twist [1/(N m)].
    pub const PER_TWIST: usize = 31;
    /// 1 over the strength of the spur [1/N].
    pub const PER_SPUR: usize = 32;
    /// Square of the load over the strength from which wear is counted; infinite off the stem.
    pub const LEAST_LOAD: usize = 33;
    /// Fields.
    pub const FIELDS: usize = 34;
}

/// Intermediate numbers of a stem between the passes.
pub(crate) mod stem_work {
    /// Direction of the stem, world (3).
    pub const DIRECTION: usize = 0;
    /// Change of its rate if the link's velocity stays unchanged [rad/s] (3).
    pub const Y: usize = 3;
    /// Square of the larger load over its strength, of zone and spur, less `stem::LEAST_LOAD`; where no world of the tile may be over it, some negative number.
    pub const OVER: usize = 6;
    /// Loads on the zone, valid where `OVER` is positive in any world: tension, its parts along and across the zone's axis \[N\], and torque about the stem [N m].
    pub const LOAD: usize = 7;
    /// Fields.
    pub const FIELDS: usize = 11;
}

/// Air at a link, h the substep; worlds in still air have none.
pub(crate) mod air {
    /// Half air density times drag coefficient times area, of the wood across the air and of the leaves [kg/m]; 0 on debris.
    pub const WOOD: usize = 0;
    pub const LEAVES: usize = 1;
    /// `link::LINEAR_DRAG`, `link::ACROSS` and `link::ALONG` in still air.
    pub const STILL: usize = 2;
    pub const ACROSS: usize = 3;
    pub const ALONG: usize = 4;
    /// 1 over `link::H_MASS`.
    pub const PER_H_MASS: usize = 5;
    /// h times the force in this frame [N s] (3).
    pub const H_FORCE: usize = 6;
    /// Fields.
    pub const FIELDS: usize = 9;
}

/// Air at a fruit; worlds in still air have none.
pub(crate) mod ball {
    /// Half air density times drag coefficient times area [kg/m]; 0 off the stem.
    pub const DRAG: usize = 0;
    /// Applied force without the wind's \[N\] (3).
    pub const PULL: usize = 1;
    /// Fields.
    pub const FIELDS: usize = 4;
}

/// Limits of a stem; infinite off the stem.
pub(crate) mod limit {
    /// Square of the stretch that detaches [m^2].
    pub const STRETCH: usize = 0;
    /// Square of the direct pull that detaches [N^2].
    pub const PULL: usize = 1;
    /// Fields.
    pub const FIELDS: usize = 2;
}

/// Motion that a link passes to its children, at the link's tip.
pub(crate) mod tip {
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

/// Velocity change of a link's tip in a substep.
pub(crate) mod change {
    /// Of the angular velocity (3).
    pub const TURN: usize = 0;
    /// Of the velocity (3).
    pub const SHIFT: usize = 3;
    /// Fields.
    pub const FIELDS: usize = 6;
}

/// Inertia and wrench that children pass to their parent, at its tip.
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

/// Motion of a link's tip, kept only in tiles with debris.
pub(crate) mod tip_motion {
    /// Height \[m\].
    pub const Z: usize = 0;
    /// Velocity [m/s] (3).
    pub const V: usize = 1;
    /// Change of the vertical velocity in the latest substep, before the link turned [m/s].
    pub const LIFT: usize = 4;
    /// Fields.
    pub const FIELDS: usize = 5;
}

/// Contact of a link's tip with the ground, kept only in tiles with debris.
pub(crate) mod prop {
    /// Damper along the ground, times h \[kg\].
    pub const ACROSS: usize = 0;
    /// Damper along the normal, times h \[kg\].
    pub const NORMAL: usize = 1;
    /// Impulse at the tip's present velocity [N s] (3).
    pub const IMPULSE: usize = 2;
    /// Fields.
    pub const FIELDS: usize = 5;
}

/// Floats of a cache line, and of the widest vector.
pub(crate) const LINE: usize = 16;

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
