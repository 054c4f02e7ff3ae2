//! The camera in whole worlds: depth and labels compared with parry's ray caster, and the visibility of fruit.

#[path = "../crates/camera/tests/suite/common/ray_cast.rs"]
mod ray_cast;

use orchard_camera::picture::look_at;
use orchard_camera::{
    Frame, Geometry, Item, Label, NO_INSTANCE, PixelBox, Scene, blade, fruit_views, render,
};
use orchard_geometry::height_field::closest_on_triangle;
use orchard_geometry::{
    Intrinsics, Pose, Rotation, Vec3, inverse_transform, math, rotation_from_z, transform,
};
use orchard_perception::{DetectorConfig, detect, mask};
use orchard_picker::{BaselinePicker, Controller, PickerConfig};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_world::World;
use ray_cast::RayCaster;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Largest difference of depths \[m\].
const TOLERANCE: f64 = 1e-5;
/// Number of views of a scene, and of random rays of each view: 10,000 rays a scene. Of every fifth view all pixels are checked besides.
const VIEWS: usize = 25;
const RAYS: usize = 400;
const VIEWS_A_WHOLE: usize = 5;

/// A world whose robot has driven to the tree for two seconds.
fn world(spec: Spec, seed: u64) -> World {
    let robot = RobotModel::paper();
    let mut command = robot.start_command();
    command.base_velocity = [0.4, 0.0, 0.0];
    let mut world = World::new(Arc::new(spec), Arc::new(robot), seed, 0).unwrap();
    for _ in 0..120 {
        world.step(&command);
    }
    world
}

fn with_foliage(density: f64) -> Spec {
    let mut spec = Spec::paper();
    spec.foliage.density = spec.foliage.density.with_value(density).unwrap();
    spec
}

/// A random camera in a world.
struct View {
    k: Intrinsics,
    x_world_camera: Pose,
    near: f64,
    far: f64,
    frame: Frame,
}

impl View {
    /// The first view has the wrist camera's own pose. Most others look at tree or robot, some in any direction, some from below the ground.
    /// Pixels are not square, the optical axis is off the middle, fields of view are narrow and wide.
    fn random(world: &World, scene: &Scene, number: usize, draws: &mut Stream) -> Self {
        let (width, height) = (draws.integer(40, 120) as usize, draws.integer(30, 90) as usize);
        let mut focal = |count: usize| 0.5 * count as f64 / math::tan(0.5 * draws.uniform(0.2, 2.2));
        let (fx, fy) = (focal(width), focal(height));
        let mut axis = |count: usize| draws.uniform(-0.1, 1.1) * count as f64;
        let k = Intrinsics { width, height, fx, fy, cx: axis(width), cy: axis(height) };
        let x_world_camera = if number == 0 {
            world.x_world_camera()
        } else {
            let p_robot = world.x_world_odom().translation.vector + Vec3::z() * 0.5;
            let p_target = if draws.unit() < 0.25 { p_robot } else { Vec3::z() * draws.uniform(0.3, 1.8) };
            let mut p_eye = p_target + direction(draws) * draws.uniform(0.1, 2.0);
            if draws.unit() < 0.9 {
                p_eye.z = p_eye.z.abs();
            }
            let roll = Rotation::from_axis_angle(&Vec3::z_axis(), draws.uniform(-PI, PI));
            let rotation = if draws.unit() < 0.8 {
                look_at(&p_eye, &p_target).rotation * roll
            } else {
                rotation_from_z(&direction(draws)) * roll
            };
            Pose::from_parts(p_eye.into(), rotation)
        };
        let (near, far) = (draws.uniform(0.0, 0.3), draws.uniform(2.0, 8.0));
        let mut frame = Frame::new(0, 0);
        render(scene, &k, &x_world_camera, near, far, &mut frame);
        Self { k, x_world_camera, near, far, frame }
    }

    fn is_valid(&self, z: f64) -> bool {
        (self.near..=self.far).contains(&z)
    }

    fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let Intrinsics { width, height, .. } = self.k;
        (0..height).flat_map(move |v| (0..width).map(move |u| (u, v)))
    }
}

