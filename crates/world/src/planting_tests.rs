use super::*;
use orchard_spec::Preset;
use orchard_spec::randomisation::Axis;
use orchard_treegen::Habit;

const SEED: u64 = 23;

/// The randomised preset with every dial turned by `strength`.
fn spec(mode: Mode, strength: impl Fn(Axis) -> f64) -> Arc<Spec> {
    let mut spec = Spec::preset(Preset::Randomised);
    spec.randomisation.mode = mode;
    for &axis in Axis::ALL {
        let dial = spec.randomisation.strength_mut(axis);
        *dial = dial.with_value(strength(axis)).unwrap();
    }
    Arc::new(spec)
}

fn draw(spec: &Arc<Spec>, world: u32, episode: u32) -> Planting {
    Planting::draw(spec, SEED, world, episode).unwrap()
}

/// Draws of all axes, for a tree of 150 segments and 40 fruit.
struct Drawn {
    variation: Variation,
    crop: Crop,
    habit: Habit,
}

fn variation(spec: &Spec, world: u32, episode: u32) -> Drawn {
    let axes = &spec.randomisation;
    let stream = |axis| axes.mode.stream(axis, SEED, world, episode);
    Drawn {
        variation: Variation::draw(axes, stream),
        crop: Crop::draw(axes, 40, stream),
        habit: draw_habit(axes, 150, stream),
    }
}

/// Debug text distinguishes every bit of an f64, the sign of zero included.
fn bits(of: &impl std::fmt::Debug) -> String {
    format!("{of:?}")
}

/// Tree, fruit and colours without the spec, which holds the dials themselves.
fn grown(planting: &Planting) -> String {
    bits(&(&planting.skeleton, &planting.fruit, planting.appearance))
}

#[test]
fn strength_zero_is_the_base_bit_for_bit() {
    for mode in Mode::ALL {
        let spec = spec(mode, |_| 0.0);
        for world in 0..3 {
            let source = mode.base_world(world);
            let skeleton = grow(&spec, SEED, source).unwrap();
            let base = Planting::of_tree(spec.clone(), skeleton, SEED, source);
            let drawn = draw(&spec, world, 5);
            assert_eq!(bits(&drawn), bits(&base), "{mode:?}, world {world}");
            assert!(Arc::ptr_eq(&drawn.spec, &spec));
        }
    }
}

/// Draws of one axis.
fn of_axis(drawn: &Drawn, axis: Axis) -> String {
    let Drawn { variation: v, crop, habit } = drawn;
    let appearance = &v.appearance;
    match axis {
        Axis::Scale | Axis::SegmentLength => bits(&habit.length),
        Axis::Stockiness | Axis::SegmentRadius => bits(&habit.radius),
        Axis::SegmentBend => bits(&habit.bend),
        Axis::Droop => bits(&habit.droop),
        Axis::Lean => bits(&habit.lean_world),
        Axis::ForkSpread => bits(&habit.fork_spread),
        Axis::Twist => bits(&habit.twist),
        Axis::WoodDensity => bits(&v.wood_density),
        Axis::YoungsModulus => bits(&v.youngs_modulus),
        Axis::RuptureStress => bits(&v.rupture_stress),
        Axis::FruitSize => bits(&crop.size),
        Axis::FruitMass => bits(&crop.mass),
        Axis::FruitVisible => bits(&crop.count),
        Axis::LeafSize => bits(&v.leaf_size),
        Axis::LeafDensity => bits(&v.leaf_density),
        Axis::WoodTint => bits(&appearance.wood),
        Axis::FoliageColour => bits(&appearance.leaf),
        Axis::AppleHue => bits(&appearance.fruit),
    }
}

/// Axes that share a list or act on what another axis shows: scale is in lengths and radii, and a product has one
/// rounding more with both factors in it.
fn entangled(axis: Axis) -> Vec<Axis> {
    match axis {
        Axis::Scale => vec![Axis::Scale, Axis::SegmentLength, Axis::Stockiness, Axis::SegmentRadius],
        Axis::SegmentLength => vec![Axis::Scale, Axis::SegmentLength],
        Axis::Stockiness | Axis::SegmentRadius => vec![Axis::Stockiness, Axis::SegmentRadius],
        other => vec![other],
    }
}

