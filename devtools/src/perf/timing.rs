//! Timing of a piece of work.

pub use orchard_scaling::processor_time as cpu_time;

/// Rounds of a measurement; the median is reported.
const ROUNDS: usize = 5;

/// Shortest time of a round \[s\]: long compared with the clock's resolution and a scheduler's time slice.
const ROUND_SECONDS: f64 = 0.4;

/// Runs of `work` per second of processor time: the median over rounds. `work` gets a counter that counts over all
/// calls.
pub fn rate(mut work: impl FnMut(u32) -> anyhow::Result<()>) -> anyhow::Result<f64> {
    let mut call = 0;
    let mut rates = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let (start, first) = (cpu_time(), call);
        let spent = || (cpu_time() - start).as_secs_f64();
        while spent() < ROUND_SECONDS {
            work(call)?;
            call += 1;
        }
        rates.push(f64::from(call - first) / spent());
    }
    rates.sort_by(f64::total_cmp);
    Ok(rates[ROUNDS / 2])
}

/// Figures of the rounds of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounds(Vec<f64>);

impl Rounds {
    /// Makes rounds from given figures, at least one.
    pub fn new(figures: Vec<f64>) -> Self {
        Self(figures)
    }

    /// The median.
    pub fn median(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let half = sorted.len() / 2;
        if sorted.len() % 2 == 1 { sorted[half] } else { 0.5 * (sorted[half - 1] + sorted[half]) }
    }

    /// Ratios to the figures of another side, round by round. Both are measured alternately, so that a slowdown of the machine affects both.
    pub fn over(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a / b).collect())
    }

    /// Smallest and largest.
    pub fn spread(&self) -> [f64; 2] {
        [self.0.iter().copied().fold(f64::INFINITY, f64::min), self.0.iter().copied().fold(0.0, f64::max)]
    }
}

/// A measurement that can be repeated.
pub type Side<'a> = Box<dyn FnMut() -> anyhow::Result<f64> + 'a>;

/// Measures all sides alternately, round by round, so that a slowdown of the machine affects them alike.
pub fn alternate(rounds: usize, sides: &mut [Side<'_>]) -> anyhow::Result<Vec<Rounds>> {
    let mut figures = vec![Rounds(Vec::with_capacity(rounds)); sides.len()];
    for _ in 0..rounds {
        for (side, figures) in sides.iter_mut().zip(&mut figures) {
            figures.0.push(side()?);
        }
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_round_leaves_the_ratio() {
        let (fast, slow) = (Rounds::new(vec![4.0, 2.0, 4.0]), Rounds::new(vec![2.0, 1.0, 2.0]));
        assert_eq!(slow.over(&fast), Rounds::new(vec![0.5; 3]));
    }

    #[test]
    fn sides_take_turns() {
        let calls = std::cell::RefCell::new(Vec::new());
        let calls = &calls;
        let side = |name: f64| -> Side<'_> {
            Box::new(move || {
                calls.borrow_mut().push(name);
                Ok(name + calls.borrow().len() as f64)
            })
        };
        let figures = alternate(3, &mut [side(0.0), side(10.0)]).unwrap();
        assert_eq!(*calls.borrow(), [0.0, 10.0, 0.0, 10.0, 0.0, 10.0]);
        assert_eq!(figures[0], Rounds(vec![1.0, 3.0, 5.0]));
        assert_eq!((figures[1].median(), figures[1].spread()), (14.0, [12.0, 16.0]));
        assert_eq!(Rounds(vec![4.0, 1.0]).median(), 2.5);
    }
}
