//! Placement on grown trees.

use orchard_fruit::place;
use orchard_spec::Spec;
use orchard_treegen::grow;

#[test]
fn fruit_hangs_where_it_may() {
    let spec = Spec::paper();
    let mut full = 0;
    for seed in 0..40 {
        let skeleton = grow(&spec, seed, 0).unwrap();
        let fruit = place(&spec.fruit, &skeleton, seed, 0);
        assert_eq!(fruit, place(&spec.fruit, &skeleton, seed, 0), "not repeatable");
        assert!(fruit.len() <= spec.fruit.count.get() as usize);
        full += u32::from(fruit.len() == spec.fruit.count.get() as usize);
        for (i, f) in fruit.iter().enumerate() {
            let segment = &skeleton.segments[f.segment];
            assert!(segment.order >= 2 && segment.radius < 0.020);
            assert!(f.radius >= 0.026 && f.radius <= 0.035 && f.mass == 0.16);
            assert!((14.0..=23.0).contains(&f.detach_force));
            assert!(f.p_hang_world.z >= f.radius);
            for other in &fruit[..i] {
                assert!((f.p_hang_world - other.p_hang_world).norm() >= f.radius + other.radius);
            }
        }
    }
    // Most trees must bear the nominal load, or the fruit sweep would compare other loads than it states.
    assert!(full >= 36, "only {full} of 40 trees carry their 40 fruit");
}

#[test]
fn the_dial_gives_the_count() {
    let mut spec = Spec::paper();
    let skeleton = grow(&spec, 5, 0).unwrap();
    for count in [0, 1, 20] {
        spec.fruit.count = spec.fruit.count.with_value(count).unwrap();
        assert_eq!(place(&spec.fruit, &skeleton, 5, 0).len(), count as usize);
    }
}