/// A unit vector, uniform on the sphere.
fn direction(draws: &mut Stream) -> Vec3 {
    let (z, bearing) = (draws.uniform(-1.0, 1.0), draws.uniform(-PI, PI));
    let (sin, cos) = math::sin_cos(bearing);
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Distance of a point from the surface of an item \[m\].
fn distance(item: &Item, p_world: &Vec3) -> f64 {
    let p = inverse_transform(&item.x_world_item, p_world);
    match &item.geometry {
        Geometry::Shape(shape) => shape.signed_distance(&p).abs(),
        Geometry::Blade { mesh, length, width } => {
            let v = mesh.vertices(*length, *width);
            let from = |face: [usize; 3]| (p - closest_on_triangle(&p, &face.map(|k| v[k])).0).norm();
            blade::triangles().into_iter().map(from).fold(f64::INFINITY, f64::min)
        }
    }
}

/// Counts over the rays of a scene.
#[derive(Debug, Default)]
struct Tally {
    labels: BTreeMap<Label, usize>,
    /// Rays whose two nearest surfaces are closer together than the tolerance and that show the other one: of two surfaces in one plane the
    /// image shows the earlier item. From below, the ground and the underside of the robot's base are such a pair.
    ties: usize,
    /// Rays that pass a silhouette so closely that image and ray caster round to different sides of it.
    grazing: usize,
}

/// Compares one ray: depth to the tolerance, and label and instance of the item that was hit.
fn compare(scene: &Scene, caster: &RayCaster, view: &View, (u, v): (usize, usize), tally: &mut Tally) {
    let (k, x) = (&view.k, &view.x_world_camera);
    let seen = (view.frame.label[(u, v)], view.frame.instance[(u, v)]);
    let z = f64::from(view.frame.depth[(u, v)]);
    let names = |item: &Item| (item.label, item.instance) == seen;
    let hit = caster.at_pixel(k, x, u as f64, v as f64);
    *tally.labels.entry(seen.0).or_default() += 1;
    let agrees = match hit.filter(|(t, _)| view.is_valid(*t)) {
        None => z == 0.0,
        Some((t, item)) if (z - t).abs() <= TOLERANCE => {
            if names(&scene.items[item]) {
                return;
            }
            // Two surfaces at one depth: the ray must hit the one that the image shows as well.
            let (p, d) = (x.translation.vector, x.rotation * k.ray(u as f64, v as f64));
            let shown = scene.items.iter().position(names).expect("what shows is in the scene");
            tally.ties += 1;
            caster.cast(shown, &p, &d).is_some_and(|other| (other - t).abs() <= TOLERANCE)
        }
        // A depth may round across an end of the range.
        Some((t, _)) => z == 0.0 && (t - view.near).abs().min((t - view.far).abs()) <= TOLERANCE,
    };
    if !agrees {
        let beside = caster.beside_pixel(k, x, u as f64, v as f64);
        // A pixel's ten-thousandth moves a surface's depth by less than this unless it is seen edge-on.
        let explained =
            beside.iter().any(|t| (t.filter(|t| view.is_valid(*t)).unwrap_or(0.0) - z).abs() <= 1e-3);
        assert!(explained, "({u}, {v}): shows {seen:?} at {z}, cast {hit:?}, beside it {beside:?}");
        tally.grazing += 1;
    }
}

/// Checks depth, label and instance of every pixel: all are set or none, and the surface of the labelled item goes through the point.
fn check_pixels(scene: &Scene, view: &View) {
    let items: BTreeMap<(Label, u32), &Item> =
        scene.items.iter().map(|item| ((item.label, item.instance), item)).collect();
    assert_eq!(items.len(), scene.items.len(), "two items of one name");
    let Frame { depth, label, instance } = &view.frame;
    for at in view.pixels() {
        let z = f64::from(depth[at]);
        if label[at] == Label::None {
            assert_eq!((z, instance[at]), (0.0, NO_INSTANCE), "{at:?}");
            continue;
        }
        let item = items[&(label[at], instance[at])];
        assert!(view.is_valid(z), "{at:?}: {z}");
        // Only the ground has no instance number.
        assert_eq!(instance[at] == NO_INSTANCE, label[at] == Label::Ground, "{at:?}");
        let ray = view.k.ray(at.0 as f64, at.1 as f64);
        let gap = distance(item, &transform(&view.x_world_camera, &(ray * z)));
        // Only the depth is rounded to f32; all else is f64.
        let rounding = 0.5 * f64::from(f32::EPSILON) * z * ray.norm() + 1e-10;
        assert!(gap <= rounding, "{at:?}: {:?} lies {gap:e} m off", item.label);
    }
}

/// Checks 10,000 random rays of a scene, and all pixels of some of its views.
fn check(name: &str, world: &World, expected: &[Label]) {
    let scene = world.scene();
    let caster = RayCaster::new(&scene);
    let mut draws = Stream::new(5, 0, Purpose::Test);
    let mut tally = Tally::default();
    for number in 0..VIEWS {
        let view = View::random(world, &scene, number, &mut draws);
        if number % VIEWS_A_WHOLE == 0 {
            check_pixels(&scene, &view);
        }
        for _ in 0..RAYS {
            let u = draws.integer(0, view.k.width as u32 - 1) as usize;
            let v = draws.integer(0, view.k.height as u32 - 1) as usize;
            compare(&scene, &caster, &view, (u, v), &mut tally);
        }
    }
    println!("{name}: {tally:?}");
    for label in expected {
        assert!(tally.labels.get(label).is_some_and(|&rays| rays >= 10), "{name}: {label:?} in {tally:?}");
    }
    // Each grazing ray is explained; more than one in a thousand would still be suspicious.
    assert!(1000 * tally.grazing <= VIEWS * RAYS, "{name}: {tally:?}");
}

const TREE: [Label; 5] = [Label::Fruit, Label::Leaf, Label::Wood, Label::Robot, Label::Ground];

#[test]
fn images_of_a_nominal_world_match_the_ray_caster() {
    check("nominal", &world(Spec::paper(), 20250704), &TREE);
}

#[test]
fn images_of_dense_foliage_match_the_ray_caster() {
    check("foliage 1.5", &world(with_foliage(1.5), 20250705), &TREE);
}

#[test]
fn images_of_terrain_match_the_ray_caster() {
    let spec = Spec::paper();
    let spec = Spec { terrain: spec.terrain.with_amplitude(0.2).unwrap(), ..spec };
    let world = world(spec, 20250706);
    assert!(world.terrain().is_some());
    check("terrain 20 cm", &world, &TREE);
}

#[test]
fn images_of_posts_and_wires_match_the_ray_caster() {
    let world = world(Spec::preset(Preset::VTrellis), 20250704);
    check("v-trellis", &world, &[&TREE[..], &[Label::Scenery]].concat());
}

#[test]
fn images_of_a_calibrated_world_match_the_ray_caster() {
    check("calibrated", &world(Spec::preset(Preset::Calibrated), 20250704), &TREE);
}

/// The visibility of each fruit equals a count pixel by pixel: in the image, and along the rays that meet the fruit alone.
#[test]
fn fruit_views_match_a_count_of_pixels() {
    let world = world(Spec::paper(), 20250704);
    let scene = world.scene();
    let caster = RayCaster::new(&scene);
    let mut draws = Stream::new(6, 0, Purpose::Test);
    let (mut partly, mut hidden) = (0, 0);
    for number in 0..12 {
        let view = View::random(&world, &scene, number, &mut draws);
        let (k, x) = (&view.k, &view.x_world_camera);
        let seen = fruit_views(&view.frame, &scene, k, x);
        assert_eq!(seen.len(), world.fruit().len());
        for (i, seen) in seen.iter().enumerate() {
            let item = scene.items.iter().position(|f| f.label == Label::Fruit && f.instance == i as u32);
            let item = item.expect("every fruit is in the scene");
            let shows = |at: &(usize, usize)| {
                (view.frame.label[*at], view.frame.instance[*at]) == (Label::Fruit, i as u32)
            };
            let visible: Vec<(usize, usize)> = view.pixels().filter(shows).collect();
            let covered = view.pixels().filter(|&(u, v)| {
                let d_world = x.rotation * k.ray(u as f64, v as f64);
                caster.cast(item, &x.translation.vector, &d_world).is_some()
            });
            let covered = covered.count();
            let (us, vs) = (visible.iter().map(|at| at.0), visible.iter().map(|at| at.1));
            let ends = us.clone().min().zip(us.max()).zip(vs.clone().min().zip(vs.max()));
            assert_eq!(seen.instance, i as u32);
            assert_eq!(seen.visible_px as usize, visible.len(), "fruit {i}");
            assert_eq!(seen.unoccluded_px as usize, covered, "fruit {i}");
            assert_eq!(seen.visible_box, ends.map(|(u, v)| PixelBox { u, v }), "fruit {i}");
            let share = if covered > 0 { visible.len() as f64 / covered as f64 } else { 0.0 };
            assert_eq!(seen.visible_fraction(), share, "fruit {i}");
            assert_eq!(seen.radius, world.fruit().fruit[i].radius);
            let p_world = world.data().point_p_world[world.fruit().points[i].index()];
            // Rounding of a rotation at metres of range.
            assert!((transform(x, &seen.p_camera) - p_world).norm() < 1e-14, "fruit {i}");
            partly += usize::from(share > 0.0 && share < 1.0);
            hidden += usize::from(covered > 0 && visible.is_empty());
        }
    }
    assert!(partly >= 20 && hidden >= 5, "{partly} {hidden}");
}

/// True if most pixels on a sphere (camera frame) show the robot.
fn is_robot(frame: &Frame, k: &Intrinsics, p_camera: &Vec3, radius: f64) -> bool {
    /// A few times the detector's band \[m\].
    const NEAR: f64 = 5e-3;
    let (mut robot, mut other) = (0, 0);
    for (i, (&z, label)) in frame.depth.pixels().iter().zip(frame.label.pixels()).enumerate() {
        let p = k.back_project((i % k.width) as f64, (i / k.width) as f64, f64::from(z));
        if z > 0.0 && ((p - p_camera).norm() - radius).abs() <= NEAR {
            *if *label == Label::Robot { &mut robot } else { &mut other } += 1;
        }
    }
    robot > other
}

/// The hand is always in view; the picker's mask from kinematics prevents detections on it while the robot moves.
#[test]
fn the_picker_never_detects_fruit_on_the_robot() {
    const FRAMES: u32 = 20 * 60;
    let robot = Arc::new(RobotModel::paper());
    let mut seen = 0;
    for tree in 0..2 {
        let mut world = World::new(Arc::new(Spec::paper()), robot.clone(), 20250704, tree).unwrap();
        let mut picker = BaselinePicker::new(&robot, DetectorConfig::paper(), PickerConfig::baseline());
        for _ in 0..FRAMES {
            let observation = world.observe();
            let command = picker.act(&observation);
            if let (Some(_), Some(truth)) = (&observation.depth, world.camera_truth()) {
                let x_odom_camera = world.x_world_odom().inverse() * truth.sight.x_world_camera;
                for d in &picker.record().images.last().unwrap().detections {
                    let p_camera = inverse_transform(&x_odom_camera, &d.p_odom);
                    let on_robot = is_robot(truth.truth(), &observation.intrinsics, &p_camera, d.radius);
                    assert!(!on_robot, "tree {tree}, {} s", observation.time);
                    seen += 1;
                }
            }
            world.step(&command);
        }
    }
    assert!(seen > 100, "{seen} detections");
}

/// From all sides, the detector takes the arm's round links for fruit without a mask, and never with it.
#[test]
fn the_mask_hides_the_links() {
    let (world, detector) = (world(Spec::paper(), 20250704), DetectorConfig::paper());
    let scene = world.scene();
    let k = Intrinsics::from_vertical_fov(192, 144, 1.3);
    let p_arm = world.handle().x_world_base(world.data()).translation.vector + Vec3::z() * 0.8;
    let (mut bare, mut masked) = (0, 0);
    for i in 0..48 {
        let (sin, cos) = math::sin_cos(2.0 * PI * f64::from(i) / 48.0);
        let x = look_at(&(p_arm + Vec3::new(cos, sin, 0.1 * f64::from(i % 5)) * 0.7), &p_arm);
        let mut frame = Frame::new(0, 0);
        render(&scene, &k, &x, 0.3, 3.0, &mut frame);
        let link = |item: &Item| match &item.geometry {
            Geometry::Shape(shape) if item.label == Label::Robot => {
                Some((shape.clone(), x.inverse() * item.x_world_item))
            }
            _ => None,
        };
        let links: Vec<_> = scene.items.iter().filter_map(link).collect();
        let mask = mask::self_mask(&frame.depth, &k, &links, detector.mask.robot_margin.si());
        let on_robot = |mask| {
            let found = detect(&frame.depth, &k, mask, &detector).unwrap();
            found.iter().filter(|d| is_robot(&frame, &k, &d.p_camera, d.radius)).count()
        };
        bare += on_robot(None);
        masked += on_robot(Some(&mask));
    }
    assert!(bare > 0 && masked == 0, "{bare} links taken for fruit without a mask, {masked} with it");
}
