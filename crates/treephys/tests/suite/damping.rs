//! Damping by modal ratios: a plucked limb loses what its config asks, at the substep of the benchmark.

use super::fixture::{Wood, chain, empty};
use orchard_geometry::{Vec3, math};
use orchard_multibody::equilibrium;
use orchard_quantity::from_toml;
use orchard_spec::Spec;
use orchard_spec::wood::{JointLaw, ModalDampingSpec, WoodSpec};
use orchard_treegen::{LeafSite, Skeleton};
use orchard_treephys::section;
use orchard_treephys::trials::{Trial, radius_of_frequency, straight_limb, sway_frequency};
use std::f64::consts::TAU;

/// Undragged wood of the corrected law with a damping ratio.
pub fn wood(ratio: f64, in_leaf: f64) -> WoodSpec {
    let text = format!(
        "ratio = {{ value = {ratio}, range = [0, 1], unit = '1', source = 'x' }}\n\
         ratio_in_leaf = {{ value = {in_leaf}, range = [0, 1], unit = '1', source = 'x' }}"
    );
    let law: ModalDampingSpec = from_toml("x", &text).unwrap();
    let mut wood = Spec::paper().wood;
    wood.joint_law = JointLaw::Corrected;
    wood.linear_drag = wood.linear_drag.with_value(0.0).unwrap();
    wood.angular_drag = wood.angular_drag.with_value(0.0).unwrap();
    wood.modal_damping = Some(law);
    wood
}

pub const LENGTH: f64 = 1.0;
pub const LINKS: usize = 8;

/// 1 to 10 Hz, ratios 0.01 to 0.1, h = 1/180 s: the ratio within 10 % of the asked one. Ratio and frequency are those that the step gives a mode,
/// `a = 1 + z^2 + 2 zeta z`, `b = 1 + z^2`, `cos(theta) = (a + b - z^2) / (2 sqrt(a b))` (`TreeBody::lead_springs`), within 2 %: Rayleigh's quotient is 0.4 %
/// high, and maxima are read off some 18 samples a period at 10 Hz.
#[test]
fn a_plucked_limb_has_the_asked_ratio() {
    for frequency in [1.0, 2.0, 5.0, 10.0] {
        for ratio in [0.01, 0.03, 0.1] {
            let wood = wood(ratio, ratio);
            let radius = radius_of_frequency(&wood, LENGTH, frequency);
            let limb = straight_limb(LINKS, LENGTH, radius);
            let h = Spec::paper().sim.substep();
            let z = TAU * h * sway_frequency(&limb, &wood, 0, &[]);
            let (a, b) = (1.0 + z * z + 2.0 * ratio * z, 1.0 + z * z);
            let theta = math::acos((a + b - z * z) / (2.0 * (a * b).sqrt()));
            let decay = 0.5 * math::ln(a / b);
            let stiffness = wood.youngs_modulus.si() * section::second_moment(radius);
            let mut trial = Trial::new(limb, &wood, &Spec::paper().sim).unwrap();
            let sway = trial.pluck(LINKS - 1, Vec3::z() * (1e-3 * stiffness), 6).unwrap().unwrap();
            println!("{frequency} Hz, {ratio}: {sway:?}");
            assert!((sway.ratio / ratio - 1.0).abs() < 0.1, "{frequency} Hz, {ratio}: {sway:?}");
            let stepped = decay / (theta * theta + decay * decay).sqrt();
            assert!((sway.ratio / stepped - 1.0).abs() < 0.02, "{frequency} Hz, {stepped}: {sway:?}");
            let stepped = theta / (TAU * h);
            assert!((sway.frequency / stepped - 1.0).abs() < 0.02, "{stepped} Hz, {ratio}: {sway:?}");
        }
    }
}

/// Rayleigh's quotient of a uniform cantilever is 0.4 % above Euler-Bernoulli's first frequency; 16 links and the caps of the capsules, which add
/// 4 r / 3 of length a link to the mass, take some off again.
#[test]
fn sway_frequency_is_that_of_a_beam() {
    let wood = wood(0.0, 0.0);
    let limb = straight_limb(16, LENGTH, radius_of_frequency(&wood, LENGTH, 0.5));
    let found = sway_frequency(&limb, &wood, 0, &[]);
    assert!((found / 0.5 - 1.0).abs() < 0.02, "{found}");
}