/// Each dial moves its own axis, and no other by a bit; at zero its axis is the base's exactly, whatever the other dials are.
#[test]
fn every_dial_moves_its_axis_and_no_other() {
    let mode = Mode::DistinctTopology;
    let full = variation(&spec(mode, |_| 1.0), 1, 0);
    let none = variation(&spec(mode, |_| 0.0), 1, 0);
    for &turned in Axis::ALL {
        let alone = variation(&spec(mode, |axis| f64::from(u8::from(axis == turned))), 1, 0);
        let without = variation(&spec(mode, |axis| f64::from(u8::from(axis != turned))), 1, 0);
        for &axis in Axis::ALL {
            let (alone, without) = (of_axis(&alone, axis), of_axis(&without, axis));
            if entangled(turned).contains(&axis) {
                assert_ne!(alone, of_axis(&none, axis), "{turned:?} does not move {axis:?}");
                assert_ne!(without, of_axis(&full, axis), "{turned:?} does not move {axis:?}");
            } else {
                assert_eq!(alone, of_axis(&none, axis), "{turned:?} moves {axis:?}");
                assert_eq!(without, of_axis(&full, axis), "{turned:?} moves {axis:?}");
            }
        }
        if entangled(turned).len() == 1 {
            assert_eq!(of_axis(&without, turned), of_axis(&none, turned), "{turned:?} at zero");
        }
    }
}

/// Every dial alone shows in the planting, and only where it should.
#[test]
fn every_dial_shows_in_the_tree_that_it_changes() {
    let base = draw(&spec(Mode::DistinctTopology, |_| 0.0), 1, 0);
    for &turned in Axis::ALL {
        let now = draw(&spec(Mode::DistinctTopology, |axis| f64::from(u8::from(axis == turned))), 1, 0);
        let (a, b) = (&base.spec, &now.spec);
        let changed = [
            base.skeleton.segments != now.skeleton.segments,
            base.skeleton.leaves != now.skeleton.leaves,
            base.fruit != now.fruit,
            a.wood != b.wood,
            base.appearance != now.appearance,
        ];
        let expected = match turned {
            Axis::WoodDensity | Axis::YoungsModulus | Axis::RuptureStress => {
                [false, false, false, true, false]
            }
            Axis::FruitSize | Axis::FruitMass | Axis::FruitVisible => [false, false, true, false, false],
            Axis::LeafSize | Axis::LeafDensity => [false, true, false, false, false],
            Axis::WoodTint | Axis::FoliageColour | Axis::AppleHue => [false, false, false, false, true],
            _ => [true, true, true, false, false],
        };
        assert_eq!(changed, expected, "{turned:?}");
        let structure =
            |p: &Planting| p.skeleton.segments.iter().map(|s| (s.parent, s.order)).collect::<Vec<_>>();
        assert_eq!(structure(&base), structure(&now), "{turned:?}");
    }
}

/// The figures at strength 1, over many trees.
#[test]
fn draws_keep_to_their_intervals() {
    let spec = spec(Mode::DistinctTopology, |_| 1.0);
    let (base, axes) = (Spec::paper(), &spec.randomisation);
    let (size_low, size_high) = axes.fruit_size.limits.si();
    let (mass_low, mass_high) = axes.fruit_mass.limits.si();
    for world in 0..200 {
        let Drawn { variation: v, crop, habit } = variation(&spec, world, 0);
        for (axis, factor) in [
            (&axes.wood_density, v.wood_density),
            (&axes.youngs_modulus, v.youngs_modulus),
            (&axes.rupture_stress, v.rupture_stress),
            (&axes.fork_spread, habit.fork_spread),
            (&axes.leaf_size, v.leaf_size),
            (&axes.leaf_density, v.leaf_density),
        ] {
            assert!(axis.factor.contains_si(factor), "{factor}");
        }
        assert!(habit.lean_world.norm() <= 5.0_f64.to_radians() && habit.lean_world.z == 0.0);
        assert!(habit.twist.abs() <= 22.0_f64.to_radians());
        assert!((22..=40).contains(&crop.count), "{}", crop.count);
        let own = v.constants(&spec);
        assert_eq!(own.wood.density.si(), base.wood.density.si() * v.wood_density);
        assert_eq!(own.sim, base.sim);
    }
    for world in 0..20 {
        for fruit in draw(&spec, world, 0).fruit {
            assert!(
                (size_low..=size_high).contains(&fruit.radius)
                    && (mass_low..=mass_high).contains(&fruit.mass)
            );
        }
    }
}

