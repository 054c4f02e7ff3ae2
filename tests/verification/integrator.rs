//! Order of the schemes in time, on a branch with a lateral that swings widely under gravity, drag and damping:
//! the error of the state at a fixed time falls with h^1 and h^2.

use super::fixture::{GRAVITY, Wood};
use orchard_geometry::{Vec3, math, rotation_from_z};
use orchard_multibody::Integrator;
use orchard_spec::Spec;
use orchard_treegen::{Segment, Skeleton};

fn forked() -> Skeleton {
    let mut skeleton = super::fixture::branch(Vec3::z(), &[(0.3, 0.01), (0.3, 0.008), (0.3, 0.006)]);
    let heading = Vec3::new(0.6, 0.48, 0.64);
    for k in 0..3 {
        skeleton.segments.push(Segment {
            parent: Some(if k == 0 { 1 } else { 2 + k }),
            p_base_world: Vec3::new(0.0, 0.0, 0.6) + heading * (0.2 * k as f64),
            r_world_segment: rotation_from_z(&heading),
            length: 0.2,
            radius: 0.004,
            order: 1,
        });
    }
    skeleton
}

/// Nodes after 0.2 s from a bent start.
fn state_after(integrator: Integrator, steps: u32) -> Vec<Vec3> {
    let mut spec = Spec::paper().wood;
    spec.damping_time = spec.damping_time.with_value(0.002).unwrap();
    let mut wood = Wood::new(forked(), spec);
    wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
    wood.settings.integrator = integrator;
    wood.settings.h = 0.2 / f64::from(steps);
    for (dof, v) in wood.data.v.iter_mut().enumerate() {
        *v = [1.5, -1.0, 0.7, 2.0][dof % 4];
    }
    for _ in 0..steps {
        wood.step();
    }
    (0..wood.tree.len()).map(|i| wood.p_tip(i)).collect()
}

fn order(integrator: Integrator, steps: u32) -> f64 {
    let distance =
        |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt();
    let [coarse, middle, fine] = [steps, 2 * steps, 4 * steps].map(|n| state_after(integrator, n));
    math::ln(distance(&coarse, &middle) / distance(&middle, &fine)) / math::ln(2.0)
}

/// Richardson: |s(h) - s(h/2)| / |s(h/2) - s(h/4)| = 2^p.
#[test]
fn observed_orders() {
    let euler = order(Integrator::LinearlyImplicitEuler, 2000);
    let midpoint = order(Integrator::ImplicitMidpoint, 500);
    println!("orders: Euler {euler}, midpoint {midpoint}");
    assert!((euler - 1.0).abs() < 0.1, "{euler}");
    assert!((midpoint - 2.0).abs() < 0.1, "{midpoint}");
}

/// Both schemes tend to the same motion: the midpoint's is within the first-order error of the other's.
#[test]
fn both_schemes_tend_to_the_same_motion() {
    let fine = state_after(Integrator::ImplicitMidpoint, 2000);
    let error = |steps| {
        let state = state_after(Integrator::LinearlyImplicitEuler, steps);
        state.iter().zip(&fine).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let (coarse, half) = (error(2000), error(4000));
    assert!((coarse / half - 2.0).abs() < 0.2, "{coarse} {half}");
}
