//! Time that the parts of a round of frames take, for measurements of speed. No result depends on it.

use std::collections::BTreeMap;
use std::time::Instant;

/// Detail of the times that are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Those of the processor's parts, as they are without a profile.
    Parts,
    /// Those of kernels as well. Every kernel is a pass of its own then, so that the processor takes longer to submit them.
    Kernels,
}

/// Wall time by the part of a round, in which a crew begins and ends frames once, and device time by kernel, summed up over rounds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Profile {
    /// Rounds of crews that it holds.
    pub rounds: u64,
    /// Wall time of the processor by part \[s\].
    pub host: BTreeMap<&'static str, f64>,
    /// Time of the device by kernel \[s\], by its own clock; `all` is from the beginning of a round's first kernel to the end of its last. Empty where the adapter has no clock, and if only parts are timed.
    pub device: BTreeMap<&'static str, f64>,
    /// Contacts of each lane in the latest substep on the device, and Newton iterations of their solve.
    pub solves: Vec<[u32; 2]>,
}

impl Profile {
    /// Adds what a part took, from its beginning until now.
    pub fn add(&mut self, part: &'static str, since: Instant) {
        *self.host.entry(part).or_default() += since.elapsed().as_secs_f64();
    }

    /// Adds another one.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        self.rounds += other.rounds;
        for (own, others) in [(&mut self.host, &other.host), (&mut self.device, &other.device)] {
            for (part, seconds) in others {
                *own.entry(part).or_default() += seconds;
            }
        }
        self.solves.extend(&other.solves);
        self
    }
}

/// Takes the times of a round's parts, if they are kept.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    since: Option<Instant>,
}

impl Stopwatch {
    /// Starts it for a profile.
    pub fn start(profile: Option<&Profile>) -> Self {
        Self { since: profile.map(|_| Instant::now()) }
    }

    /// Adds the time since its start, or since the last part, to a part.
    pub fn part(&mut self, profile: &mut Option<Profile>, part: &'static str) {
        if let (Some(since), Some(profile)) = (&mut self.since, profile) {
            profile.add(part, *since);
            *since = Instant::now();
        }
    }
}
