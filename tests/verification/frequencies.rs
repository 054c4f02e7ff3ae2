//! Bending modes of a uniform cantilever, Euler-Bernoulli:
//!
//! `omega_k = beta_k^2 sqrt(E I / (m' L^4))`, `cos beta cosh beta = -1`: beta = 1.87510, 4.69409, 7.85476,
//!
//! `phi_k(x) = cosh bx - cos bx - s (sinh bx - sin bx)`, `s = (cosh b + cos b) / (sinh b + sin b)` on 0..1.

use super::fixture::{Wood, bare_wood};
use orchard_geometry::math;
use orchard_multibody::{Integrator, forward_kinematics};
use orchard_spec::wood::JointLaw;
use std::f64::consts::TAU;

/// Roots of `cos beta cosh beta = -1`.
pub const BETA: [f64; 3] = [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613];

/// Mode shape k at x in 0..1.
pub fn shape(k: usize, x: f64) -> f64 {
    let b = BETA[k];
    let cosh = |y: f64| 0.5 * (math::exp(y) + math::exp(-y));
    let sinh = |y: f64| 0.5 * (math::exp(y) - math::exp(-y));
    let ratio = (cosh(b) + math::cos(b)) / (sinh(b) + math::sin(b));
    cosh(b * x) - math::cos(b * x) - ratio * (sinh(b * x) - math::sin(b * x))
}

/// Frequency of mode k of a beam of 1 m \[Hz\].
pub fn beam_frequency(wood: &Wood, k: usize) -> f64 {
    BETA[k] * BETA[k] * (wood.bending_stiffness(0) / wood.mass()).sqrt() / TAU
}

/// Bends a cantilever of 1 m along x, in the vertical plane, so that its nodes lie on mode k.
pub fn bend_into(wood: &mut Wood, k: usize, amplitude: f64) {
    let n = wood.tree.len();
    let node = |i: usize| amplitude * shape(k, i as f64 / n as f64);
    // Slopes of the links; each joint holds the difference to the link before. A link along x turned about
    // its own x or y axis moves in the plane that the axis is normal to: take the one that is horizontal.
    let mut before = 0.0;
    for i in 0..n {
        let slope = (node(i + 1) - node(i)) * n as f64;
        let body = wood.tree.bodies[i];
        for dof in wood.model.dofs(body) {
            // Turning about an axis a by t moves the tip along t (a x e_x): its z part is -t a_y.
            let lift = -wood.data.dof_axis_world(dof).y;
            wood.data.q[dof] = lift * (slope - before);
        }
        before = slope;
    }
    forward_kinematics(&wood.model, &mut wood.data);
}

/// Coordinate of mode k by projection of the nodes' heights, each with the mass of one link (half at the tip).
pub fn modal_coordinate(wood: &Wood, k: usize) -> f64 {
    let n = wood.tree.len();
    let weight = |i: usize| if i + 1 == n { 0.5 } else { 1.0 };
    (0..n).map(|i| weight(i) * shape(k, (i + 1) as f64 / n as f64) * wood.p_tip(i).z).sum()
}

/// Times at which a sampled signal rises through zero, by linear interpolation, in steps.
pub fn rising_zeros(signal: &[f64]) -> Vec<f64> {
    let rises = signal.windows(2).enumerate().filter(|(_, pair)| pair[0] < 0.0 && pair[1] >= 0.0);
    rises.map(|(i, pair)| i as f64 + pair[0] / (pair[0] - pair[1])).collect()
}

/// 16 links of the corrected law. Rigid links, half a link's bending lost at the tip: the error grows with the
/// square of the mode's wave number, hence 1, 2 and 5 %. 400 midpoint steps a period err by (2 pi / 400)^2 / 12.
#[test]
fn three_natural_frequencies_at_16_links() {
    for (k, tolerance) in [0.01, 0.02, 0.05].into_iter().enumerate() {
        let mut wood = Wood::cantilever(16, bare_wood(JointLaw::Corrected, 0.0));
        let exact = beam_frequency(&wood, k);
        wood.settings.integrator = Integrator::ImplicitMidpoint;
        wood.settings.h = 1.0 / (400.0 * exact);
        bend_into(&mut wood, k, 1e-5);
        let mut signal = Vec::new();
        for _ in 0..400 * 12 {
            wood.step();
            signal.push(modal_coordinate(&wood, k));
        }
        let zeros = rising_zeros(&signal);
        let periods = (zeros.len() - 1) as f64;
        let measured = periods / ((zeros[zeros.len() - 1] - zeros[0]) * wood.settings.h);
        println!(
            "mode {}: {measured} Hz, exact {exact} Hz, {:+.3} %",
            k + 1,
            100.0 * (measured / exact - 1.0)
        );
        assert!((measured / exact - 1.0).abs() < tolerance, "mode {}: {measured} against {exact} Hz", k + 1);
    }
}
