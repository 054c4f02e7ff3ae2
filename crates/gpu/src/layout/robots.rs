//! Fields of robots.

fields! {
    /// State of a robot: `[block][quad][lane][4]`. Whole numbers are kept as bits.
    robot {
        /// Coordinates of the degrees of freedom, in the order of the robot's model [m or rad] ([`robot::DOFS`]).
        Q = 0,
        /// Velocities [m/s or rad/s] ([`robot::DOFS`]).
        V = 16,
        /// Set points of the arm's joints [rad] ([`robot::ARM`]).
        ARM_TARGET = 32,
        /// Their velocities [rad/s] ([`robot::ARM`]).
        ARM_RATE = 40,
        /// Velocity set point of the base, in its frame: forward [m/s], left [m/s], yaw rate [rad/s] (3); on a rail the speed along it alone.
        BASE_TARGET = 48,
        /// Number of frames since the batch was created.
        FRAME = 51,
        /// Set points of the fingers' openings [m] (2).
        FINGER_TARGET = 52,
        /// Frame in which the world was stopped; 0 while it runs.
        STOPPED = 54,
        /// Degree of freedom that was not finite then; [`robot::DOFS`] for a command, [`robot::OF_TREE`] for the tree of its world.
        FAULT = 55,
        /// Vacuum of the suction cup [Pa].
        VACUUM = 56,
        /// The fruit on which its lip lies, from 1, as bits; 0 without one.
        CUP_FRUIT = 57,
        /// Points of the lip that are closed on it, a bit each.
        CUP_CLOSED = 58,
        /// Number of fields.
        FIELDS = 60,
        /// Largest number of degrees of freedom.
        DOFS = 16,
        /// Largest number of the arm's joints.
        ARM = 8,
        /// Largest number of fingers.
        FINGERS = 2,
        /// Largest number of couplings.
        COUPLINGS = 4,
        /// Largest number of points of a suction cup's lip: a command holds a bit for each, as a number.
        LIP = 24,
        /// Fault of a world whose tree was stopped.
        OF_TREE = 17,
    }
    /// Command of a robot: `[block][quad][lane][4]`.
    command {
        /// Set points of the arm's joints at the end of the frame [rad] ([`robot::ARM`]).
        ARM_Q = 0,
        /// Their velocities then [rad/s] ([`robot::ARM`]).
        ARM_V = 8,
        /// Velocity of the base, in its frame [m/s, m/s, rad/s] (3).
        BASE = 16,
        /// 1 if the next reset is for this world, else 0.
        RESET = 19,
        /// Opening of each finger [m].
        FINGER_Q = 20,
        /// Largest force of each finger at its pad [N].
        FINGER_FORCE = 21,
        /// Set point of the chassis height above its rest in the last substep of the frame [m].
        HEIGHT = 22,
        /// Rate at which that set point rises within the frame [m/s].
        CLIMB = 23,
        /// Opening of the valve of the suction cup.
        VALVE = 24,
        /// Points of its lip under which leaves lie, a bit each, as a number.
        LEAVES = 25,
        /// Points on which something presses at the start of the frame, likewise.
        PRESSED = 26,
        /// Number of fields.
        FIELDS = 28,
    }
    /// Joint by which a robot's base moves.
    drive {
        /// It stands.
        FIXED = 0,
        /// It slides on a rail.
        RAIL = 1,
        /// It drives in any direction.
        HOLONOMIC = 2,
        /// It drives along its heading and turns on the spot.
        DIFFERENTIAL = 3,
        /// It drives along its heading and turns on circles.
        ACKERMANN = 4,
    }
}
