//! The next frames of all worlds.

use orchard_gpu::{Course, GpuError, News, Tenant, Wish, WorldBatch};
use orchard_multibody::ContactReport;
use orchard_robot::{Climb, Command, UnderLip};
use orchard_world::{Calm, Moved, Outlook, Span, World};
use rayon::prelude::*;

use crate::lane::{Lockstep, Occupant};
use crate::profile::Stopwatch;
use crate::tally::Where;

/// Frames under way.
#[derive(Debug)]
#[must_use = "frames that were begun are to be ended"]
pub struct Begun {
    starts: Vec<Start>,
}

/// Start of a world's next frames.
#[derive(Debug)]
struct Start {
    place: Where,
    /// Commands that act in the frames for which the world is lent to the device; none if it is not.
    commands: Vec<Command>,
    wish: Wish,
    climb: Climb,
    under_lip: UnderLip,
    /// True if wood and fruit must catch up before: the world leaves the device, or comes to it anew.
    is_late: bool,
    /// Places of the frames that were computed here.
    here: Vec<Where>,
}

impl Start {
    /// True if the frames are computed here, and need nothing of the device.
    fn steps_here(&self) -> bool {
        self.commands.is_empty() && !self.is_late
    }
}

impl Lockstep {
    /// Advances worlds by the frames of their spans, or by the first of them if there is no room for all. A world that leaves the device in the midst of them takes the others here. Worlds in other lanes stand still.
    ///
    /// # Errors
    /// The device was lost; then the frames are not over, and the worlds cannot go on.
    ///
    /// # Panics
    /// No world has entered a lane.
    pub fn step<S: Span>(&mut self, spans: &mut [S]) -> Result<(), GpuError> {
        let begun = self.begin(spans)?;
        self.end(spans, begun)
    }

    /// Begins frames of worlds as [`Self::step`] does: the device is at work when this returns, and the worlds that are computed here have moved. Another lockstep of the device can begin or end its
    /// frames before these end.
    ///
    /// # Errors
    /// The device was lost.
    ///
    /// # Panics
    /// No world has entered a lane.
    pub fn begin<S: Span>(&mut self, spans: &mut [S]) -> Result<Begun, GpuError> {
        let mut watch = Stopwatch::start(self.profile.as_ref());
        let (lanes, most) = (&self.lanes, self.frames);
        let mut starts: Vec<Start> = spans.par_iter_mut().map(|span| start_of(lanes, most, span)).collect();
        // Worlds that leave the device are asked with the frames of the others, and take theirs at the end.
        let coming = |start: &Start| start.is_late && !start.commands.is_empty();
        let late = spans.iter_mut().zip(&starts).filter(|(_, start)| coming(start));
        let mut late: Vec<_> = late.map(|(span, _)| (span.lane(), span.frames().0)).collect();
        self.catch_up(&mut late)?;
        watch.part(&mut self.profile, "outlook");
        self.exchange(spans, &starts);
        watch.part(&mut self.profile, "exchange");
        let mut courses = vec![Course::default(); self.lanes.len()];
        for (span, start) in spans.iter().zip(&starts) {
            let &Start { ref commands, wish, climb, under_lip, .. } = start;
            courses[span.lane()] = Course { commands, wish, climb, under_lip };
        }
        // Worlds that are computed here move while the frames of the others are submitted.
        let (batch, of_starts) = (&mut self.batch, &starts);
        let (submitted, here) = rayon::join(
            || batch.advance_lanes(&courses),
            || {
                let each = spans.par_iter_mut().zip(of_starts);
                each.map(|(span, start)| start.steps_here().then(|| step_here(span, start.place, most)))
                    .collect::<Vec<_>>()
            },
        );
        submitted?;
        starts.iter_mut().zip(here).for_each(|(start, here)| start.here = here.unwrap_or_default());
        watch.part(&mut self.profile, "submit");
        Ok(Begun { starts })
    }

