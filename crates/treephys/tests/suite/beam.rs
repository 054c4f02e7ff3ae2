//! The paper's joint law against Euler-Bernoulli.

use super::fixture;

use fixture::{Wood, chain, empty};
use orchard_geometry::Vec3;
use orchard_multibody::equilibrium;
use orchard_spec::Spec;
use orchard_treephys::section;

/// With k = E I / l at each of n joints, the root's included, a tip load P on a uniform cantilever of length L
/// deflects its tip by P L^3 / (3 E I) (1 + 3 / (2 n) + 1 / (2 n^2)). The load is small: 1e-4 rad at the tip, so
/// that the geometric error is of order 1e-8; the tolerance is 0.1 %.
#[test]
fn paper_law_has_the_chain_bias() {
    let (total, radius) = (1.0, 0.01);
    for n in [1, 2, 3, 4, 5, 8, 16] {
        let length = total / n as f64;
        let mut skeleton = empty();
        chain(&mut skeleton, None, Vec3::new(0.0, 0.0, 1.0), Vec3::x(), n, length, radius);
        let mut wood = Wood::new(&skeleton, Spec::paper().wood);
        let stiffness = wood.spec.youngs_modulus.si() * section::second_moment(radius);
        let load = 1e-4 * 3.0 * stiffness / (total * total);
        wood.load_tip(n - 1, length, Vec3::new(0.0, 0.0, -load));
        equilibrium(&wood.model, &mut wood.data, &Vec3::zeros(), 1e-14).unwrap();

        let deflection = 1.0 - wood.p_tip(n - 1, length).z;
        let exact = load * total * total * total / (3.0 * stiffness);
        let m = n as f64;
        let bias = 1.0 + 3.0 / (2.0 * m) + 1.0 / (2.0 * m * m);
        assert!(
            (deflection / exact / bias - 1.0).abs() < 1e-3,
            "n = {n}: {} against {bias}",
            deflection / exact
        );
    }
}

/// A pull that is released only loses energy: no damping is negative and the step is linearly implicit.
#[test]
fn energy_never_rises_after_release() {
    let mut skeleton = empty();
    chain(&mut skeleton, None, Vec3::zeros(), Vec3::z(), 4, 0.25, 0.02);
    chain(&mut skeleton, Some(2), Vec3::new(0.0, 0.0, 0.75), Vec3::new(0.8, 0.0, 0.6), 5, 0.12, 0.008);
    let mut wood = Wood::new(&skeleton, Spec::paper().wood);
    wood.load_tip(8, 0.12, Vec3::new(3.0, 5.0, -17.0));
    equilibrium(&wood.model, &mut wood.data, &wood.settings.gravity, 1e-14).unwrap();
    wood.data.body_force_world.fill(Vec3::zeros());
    wood.data.body_torque_world.fill(Vec3::zeros());
    let energy = |w: &Wood| orchard_multibody::energy(&w.model, &w.data, &w.settings.gravity).total();
    let mut last = energy(&wood);
    let start = last;
    for _ in 0..720 {
        wood.substep();
        let now = energy(&wood);
        // Round-off of a sum of some ten terms of a few joules.
        assert!(now <= last + 1e-13, "{last} -> {now}");
        last = now;
    }
    assert!(last < start - 1e-3);
}
