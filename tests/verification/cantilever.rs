//! Static deflection of a cantilever, Euler-Bernoulli:
//!
//! `w_tip = P L^3 / (3 E I)` under a tip load, `w_tip = q L^4 / (8 E I)` under its own weight q a metre.
//!
//! Loads are so small that the geometric error, of second order in the slope, is below 1e-6.

use super::fixture::{GRAVITY, Wood, bare_wood, branch};
use orchard_geometry::{Vec3, math};
use orchard_spec::wood::JointLaw;

/// Slope at the tip that the loads are chosen for \[rad\].
const SLOPE: f64 = 1e-4;

/// Tip deflection over the exact one under a tip load.
fn point_load(law: JointLaw, n: usize) -> f64 {
    let mut wood = Wood::cantilever(n, bare_wood(law, 0.1));
    let stiffness = wood.bending_stiffness(0);
    let load = SLOPE * 3.0 * stiffness;
    wood.load_tip(n - 1, Vec3::new(0.0, 0.0, -load));
    wood.settle();
    -wood.p_tip(n - 1).z / (load / (3.0 * stiffness))
}

/// Tip deflection over the exact one under its own weight, in weak gravity. The caps of the capsules overlap and
/// add mass, evenly along the branch: q is the weight of the links over the length.
fn self_weight(law: JointLaw, n: usize) -> f64 {
    let mut wood = Wood::cantilever(n, bare_wood(law, 0.1));
    let exact = wood.mass() * GRAVITY / (8.0 * wood.bending_stiffness(0));
    let part = SLOPE / exact;
    wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY * part);
    wood.settle();
    -wood.p_tip(n - 1).z / (exact * part)
}

/// Observed order of convergence between n and 2 n links.
fn order(error: impl Fn(usize) -> f64, n: usize) -> f64 {
    math::ln(error(n).abs() / error(2 * n).abs()) / math::ln(2.0)
}

/// The paper's E I / l gives `1 + 3 / (2 n) + 1 / (2 n^2)`: 32 % too much at 5 links, and first order.
#[test]
fn the_papers_law_keeps_its_bias() {
    for n in [1, 2, 4, 5, 8, 16] {
        let m = n as f64;
        let bias = 1.0 + 1.5 / m + 0.5 / (m * m);
        let ratio = point_load(JointLaw::Paper, n);
        assert!((ratio / bias - 1.0).abs() < 1e-6, "n = {n}: {ratio} against {bias}");
    }
    assert!((point_load(JointLaw::Paper, 5) - 1.32).abs() < 1e-4);
    let p = order(|n| point_load(JointLaw::Paper, n) - 1.0, 16);
    assert!((p - 1.0).abs() < 0.05, "order {p}");
}

/// The corrected law gives `1 + 1 / (2 n^2)`: 3.125 % at 4 links, and second order.
#[test]
fn the_corrected_law_converges_at_second_order() {
    for n in [1, 2, 4, 8, 16] {
        let m = n as f64;
        let ratio = point_load(JointLaw::Corrected, n);
        assert!((ratio / (1.0 + 0.5 / (m * m)) - 1.0).abs() < 1e-6, "n = {n}: {ratio}");
    }
    assert!(point_load(JointLaw::Corrected, 4) - 1.0 <= 0.032);
    let p = order(|n| point_load(JointLaw::Corrected, n) - 1.0, 4);
    assert!((p - 2.0).abs() < 0.01, "order {p}");
}

/// The weight of a link acts at its middle. With the moment `q (L - x)^2 / 2` at every joint x the sums give
/// an error of the order of the law: second for the corrected one, first for the paper's.
#[test]
fn self_weight_converges_at_the_order_of_the_law() {
    for (law, expected) in [(JointLaw::Corrected, 2.0), (JointLaw::Paper, 1.0)] {
        let p = order(|n| self_weight(law, n) - 1.0, 16);
        assert!((p - expected).abs() < 0.05, "{law:?}: order {p}");
    }
    // q l^4 / (2 E I) (n^3 / 2 + sum of j^3 for j < n) = q L^4 / (8 E I) (1 + 1 / n^2).
    let ratio = self_weight(JointLaw::Corrected, 8);
    assert!((ratio - (1.0 + 1.0 / 64.0)).abs() < 1e-6, "{ratio}");
}

/// Two sections of radii r and r/2 and lengths L/2: `w = P L^3 / (24 E I_1) (7 + I_1 / I_2)`. The halves either
/// side of the step are shared, so that second order is kept across it.
#[test]
fn a_step_of_the_section_keeps_second_order() {
    let error = |n: usize| {
        let cell = 1.0 / n as f64;
        let mut parts = vec![(cell, 0.006); n / 2];
        parts.extend(vec![(cell, 0.003); n / 2]);
        let mut wood = Wood::new(branch(Vec3::x(), &parts), bare_wood(JointLaw::Corrected, 0.1));
        let (thick, thin) = (wood.bending_stiffness(0), wood.bending_stiffness(n - 1));
        let exact = (7.0 + thick / thin) / (24.0 * thick);
        let load = SLOPE / exact;
        wood.load_tip(n - 1, Vec3::new(0.0, 0.0, -load));
        wood.settle();
        -wood.p_tip(n - 1).z / (load * exact) - 1.0
    };
    let p = order(error, 8);
    assert!((p - 2.0).abs() < 0.05, "order {p}");
}
