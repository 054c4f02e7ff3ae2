//! Seats that threads of a pool share.

use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::device::device;
use orchard_lockstep::{Lockstep, Seats};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::World;
use rayon::prelude::*;

/// A pool with fewer threads than seats runs one episode after the other: while a frame is computed, its thread does not begin the next episode, which would wait for the frame.
#[test]
fn a_thread_that_waits_for_its_frame_begins_no_other_episode() {
    let Some(gpu) = device() else { return };
    let robot = Arc::new(RobotModel::paper());
    let world = World::new(Arc::new(Spec::paper()), robot.clone(), 20_250_704, 0).unwrap();
    let together = Lockstep::new(&gpu, std::slice::from_ref(&world), 2, 1).unwrap();
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (seats, episodes) = (Seats::new(&gpu, vec![together], Arc::new(pool())), pool());
    let (ended, told) = channel();
    let ended = Mutex::new(ended);
    std::thread::spawn(move || {
        episodes.install(|| {
            (0..3_u32).into_par_iter().with_max_len(1).for_each(|_| {
                let seat = seats.take();
                seat.enter(&world).unwrap();
                let mut own = Box::new(world.clone());
                for _ in 0..3 {
                    own = seat.step(own, robot.start_command());
                }
                ended.lock().unwrap().send(own.frame()).unwrap();
            });
        });
    });
    for _ in 0..3 {
        assert_eq!(told.recv_timeout(Duration::from_secs(300)), Ok(3));
    }
}
