//! Timing of a piece of work.

pub use orchard_program::rows::Rounds;
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

/// A measurement that can be repeated.
pub type Side<'a> = Box<dyn FnMut() -> anyhow::Result<f64> + 'a>;

/// Measures all sides alternately, round by round, so that a slowdown of the machine affects them alike.
pub fn alternate(rounds: usize, sides: &mut [Side<'_>]) -> anyhow::Result<Vec<Rounds>> {
    let mut figures = vec![Vec::with_capacity(rounds); sides.len()];
    for _ in 0..rounds {
        for (side, figures) in sides.iter_mut().zip(&mut figures) {
            figures.push(side()?);
        }
    }
    Ok(figures.into_iter().map(Rounds::new).collect())
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
        assert_eq!(figures[0], Rounds::new(vec![1.0, 3.0, 5.0]));
        assert_eq!((figures[1].median(), figures[1].spread()), (14.0, [12.0, 16.0]));
        assert_eq!(Rounds::new(vec![4.0, 1.0]).median(), 2.5);
    }
}
