//! The batches under test, each with its tolerances and their reasons.

use super::trees::Errors;
use orchard_batch::{Batch, Isa, ReferenceBatch, Stepper, TreeWorld};
use orchard_gpu::{Gpu, GpuBatch, Options};
use orchard_multibody::{Preconditioner, Solver};

/// Links of a world that the suite pushes at once, at most.
pub const PUSHES: usize = 8;

/// Errors that a batch may have against [`TreeWorld::step`].
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// Joint angle, over the largest joint angle of the world.
    pub angle: f64,
    /// Joint rate \[rad/s\].
    pub rate: f64,
    /// Position of a segment's tip \[m\].
    pub tip: f64,
    /// Position of a tip or of a fruit while broken limbs swing and loose fruit fall \[m\]: a swing multiplies the error that it starts with.
    pub falling: f64,
}

impl Tolerance {
    /// Of wood whose dampers hold ratios of 0.03: rounding has random signs, and adds up over the ten substeps and more in which a mode of a twig decays,
    /// by sqrt(10). In the paper's wood it decays within one or two.
    pub fn lightly_damped(self) -> Self {
        let more = 10_f64.sqrt();
        Self { angle: self.angle * more, rate: self.rate * more, ..self }
    }

    /// Of fruit on stems that bend: a unit in the last place of a height of 2 m, 2e-5 m/s in a substep, turns a stem of 6 cm by 3.5e-4 rad/s, and adds up over the
    /// hundred substeps and less in which a swing decays. A stem is nine times as stiff as a tether: rounding of a fruit's position shakes the wood four times as
    /// much, and with the wood's own rounding its angles err twice as much.
    pub fn on_stems(self) -> Self {
        let Self { angle, .. } = self.lightly_damped();
        Self { angle: 2.0 * angle, rate: 30.0 * self.rate, ..self }
    }

    /// True if these errors of a world without breaks are within it.
    pub fn admits(self, errors: Errors) -> bool {
        errors.angle <= self.angle && errors.rate <= self.rate && errors.tip <= self.tip
    }
}

/// Bits equal those of the f64 worlds, since the arithmetic is the same.
const SAME_BITS: Tolerance = Tolerance { angle: 0.0, rate: 0.0, tip: 0.0, falling: 0.0 };

/// Conjugate gradients in f64 end at their own relative residual.
const ITERATED: Tolerance = Tolerance { angle: 1e-8, rate: 1e-7, tip: 1e-8, falling: 1e-5 };

/// f32 has a relative rounding of 6e-8; 20 links in a chain and 180 substeps may lose three digits of it in angles and tips. Rates have a floor: one unit in the last place of a fruit's height of 2 m is
/// 1.2e-7 m, which is 2e-5 m/s in a substep, and a twig of 0.1 m that follows half of it turns at 1e-4 rad/s.
const LANES: Tolerance = Tolerance { angle: 1e-4, rate: 1e-4, tip: 5e-5, falling: 1e-2 };

/// f32 as in lanes. The bounds on angle and tip are those of `validate gpu`.
const DEVICE: Tolerance = Tolerance { angle: 5e-5, tip: 1e-5, ..LANES };

/// Conjugate gradients on the device stop at 1e-5 of the first residual. Residuals of random sign in 180 substeps add 1e-5 x sqrt(180) = 1.3e-4 to the rounding in angles.
const DEVICE_ITERATED: Tolerance = Tolerance { angle: 1.8e-4, ..DEVICE };

/// Function that makes a batch of some worlds.
type Build = dyn Fn(&[TreeWorld]) -> Box<dyn Stepper>;

/// One kind of batch.
pub struct Backend {
    pub name: String,
    /// Against the f64 worlds.
    pub tolerance: Tolerance,
    /// Of a reset world against the same world of a new batch.
    pub reset: Tolerance,
    /// True if it takes several times as long as each of the others: tests then take fewer kinds of worlds.
    pub is_slow: bool,
    build: Box<Build>,
}

impl Backend {
    fn new<S: Stepper + 'static>(
        name: impl Into<String>,
        tolerance: Tolerance,
        build: impl Fn(&[TreeWorld]) -> S + 'static,
    ) -> Self {
        let build = Box::new(move |worlds: &[TreeWorld]| -> Box<dyn Stepper> { Box::new(build(worlds)) });
        Self { name: name.into(), tolerance, reset: SAME_BITS, is_slow: false, build }
    }

    /// A batch of these worlds.
    pub fn build(&self, worlds: &[TreeWorld]) -> Box<dyn Stepper> {
        let stepper = (self.build)(worlds);
        assert_eq!((stepper.len(), stepper.is_empty()), (worlds.len(), worlds.is_empty()));
        stepper
    }
}

/// All batches that this computer can run. Without an adapter the calling test is reported as skipped, and the others are still tested.
#[track_caller]
pub fn backends() -> Vec<Backend> {
    let cg = Solver::Cg { preconditioner: Preconditioner::ArticulatedBody };
    let mut all = vec![
        Backend::new("f64", SAME_BITS, |worlds| ReferenceBatch::new(worlds.to_vec(), Solver::Aba)),
        Backend::new("f64, conjugate gradients", ITERATED, move |worlds| {
            ReferenceBatch::new(worlds.to_vec(), cg)
        }),
    ];
    all.extend(Isa::available().into_iter().map(|isa| {
        Backend::new(format!("lanes, {isa:?}"), LANES, move |worlds| Batch::with_isa(worlds, isa).unwrap())
    }));
    if let Some(gpu) = super::testing::device() {
        let solvers = [
            ("device", DEVICE, orchard_gpu::Solver::Aba),
            ("device, conjugate gradients", DEVICE_ITERATED, orchard_gpu::Solver::ConjugateGradients),
        ];
        all.extend(solvers.map(|(name, tolerance, solver)| {
            let gpu = gpu.clone();
            // The device finds the equilibrium again, in f32.
            let new = Backend::new(name, tolerance, move |worlds| on_device(&gpu, worlds, solver));
            let is_slow = solver == orchard_gpu::Solver::ConjugateGradients;
            Backend { reset: tolerance, is_slow, ..new }
        }));
    }
    all
}

fn on_device(gpu: &Gpu, worlds: &[TreeWorld], solver: orchard_gpu::Solver) -> GpuBatch {
    let options = Options { pushes_each: PUSHES, solver, ..Options::default() };
    GpuBatch::with_options(gpu, worlds, options).unwrap()
}
