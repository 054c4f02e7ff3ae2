//! Damping of a mode under `K_d = c_d K_p`:
//!
//! `zeta = c_d omega / 2`, logarithmic decrement `delta = 2 pi zeta / sqrt(1 - zeta^2)`.

use super::fixture::{Wood, bare_wood};
use super::frequencies::{beam_frequency, bend_into, modal_coordinate};
use orchard_geometry::math;
use orchard_multibody::Integrator;
use orchard_spec::wood::JointLaw;
use std::f64::consts::TAU;

/// Damping ratio of the first mode of an 8-link cantilever, from the maxima of its swing, at h = 1/180 s.
fn measured_ratio(integrator: Integrator, frequency: f64, commanded: f64) -> f64 {
    let omega = TAU * frequency;
    let mut spec = bare_wood(JointLaw::Corrected, 2.0 * commanded / omega);
    // The modulus that puts the first mode at the wanted frequency.
    let ratio = frequency / beam_frequency(&Wood::cantilever(8, spec.clone()), 0);
    let modulus = spec.youngs_modulus.value() * ratio * ratio;
    spec.youngs_modulus = spec.youngs_modulus.with_value(modulus).unwrap();
    let mut wood = Wood::cantilever(8, spec);
    wood.settings.integrator = integrator;
    bend_into(&mut wood, 0, 1e-5);
    let mut signal = vec![modal_coordinate(&wood, 0)];
    let steps = (10.0 / (frequency * wood.settings.h)) as usize;
    for _ in 0..steps {
        wood.step();
        signal.push(modal_coordinate(&wood, 0));
    }
    // Maxima by the parabola through three samples.
    let maxima: Vec<f64> = signal
        .windows(3)
        .filter(|w| w[1] > 0.0 && w[1] >= w[0] && w[1] > w[2])
        .map(|w| w[1] + (w[0] - w[2]) * (w[0] - w[2]) / (8.0 * (2.0 * w[1] - w[0] - w[2])))
        .collect();
    let periods = (maxima.len() - 1) as f64;
    let delta = math::ln(maxima[0] / maxima[maxima.len() - 1]) / periods;
    delta / (TAU * TAU + delta * delta).sqrt()
}

/// The measured range of real branches, 0.01 to 0.08 of critical, comes out within 10 %.
#[test]
fn logarithmic_decrement_is_the_commanded_damping() {
    for commanded in [0.01, 0.03, 0.08] {
        let measured = measured_ratio(Integrator::ImplicitMidpoint, 3.0, commanded);
        println!("commanded {commanded}, measured {measured}");
        assert!((measured / commanded - 1.0).abs() < 0.1, "commanded {commanded}, measured {measured}");
    }
}

/// Undamped wood at 3 Hz and h = 1/180 s: the midpoint rule's own damping is under 0.002 of critical (it has
/// none; what is left is the reading of the maxima), the linearly implicit scheme's is `omega h / 2` = 0.052.
#[test]
fn own_damping_of_the_schemes() {
    let own = measured_ratio(Integrator::ImplicitMidpoint, 3.0, 0.0);
    assert!(own.abs() < 0.002, "{own}");
    // To first order in omega h = 0.105.
    let euler = measured_ratio(Integrator::LinearlyImplicitEuler, 3.0, 0.0);
    println!("midpoint {own}, Euler {euler}");
    assert!((euler / (TAU * 3.0 / 360.0) - 1.0).abs() < 0.1, "{euler}");
}
