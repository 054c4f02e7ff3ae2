//! A fruit that the robot holds by friction, on the device against f64.

use orchard_geometry::{inverse_transform, transform};
use orchard_robot::{Suction, UnderLip};

use super::laid::{FRUIT, off_stem};
use super::*;
use crate::{Course, Fitted, Meeting, Room, Tenant};

/// Frames that the fingers have to close, and that the grip has to settle.
const CLOSING: u32 = 120;
const SETTLING: u32 = 60;

/// A world whose robot holds a fruit before its trunk, and a lane of the device for it.
pub(super) struct Grip {
    pub world: World,
    pub command: Command,
    /// Points of the lip that the device is told to lie over leaves, or to be pressed on.
    pub under_lip: UnderLip,
    tree: TreeWorld,
    batch: WorldBatch,
    fitted: Fitted,
    is_planted: bool,
}

impl Grip {
    /// Closes the fingers of a robot on a fruit that has come off its stem, in f64.
    fn new(gpu: &Gpu, spec: &Arc<Spec>) -> Self {
        let robot = RobotModel::paper();
        let (mut world, mut command) = off_stem(spec, &robot);
        let point = world.fruit().points[FRUIT].index();
        let lift = world.fruit().fruit[FRUIT].mass * spec.sim.gravity.si();
        command.finger_q = 0.0;
        for frame in 0..CLOSING + SETTLING {
            let x_world_tcp = world.handle().x_world_tcp(world.data());
            let is_free = frame < CLOSING && !world.is_held(FRUIT);
            let data = world.data_mut();
            data.point_force_world[point] = Vec3::new(0.0, 0.0, if frame < CLOSING { lift } else { 0.0 });
            if is_free {
                data.point_p_world[point] = x_world_tcp.translation.vector;
                data.point_v_world[point] = Vec3::zeros();
                data.point_w_world[point] = Vec3::zeros();
            }
            world.step(&command);
        }
        assert!(world.is_held(FRUIT), "the fingers have not closed on the fruit");
        Self::on(gpu, world, &robot, command)
    }

    /// A world and a lane of the device for it.
    pub fn on(gpu: &Gpu, world: World, robot: &RobotModel, command: Command) -> Self {
        let tree = tree_of(&world);
        let room = Room::for_trees(std::slice::from_ref(&tree), 0.0).unwrap();
        let batch = WorldBatch::with_lanes(gpu, room, &tree, robot, 1, 1).unwrap();
        let fitted = batch.fitted(&tree, &world.x_world_start()).unwrap().unwrap();
        Self { world, command, under_lip: UnderLip::default(), tree, batch, fitted, is_planted: false }
    }

    /// Puts the world's state on the device.
    pub fn plant(&mut self) {
        let suction = *self.world.suction();
        self.plant_with(&suction);
    }

    /// As [`Self::plant`], with a vacuum of its own.
    pub fn plant_with(&mut self, suction: &Suction) {
        let Self { tree, world, .. } = &*self;
        let (data, rupture) = (world.data().clone(), world.rupture().clone());
        let tree = tree.in_state_of(data, rupture, world.fruit_lives().clone(), world.frame());
        let x_world_odom = self.world.x_world_start();
        let tenant = Tenant {
            lane: 0,
            is_back: self.is_planted,
            tree: &tree,
            fitted: &self.fitted,
            x_world_odom: &x_world_odom,
            model: self.world.model(),
            handle: self.world.handle(),
            data: self.world.data(),
            start: self.world.start(),
            set_points: self.world.set_points(),
            suction,
        };
        self.batch.plant(&[tenant]);
        self.is_planted = true;
    }

    pub fn advance(&mut self, frames: u32) {
        for _ in 0..frames {
            let (commands, under_lip) = (&[self.command], self.under_lip);
            self.batch.advance_lanes(&[Course { commands, under_lip, ..Course::default() }]).unwrap();
            self.batch.fetch().unwrap();
        }
    }

    /// State on the device.
    pub fn read(&mut self) -> (Data, Meeting) {
        self.batch.ask(&[true]);
        self.batch.fetch().unwrap();
        let mut data = self.world.data().clone();
        self.batch.store_driven((0, 0), self.world.model(), self.world.handle(), &mut data);
        let meeting = self.batch.store_whole((0, 0), self.world.model(), &mut data).unwrap();
        forward_kinematics(self.world.model(), &mut data);
        (data, meeting)
    }

    /// Vacuum of a suction cup on the device, after [`Self::read`].
    pub fn suction(&self) -> Suction {
        self.batch.suction(0, 0)
    }

    pub fn point(&self) -> usize {
        self.world.fruit().points[FRUIT].index()
    }

    /// Place of the fruit in the hand.
    fn p_tcp(&self, data: &Data) -> Vec3 {
        inverse_transform(&self.world.handle().x_world_tcp(data), &data.point_p_world[self.point()])
    }

    /// Force that friction can bear square to the normals of some contacts with the fruit, all of them parallel \[N\].
    fn limit(&self, contacts: &[ContactReport]) -> f64 {
        let model = self.world.model();
        let own = self.world.fruit().colliders[FRUIT];
        let bear = |c: &ContactReport| {
            (model.collider(c.a).friction * model.collider(c.b).friction).sqrt()
                * c.force_world.dot(&c.n_world)
        };
        contacts.iter().filter(|c| c.a == own).map(bear).sum()
    }

