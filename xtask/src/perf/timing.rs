//! Timing of a piece of work.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// Rounds of a measurement; the median is reported.
const ROUNDS: usize = 5;

/// Shortest time that a round may take [s]: long against the clock's resolution and a scheduler's slice.
const ROUND_SECONDS: f64 = 0.4;

/// How often `work` runs a second: the median over rounds. `work` gets a counter that goes on over all calls.
pub fn rate(mut work: impl FnMut(u32) -> anyhow::Result<()>) -> anyhow::Result<f64> {
    let mut call = 0;
    let mut rates = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let (start, first) = (Instant::now(), call);
        while start.elapsed().as_secs_f64() < ROUND_SECONDS {
            work(call)?;
            call += 1;
        }
        rates.push(f64::from(call - first) / start.elapsed().as_secs_f64());
    }
    rates.sort_by(f64::total_cmp);
    Ok(rates[ROUNDS / 2])
}

/// Processor time of all threads of this process so far. Other processes on the machine do not count.
pub fn cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

/// Median over rounds of the processor time [s] that `work` takes on what `prepare` gives it, which is not timed.
pub fn median_cpu_seconds<T>(mut prepare: impl FnMut() -> T, mut work: impl FnMut(T)) -> f64 {
    let mut seconds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let subject = prepare();
            let start = cpu_time();
            work(subject);
            (cpu_time() - start).as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[ROUNDS / 2]
}