    /// Ends the frames that were begun with these spans.
    ///
    /// # Errors
    /// The device was lost; then the frames are not over, and the worlds cannot go on.
    pub fn end<S: Span>(&mut self, spans: &mut [S], begun: Begun) -> Result<(), GpuError> {
        let Begun { mut starts } = begun;
        let mut watch = Stopwatch::start(self.profile.as_ref());
        if self.profile.is_some() {
            self.batch.await_answers()?;
            watch.part(&mut self.profile, "wait");
        }
        self.batch.fetch()?;
        watch.part(&mut self.profile, "read");
        let (batch, lanes) = (&self.batch, &self.lanes);
        let lent = spans.par_iter_mut().zip(&starts);
        let mut ends: Vec<End> = lent.map(|(span, start)| take_back(batch, lanes, span, start)).collect();
        watch.part(&mut self.profile, "take_back");
        let most = self.frames;
        let left = spans.par_iter_mut().zip(&mut starts).zip(&mut ends);
        left.for_each(|((span, start), end)| {
            if start.is_late && start.commands.is_empty() {
                catch_up(batch, span.lane(), span.frames().0);
                start.here = step_here(span, start.place, most);
            }
            if let Some(place) = end.left {
                end.here = step_here(span, place, start.commands.len() - end.frames);
            }
        });
        watch.part(&mut self.profile, "step_here");
        let there = ends.iter().map(|end| (Where::Device, end.frames));
        let here = starts.iter().flat_map(|start| &start.here).chain(ends.iter().flat_map(|end| &end.here));
        self.tally.count(there.chain(here.map(|place| (*place, 1))));
        for (span, end) in spans.iter().zip(&ends) {
            let (lane, Some(last)) = (span.lane(), end.last) else { continue };
            let Some(occupant) = &mut self.lanes[lane] else { continue };
            self.tally.calm += end.calm as u64;
            self.tally.free_fruit += end.free_fruit as u64;
            let faults = [last.lost, last.unsolved];
            let [lost, unsolved] = [0, 1].map(|k| u64::from(faults[k] - occupant.faults[k]));
            self.tally.contacts_lost += lost;
            self.tally.contacts_unsolved += unsolved;
            (occupant.impulse, occupant.faults) = (f64::from(last.contact_impulse), faults);
            if end.is_changed || end.is_ahead {
                // The device takes it anew.
                occupant.is_on_device = false;
                self.batch.retire(lane);
            }
        }
        watch.part(&mut self.profile, "count");
        if let Some(profile) = &mut self.profile {
            profile.rounds += 1;
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
        let mut asked = vec![false; self.lanes.len()];
        for (lane, _) in worlds.iter().filter(|(_, world)| world.is_behind()) {
            asked[*lane] = true;
        }
        if !asked.contains(&true) {
            return Ok(());
        }
        self.batch.ask(&asked);
        self.batch.fetch()?;
        let batch = &self.batch;
        worlds
            .par_iter_mut()
            .filter(|(_, world)| world.is_behind())
            .for_each(|(lane, world)| catch_up(batch, *lane, world));
        Ok(())
    }

    /// Takes worlds from the device that are computed here, and puts those on it that are computed there.
    fn exchange<S: Span>(&mut self, spans: &mut [S], starts: &[Start]) {
        let mut coming: Vec<(usize, &World)> = Vec::new();
        for (span, start) in spans.iter_mut().zip(starts) {
            let lane = span.lane();
            let Some(occupant) = &mut self.lanes[lane] else { continue };
            match (start.place, occupant.is_on_device) {
                (Where::Device, false) => coming.push((lane, span.frames().0)),
                (Where::Device, true) => {}
                (_, true) => {
                    occupant.is_on_device = false;
                    self.batch.retire(lane);
                }
                (_, false) => {}
            }
        }
        let lanes = &self.lanes;
        let trees: Vec<_> = coming
            .par_iter()
            .map(|(lane, world)| {
                let (data, rupture) = (world.data().clone(), world.rupture().clone());
                let tree = &occupant(lanes, *lane).fitting.tree;
                tree.in_state_of(data, rupture, world.fruit_lives().clone(), world.frame())
            })
            .collect();
        let fittings: Vec<_> =
            coming.iter().map(|(lane, _)| occupant(lanes, *lane).fitting.clone()).collect();
        let starts: Vec<_> = coming.iter().map(|(_, world)| world.x_world_start()).collect();
        let tenants = coming.iter().zip(&trees).zip(fittings.iter().zip(&starts));
        let tenants: Vec<Tenant<'_>> = tenants
            .filter_map(|((&(lane, world), tree), (fitting, x_world_odom))| {
                Some(Tenant {
                    lane,
                    is_back: occupant(lanes, lane).is_planted,
                    tree,
                    fitted: fitting.fitted.as_ref()?,
                    x_world_odom,
                    model: world.model(),
                    handle: world.handle(),
                    data: world.data(),
                    start: world.start(),
                    set_points: world.set_points(),
                    suction: world.suction(),
                })
            })
            .collect();
        self.batch.plant(&tenants);
        for (lane, _) in coming {
            if let Some(occupant) = &mut self.lanes[lane] {
                (occupant.is_on_device, occupant.is_planted) = (true, true);
                (occupant.impulse, occupant.faults) = (0.0, [0; 2]);
            }
        }
    }
}

/// End of a world's frames on the device.
#[derive(Default)]
struct End {
    /// Frames taken there, and those of them that were calm, and in which free fruit moved here.
    frames: usize,
    calm: usize,
    free_fruit: usize,
    /// News after the last of them.
    last: Option<News>,
    /// True if a fruit came off or into the hand, or wood broke.
    is_changed: bool,
    /// True if the device has taken frames that do not count.
    is_ahead: bool,
    /// Reason for which the frames that follow in its span are computed here; none if there are none.
    left: Option<Where>,
    /// Their places.
    here: Vec<Where>,
}

fn occupant(lanes: &[Option<Occupant>], lane: usize) -> &Occupant {
    lanes[lane].as_ref().unwrap_or_else(|| panic!("no world has entered lane {lane}"))
}

/// Finds where the next frames of a world, of which it can take so many at once, are computed.
fn start_of<S: Span>(lanes: &[Option<Occupant>], most: usize, span: &mut S) -> Start {
    let (occupant, is_whole) = (occupant(lanes, span.lane()), span.is_whole());
    let (world, given) = span.frames();
    let Outlook { stays, frames, is_watched } = world.outlook(&given[..given.len().min(most)]);
    let commands = &given[..frames];
    let place = match (&occupant.fitting.fitted, stays) {
        (None, _) => Where::TooLarge,
        (Some(_), Some(stay)) => Where::Here(stay),
        (Some(_), None) => Where::Device,
    };
    let is_there = place == Where::Device && occupant.is_on_device;
    let is_late = !is_there && world.is_behind();
    let (lent, wish) = match (place, is_watched, is_whole && commands.len() == given.len()) {
        (Where::Device, true, _) => (commands.len(), Wish::Each),
        (Where::Device, false, true) => (commands.len(), Wish::Last),
        (Where::Device, false, false) => (commands.len(), Wish::News),
        _ => (0, if is_late { Wish::Last } else { Wish::News }),
    };
    let (climb, under_lip) = (world.climb(), world.under_lip(commands));
    let commands = world.coming(commands).take(lent).copied().collect();
    Start { place, commands, wish, climb, under_lip, is_late, here: Vec::new() }
}

/// Computes up to so many frames of a world here, the first one for a reason that is known; returns the reasons.
fn step_here<S: Span>(span: &mut S, first: Where, most: usize) -> Vec<Where> {
    let mut places = Vec::new();
    for _ in 0..span.frames().1.len().min(most) {
        let (world, commands) = span.frames();
        let command = commands[0];
        world.step(&command);
        places.push(first);
        if !span.after_frame() {
            break;
        }
    }
    places
}

/// Brings wood and fruit of a world up to its robot, as they were read at the first instant.
fn catch_up(batch: &WorldBatch, lane: usize, world: &mut World) {
    world.catch_up(|model, data| {
        batch.store_whole((lane, 0), model, data);
        batch.stem_wear(lane, 0).collect()
    });
}

/// Takes the frames of a world, if it was lent, with the motion that was read from the device.
fn take_back<S: Span>(batch: &WorldBatch, lanes: &[Option<Occupant>], span: &mut S, start: &Start) -> End {
    let mut end = End::default();
    let lane = span.lane();
    let occupant = occupant(lanes, lane);
    let mut impulse_before = occupant.impulse;
    for frame in 0..start.commands.len() {
        let (world, commands) = span.frames();
        let (command, news) = (commands[0], batch.news(lane, frame));
        let impulse = f64::from(news.contact_impulse) - impulse_before;
        let peak_force = f64::from(news.peak_contact_force);
        (end.frames, end.last) = (frame + 1, Some(news));
        impulse_before = f64::from(news.contact_impulse);
        end.free_fruit += usize::from(world.fruit_lives().any_free());
        if news.is_whole {
            end.is_changed = world.take_back(&command, |model, handle, data| {
                let set_points = batch.store_driven((lane, frame), model, handle, data);
                let meeting = batch.store_whole((lane, frame), model, data).unwrap_or_default();
                let contacts = meeting.contacts.iter().map(|contact| {
                    let [first, second] = contact.pair.map(|number| occupant.fitting.colliders[number]);
                    // In a report the collider that the model has first is `a`.
                    let (a, b, sign) =
                        if first < second { (first, second, 1.0) } else { (second, first, -1.0) };
                    let (n_world, force_world) = (contact.n_world * sign, contact.force_world * sign);
                    ContactReport { a, b, p_world: contact.p_world, n_world, gap: contact.gap, force_world }
                });
                let v_fruit_before = batch.fruit_before(lane, frame).collect();
                let stem_wear = batch.stem_wear(lane, frame).collect();
                let contacts = contacts.collect();
                let suction = batch.suction(lane, frame);
                Moved { set_points, suction, contacts, impulse, peak_force, v_fruit_before, stem_wear }
            });
        } else {
            end.calm += 1;
            world.take_back_calm(&command, |model, handle, data| Calm {
                set_points: batch.store_driven((lane, frame), model, handle, data),
                impulse,
                peak_force,
                excess: f64::from(news.excess),
                tension: f64::from(news.tension),
            });
        }
        let goes_on = span.after_frame();
        if end.frames == start.commands.len() {
            break;
        }
        if goes_on && news.is_whole {
            let (world, commands) = span.frames();
            end.left = match world.outlook(&commands[..1]).stays {
                Some(stay) => Some(Where::Here(stay)),
                // What the device knows of fruit and wood is not true any more.
                None => end.is_changed.then_some(Where::Changed),
            };
        }
        if !goes_on || end.left.is_some() {
            end.is_ahead = true;
            break;
        }
    }
    end
}