/// A limb of another order has dampers of its own sway; a leaf anywhere on it raises its ratio, and that of what bears it.
#[test]
fn limbs_are_damped_by_their_own_sway_and_leaves() {
    let mut skeleton = empty();
    chain(&mut skeleton, None, Vec3::zeros(), Vec3::z(), 4, 0.25, 0.03);
    chain(&mut skeleton, Some(3), Vec3::new(0.0, 0.0, 1.0), Vec3::x(), 3, 0.2, 0.008);
    chain(&mut skeleton, Some(1), Vec3::new(0.0, 0.0, 0.5), Vec3::y(), 3, 0.2, 0.008);
    let law = wood(0.02, 0.1);
    let times = |skeleton: &Skeleton| {
        let wood = Wood::new(skeleton, law.clone());
        let pairs = wood.tree.damping.iter().zip(&wood.tree.stiffness);
        pairs.map(|(damping, stiffness)| damping / stiffness).collect::<Vec<f64>>()
    };
    let bare = times(&skeleton);
    let of = |ratio: f64, root: usize| 2.0 * ratio / (TAU * sway_frequency(&skeleton, &law, root, &[]));
    for (i, root) in [0, 0, 0, 0, 4, 4, 4, 7, 7, 7].into_iter().enumerate() {
        assert!((bare[i] / of(0.02, root) - 1.0).abs() < 1e-12, "{i}");
    }
    let mut leafy = skeleton.clone();
    let x_segment_leaf = orchard_geometry::Pose::identity();
    leafy.leaves.push(LeafSite { segment: 6, x_segment_leaf, length: 0.08, width: 0.05, size_class: 1 });
    let leafy = times(&leafy);
    for (i, raised) in [true, true, true, true, true, true, true, false, false, false].into_iter().enumerate()
    {
        let factor = if raised { 5.0 } else { 1.0 };
        assert!((leafy[i] / bare[i] - factor).abs() < 1e-9, "{i}");
    }
}

/// Undamped wood neither gains nor loses amplitude over 2000 substeps, however stiff: the quadratic form
/// `v (M + h^2 K) v + q K q - h q K v` of a linear system is kept by the led springs. Here the amplitude is small, so that the tree is linear
/// to 1e-6.
#[test]
fn led_springs_keep_the_energy_of_undamped_wood() {
    let mut skeleton = empty();
    chain(&mut skeleton, None, Vec3::zeros(), Vec3::z(), 4, 0.25, 0.02);
    chain(&mut skeleton, Some(2), Vec3::new(0.0, 0.0, 0.75), Vec3::new(0.8, 0.0, 0.6), 5, 0.12, 0.006);
    let mut wood = Wood::new(&skeleton, wood(0.0, 0.0));
    wood.settings.gravity = Vec3::zeros();
    wood.load_tip(8, 0.12, Vec3::new(0.0, 5e-4, -1e-3));
    equilibrium(&wood.model, &mut wood.data, &Vec3::zeros(), 1e-16).unwrap();
    wood.data.body_force_world.fill(Vec3::zeros());
    wood.data.body_torque_world.fill(Vec3::zeros());
    let h = wood.settings.h;
    let form = |w: &mut Wood| {
        w.data.rest.fill(0.0);
        let kinetic = 2.0 * orchard_multibody::energy(&w.model, &w.data, &Vec3::zeros()).kinetic;
        let joints = w.tree.bodies.iter().flat_map(|&b| w.model.dofs(b).zip(w.model.qs(b)));
        kinetic
            + joints
                .map(|(dof, q)| (w.data.stiffness[dof], w.data.q[q], w.data.v[dof]))
                .map(|(k, q, v)| k * (h * h * v * v + q * q - h * q * v))
                .sum::<f64>()
    };
    let start = form(&mut wood);
    let mut worst: f64 = 0.0;
    for _ in 0..2000 {
        wood.substep();
        worst = worst.max((form(&mut wood) / start - 1.0).abs());
    }
    println!("worst change of the form: {worst:e}");
    assert!(worst < 1e-4, "{worst:e}");
}
