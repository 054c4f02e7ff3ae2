//! Gaps and faults of public URDF files, and the assumptions in their place.

use orchard_geometry::{Mat3, Pose, Shape, Vec3, transform};
use orchard_multibody::{Body, JointKind, ModelBuilder};
use orchard_robot::{Articulation, Limit, Limits, Loaded, NoMeshes, Resources, RobotError, Warning};
use proptest::prelude::*;

const LIMIT: &str = "<limit lower='-1' upper='1' effort='5' velocity='2'/>";

fn link_with(name: &str, inside: &str) -> String {
    format!("<link name='{name}'>{inside}</link>")
}

fn inertial(mass: f64, moments: [f64; 3]) -> String {
    let [x, y, z] = moments;
    format!(
        "<inertial><mass value='{mass}'/><inertia ixx='{x}' ixy='0' ixz='0' iyy='{y}' iyz='0' izz='{z}'/></inertial>"
    )
}

fn link(name: &str) -> String {
    link_with(name, &inertial(2.0, [0.1; 3]))
}

fn joint(name: &str, kind: &str, ends: [&str; 2], inside: &str) -> String {
    let [parent, child] = ends;
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"
    )
}

fn load_with(parts: &[String], limits: &str) -> Result<Loaded, RobotError> {
    let limits = Limits::from_toml("limits.toml", limits).unwrap();
    let text = format!("<robot name='r'>{}</robot>", parts.concat());
    let loaded = Articulation::load(&text, &mut NoMeshes, &limits)?;
    // Whatever loads can be simulated.
    let mut builder = ModelBuilder::new();
    let mut bodies = Vec::new();
    for link in &loaded.articulation.links {
        bodies.push(builder.add_body(Body {
            parent: link.parent.map(|p| bodies[p]),
            joint: link.joint,
            x_parent_joint: link.x_parent_joint,
            inertia: link.inertia,
        }));
    }
    builder.build().unwrap_or_else(|e| panic!("{e}: {text}"));
    Ok(loaded)
}

fn load(parts: &[String]) -> Loaded {
    load_with(parts, "").unwrap_or_else(|e| panic!("{e}"))
}

fn limit_of(inside: &str, kind: &str, limits: &str) -> (Option<Limit>, Vec<Warning>) {
    let parts = [link("a"), link("b"), joint("j", kind, ["a", "b"], inside)];
    let loaded = load_with(&parts, limits).unwrap();
    (loaded.articulation.links[0].limit, loaded.warnings)
}

