//! A frame of all worlds.

use orchard_gpu::{GpuError, News, Tenant, Wish, WorldBatch};
use orchard_multibody::ContactReport;
use orchard_robot::Command;
use orchard_world::{Calm, Lent, Moved, Outlook, World};
use rayon::prelude::*;

use crate::lane::{Lockstep, Occupant};
use crate::profile::Stopwatch;
use crate::tally::Where;

/// A world's next frame.
#[derive(Debug)]
pub struct Turn<'a> {
    /// Lane that the world has entered.
    pub lane: usize,
    /// The world that entered it.
    pub world: &'a mut World,
    /// Command of the frame.
    pub command: Command,
    /// True if wood and fruit are needed after it; else they may be behind then ([`World::is_behind`]), until [`Lockstep::catch_up`].
    pub is_whole: bool,
}

/// A frame under way.
#[derive(Debug)]
#[must_use = "a frame that was begun is to be ended"]
pub struct Begun {
    starts: Vec<Start>,
}

/// Start of a world's frame.
#[derive(Debug)]
struct Start {
    place: Where,
    wish: Wish,
    /// The frame, if the device computes it.
    lent: Option<Lent>,
    /// True if wood and fruit must catch up before: the world comes to the device, or leaves it.
    is_late: bool,
}

impl Lockstep {
    /// Advances worlds by a frame, each under its command. Worlds in other lanes stand still.
    ///
    /// # Errors
    /// The device was lost; then the frame is not over, and the worlds cannot go on.
    ///
    /// # Panics
    /// No world has entered a lane.
    pub fn step(&mut self, turns: &mut [Turn<'_>]) -> Result<(), GpuError> {
        let begun = self.begin(turns)?;
        self.end(turns, begun)
    }

    /// Begins a frame of worlds, each under its command: the device is at work when this returns, and the worlds that are computed here have moved. Another lockstep of the device can begin or end its
    /// frame before this one ends.
    ///
    /// # Errors
    /// The device was lost.
    ///
    /// # Panics
    /// No world has entered a lane.
    pub fn begin(&mut self, turns: &mut [Turn<'_>]) -> Result<Begun, GpuError> {
        let mut watch = Stopwatch::start(self.profile.as_ref());
        let lanes = &self.lanes;
        let mut starts: Vec<Start> = turns.par_iter_mut().map(|turn| start_of(lanes, turn)).collect();
        let late = turns.iter_mut().zip(&starts).filter(|(_, start)| start.is_late);
        let mut late: Vec<_> = late.map(|(turn, _)| (turn.lane, &mut *turn.world)).collect();
        self.catch_up(&mut late)?;
        for (turn, start) in turns.iter_mut().zip(&mut starts) {
            if start.is_late && start.place == Where::Device {
                start.lent = Some(turn.world.lend(&turn.command));
            }
        }
        watch.part(&mut self.profile, "outlook");
        self.exchange(turns, &starts)?;
        watch.part(&mut self.profile, "exchange");
        let mut wishes = vec![Wish::Nothing; self.lanes.len()];
        let mut commands = vec![None; self.lanes.len()];
        for (turn, start) in turns.iter().zip(&starts) {
            if let Some(lent) = &start.lent {
                (wishes[turn.lane], commands[turn.lane]) = (start.wish, Some(&lent.command));
            }
        }
        self.batch.command_all(&commands)?;
        watch.part(&mut self.profile, "command");
        if starts.iter().any(|start| start.lent.is_some()) {
            self.pause_others(&wishes);
            self.batch.advance(1);
            self.batch.ask(&wishes);
        }
        watch.part(&mut self.profile, "submit");
        // While the device is at work.
        turns.par_iter_mut().zip(&starts).filter(|(_, start)| start.lent.is_none()).for_each(|(turn, _)| {
            turn.world.step(&turn.command);
        });
        watch.part(&mut self.profile, "step_here");
        Ok(Begun { starts })
    }

    /// Ends the frame that was begun with these turns.
    ///
    /// # Errors
    /// The device was lost; then the frame is not over, and the worlds cannot go on.
    pub fn end(&mut self, turns: &mut [Turn<'_>], begun: Begun) -> Result<(), GpuError> {
        let Begun { starts } = begun;
        let mut watch = Stopwatch::start(self.profile.as_ref());
        if self.profile.is_some() {
            self.batch.await_answers()?;
            watch.part(&mut self.profile, "wait");
        }
        self.batch.fetch()?;
        watch.part(&mut self.profile, "read");
        let (batch, lanes) = (&self.batch, &self.lanes);
        let ends: Vec<Option<End>> = turns
            .par_iter_mut()
            .zip(&starts)
            .map(|(turn, start)| {
                let lent = start.lent.as_ref()?;
                Some(take_back(batch, occupant(lanes, turn.lane), turn, lent))
            })
            .collect();
        watch.part(&mut self.profile, "take_back");
        self.tally.count(starts.iter().map(|start| start.place));
        for (turn, end) in turns.iter().zip(ends) {
            if let (Some(End { impulse, faults, is_calm, is_off_stem }), Some(occupant)) =
                (end, &mut self.lanes[turn.lane])
            {
                self.tally.calm += u64::from(is_calm);
                let [lost, unsolved] = [0, 1].map(|k| u64::from(faults[k] - occupant.faults[k]));
                self.tally.contacts_lost += lost;
                self.tally.contacts_unsolved += unsolved;
                (occupant.impulse, occupant.faults) = (impulse, faults);
                if is_off_stem {
                    // The device takes it anew.
                    occupant.is_on_device = false;
                    self.batch.retire(turn.lane);
                }
            }
        }
        watch.part(&mut self.profile, "count");
        if let Some(profile) = &mut self.profile {
            profile.frames += 1;
        }
        Ok(())
    }

    /// Brings wood and fruit of worlds that are behind up to their robots ([`World::is_behind`]); a world is given with its lane.
    ///
    /// # Errors
    /// The device was lost.
    ///
    /// # Panics
    /// A world that is behind has not entered the lane, or its frame is not over.
    pub fn catch_up(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<(), GpuError> {
        let mut wishes = vec![Wish::Nothing; self.lanes.len()];
        for (lane, _) in worlds.iter().filter(|(_, world)| world.is_behind()) {
            wishes[*lane] = Wish::Whole;
        }
        if !wishes.contains(&Wish::Whole) {
            return Ok(());
        }
        self.batch.ask(&wishes);
        self.batch.fetch()?;
        let batch = &self.batch;
        worlds.par_iter_mut().filter(|(_, world)| world.is_behind()).for_each(|(lane, world)| {
            world.catch_up(|model, data| {
                batch.store_whole(*lane, model, data);
            });
        });
        Ok(())
    }

    /// Takes worlds from the device that are computed here, and puts those on it that are computed there.
    fn exchange(&mut self, turns: &[Turn<'_>], starts: &[Start]) -> Result<(), GpuError> {
        let mut coming = Vec::new();
        for (turn, start) in turns.iter().zip(starts) {
            let Some(occupant) = &mut self.lanes[turn.lane] else { continue };
            match (start.place, occupant.is_on_device) {
                (Where::Device, false) => coming.push(turn),
                (Where::Device, true) => {}
                (_, true) => {
                    occupant.is_on_device = false;
                    self.batch.retire(turn.lane);
                }
                (_, false) => {}
            }
        }
        let lanes = &self.lanes;
        let trees: Vec<_> = coming
            .par_iter()
            .map(|turn| occupant(lanes, turn.lane).tree.in_state_of(turn.world.data().clone()))
            .collect();
        let fitted: Vec<_> = coming.iter().map(|turn| occupant(lanes, turn.lane).fitted.clone()).collect();
        let starts: Vec<_> = coming.iter().map(|turn| turn.world.x_world_start()).collect();
        let tenants = coming.iter().zip(&trees).zip(fitted.iter().zip(&starts));
        let tenants: Vec<Tenant<'_>> = tenants
            .filter_map(|((turn, tree), (fitted, x_world_odom))| {
                Some(Tenant {
                    lane: turn.lane,
                    is_back: occupant(lanes, turn.lane).is_planted,
                    tree,
                    fitted: fitted.as_deref()?,
                    x_world_odom,
                    model: turn.world.model(),
                    handle: turn.world.handle(),
                    data: turn.world.data(),
                    start: turn.world.start(),
                    set_points: turn.world.set_points(),
                })
            })
            .collect();
        self.batch.plant(&tenants)?;
        for turn in coming {
            if let Some(occupant) = &mut self.lanes[turn.lane] {
                (occupant.is_on_device, occupant.is_planted) = (true, true);
                (occupant.impulse, occupant.faults) = (0.0, [0; 2]);
            }
        }
        Ok(())
    }

    /// Takes worlds from the device about whose lanes nothing is asked: they have no turn now, or are computed here.
    fn pause_others(&mut self, wishes: &[Wish]) {
        for (lane, (occupant, wish)) in self.lanes.iter_mut().zip(wishes).enumerate() {
            if let Some(occupant) = occupant
                && occupant.is_on_device
                && *wish == Wish::Nothing
            {
                occupant.is_on_device = false;
                self.batch.retire(lane);
            }
        }
    }
}

/// Numbers of a lane after a frame on the device.
struct End {
    impulse: f64,
    faults: [u32; 2],
    is_calm: bool,
    /// True if a fruit came off or into the hand.
    is_off_stem: bool,
}

fn occupant(lanes: &[Option<Occupant>], lane: usize) -> &Occupant {
    lanes[lane].as_ref().unwrap_or_else(|| panic!("no world has entered lane {lane}"))
}

/// Starts the frame of a world, if it need not catch up before.
fn start_of(lanes: &[Option<Occupant>], turn: &mut Turn<'_>) -> Start {
    let occupant = occupant(lanes, turn.lane);
    let Outlook { stays, is_whole } = turn.world.outlook(&turn.command);
    let place = match (&occupant.fitted, stays) {
        (None, _) => Where::TooLarge,
        (Some(_), Some(stay)) => Where::Here(stay),
        (Some(_), None) => Where::Device,
    };
    let is_there = place == Where::Device && occupant.is_on_device;
    let is_late = !is_there && turn.world.is_behind();
    let lent = (place == Where::Device && !is_late).then(|| turn.world.lend(&turn.command));
    // One that comes to the device knows nothing of its fruit a frame ago.
    let wish = if turn.is_whole || is_whole || !is_there { Wish::Whole } else { Wish::News };
    Start { place, wish, lent, is_late }
}

/// Ends a frame of a world by the motion that was read from the device.
fn take_back(batch: &WorldBatch, occupant: &Occupant, turn: &mut Turn<'_>, lent: &Lent) -> End {
    let lane = turn.lane;
    let news @ News { lost, unsolved, .. } = batch.news(lane);
    let impulse = f64::from(news.contact_impulse);
    let mut end = End { impulse, faults: [lost, unsolved], is_calm: !news.is_whole, is_off_stem: false };
    let (impulse, peak_force) = (impulse - occupant.impulse, f64::from(news.peak_contact_force));
    if end.is_calm {
        turn.world.take_back_calm(|model, handle, data| Calm {
            set_points: batch.store_driven(lane, model, handle, data),
            impulse,
            peak_force,
            excess: f64::from(news.excess),
            tension: f64::from(news.tension),
        });
        return end;
    }
    end.is_off_stem = turn.world.take_back(lent, |model, handle, data| {
        let set_points = batch.store_driven(lane, model, handle, data);
        let meeting = batch.store_whole(lane, model, data).unwrap_or_default();
        let contacts = meeting.contacts.iter().map(|contact| ContactReport {
            a: occupant.of_tree[contact.tree],
            b: occupant.of_robot[contact.robot],
            p_world: contact.p_world,
            n_world: contact.n_world,
            gap: contact.gap,
            force_world: contact.force_world,
        });
        let v_fruit_before = batch.fruit_before(lane).collect();
        Moved { set_points, contacts: contacts.collect(), impulse, peak_force, v_fruit_before }
    });
    end
}
