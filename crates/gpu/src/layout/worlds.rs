//! Fields of whole worlds: what the contacts of a robot with its tree need.

fields! {
    /// A link at the start of a substep, in worlds with a robot ([`crate::laws`]): the outward pass stores its place, the inward pass all else. Vectors are in the axes of the world.
    touch {
        /// Place of its joint [m] (3).
        P = 0,
        /// Radius of its wood [m]; negative on a broken limb, which the robot does not meet.
        RADIUS = 3,
        /// Direction of its axis (3).
        Z = 4,
        /// Length [m].
        LENGTH = 7,
        /// First axis of its joint (3). With D the joint's pivot, D^-1 = C C^T.
        FIRST = 8,
        /// C_11.
        C_11 = 11,
        /// Second axis of its joint (3).
        SECOND = 12,
        /// C_22.
        C_22 = 15,
        /// Angular velocity [rad/s] (3).
        W = 16,
        /// C_21.
        C_21 = 19,
        /// Velocity at its joint [m/s] (3).
        V = 20,
        /// 0, or 1 and the place of the first [`path`] that passes it among those of its world, as bits: there are its changes by contacts.
        PASSED = 23,
        /// Number of fields.
        FIELDS = 24,
    }
    /// The system of a robot's substep, between its two halves: `[block][quad][lane][4]`, in the buffer of meetings.
    system {
        /// Matrix of the joints, without servos and losses: rows of 16, of which those from the diagonal on are used.
        MATRIX = 0,
        /// Impulses on the joints, without servos and losses ([`super::robot::DOFS`]).
        IMPULSE = 256,
        /// Servos: stiffness, damping, rest, torque, by joint.
        SERVO = 272,
        /// Losses: torque, damping, Coulomb friction that holds the joint, by joint; the fourth number is free.
        LOSS = 336,
        /// Motion of the links in the world: origin [m], second and third axis, angular velocity [rad/s], velocity of the origin [m/s]; 3 numbers each, the fourth is free.
        LINK = 400,
        /// Number of fields of a link's motion.
        LINK_FIELDS = 20,
        /// Changes of the joints' velocities.
        CHANGE = 720,
        /// Number of contacts, as bits.
        CONTACTS = 736,
        /// Number of pairs of colliders that are near each other, as bits.
        NEAR = 737,
        /// Servos and losses of the arm's joints with the limits that they meet without contacts: 8 numbers a joint.
        LIMITED = 740,
        /// Axis of the suction cup (3), and the impulse by which it draws its fruit against it [N s]; only of a robot with a cup.
        CUP = 804,
        /// That fruit, from 1, as bits.
        CUP_FRUIT = 808,
        /// Number of fields.
        FIELDS = 812,
    }
    /// A world's record of its contacts: numbers, then [`contact`] by [`contact`], then the pairs of near colliders.
    meeting {
        /// Number of contacts in the latest substep, as bits.
        CONTACTS = 0,
        /// Number of pairs, and of contacts, for which there was no room since the reset, as bits.
        LOST = 1,
        /// Number of solves since the reset that did not converge, as bits.
        UNSOLVED = 2,
        /// Number of Newton iterations in the latest substep, as bits.
        ITERATIONS = 3,
        /// Impulse of the robot on live wood since the reset [N s].
        IMPULSE = 4,
        /// Largest sum of its forces on live wood in a substep since the reset [N].
        PEAK = 5,
        /// Largest number of contact points of a substep since the reset, as bits.
        MOST = 6,
        /// Number of contacts that follow: those of the latest substep, as bits.
        LAST = 7,
        /// Number of fields before the contacts.
        FIELDS = 8,
        /// Largest number of pairs whose distance is computed in a substep.
        MOST_PAIRS = 128,
        /// Largest number of contact points of which the nearest are kept.
        MOST_TOUCHES = 64,
        /// Largest number of contacts that are solved.
        MOST_CONTACTS = 20,
        /// Largest number of their ways through the tree: contacts of two fruit on different links have two.
        MOST_WAYS = 24,
    }
    /// A contact point of two colliders.
    contact {
        /// Impulse on the first collider in the substep [N s], world (3); until that is solved, the one of the substep before.
        IMPULSE = 0,
        /// The colliders ([`pair`]), as bits.
        PAIR = 3,
        /// Unit normal from the second to the first, world (3).
        N = 4,
        /// Distance of the surfaces [m].
        GAP = 7,
        /// Place halfway between the surfaces [m], world (3).
        P = 8,
        /// Impulse along the normal if it is given, that of a suction cup on its fruit [N s]; 0 for two surfaces.
        GIVEN = 11,
        /// Number of fields.
        FIELDS = 12,
    }
    /// Two colliders that touch each other, as numbers of the world's colliders: segments, fruit, those of the robot, what stands still, the ground.
    /// The first one is wood, a fruit or the robot's; the second one comes later in this order.
    pair {
        /// Shift of the first number.
        FIRST = 16,
        /// Mask of a number.
        NUMBER = 0xffff,
    }
    /// Memory of a workgroup that solves the contacts of one world after another: 16 responses of the robot's joints for each row of a contact, then [`path`] by [`path`], those of a contact from its link
    /// to the root, then [`block`] by [`block`].
    desk {
        /// Largest number of desks, our own choice: about as many workgroups as a large device runs at once. A smaller batch has a desk for each world.
        MOST = 1056,
    }
    /// Response of a joint of the tree to unit impulses along the three rows of a contact, in coordinates in which the system's matrix is 1.
    path {
        /// Three numbers for the first axis; of the first path that passes a joint, at the end, the changes of its rates by the contacts (2).
        A = 0,
        /// Three numbers for the second axis.
        B = 3,
        /// Segment, as bits.
        SEGMENT = 6,
        /// Number of fields.
        FIELDS = 8,
    }
    /// Velocity change of a contact by unit impulses on another one, or on itself.
    block {
        /// The changes (3), impulse by impulse; the fourth number of each is free.
        COLUMNS = 0,
        /// Number of fields.
        FIELDS = 12,
    }
    /// A collider of the robot, in the table that all worlds read.
    collider {
        /// Shape ([`solid`]).
        KIND = 0,
        /// Link on which it is; all bits set for the ground.
        LINK = 1,
        /// A bit for each later collider of the robot that it meets.
        MEETS = 2,
        /// 1 if it meets the ground.
        ON_GROUND = 3,
        /// Friction with each [`material`].
        FRICTION = 4,
        /// Stiffness with each [`material`] [N/m].
        STIFFNESS = 9,
        /// Radius of a sphere or capsule [m].
        RADIUS = 14,
        /// Length of a capsule [m].
        LENGTH = 15,
        /// Half sides of a box [m] (3).
        HALF = 16,
        /// Radius of a ball about it [m].
        BOUND = 19,
        /// Place of its frame on the link [m] (3, the fourth number is free).
        P = 20,
        /// Axes of its frame on the link (3 each, the fourth number is free).
        AXES = 24,
        /// Centre of the ball about it on the link [m] (3).
        CENTRE = 36,
        /// Number of fields.
        FIELDS = 40,
        /// Largest number of colliders: bits of a word.
        MOST = 32,
    }
    /// Shape of a collider of the robot.
    solid {
        /// Ball.
        SPHERE = 0,
        /// Capsule from the origin along z.
        CAPSULE = 1,
        /// Box about the origin.
        BOX = 2,
    }
    /// Material of a surface.
    material {
        WOOD = 0,
        FRUIT = 1,
        /// Posts and wires.
        STILL = 2,
        GROUND = 3,
        /// The robot itself; its own figure.
        ROBOT = 4,
        /// Number of materials.
        COUNT = 5,
    }
    /// A collider that stands still in all worlds: a capsule.
    still {
        /// Start of its axis [m], world (3).
        P = 0,
        /// Radius [m].
        RADIUS = 3,
        /// From the start to the end of its axis [m], world (3, the fourth number is free).
        ALONG = 4,
        /// Number of fields.
        FIELDS = 8,
    }
    /// First fields of the table that all worlds read, as whole numbers; the colliders of the robot follow, then those that stand still, then what each world has of its own.
    head {
        /// Number of the robot's colliders.
        COLLIDERS = 0,
        /// Largest number of links between a tip and the root of a tree.
        DEPTH = 1,
        /// First quad of the records of worlds in the buffer of meetings, and their quads.
        RECORDS = 2,
        /// Quads of a record.
        RECORD = 3,
        /// First quad of what each world has of its own, and its quads.
        PLACES = 4,
        /// Quads of a world there.
        PLACE = 5,
        /// Distance from which on surfaces have a contact [m].
        MARGIN = 6,
        /// Stiffness of the contact of two fruit on their stems [N/m]; 0 where they pass through each other.
        FRUIT_STIFFNESS = 7,
        /// Friction of fruit on fruit, on what stands still, and on the ground.
        FRICTION_OF_FRUIT = 8,
        /// Stiffness of its contact with what stands still, and with the ground [N/m].
        STIFFNESS_OF_FRUIT = 11,
        /// Number of colliders that stand still.
        STILL = 13,
        /// First quad of the desks in the buffer of meetings, and their quads.
        DESKS = 14,
        DESK = 15,
        /// Number of fields.
        FIELDS = 16,
    }
    /// A world's own part of that table. Behind these fields, for each segment, its row and above it the row bits the parent's segment (all set for the root); then
    /// for each fruit its row and its segment likewise.
    place {
        /// First quad of the links' [`touch`] in the work buffer.
        TOUCH = 0,
        /// First quad of the links' [`super::work`] there.
        WORK = 1,
        /// First quad of the fruit.
        FRUIT = 2,
        /// First field of the world.
        WORLD = 3,
        /// Cosine and sine of the turn of odom about the vertical.
        TURN = 4,
        /// Place of odom [m] (3).
        P = 6,
        /// Number of segments.
        SEGMENTS = 9,
        /// Number of fruit.
        FRUITS = 10,
        /// Number of pairs of fruit that have grown into each other.
        OVERLAPS = 11,
        /// 1 if the ground is level at height 0, which the robot meets.
        GROUND = 12,
        /// Number of fields.
        FIELDS = 16,
        /// Largest number of such pairs. Each is two words behind all others: [`pair`], and the depth [m].
        MOST_OVERLAPS = 64,
    }
    /// Head of the table of what is asked of lanes. For each lane a [`wish`] follows, with the number of its frames from bit [`wish::FRAMES_BIT`] on, then for each lane its [`super::world::MISSED`], then for each lane the quads of the angles and rates of its links, then those of the motion of its fruit: place, velocity and spin, and on stems that bend rotation, rate and rest with the wear.
    asked {
        /// Number of lanes.
        LANES = 0,
        /// Room for links, and for fruit, of a lane.
        LINKS = 1,
        FRUIT = 2,
        /// Largest number of frames.
        FRAMES = 3,
        /// Quads of the motion of a fruit.
        MOTION = 4,
        /// Number of fields.
        FIELDS = 5,
    }
    /// Wish about a lane.
    wish {
        /// Nothing is asked.
        NOTHING = 0,
        /// A few numbers are asked, and the motion of the tree only if something happened to it.
        NEWS = 1,
        /// As [`Self::NEWS`], and all after the last frame.
        LAST = 2,
        /// All after every frame.
        EACH = 3,
        /// First bit of the number of frames.
        FRAMES_BIT = 8,
    }
    /// Told about a lane after each of its frames, all lanes frame after frame. Behind those of [`asked::FRAMES`] frames are the velocities of their fruit a frame ago, then slots: motion of links and of fruit, the beginning of the record of contacts, velocities of the fruit a frame ago.
    told {
        /// Slot with the motion of its tree, as bits; all set if there is none.
        SLOT = 0,
        /// Numbers of [`meeting`]: lost, unsolved, impulse, peak.
        LOST = 1,
        UNSOLVED = 2,
        IMPULSE = 3,
        PEAK = 4,
        /// Numbers of [`super::world`]: excess and tension.
        EXCESS = 5,
        TENSION = 6,
        /// Number of fields.
        FIELDS = 8,
    }
}
