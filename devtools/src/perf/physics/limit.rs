//! Ratio of a rate to the arithmetic peak of one core.
//!
//! The arithmetic of a substep is counted by hand, from the passes of `crates/batch/src/kernel`, in which nothing is
//! computed twice; a product and sum in one instruction count as two. `docs/performance.md` lists the count. The peak
//! is measured: as many independent chains of products and sums as keep the pipelines full.

use orchard_batch::TreeWorld;
use orchard_treephys::TreeBody;
use pulp::{Simd, WithSimd};

use crate::perf::timing::cpu_time;
use orchard_program::rows::Limit;

/// Operations per link: kinematics and right-hand side 279, inertia at the joint 148, elimination 256, root-to-leaf pass 57.
const LINK: usize = 279 + 148 + 256 + 57;
/// Operations to add a branch to its siblings at a fork.
const SIBLING: usize = 27;
/// Operations per fruit: elimination 112, its mass on the link 32, root-to-leaf pass 30.
const FRUIT: usize = 112 + 32 + 30;

/// Independent chains: latency of a product and sum times the number started per cycle, on the widest cores.
const CHAINS: usize = 12;
/// Independent chains for portable code: product and sum one after the other, two numbers per register.
const PORTABLE_CHAINS: usize = 24;
/// Products and sums per chain in one call.
const CHAIN_STEPS: usize = 4096;
/// Shortest time of a measurement \[s\].
const PEAK_SECONDS: f64 = 0.05;
/// Measurements; the best counts, since a peak is an upper bound.
const PEAK_ROUNDS: usize = 5;

/// Floating-point operations of a substep of a world.
pub fn operations(world: &TreeWorld) -> f64 {
    operations_of(&world.plant().tree, world.plant().fruit.len())
}

/// Floating-point operations of a substep of a tree with so many fruit, without contacts.
pub fn operations_of(tree: &TreeBody, fruit: usize) -> f64 {
    let links = tree.len();
    // Every link but the root is a child; the first of each parent needs no addition.
    let mut parents: Vec<usize> = tree.parent.iter().flatten().copied().collect();
    let children = parents.len();
    parents.sort_unstable();
    parents.dedup();
    (links * LINK + (children - parents.len()) * SIBLING + fruit * FRUIT) as f64
}

/// Peak rates of one core \[operations/s\].
#[derive(Debug, Clone, Copy)]
pub struct Peaks {
    /// f64 with the baseline instructions of the architecture, the compiler's default.
    pub portable_f64: f64,
    /// f64 in the widest vectors of the processor.
    pub vector_f64: f64,
    /// f32 in the widest vectors of the processor.
    pub vector_f32: f64,
}

impl Peaks {
    /// Measures them; takes about a second.
    pub fn measure() -> Self {
        Self {
            portable_f64: best_rate(portable_chains),
            vector_f64: best_rate(|| pulp::Arch::new().dispatch(Chains(Kind::F64))),
            vector_f32: best_rate(|| pulp::Arch::new().dispatch(Chains(Kind::F32))),
        }
    }

    /// A limit of f64 work at `rate` substeps/s a core.
    pub fn of_f64(&self, rate: f64, operations: f64, why: &str) -> Limit {
        Limit::new(rate * operations, self.portable_f64, self.vector_f64, operations, why)
    }

    /// A limit of f32 work in lanes at `rate` substeps/s a core.
    pub fn of_lanes(&self, rate: f64, operations: f64, why: &str) -> Limit {
        Limit::new(rate * operations, self.vector_f32, self.vector_f32, operations, why)
    }
}

/// Best rate of chains, which return their number of products and sums.
fn best_rate(chains: impl Fn() -> usize) -> f64 {
    let round = |_| {
        let (start, mut operations) = (cpu_time(), 0);
        loop {
            operations += 2 * chains();
            let seconds = (cpu_time() - start).as_secs_f64();
            if seconds > PEAK_SECONDS {
                return operations as f64 / seconds;
            }
        }
    };
    (0..PEAK_ROUNDS).map(round).fold(0.0, f64::max)
}

/// `x <- a x + b` with the fixed point 1, which avoids overflow and subnormal numbers.
const FACTOR: f64 = 0.5;

fn portable_chains() -> usize {
    let (factor, term) = std::hint::black_box((FACTOR, 1.0 - FACTOR));
    let mut x = [0.0_f64; PORTABLE_CHAINS];
    for _ in 0..CHAIN_STEPS {
        for x in &mut x {
            *x = *x * factor + term;
        }
    }
    std::hint::black_box(x);
    PORTABLE_CHAINS * CHAIN_STEPS
}

#[derive(Clone, Copy)]
enum Kind {
    F32,
    F64,
}

struct Chains(Kind);

impl WithSimd for Chains {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        match self.0 {
            Kind::F32 => {
                let factor = simd.splat_f32s(std::hint::black_box(FACTOR) as f32);
                let mut x = [factor; CHAINS];
                for _ in 0..CHAIN_STEPS {
                    for x in &mut x {
                        *x = simd.mul_add_e_f32s(*x, factor, factor);
                    }
                }
                std::hint::black_box(&x);
                CHAINS * CHAIN_STEPS * S::F32_LANES
            }
            Kind::F64 => {
                let factor = simd.splat_f64s(std::hint::black_box(FACTOR));
                let mut x = [factor; CHAINS];
                for _ in 0..CHAIN_STEPS {
                    for x in &mut x {
                        *x = simd.mul_add_e_f64s(*x, factor, factor);
                    }
                }
                std::hint::black_box(&x);
                CHAINS * CHAIN_STEPS * S::F64_LANES
            }
        }
    }
}