fn no_limit(lacks: &[&'static str]) -> Vec<Warning> {
    vec![Warning::NoLimit { joint: "j".to_owned(), lacks: lacks.to_vec() }]
}

#[test]
fn limits_that_are_absent_zero_or_beyond_any_robot_are_none() {
    let full = Limit { lower: -1.0, upper: 1.0, velocity: 2.0, effort: 5.0 };
    assert_eq!(limit_of(LIMIT, "revolute", ""), (Some(full), vec![]));
    let all = ["position", "velocity", "effort"];
    let blank = "<limit lower='0' upper='0' effort='0' velocity='0'/>";
    for nothing in ["", "<limit/>", blank, "<limit lower='-1e16' upper='1e16' effort='-1' velocity='1e9'/>"] {
        assert_eq!(limit_of(nothing, "prismatic", ""), (Some(Limit::NONE), no_limit(&all)), "{nothing}");
    }
    let no_speed = "<limit lower='-1' upper='1' effort='5' velocity='0'/>";
    let (limit, warnings) = limit_of(no_speed, "revolute", "");
    assert_eq!((limit.unwrap().velocity, warnings), (f64::INFINITY, no_limit(&["velocity"])));
    // URDF takes 0 for one end that is absent.
    let half = limit_of("<limit upper='1' effort='5' velocity='2'/>", "revolute", "").0.unwrap();
    assert_eq!((half.lower, half.upper), (0.0, 1.0));
    // Positions of a continuous joint are no limits.
    let (limit, warnings) = limit_of(LIMIT, "continuous", "");
    assert_eq!(limit.unwrap(), Limit { lower: -f64::INFINITY, upper: f64::INFINITY, ..full });
    assert!(warnings.is_empty());
}

#[test]
fn a_limits_file_completes_and_replaces() {
    let file = "[j]\nlower = -2.5\nupper = 2.5\nvelocity = 1.0\neffort = 7.0\n";
    let full = Limit { lower: -2.5, upper: 2.5, velocity: 1.0, effort: 7.0 };
    for (kind, inside) in [("continuous", ""), ("revolute", ""), ("revolute", LIMIT)] {
        assert_eq!(limit_of(inside, kind, file), (Some(full), vec![]));
    }
    let crossed = "<limit lower='1' upper='-1' effort='5' velocity='2'/>";
    assert_eq!(limit_of(crossed, "revolute", file).0, Some(full));
    let parts = [link("a"), link("b"), joint("j", "revolute", ["a", "b"], crossed)];
    assert!(load_with(&parts, "").unwrap_err().to_string().contains("joint `j`"));
    assert!(load_with(&parts, "[k]\nlower = 0.0").unwrap_err().to_string().contains("limits file"));
    for bad in ["[j]\nlower = 1.0\nupper = 1.0", "[j]\neffort = 0.0", "[j]\nupper = inf", "[j]\nspeed = 1.0"]
    {
        let line = Limits::from_toml("limits.toml", bad).unwrap_err().to_string();
        assert!(line.contains("limits.toml") && line.contains('j'), "{line}");
    }
}

#[test]
fn a_joint_with_one_position_is_fixed_there() {
    let locked = "<axis xyz='0 0 1'/><limit lower='1.5707963267948966' upper='1.5707963267948966' effort='5' velocity='2'/>";
    let tip = joint("k", "fixed", ["b", "c"], "<origin xyz='1 0 0'/>");
    let loaded = load(&[link("a"), link("b"), link("c"), joint("j", "revolute", ["a", "b"], locked), tip]);
    assert!(loaded.articulation.links.is_empty());
    let p = loaded.articulation.frame("c").unwrap().x_link_frame.translation.vector;
    assert!((p - Vec3::y()).norm() < 1e-12, "{p}");
    assert!(matches!(&loaded.warnings[..], [Warning::Locked { joint, .. }] if joint == "j"));
}

#[test]
fn links_without_mass_get_the_least_or_are_fixed() {
    let chain = |b: &str, c: &str| {
        let joints = [["a", "b"], ["b", "c"]].map(|ends| joint(ends[1], "revolute", ends, LIMIT));
        load(&[link("a"), link_with("b", b), link_with("c", c), joints.concat()])
    };
    // Between two joints that move.
    let loaded = chain("", &inertial(2.0, [0.1; 3]));
    assert_eq!(loaded.warnings, [Warning::NoMass { link: "b".to_owned(), assumed: 0.001 }]);
    assert_eq!(loaded.articulation.links[0].inertia.mass, 0.001);
    // At the end: a frame that nothing shows moves nothing.
    let loaded = chain(&inertial(2.0, [0.1; 3]), "");
    assert_eq!(loaded.warnings, [Warning::MovesNothing { joint: "c".to_owned() }]);
    assert_eq!((loaded.articulation.links.len(), loaded.articulation.frame("c").unwrap().link), (1, Some(0)));
    // At the end, with a shape.
    let ball = "<collision><geometry><sphere radius='0.1'/></geometry></collision>";
    let loaded = chain(&inertial(2.0, [0.1; 3]), ball);
    assert_eq!(loaded.warnings, [Warning::NoMass { link: "c".to_owned(), assumed: 0.001 }]);
    // An inertia without mass, and an incomplete one.
    let loaded = chain(
        &inertial(2.0, [0.1; 3]),
        &inertial(0.0, [0.1; 3]).replace("</inertial>", &format!("</inertial>{ball}")),
    );
    assert!(loaded.warnings.contains(&Warning::InertiaWithoutMass { link: "c".to_owned() }));
    let loaded = chain(&inertial(2.0, [0.1; 3]), &format!("<inertial><mass value='0'/></inertial>{ball}"));
    assert!(loaded.warnings.contains(&Warning::IncompleteInertial { link: "c".to_owned() }));
    // A joint that others mimic is a drive, whatever it carries.
    let led = joint("f", "revolute", ["a", "d"], &format!("{LIMIT}<mimic joint='c' multiplier='2'/>"));
    let drive = joint("c", "revolute", ["a", "c"], LIMIT);
    let loaded = load(&[link("a"), link_with("c", ""), link("d"), drive, led]);
    assert_eq!(loaded.articulation.links[1].mimic.unwrap().multiplier, 2.0);
    assert_eq!(loaded.warnings, [Warning::NoMass { link: "c".to_owned(), assumed: 0.001 }]);
}

#[test]
fn inertias_of_no_body_are_replaced_by_the_nearest() {
    let inertia = |moments: [f64; 3]| {
        let parts =
            [link("a"), link_with("b", &inertial(2.0, moments)), joint("j", "revolute", ["a", "b"], LIMIT)];
        let loaded = load(&parts);
        (loaded.articulation.links[0].inertia.i_com, loaded.warnings)
    };
    let diagonal = |m: [f64; 3]| Mat3::from_diagonal(&Vec3::from(m));
    // A body keeps its inertia, to the bit.
    for good in [[0.1, 0.2, 0.3], [0.1; 3], [1.0, 1.0, 1e-9]] {
        assert_eq!(inertia(good), (diagonal(good), vec![]));
    }
    // Second moments of (0.1, 0.1, 0.5) are 0.25, 0.25 and -0.15: the last is raised to that of 1 mm, 2e-6.
    let (made, warnings) = inertia([0.1, 0.1, 0.5]);
    assert!((made - diagonal([0.250_002, 0.250_002, 0.5])).norm() < 1e-12, "{made}");
    assert!(matches!(&warnings[..], [Warning::ImpossibleInertia { link, .. }] if link == "b"));
    for bad in [[0.0; 3], [-0.1, 0.1, 0.1], [0.0, 0.1, 0.1], [1.0, 1.0, 0.0], [-1.0, -2.0, -3.0]] {
        let (made, warnings) = inertia(bad);
        let m = made.symmetric_eigenvalues();
        assert!(m.min() > 0.0 && m.max() <= (m.sum() - m.max()) * (1.0 + 1e-9), "{bad:?}: {m}");
        assert_eq!(warnings.len(), 1);
    }
}

#[test]
fn followers_keep_ratio_and_offset() {
    let axis = "<axis xyz='0 1 0'/>";
    let mimic = |of: &str, rest: &str| format!("{axis}{LIMIT}<mimic joint='{of}' {rest}/>");
    let parts = |ends: &str| {
        vec![
            link("a"),
            link("b"),
            link("c"),
            link("d"),
            joint("k", "revolute", ["a", "c"], &mimic("j", "multiplier='-2' offset='0.5'")),
            joint("l", "prismatic", ["c", "d"], &mimic("k", "multiplier='3' offset='0.25'")),
            joint("j", "revolute", ["a", "b"], ends),
        ]
    };
    let loaded = load(&parts(&format!("{axis}{LIMIT}")));
    let robot = &loaded.articulation;
    let of = |name: &str| &robot.links[robot.link_of_joint(name).unwrap()];
    assert_eq!(
        of("k").mimic.map(|m| (m.leader, m.multiplier)),
        Some((robot.link_of_joint("j").unwrap(), -2.0))
    );
    assert_eq!(
        of("l").mimic.map(|m| (m.leader, m.multiplier)),
        Some((robot.link_of_joint("k").unwrap(), 3.0))
    );
    // With q = 0 for j, the file's position is 0.5 for k and 3 x 0.5 + 0.25 for l.
    assert!((of("k").x_parent_joint.rotation.angle() - 0.5).abs() < 1e-12);
    assert!((of("l").x_parent_joint.translation.vector - Vec3::y() * 1.75).norm() < 1e-12);
    let limit = of("k").limit.unwrap();
    assert_eq!((limit.lower, limit.upper), (-1.5, 0.5));
    // A leader that is fixed.
    let loaded = load(&parts("<limit lower='0.1' upper='0.1' effort='1' velocity='1'/>"));
    assert!(loaded.articulation.links.is_empty());
    assert_eq!(loaded.warnings.iter().filter(|w| matches!(w, Warning::MimicsFixed { .. })).count(), 2);
    let circle = [
        link("a"),
        link("b"),
        link("c"),
        joint("j", "revolute", ["a", "b"], &mimic("k", "")),
        joint("k", "revolute", ["a", "c"], &mimic("j", "")),
    ];
    assert!(load_with(&circle, "").unwrap_err().to_string().contains("mimics itself"));
}

#[test]
fn a_planar_joint_of_any_normal_keeps_its_frames() {
    let text =
        [link("a"), link("b"), joint("j", "planar", ["a", "b"], "<origin xyz='1 2 3'/><axis xyz='1 0 0'/>")];
    let robot = load(&text).articulation;
    let x_root_link = robot.links[0].x_parent_joint;
    // The joint's own z is the normal; the link's frame stands as the file says.
    assert!((x_root_link * Vec3::z() - Vec3::x()).norm() < 1e-12);
    let x = x_root_link * robot.frame("b").unwrap().x_link_frame;
    assert!((x.translation.vector - Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-12 && x.rotation.angle() < 1e-12);
}

#[test]
fn what_harvesting_does_not_need_cannot_spoil_a_file() {
    let visual = "<visual><geometry/><material name=''><texture/></material></visual>";
    let empty = "<collision/><collision><geometry/></collision>\
                 <collision><geometry><box size='0 0 0'/></geometry></collision>";
    let parts = [
        link_with("a", &(inertial(1.0, [0.1; 3]) + visual + empty)),
        "<gazebo><plugin filename='$(arg x)'><link name='a'/></plugin></gazebo><transmission name='t'><joint name='j'/>\
         </transmission><material name='m'><color/></material><!-- <xacro:if value='${x}'/> -->"
            .to_owned(),
        link("b"),
        joint("j", "floating", ["a", "b"], "<limit/><safety_controller/>"),
    ];
    let loaded = load(&parts);
    assert_eq!(loaded.articulation.links[1].joint, JointKind::Free);
    assert_eq!(loaded.warnings, [Warning::EmptyShape { link: "a".to_owned() }]);
}

/// Meshes by name; counts what is read.
struct Tetrahedra(usize);

impl Resources for Tetrahedra {
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        self.0 += 1;
        match name {
            "t.obj" => {
                Ok(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n".to_vec())
            }
            _ => Err("it is not here".to_owned()),
        }
    }

    fn find(&mut self, name: &str) -> Result<(), String> {
        self.read(name).map(|_| ())
    }
}

#[test]
fn meshes_become_shapes_at_their_places() {
    let mesh = |file: &str, rest: &str| {
        format!(
            "<collision><origin xyz='0 0 2'/><geometry><mesh filename='{file}' {rest}/></geometry></collision>"
        )
    };
    let text = format!(
        "<robot name='r'><link name='l'>{}{}{}<visual><geometry><mesh filename='v.dae'/></geometry></visual></link></robot>",
        mesh("t.obj", ""),
        mesh("t.obj", "scale='1 1 1'"),
        mesh("t.obj", "scale='-2 1 1'")
    );
    let mut files = Tetrahedra(0);
    let loaded = Articulation::load(&text, &mut files, &Limits::default()).unwrap();
    // Twice for two scales, and once in vain for the visual mesh.
    assert_eq!((files.0, loaded.meshes.len()), (3, 4));
    assert_eq!(loaded.warnings, [Warning::NoVisual { link: "l".to_owned(), file: "v.dae".to_owned() }]);
    let shapes = &loaded.articulation.links[0].shapes;
    let corner = |i: usize, p: [f64; 3]| {
        let x = shapes[i].x_link_shape.inverse();
        shapes[i].shape.signed_distance(&transform(&x, &Vec3::from(p)))
    };
    assert!(shapes.len() == 3 && shapes.iter().all(|s| matches!(s.shape, Shape::ConvexHull(_))));
    assert!(corner(0, [1.0, 0.0, 2.0]).abs() < 1e-9 && corner(2, [-2.0, 0.0, 2.0]).abs() < 1e-9);
    assert!(corner(0, [0.2, 0.2, 2.2]) < -0.1 && corner(2, [0.2, 0.2, 2.2]) > 0.1);
    let error = Articulation::load(&text.replace("t.obj", "u.obj"), &mut files, &Limits::default());
    assert_eq!(error.unwrap_err().to_string(), "link `l`: mesh `u.obj`: it is not here");
}

/// A random link: parent, mass \[kg\], place in the parent's frame \[m\], and kind of joint.
type RandomLink = (usize, f64, [f64; 3], usize);

/// A random tree, and keys that order the elements in the file.
fn random_tree() -> impl Strategy<Value = (Vec<RandomLink>, Vec<u32>)> {
    let link = (0..1000_usize, 0.1..5.0_f64, prop::array::uniform3(-1.0..1.0_f64), 0..5_usize);
    prop::collection::vec(link, 1..24).prop_flat_map(|links| {
        let keys = prop::collection::vec(any::<u32>(), 2 * links.len());
        (Just(links), keys)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Trees in any order, with odd names: mass and centre of mass are those of the links, and every frame is where the joints put it.
    #[test]
    fn random_trees_load((links, keys) in random_tree(), odd in "[ -~&&[^<>&'\"$]]{1,6}") {
        let name = |i: usize| format!("{odd}{i} é");
        let kinds = ["fixed", "revolute", "continuous", "prismatic", "floating"];
        let mut p_root = vec![Vec3::zeros()];
        let mut elements = vec![link(&name(0))];
        let (mut mass, mut moment) = (0.0, Vec3::zeros());
        let mut on_ground = vec![true];
        for (i, (parent, m, at, kind)) in links.iter().enumerate() {
            let (child, parent) = (i + 1, parent % (i + 1));
            let [x, y, z] = at;
            let ends = [name(parent), name(child)];
            let inside = format!("<origin xyz='{x} {y} {z}'/>{LIMIT}");
            elements.push(link_with(&name(child), &inertial(*m, [0.1; 3])));
            elements.push(joint(&format!("j{}", name(child)), kinds[*kind], [&ends[0], &ends[1]], &inside));
            p_root.push(p_root[parent] + Vec3::from(*at));
            on_ground.push(on_ground[parent] && *kind == 0);
            if !on_ground[child] {
                mass += m;
                moment += p_root[child] * *m;
            }
        }
        let mut order: Vec<usize> = (0..elements.len()).collect();
        order.sort_by_key(|&i| keys.get(i).copied().unwrap_or_default());
        let loaded = load(&order.iter().map(|&i| elements[i].clone()).collect::<Vec<_>>());
        prop_assert_eq!(&loaded.warnings, &vec![]);
        let robot = &loaded.articulation;
        let x_root_links = robot.poses_at_zero();
        let sum: f64 = robot.links.iter().map(|l| l.inertia.mass).sum();
        prop_assert!((sum - mass).abs() < 1e-9, "{sum} {mass}");
        let own = robot.links.iter().zip(&x_root_links).map(|(l, x)| transform(x, &l.inertia.p_com) * l.inertia.mass);
        prop_assert!((own.sum::<Vec3>() - moment).norm() < 1e-9);
        for (i, p) in p_root.iter().enumerate() {
            let frame = robot.frame(&name(i)).unwrap();
            let x_link = frame.link.map_or(Pose::identity(), |l| x_root_links[l]);
            prop_assert!(((x_link * frame.x_link_frame).translation.vector - p).norm() < 1e-9);
        }
    }
}
