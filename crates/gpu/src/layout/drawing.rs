//! Fields of the base table, from which worlds are drawn ([`crate::table`]).

fields! {
    /// Head of the base table, from which worlds are drawn. The entries of the axes follow it, then those of the segments, then those of the fruit.
    base {
        /// Bits [`varied`].
        FLAGS = 0,
        /// Episode, for the axes whose draws belong to an episode.
        EPISODE = 1,
        /// Number of segments.
        SEGMENTS = 2,
        /// Number of fruit.
        FRUIT = 3,
        /// Smallest height of a branch's underside above the ground [m].
        CLEARANCE = 4,
        /// Density of wood [kg/m^3].
        DENSITY = 5,
        /// Young's modulus of wood [Pa].
        MODULUS = 6,
        /// Rupture stress of wood [Pa].
        STRESS = 7,
        /// Smallest joint stiffness [N m/rad].
        STIFFNESS_MIN = 8,
        /// Largest joint stiffness [N m/rad].
        STIFFNESS_MAX = 9,
        /// Length of a stem, from its anchor to the skin of the fruit [m].
        STEM = 10,
        /// Damping of a stem over the root of its fruit's mass [N s/m/kg^1/2].
        STEM_DAMPING = 11,
        /// Air drag of a fruit over the square of its radius [N s^2/m^4].
        AIR_DRAG = 12,
        /// Upward force that compensates a fruit's weight on the anchor, over its mass [m/s^2].
        BIAS = 13,
        /// Droop of an internode, on which the factor acts [rad].
        INTERNODE = 14,
        /// Number of fields.
        FIELDS = 16,
    }
    /// Bits of [`base::FLAGS`].
    varied {
        /// Some axis changes the form of the wood.
        FORM = 1,
        /// Joint stiffness follows the corrected law.
        CORRECTED = 2,
        /// Joint stiffness belongs to the branch order, and no axis changes it.
        PER_LEVEL = 4,
    }
    /// Numbers of the axes in the table.
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
        /// Number of axes.
        COUNT = 14,
    }
    /// Entry of an axis.
    dial {
        /// Key of its random streams (8 words).
        KEY = 0,
        /// Strength.
        STRENGTH = 8,
        /// Lower end of a uniform distribution, mean of a normal one.
        LOW = 9,
        /// Upper end of a uniform distribution, standard deviation of a normal one.
        HIGH = 10,
        /// 1 if the number of the stream is the episode and not the world.
        BY_EPISODE = 11,
        /// Lower end of a truncated normal distribution, or lower limit of the result.
        LEAST = 12,
        /// Upper end or limit.
        MOST = 13,
        /// Number of fields.
        FIELDS = 16,
    }
    /// Entry of a segment; parents come first.
    segment {
        /// Row in the tile.
        ROW = 0,
        /// Entry of its parent, or `u32::MAX`.
        PARENT = 1,
        /// Place on the tree, bits [`growth`].
        GROWTH = 2,
        /// Radius in the units of its operation.
        RADIUS_UNITS = 3,
        /// Heading in world coordinates (3).
        HEADING = 4,
        /// Square of the angle that breaks its joint [rad^2].
        LIMIT = 7,
        /// Direction in the parent's frame (3), and length [m], as in a link.
        DIRECTION = 8,
        /// Mass, inertia across, excess and stiffness, as in a link.
        MASS = 12,
        /// Radius [m].
        RADIUS = 16,
        /// Number of fields.
        FIELDS = 20,
    }
    /// Bits of [`segment::GROWTH`].
    growth {
        /// The segment does not belong to the trunk.
        BRANCH = 0x1,
        /// The segment is a lateral of its parent's axis.
        LATERAL = 0x2,
        /// Shift of the number of laterals before it on that axis.
        ORDINAL = 2,
    }
    /// Entry of a fruit.
    fruit_entry {
        /// Row in the tile.
        ROW = 0,
        /// Entry of its segment.
        SEGMENT = 1,
        /// Distance of its anchor from the bark, outwards [m].
        OFF_BARK = 2,
        /// Unit vector across the wood to the anchor, in the segment's frame (2); zero for an anchor on the axis.
        ACROSS = 4,
        /// That vector over the one to the underside, as complex numbers (2); zero where there is no underside.
        FROM_UNDERSIDE = 6,
        /// Mass and the fields after it, as in a fruit.
        MASS = 8,
        /// Stiffness and the fields after it, as in a fruit.
        STIFFNESS = 12,
        /// Anchor and the field after it, as in a fruit.
        ANCHOR = 16,
        /// Number of fields.
        FIELDS = 20,
    }
    /// Numbers in a link's work while the wood of a world is being drawn.
    form {
        /// Rotation of everything that grows on it, as a quaternion (4: vector, scalar).
        TURN = 0,
        /// Rotation that lifts it off the ground (4).
        LIFT = 4,
        /// Second and third axis of its frame (6).
        AXES = 8,
        /// Height of its tip [m].
        Z_TIP = 14,
        /// Radius [m].
        RADIUS = 15,
    }
}
