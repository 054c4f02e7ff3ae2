//! Where numbers stand in the device's memory, for Rust and for the kernels.
//!
//! Everything is `[block][row][quad][lane][4]`: a block is [`LANES`] worlds side by side, so that the threads of a warp read whole lines of memory, four fields
//! of their world at a time. What is read together stands together. Worlds and forces on links are `[tile][field][lane]`.
//! The constants here are also the head of every kernel's source ([`wgsl`]).

use std::fmt::Write;

/// Worlds of a block, and of a tile at most: the threads of a warp.
pub const LANES: usize = 32;
/// Fields that are read at once.
pub(crate) const QUAD: usize = 4;

/// One list of constants for both languages: names in Rust are `module::NAME`, in WGSL `MODULE_NAME`.
macro_rules! fields {
    ($($(#[$about:meta])* $module:ident { $($(#[$doc:meta])* $name:ident = $value:literal,)* })*) => {
        $($(#[$about])*
        #[allow(dead_code, reason = "some are for the kernels and their twins alone")]
        pub(crate) mod $module { $($(#[$doc])* pub const $name: usize = $value;)* })*

        const ALL: &[(&str, &str, usize)] =
            &[$($((stringify!($module), stringify!($name), $value),)*)*];
    };
}

fields! {
    /// A link. Constants first, what a broken joint keeps after them, then the state. Breaking changes no constant, so that a reset finds all of them.
    link {
        /// Axis at rest in the parent's frame (3): the joint's frame is the parent's, turned by the smallest rotation that carries z onto it.
        DIRECTION = 0,
        /// From the joint to the tip, where all children sit [m].
        LENGTH = 3,
        /// Mass [kg].
        MASS = 4,
        /// Inertia across the link about the centre of mass [kg m^2].
        ACROSS = 5,
        /// Inertia about the axis less that across [kg m^2].
        EXCESS = 6,
        /// Joint stiffness [N m/rad]; its damping is in proportion.
        STIFFNESS = 7,
        /// Square of the angle that breaks the joint [rad^2]. It and what follows is not read in every substep.
        LIMIT = 8,
        /// Of a broken joint: inertia of its sub-tree [kg m^2].
        BROKEN_INERTIA = 9,
        /// Its friction before the ramp [N m].
        FRICTION = 10,
        /// Its rate a substep ago [rad/s].
        LAST_RATE = 11,
        /// Angles [rad] (2).
        Q = 12,
        /// Rates [rad/s] (2).
        V = 14,
        /// Fields.
        FIELDS = 16,
    }
    /// What the way in leaves for the way out at a link.
    work {
        /// Inverse pivot times U, of the first joint axis: torque (3), and inverse pivot times the joint's impulse.
        G_1N = 0,
        /// Force (3), and the second joint's.
        G_1F = 4,
        /// The same of the second joint axis (3).
        G_2N = 8,
        /// Likewise (3).
        G_2F = 12,
        /// Between a way out and the next way in, for a link of a broken limb: impulse of the ground on its tip (3), and damper along the ground.
        PROP = 0,
        /// Damper along the normal, then what held the tip: the velocity at which the impulse vanishes, and its vertical velocity. The way in hands
        /// these two on as the fourth numbers of `G_2N` and `G_2F`.
        HELD = 4,
        /// Fields.
        FIELDS = 16,
    }
    /// What conjugate gradients keep of a joint, if worlds are stepped by them.
    krylov {
        /// First axis (3), and the first number of the inverse of its block of the joint-space inertia.
        FIRST = 0,
        /// Second axis (3), and the number off its diagonal.
        SECOND = 4,
        /// From the joint to the tip [m] (3), and its last number.
        ARM = 8,
        /// Velocity changes so far (2), and residual (2).
        X = 12,
        /// Direction (2), and its product with the inertia (2).
        P = 16,
        /// Of the joint.
        ARMATURE = 20,
        /// Fields.
        FIELDS = 24,
    }
    /// Motion of a link's tip, what the way in starts from at a link that hands on to no row after it: second and third axis, angular velocity,
    /// angular bias acceleration, velocity, bias acceleration, 3 each one after the other; the last two numbers are free.
    leaf {
        /// Fields.
        FIELDS = 20,
    }
    /// What a link with several children keeps for those that do not follow at once, at its tip.
    fork {
        /// Second and third axis at the start of the substep, changes of angular and linear velocity in it (3 each).
        CHANGE = 0,
        /// The new motion, as a leaf; its last two numbers are x and y of the tip.
        MOTION = 12,
        /// z of the tip.
        HEIGHT = 32,
        /// Fields.
        FIELDS = 36,
    }
    /// What children bring to their parent's tip, one after the other: angular inertia (6: columns x, y, z from the diagonal down), columns of the coupling, torque
    /// by linear motion (9), linear inertia (6), torque impulse, force impulse (3 each).
    load {
        /// Fields.
        FIELDS = 28,
    }
    /// A fruit. Constants first, then the state, and what a substep leaves for the next one.
    fruit {
        /// Mass [kg].
        MASS = 0,
        /// Radius [m].
        RADIUS = 1,
        /// Force that takes it off when pulled at directly [N].
        THRESHOLD = 2,
        /// Coefficient of air drag off the stem [N s^2/m^2].
        AIR_DRAG = 3,
        /// Stiffness of the stem [N/m].
        STIFFNESS = 4,
        /// Damping of the stem [N s/m].
        DAMPING = 5,
        /// Upward force that takes the weight off the anchor [N].
        BIAS = 6,
        /// Largest reaction on the anchor [N].
        CAP = 7,
        /// Where the stem is fixed, in the link's frame [m] (3).
        ANCHOR = 8,
        /// Height of the hang point above the anchor [m].
        DROP = 11,
        /// Applied force [N] (3).
        FORCE = 12,
        /// Frames in a row over the stem's limit in the lower, over the pull's in the next 8 bits.
        FRAMES_OVER = 15,
        /// Position [m] (3).
        P = 16,
        /// Frame in which it came off, as bits; 0 while it hangs.
        CAME_OFF = 19,
        /// Velocity [m/s] (3).
        V = 20,
        /// 1 / (mass + h drag + what the stem adds) [1/kg].
        INVERSE_MASS = 23,
        /// From the link's origin to the anchor [m] (3); off the stem the angular velocity [rad/s].
        ARM = 24,
        /// Impulse of the stem on the anchor (3).
        REACTION = 28,
        /// Mass that the fruit adds to its link at the anchor [kg].
        ADDED_MASS = 31,
        /// Impulse on the fruit with the anchor's velocity unchanged [N s] (3).
        IMPULSE = 32,
        /// Fields.
        FIELDS = 36,
    }
    /// A force on a link.
    push {
        /// Row in the tile, as bits; `u32::MAX` if there is none.
        ROW = 0,
        /// At the centre of mass [N] (3).
        FORCE = 1,
        /// About it [N m] (3).
        TORQUE = 4,
        /// Frame after which it acts, as bits.
        AFTER = 7,
        /// Last frame in which it does, as bits.
        UNTIL = 8,
        /// Fields.
        FIELDS = 9,
    }
    /// A world. Whole numbers are kept as bits.
    world {
        /// Where its trunk stands [m] (3).
        P = 0,
        /// Frame at whose end it was found non-finite; 0 while it runs.
        STOPPED = 3,
        /// What waits for the next pass, bits [`notice`].
        NOTICE = 4,
        /// Joints that broke.
        SNAPPED = 5,
        /// Fruit that came off.
        DETACHED = 6,
        /// Largest square of an angle over its limit's, of any joint and frame.
        PEAK = 7,
        /// Rows of fruit up to its last.
        FRUIT = 8,
        /// Number of links; 0 if the tile has no world in this lane.
        LINKS = 9,
        /// Not 0 if the world is to be reset.
        RESET = 10,
        /// Energy when it was last measured [J].
        ENERGY = 11,
        /// Damping of a joint over its stiffness [s].
        DAMPING_TIME = 12,
        /// Fields.
        FIELDS = 13,
    }
    /// Head of the base table, from which worlds are varied: words, the axes' entries after them, then the segments', then the fruit's.
    base {
        /// Bits [`varied`].
        FLAGS = 0,
        /// Episode of the axes that know it.
        EPISODE = 1,
        /// Number of segments.
        SEGMENTS = 2,
        /// Number of fruit.
        FRUIT = 3,
        /// Least height of a branch's underside above the ground [m].
        CLEARANCE = 4,
        /// Density of wood [kg/m^3].
        DENSITY = 5,
        /// Young's modulus of wood [Pa].
        MODULUS = 6,
        /// Rupture stress of wood [Pa].
        STRESS = 7,
        /// Least joint stiffness [N m/rad].
        STIFFNESS_MIN = 8,
        /// Largest one.
        STIFFNESS_MAX = 9,
        /// From a stem's anchor to the skin of its fruit [m].
        STEM = 10,
        /// Damping of a stem over the root of its fruit's mass [N s/m/kg^1/2].
        STEM_DAMPING = 11,
        /// Air drag of a fruit over the square of its radius [N s^2/m^4].
        AIR_DRAG = 12,
        /// Upward force that takes a fruit's weight off the anchor, over its mass [m/s^2].
        BIAS = 13,
        /// Droop of an internode that its factor acts on [rad].
        INTERNODE = 14,
        /// Fields.
        FIELDS = 16,
    }
    /// Bits of [`base::FLAGS`].
    varied {
        /// Some axis changes the form of wood.
        FORM = 1,
        /// A joint's stiffness is that of the corrected law.
        CORRECTED = 2,
        /// It is that of a branch order, which no axis changes.
        PER_LEVEL = 4,
    }
    /// The axes by their entries in the table.
    axis {
        /// Size of the whole tree.
        SCALE = 0,
        /// Thickness of all wood.
        STOCKINESS = 1,
        /// Length of each segment.
        SEGMENT_LENGTH = 2,
        /// Radius of each segment.
        SEGMENT_RADIUS = 3,
        /// Bend at the base of each segment.
        SEGMENT_BEND = 4,
        /// Droop of every limb's internodes.
        DROOP = 5,
        /// Lean of the whole tree.
        LEAN = 6,
        /// Angle between a lateral and its parent.
        FORK_SPREAD = 7,
        /// Roll from one lateral of an axis to the next.
        TWIST = 8,
        /// Density of wood.
        WOOD_DENSITY = 9,
        /// Young's modulus of wood.
        YOUNGS_MODULUS = 10,
        /// Rupture stress of wood.
        RUPTURE_STRESS = 11,
        /// Radius of fruit.
        FRUIT_SIZE = 12,
        /// Mass of fruit.
        FRUIT_MASS = 13,
        /// How many.
        COUNT = 14,
    }
    /// An axis's entry.
    dial {
        /// Key of its random streams (8 words).
        KEY = 0,
        /// Strength.
        STRENGTH = 8,
        /// Lower end of what is drawn uniformly, mean of what is drawn normally.
        LOW = 9,
        /// Upper end, or standard deviation.
        HIGH = 10,
        /// 1 if the stream's number is the episode and not the world.
        BY_EPISODE = 11,
        /// Lower end of a cut normal distribution, or of what the factor acts on.
        LEAST = 12,
        /// Upper end.
        MOST = 13,
        /// Fields.
        FIELDS = 16,
    }
    /// A segment's entry, parents first.
    segment {
        /// Row in the tile.
        ROW = 0,
        /// Its parent's entry, or `u32::MAX`.
        PARENT = 1,
        /// Number of the lateral on its axis, in the bits of [`growth`].
        GROWTH = 2,
        /// Radius as its operation has it.
        RADIUS_UNITS = 3,
        /// Heading in the world (3).
        HEADING = 4,
        /// Square of the angle that breaks its joint [rad^2].
        LIMIT = 7,
        /// Direction in the parent's frame (3), and length [m]: as a link has them.
        DIRECTION = 8,
        /// Mass, inertia across, excess and stiffness: as a link has them.
        MASS = 12,
        /// Radius [m].
        RADIUS = 16,
        /// Fields.
        FIELDS = 20,
    }
    /// Bits of [`segment::GROWTH`].
    growth {
        /// It is no part of the trunk.
        BRANCH = 0x1,
        /// It is a lateral of its parent's axis.
        LATERAL = 0x2,
        /// Shift of how many laterals the axis had before it.
        ORDINAL = 2,
    }
    /// A fruit's entry.
    hung {
        /// Row in the tile.
        ROW = 0,
        /// Its segment's entry.
        SEGMENT = 1,
        /// How far its anchor is outside the bark [m].
        OFF_BARK = 2,
        /// Unit vector across the wood to the anchor, in the segment's frame (2); zero for an anchor on the axis.
        ACROSS = 4,
        /// The same as a complex number over that of the underside (2); zero where there is no underside.
        FROM_UNDERSIDE = 6,
        /// Mass and the fields after it: as a fruit has them.
        MASS = 8,
        /// Stiffness and the fields after it.
        STIFFNESS = 12,
        /// Anchor and the field after it.
        ANCHOR = 16,
        /// Fields.
        FIELDS = 20,
    }
    /// What is kept in a link's work while a world's wood is being formed.
    form {
        /// Turn of what grows on it, as a quaternion (4: vector, scalar).
        TURN = 0,
        /// Turn that lifts it off the ground (4).
        LIFT = 4,
        /// Second and third axis of its frame (6).
        AXES = 8,
        /// Height of its tip [m].
        Z_TIP = 14,
        /// Radius [m].
        RADIUS = 15,
    }
    /// Bits of [`world::NOTICE`].
    notice {
        /// An input or a break has changed what the way in starts from.
        STALE = 1,
        /// A joint has been over its limit for long enough.
        SNAPS = 2,
        /// A stem has.
        DETACHES = 4,
        /// A number is not finite.
        NON_FINITE = 8,
    }
    /// Where a tile stands in the buffers: whole numbers, by tile. Tiles of one block differ in nothing but the rows of their parts; each has its worlds in other lanes.
    tile {
        /// First row of links.
        ROWS = 0,
        /// First row of fruit.
        FRUIT = 1,
        /// First quad of the rows' work in the work buffer.
        WORK = 2,
        /// The same of leaves.
        LEAVES = 3,
        /// Of the warps' own slots; forks and loads share them.
        SLOTS = 4,
        /// Slots a warp has.
        SLOTS_EACH = 5,
        /// Of forks that other warps read.
        CROSS_FORKS = 6,
        /// Of loads that other warps bring.
        CROSS_LOADS = 7,
        /// First quad of the links in their buffer; what conjugate gradients keep of the rows follows them.
        LINKS = 8,
        /// First row of each part, from the trunk's on; the last one is the number of rows (20).
        STARTS = 9,
        /// Fields.
        FIELDS = 29,
    }
    /// Bits of the first word of an operation: whose child a link is, and what it keeps.
    first {
        /// There is a link in this lane.
        ACTIVE = 0x1,
        /// It stands on the ground.
        ROOT = 0x2,
        /// Its parent left its motion in a slot of this warp.
        FROM_SLOT = 0x4,
        /// Its parent left it for all warps.
        FROM_CROSS = 0x8,
        /// It leaves its own in a slot.
        TO_SLOT = 0x10,
        /// It leaves it for other warps.
        TO_CROSS = 0x20,
        /// Shift of its parent's slot or fork (8 bits).
        PARENT = 8,
        /// Shift of its own slot (8 bits).
        SLOT = 16,
        /// Shift of its own fork for other warps (8 bits).
        FORK = 24,
    }
    /// Bits of the second word: what children bring.
    second {
        /// The next row is a child, whose numbers are still at hand.
        CARRIES = 0x1,
        /// Children of this warp have brought something to its slot.
        TAKES = 0x2,
        /// It is the first to bring something to its parent's slot.
        GIVES_FIRST = 0x4,
        /// It adds to what is there.
        GIVES = 0x8,
        /// It brings it to a parent of another warp.
        GIVES_CROSS = 0x10,
        /// Number of loads from other warps (6 bits).
        LOADS = 5,
        /// Shift of the first of them (10 bits).
        FIRST_LOAD = 11,
        /// Shift of the place that it brings its own to (10 bits).
        OWN_LOAD = 21,
    }
    /// Bits of the third word: fruit and leaf.
    third {
        /// Shift of the number of leaves in the rows before, which is its own if it is one (10 bits). Rows that a world does not have count all.
        LEAF = 0,
        /// Shift of the first row of fruit (12 bits).
        FIRST_FRUIT = 10,
        /// Shift of the number of fruit (6 bits).
        FRUIT = 22,
    }
    /// Bits of the fourth word.
    fourth {
        /// A force is applied to the link.
        PUSHED = 0x1,
        /// Shift of the link's radius in hundredths of a millimetre (15 bits), with which a broken limb meets the ground.
        RADIUS = 1,
        /// These bits.
        RADIUS_BITS = 0x7fff,
        /// Shift of the parent's row (16 bits).
        PARENT_ROW = 16,
    }
    /// Bits of a link's state, by row and lane.
    state {
        /// Frames in a row over the limit (8 bits).
        FRAMES_OVER = 0xff,
        /// The joint is broken.
        BROKEN = 0x100,
        /// The link hangs from a broken joint.
        DEBRIS = 0x200,
        /// It belongs to the limb that is breaking off.
        BREAKING = 0x400,
        /// Shift of the frame in which the joint broke (21 bits: nine hours at 60 Hz).
        BROKE = 11,
    }
}

/// Units of a radius in an operation [1/m].
pub(crate) const RADIUS_UNITS: f32 = 1e5;

/// What stands where there is no limit: an infinity is refused in a kernel's source.
pub(crate) const UNBOUNDED: f32 = 1e30;

/// The same constants for a kernel.
pub(crate) fn wgsl() -> String {
    let mut text = format!(
        "const LANES: u32 = {LANES}u;\nconst UNBOUNDED: f32 = {UNBOUNDED:e};\nconst QUAD: u32 = {QUAD}u;\nconst RADIUS_UNITS: f32 = {RADIUS_UNITS:e};\n"
    );
    for (module, name, value) in ALL {
        // Writing to a string never fails.
        let _ = writeln!(text, "const {}_{name}: u32 = {value}u;", module.to_uppercase());
    }
    text
}