    /// Steps device and f64 from the same state some times, a substep each, and takes their contacts and changes into account; `watch` gets the state on the device after each.
    pub fn compare(&mut self, substeps: u32, off: &mut Off, mut watch: impl FnMut(&Self, &World, &Data)) {
        for substep in 0..substeps {
            // Both start from the device's numbers.
            self.plant();
            *self.world.data_mut() = self.read().0;
            self.advance(1);
            let (after, meeting) = self.read();
            let free = untouched(&self.world, &self.command);
            self.world.step(&self.command);
            let case = format!("substep {substep}");
            assert_eq!((meeting.lost, meeting.unsolved), (0, 0), "{case}: {meeting:?}");
            off.add_contacts(&self.world, &contacts_of(&self.world), &meeting.contacts, false, &case);
            off.add_changes(free.data(), self.world.data(), &after);
            off.iterations = off.iterations.max(meeting.iterations);
            watch(self, &free, &after);
        }
    }

    /// Steps the world in f64, and returns the place of the fruit in the hand.
    pub fn step_here(&mut self, frames: u32) -> Vec3 {
        (0..frames).for_each(|_| self.world.step(&self.command));
        self.p_tcp(self.world.data())
    }

    /// Steps the device by a number of frames; returns the place of the held fruit in the TCP frame \[m\].
    fn step_there(&mut self, frames: u32) -> Vec3 {
        self.advance(frames);
        let (data, meeting) = self.read();
        assert_eq!((meeting.lost, meeting.unsolved), (0, 0), "{meeting:?}");
        self.p_tcp(&data)
    }
}

/// While the hand turns a held fruit, each substep from the same state has the contacts of f64: pairs, gaps, normals, forces, and the velocities and the spin after it.
#[test]
fn substeps_of_a_held_fruit_have_the_contacts_of_f64() {
    const SUBSTEPS: u32 = 120;
    let Some(gpu) = device() else { return };
    let mut grip = Grip::new(&gpu, &seen(Preset::Paper));
    let mut off = Off::default();
    let (mut fastest, mut spin) = (0.0_f64, 0.0_f64);
    let point = grip.point();
    grip.command.arm_q[3] += 0.4;
    grip.command.arm_q[6] += 1.0;
    grip.command.base_velocity = [0.0, 0.1, 0.2];
    grip.compare(SUBSTEPS, &mut off, |grip, free, after| {
        assert!(grip.world.is_held(FRUIT), "it is not held any more");
        let expected = grip.world.data().point_w_world[point];
        let change = (expected - free.data().point_w_world[point]).norm();
        spin = spin.max((after.point_w_world[point] - expected).norm() / change.max(1.0));
        fastest = fastest.max(expected.norm());
    });
    assert!(fastest > 0.5, "the fruit did not turn: {fastest}");
    assert!(
        off.loaded[1] >= 2 * SUBSTEPS as usize
            && off.gap < 2e-6
            && off.normal < 1e-5
            && off.force < 1e-3
            && off.change < 1e-3
            && spin < 1e-3,
        "{off:?}, spin {spin}"
    );
}

/// The grip creeps by less than 0.05 mm/s, and gives way at the Coulomb limit: below 95 % of it the fruit stays, above 105 % it slides out, here and there.
#[test]
fn a_grip_holds_to_the_limit_of_friction() {
    const SECOND: u32 = 60;
    const CREEP: f64 = 5e-5;
    const SLID: f64 = 3e-3;
    let Some(gpu) = device() else { return };
    let mut spec = Spec::paper();
    face(&mut spec, 0.0);
    let mut grip = Grip::new(&gpu, &Arc::new(spec));
    grip.plant();
    let first = grip.step_there(SECOND / 2);
    let later = grip.step_there(SECOND);
    let creep = (later - first).norm();
    assert!(creep < CREEP, "it creeps by {creep} m/s on the device");
    let (first, later) = (grip.step_here(SECOND / 2), grip.step_here(SECOND));
    let here = (later - first).norm();
    assert!(here < CREEP, "it creeps by {here} m/s in f64");

    // Pulled out of the hand along it, with its weight taken off.
    let limit = grip.limit(&grip.world.report().contacts.clone());
    let x_world_tcp = grip.world.handle().x_world_tcp(grip.world.data());
    let along = transform(&x_world_tcp, &Vec3::z()) - x_world_tcp.translation.vector;
    let lift = grip.world.fruit().fruit[FRUIT].mass * grip.world.spec().sim.gravity.si();
    let held = grip.world.clone();
    for (share, slides) in [(0.95, false), (1.05, true)] {
        grip.world = held.clone();
        let point = grip.point();
        grip.world.data_mut().point_force_world[point] = along * (share * limit) + Vec3::z() * lift;
        grip.plant();
        let before = grip.p_tcp(grip.world.data());
        let there = (grip.step_there(SECOND / 2) - before).norm();
        let here = (grip.step_here(SECOND / 2) - before).norm();
        for (slid, place) in [(there, "the device"), (here, "f64")] {
            assert_eq!(slid > SLID, slides, "{share} of {limit} N on {place}: it slid by {slid} m");
        }
    }
}

/// A fruit that others move is not met by the robot.
#[test]
fn a_fruit_that_is_carried_is_not_met() {
    let Some(gpu) = device() else { return };
    let mut grip = Grip::new(&gpu, &Arc::new(Spec::paper()));
    let point = grip.point();
    grip.world.data_mut().point_carried[point] = true;
    grip.plant();
    grip.advance(1);
    let (_, meeting) = grip.read();
    let fruit = grip.world.tree().len() + FRUIT;
    assert!(meeting.contacts.iter().all(|contact| contact.pair[0] != fruit), "{meeting:?}");
}