#[test]
fn modes_share_what_they_say() {
    let topology = |p: &Planting| p.skeleton.segments.iter().map(|s| s.parent).collect::<Vec<_>>();
    let dimensions =
        |p: &Planting| bits(&p.skeleton.segments.iter().map(|s| (s.length, s.radius)).collect::<Vec<_>>());

    let homogeneous = spec(Mode::Homogeneous, |_| 1.0);
    assert_eq!(bits(&draw(&homogeneous, 0, 0)), bits(&draw(&homogeneous, 3, 1)));

    let shared = spec(Mode::SharedDimensions, |_| 1.0);
    let (a, b, later) = (draw(&shared, 0, 0), draw(&shared, 1, 0), draw(&shared, 1, 1));
    assert_eq!((topology(&a), dimensions(&a)), (topology(&b), dimensions(&b)));
    assert_ne!(grown(&a), grown(&b));
    assert_eq!(topology(&b), topology(&later));
    assert_ne!(dimensions(&b), dimensions(&later));
    assert_eq!(dimensions(&later), dimensions(&draw(&shared, 7, 1)));
    // All but the dimensions is the world's for good.
    assert_eq!((&b.spec, b.appearance), (&later.spec, later.appearance));

    let distinct = spec(Mode::DistinctDimensions, |_| 1.0);
    let (a, b) = (draw(&distinct, 0, 0), draw(&distinct, 1, 0));
    assert_eq!(topology(&a), topology(&b));
    assert_ne!(dimensions(&a), dimensions(&b));
    assert_eq!(bits(&b), bits(&draw(&distinct, 1, 4)));

    let free = spec(Mode::DistinctTopology, |_| 1.0);
    assert_ne!(topology(&draw(&free, 0, 0)), topology(&draw(&free, 1, 0)));
}

/// Fruit hang clear of the wood that bears them, as placed fruit do. With all of them requested, few find no room;
/// with the drawn part requested, their number is exact unless fewer find room.
#[test]
fn fruit_hang_clear_of_reshaped_wood() {
    let spec = spec(Mode::DistinctTopology, |axis| f64::from(u8::from(axis != Axis::FruitVisible)));
    let (mut there, mut grown) = (0, 0);
    for world in 0..40 {
        let planting = draw(&spec, world, 0);
        let base = place(&spec.fruit, &grow(&spec, SEED, world).unwrap(), SEED, world);
        there += planting.fruit.len();
        grown += base.len();
        for (i, a) in planting.fruit.iter().enumerate() {
            assert!(a.p_hang_world.z >= 2.0 * a.radius);
            for segment in &planting.skeleton.segments {
                let shape =
                    orchard_geometry::Shape::Capsule { radius: segment.radius, length: segment.length };
                let p = orchard_geometry::inverse_transform(&segment.x_world_segment(), &a.p_hang_world);
                assert!(shape.signed_distance(&p) > a.radius - 1e-9);
            }
            for b in &planting.fruit[..i] {
                assert!((a.p_hang_world - b.p_hang_world).norm() >= a.radius + b.radius);
            }
        }
    }
    assert!(there * 10 > grown * 8, "{there} of {grown} fruit are left");

    let drawn = self::spec(Mode::DistinctTopology, |_| 1.0);
    for world in 0..40 {
        let n = place(&drawn.fruit, &grow(&drawn, SEED, world).unwrap(), SEED, world).len();
        let stream = |axis| Mode::DistinctTopology.stream(axis, SEED, world, 0);
        let asked = Crop::draw(&drawn.randomisation, n, stream).count;
        let have_room = draw(&spec, world, 0).fruit.len();
        assert_eq!(draw(&drawn, world, 0).fruit.len(), asked.min(have_room));
    }
}

#[test]
fn the_scene_of_a_planting_shows_all_of_it() {
    use orchard_camera::Label;
    let planting = draw(&spec(Mode::DistinctTopology, |_| 1.0), 2, 0);
    let scene = tree_scene(&planting);
    let count = |label| scene.items.iter().filter(|item| item.label == label).count();
    let (segments, fruit) = (planting.skeleton.segments.len(), planting.fruit.len());
    assert_eq!((count(Label::Leaf), count(Label::Fruit)), (planting.skeleton.leaves.len(), fruit));
    assert_eq!(count(Label::Wood), segments + fruit, "segments and stems");
    assert!(scene.items.iter().filter(|item| item.label == Label::Fruit).all(|item| item.tint.is_some()));
}

/// A world's picture has the planting's colours; what the depth camera sees has none.
#[test]
fn pictures_are_coloured_and_measurements_are_not() {
    use orchard_camera::Label;
    let spec = spec(Mode::DistinctTopology, |_| 1.0);
    let world =
        crate::World::new(spec.clone(), Arc::new(orchard_robot::RobotModel::paper()), SEED, 2).unwrap();
    assert!(world.scene().items.iter().all(|item| item.tint.is_none()));
    let appearance = draw(&spec, 2, 0).appearance;
    for item in world.picture_scene().items {
        let expected = match item.label {
            _ if item.instance == orchard_camera::NO_INSTANCE => None,
            Label::Wood => appearance.wood,
            Label::Leaf => appearance.leaf,
            Label::Fruit => appearance.fruit,
            _ => None,
        };
        assert_eq!(item.tint, expected);
    }
}
