//! Fields of worlds that are stepped.

fields! {
    /// A link: constants, then the numbers of a broken joint, then the state. Breaking changes no constant, so that a reset finds all of them.
    link {
        /// Axis at rest in the parent's frame (3): the joint's frame is the parent's, turned by the smallest rotation that carries z onto it.
        DIRECTION = 0,
        /// Distance from the joint to the tip, where all children are fixed [m].
        LENGTH = 3,
        /// Mass [kg].
        MASS = 4,
        /// Inertia across the link about the centre of mass [kg m^2].
        ACROSS = 5,
        /// Inertia about the axis less that across [kg m^2].
        EXCESS = 6,
        /// Joint stiffness [N m/rad]; its damping is in proportion, by the world's time or by the joint's own ([`damper`]).
        STIFFNESS = 7,
        /// Square of the angle that breaks the joint [rad^2]. This and the next three fields are not read in every substep.
        LIMIT = 8,
        /// Broken joint: inertia of its sub-tree [kg m^2].
        BROKEN_INERTIA = 9,
        /// Broken joint: friction before the ramp [N m].
        FRICTION = 10,
        /// Broken joint: rate a substep ago [rad/s].
        LAST_RATE = 11,
        /// In lanes, where no joint breaks on the device, in the place of [`Self::LAST_RATE`]: bending over its limit at the start of the episode.
        START = 11,
        /// Angles [rad] (2).
        Q = 12,
        /// Rates [rad/s] (2).
        V = 14,
        /// Number of fields.
        FIELDS = 16,
    }
    /// Numbers that the inward pass stores at a link for the outward pass.
    work {
        /// First joint axis: torque part of D^-1 U (3), and the first number of D^-1 y; D is the joint's pivot and y the impulse on it.
        G_1N = 0,
        /// First joint axis: force part of D^-1 U (3), and the second number of D^-1 y.
        G_1F = 4,
        /// Second joint axis: torque part of D^-1 U (3).
        G_2N = 8,
        /// Second joint axis: force part of D^-1 U (3).
        G_2F = 12,
        /// Between an outward pass and the next inward pass, for a link of a broken limb: impulse of the ground on its tip (3), and damper along the ground.
        PROP = 0,
        /// Damper along the normal, then the contact that held the tip: the velocity at which the impulse vanishes, and the tip's vertical velocity. The inward pass
        /// copies these two to the fourth numbers of `G_2N` and `G_2F`.
        HELD = 4,
        /// Number of fields.
        FIELDS = 16,
    }
    /// The own damper of a joint, in worlds whose dampers hold damping ratios ([`crate::laws`]).
    damper {
        /// Damping over stiffness [s].
        TIME = 0,
        /// Number of fields.
        FIELDS = 4,
    }
    /// Numbers of a joint for conjugate gradients.
    krylov {
        /// First axis (3), and the first diagonal number of the inverse of the joint's own block of the joint-space inertia.
        FIRST = 0,
        /// Second axis (3), and the off-diagonal number of that inverse.
        SECOND = 4,
        /// Vector from the joint to the tip [m] (3), and the second diagonal number.
        ARM = 8,
        /// Velocity changes so far (2), and residual (2).
        X = 12,
        /// Search direction (2), and its product with the inertia (2).
        P = 16,
        /// Armature of the joint.
        ARMATURE = 20,
        /// Number of fields.
        FIELDS = 24,
    }
    /// Motion of a link's tip, from which the inward pass starts at a link without a child in the next row: second and third axis, angular velocity,
    /// angular bias acceleration, velocity, bias acceleration (3 each, in this order); the last two numbers are free.
    leaf {
        /// Number of fields.
        FIELDS = 20,
    }
    /// Numbers at the tip of a link with several children, for the children that do not follow in the next row.
    fork {
        /// Second and third axis at the start of the substep, changes of angular and linear velocity in it (3 each).
        CHANGE = 0,
        /// The new motion, as in a leaf; its last two numbers are x and y of the tip.
        MOTION = 12,
        /// z of the tip.
        HEIGHT = 32,
        /// Number of fields.
        FIELDS = 36,
    }
    /// Load of a child on its parent's tip, in this order: angular inertia (6: columns x, y, z from the diagonal down), columns of the coupling, torque
    /// by linear motion (9), linear inertia (6), torque impulse, force impulse (3 each).
    load {
        /// Number of fields.
        FIELDS = 28,
    }
    /// A fruit: constants, then the state, then the numbers that a substep stores for the next one.
    fruit {
        /// Mass [kg].
        MASS = 0,
        /// Radius [m].
        RADIUS = 1,
        /// Direct pull that detaches it [N].
        THRESHOLD = 2,
        /// Coefficient of air drag of a loose fruit [N s^2/m^2].
        AIR_DRAG = 3,
        /// Stiffness of the stem [N/m].
        STIFFNESS = 4,
        /// Damping of the stem [N s/m].
        DAMPING = 5,
        /// Upward force that compensates the weight on the anchor [N].
        BIAS = 6,
        /// Largest reaction on the anchor [N].
        CAP = 7,
        /// Position of the stem's anchor in the link's frame [m] (3).
        ANCHOR = 8,
        /// Height of the hang point above the anchor [m].
        DROP = 11,
        /// Applied force [N] (3).
        FORCE = 12,
        /// Number of successive frames over the limit of stem tension in the lower 8 bits, over that of the direct pull in the next 8 bits.
        FRAMES_OVER = 15,
        /// Position [m] (3).
        P = 16,
        /// Frame in which it came off, as bits; 0 while it hangs, and for one that came off before the world came here. In worlds with a robot: 0 for one that the robot meets, on its stem or in the hand.
        CAME_OFF = 19,
        /// Velocity [m/s] (3).
        V = 20,
        /// 1 / (mass + h drag + what the stem adds) [1/kg].
        INVERSE_MASS = 23,
        /// Vector from the link's origin to the anchor [m] (3); for a loose fruit its angular velocity [rad/s].
        ARM = 24,
        /// Impulse of the stem on the anchor (3).
        REACTION = 28,
        /// Mass that the fruit adds to its link at the anchor [kg].
        ADDED_MASS = 31,
        /// Impulse on the fruit with the anchor's velocity unchanged [N s] (3).
        IMPULSE = 32,
        /// Number of fields; worlds with stems or wind have more ([`rod`], [`pull`]).
        FIELDS = 36,
    }
    /// A fruit on a stem that bends, in worlds that have such stems ([`crate::laws`]): its row begins as that of a [`fruit`], and has other numbers in the places of
    /// a tether's. `DROP` is minus the length from the joint to the centre of the fruit.
    rod {
        /// Damping of bending [N m s/rad], in the place of the tether's bias.
        BENDING_DAMPING = 6,
        /// Damping of twist [N m s/rad], in the place of the tether's cap.
        TWISTING_DAMPING = 7,
        /// Kind of release, as bits: 0 while it holds, then 1 for a pull, 2 for a bend, 3 for a twist, 4 for the spur. In the place of the frames over a limit.
        RELEASE = 15,
        /// Place of a point mass that the link bears, from its joint [m] (3); for a loose fruit its angular velocity.
        ARM = 24,
        /// That mass [kg]; 0 for a loose fruit.
        BORNE_MASS = 27,
        /// Force impulse on the link (3).
        FORCE_IMPULSE = 28,
        /// Mass there that resists along the stem alone [kg].
        MASS_ALONG = 31,
        /// 1 over the strength of the spur [1/N].
        PER_SPUR = 35,
        /// Direction of the stem (3).
        DIRECTION = 36,
        /// Rotational inertia about the stem that the link bears, less that across it [kg m^2].
        EXCESS = 39,
        /// Torque impulse on the link about its joint (3).
        TORQUE_IMPULSE = 40,
        /// Rotational inertia across the stem that the link bears [kg m^2].
        ACROSS = 43,
        /// Change of the rod's rate if the link's velocity stays unchanged [rad/s] (3).
        Y = 44,
        /// 1 over the strength against twist [1/(N m)].
        PER_TWIST = 47,
        /// Rotation from the rest, in the link's axes (4: vector, scalar).
        Q = 48,
        /// Rate of the stem, in the link's axes [rad/s] (3).
        RATE = 52,
        /// Share of the zone's life that has passed.
        ZONE_WEAR = 55,
        /// Direction at rest, in the link's axes (3).
        REST = 56,
        /// Share of the spur's life that has passed.
        SPUR_WEAR = 59,
        /// Number of fields.
        FIELDS = 60,
    }
    /// Behind the other fields of a fruit's row, in worlds with wind: force that is applied besides the wind's [N] (3). [`fruit::FORCE`] is the sum there.
    pull {
        /// Place whose air the fruit feels, as bits.
        PLACE = 3,
        /// Velocity of the air at that place at the end of the coming frame [m/s] (3, and a free number); set in batches of [`crate::laws::Laws::press_aside`].
        AIR = 4,
        /// Number of fields.
        FIELDS = 8,
    }
    /// Air at a link, in worlds with wind.
    air {
        /// Force of the wind on it in this frame, as an impulse over a substep [N s] (3). From the last outward pass of a frame to its end: velocity of its centre of mass [m/s] (3), with its axis in
        /// [`work::G_2N`].
        IMPULSE = 0,
        /// Drag of translation then [1/s].
        DRAG = 3,
        /// Half air density times drag coefficient times area of its wood across the wind [kg/m].
        WOOD = 4,
        /// Half air density times drag coefficient times area of its leaves [kg/m].
        LEAVES = 5,
        /// 1 over the mass of the link [1/kg].
        PER_MASS = 6,
        /// Place of the link, as bits.
        PLACE = 7,
        /// Number of fields.
        FIELDS = 8,
    }
    /// A wave of a world's gusts, in worlds with wind: `C cos t + S sin t` with `t` the phase at a place and time. Behind it are cosine and sine of its phase in
    /// frame 0 at all places, four of the former and then four of the latter; behind all waves the shares of the mean speed at the places, and behind these the velocities of the air there at the ends of three frames in
    /// turn [m/s] (3, and a free number).
    wave {
        /// C [m/s] (3).
        COSINE = 0,
        /// Turns back per frame, times 2^32, as a whole number.
        BACK = 3,
        /// S [m/s] (3).
        SINE = 4,
        /// Number of fields.
        FIELDS = 8,
        /// Number of waves that are read at once.
        AT_ONCE = 4,
    }
    /// An external force on a link.
    push {
        /// Row in the tile, as bits; `u32::MAX` if there is none.
        ROW = 0,
        /// Force at the centre of mass [N] (3).
        FORCE = 1,
        /// Torque about the centre of mass [N m] (3).
        TORQUE = 4,
        /// Frame after which it acts, as bits.
        AFTER = 7,
        /// Last frame in which it acts, as bits.
        UNTIL = 8,
        /// Number of fields.
        FIELDS = 9,
    }
    /// A world. Whole numbers are kept as bits.
    world {
        /// Position of its trunk's base in the world [m] (3).
        P = 0,
        /// Frame at whose end it was found to be non-finite; 0 while it runs; [`Self::HELD`] while it stands in its lane until it is given frames to take.
        STOPPED = 3,
        /// Work for the next pass, bits [`notice`].
        NOTICE = 4,
        /// Number of joints that broke.
        SNAPPED = 5,
        /// Number of fruit that came off.
        DETACHED = 6,
        /// Largest square of an angle over that of its limit, of any joint and frame.
        PEAK = 7,
        /// Number of rows of fruit up to its last one.
        FRUIT = 8,
        /// Number of links; 0 if the tile has no world in this lane.
        LINKS = 9,
        /// Not 0 if the world is to be reset.
        RESET = 10,
        /// Energy when it was last measured [J].
        ENERGY = 11,
        /// Damping of a joint over its stiffness, where all joints have the same [s].
        DAMPING_TIME = 12,
        /// Frame before the first one of its wind, as bits; it may be negative.
        BEGAN = 13,
        /// In worlds with a robot, of the latest frame: largest bending of a joint over its limit, less what it was at the start; 0 where no joint bends more than then.
        EXCESS = 14,
        /// In worlds with a robot, of the latest frame: largest tension of a stem [N].
        TENSION = 15,
        /// In worlds with a robot: [`Self::PEAK`] when the host was last told of it.
        TOLD_PEAK = 16,
        /// In lanes: frames taken of those that it was given last.
        TAKEN = 17,
        /// In lanes: not 0 once something has happened in them.
        STIRRED = 18,
        /// In lanes: frames of the batch in which the world stood still. Its own frames count from them.
        MISSED = 19,
        /// Number of fields.
        FIELDS = 20,
        /// A value of [`Self::STOPPED`].
        HELD = 0xffff_ffff,
    }
    /// Bits of [`world::NOTICE`].
    notice {
        /// An input or an event has changed the numbers from which the inward pass starts.
        STALE = 1,
        /// A joint has been over its limit for enough frames.
        SNAPS = 2,
        /// A stem has been over its limit for enough frames.
        DETACHES = 4,
        /// A number is not finite.
        NON_FINITE = 8,
        /// In worlds with a robot: a joint or a stem is at its limit, or nearly so; a stem wears; or a link turns fast.
        STRAINED = 16,
        /// In worlds with a robot: [`world::PEAK`] has risen above [`world::TOLD_PEAK`].
        PEAKED = 32,
    }
    /// Header of a tile: its places in the buffers, in whole numbers. Tiles of one block differ only in the rows of their parts; each has its worlds in other lanes.
    tile {
        /// First row of links.
        ROWS = 0,
        /// First row of fruit.
        FRUIT = 1,
        /// First quad of the rows' work in the work buffer.
        WORK = 2,
        /// First quad of the leaves in the work buffer.
        LEAVES = 3,
        /// First quad of the slots of the warps; forks and loads share them.
        SLOTS = 4,
        /// Number of slots of a warp.
        SLOTS_EACH = 5,
        /// First quad of the forks that other warps read.
        CROSS_FORKS = 6,
        /// First quad of the loads that other warps store.
        CROSS_LOADS = 7,
        /// First quad of the links in their buffer. Where there are any, dampers of joints ([`damper`]), the air at links ([`air`]), waves of gusts ([`wave`]) and the
        /// numbers of conjugate gradients ([`krylov`]) follow them.
        LINKS = 8,
        /// First row of each part, from the trunk's on; the last number is that of all rows (20).
        STARTS = 9,
        /// First quad of what contacts with a robot need of the links ([`touch`]) in the work buffer, in worlds that have one.
        TOUCHES = 29,
        /// Number of rows of each part that its worlds use, from the trunk's on (19); there may be room for more.
        LENGTHS = 30,
        /// Number of fields.
        FIELDS = 49,
    }
    /// Bits of the first word of an operation: the parent of a link, and the places where its tip is stored.
    first {
        /// The world has a link in this row.
        ACTIVE = 0x1,
        /// The link stands on the ground.
        ROOT = 0x2,
        /// The tip of its parent is in a slot of this warp.
        FROM_SLOT = 0x4,
        /// The tip of its parent is in a fork for all warps.
        FROM_CROSS = 0x8,
        /// The link stores its tip in a slot.
        TO_SLOT = 0x10,
        /// The link stores its tip in a fork for other warps.
        TO_CROSS = 0x20,
        /// Shift of its parent's slot or fork (8 bits).
        PARENT = 8,
        /// Shift of its own slot (8 bits).
        SLOT = 16,
        /// Shift of its own fork for other warps (8 bits).
        FORK = 24,
    }
    /// Bits of the second word: the loads of children.
    second {
        /// The next row is a child, whose numbers are still in registers.
        CARRIES = 0x1,
        /// Children of this warp have stored a load in its slot.
        TAKES = 0x2,
        /// The link is the first to store its load in its parent's slot.
        GIVES_FIRST = 0x4,
        /// The link adds its load to the one in its parent's slot.
        GIVES = 0x8,
        /// The link stores its load for a parent of another warp.
        GIVES_CROSS = 0x10,
        /// Shift of the number of loads from other warps (6 bits).
        LOADS = 5,
        /// Shift of the first of them (10 bits).
        FIRST_LOAD = 11,
        /// Shift of the place where it stores its own load (10 bits).
        OWN_LOAD = 21,
    }
    /// Bits of the third word: fruit and leaf.
    third {
        /// Shift of the number of leaves in the rows before, which is its own number if it is a leaf (10 bits). In rows that a world does not have it counts all leaves.
        LEAF = 0,
        /// Shift of the first row of fruit (12 bits).
        FIRST_FRUIT = 10,
        /// Shift of the number of fruit (6 bits).
        FRUIT = 22,
    }
    /// Bits of the fourth word.
    fourth {
        /// An external force may act on the link.
        PUSHED = 0x1,
        /// Shift of the link's radius in hundredths of a millimetre (15 bits), for the contact of a broken limb with the ground.
        RADIUS = 1,
        /// Mask of the radius.
        RADIUS_BITS = 0x7fff,
        /// Shift of the parent's row (16 bits).
        PARENT_ROW = 16,
    }
    /// Bits of a link's state, by row and lane.
    state {
        /// Number of successive frames over the limit (8 bits).
        FRAMES_OVER = 0xff,
        /// The joint is broken.
        BROKEN = 0x100,
        /// The link belongs to a broken limb.
        DEBRIS = 0x200,
        /// The link belongs to the limb that is breaking off.
        BREAKING = 0x400,
        /// Shift of the frame in which the joint broke (21 bits: nine hours at 60 Hz).
        BROKE = 11,
    }
}
