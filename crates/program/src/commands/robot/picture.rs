//! A picture of a robot at q = 0 from the side and from above.

use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Circle, Line, Polyline, PrimitiveStyle, Triangle};
use orchard_geometry::{Image, Pose, Rotation, Vec3, transform};
use orchard_multibody::JointKind;
use orchard_robot::{Articulation, outline};

use crate::commands::gallery::caption::{self, Canvas};

/// Parts by role, for their colours.
#[derive(Debug, Clone, Default)]
pub struct Parts {
    /// Joints of the arm, from the shoulder out.
    pub arm: Vec<String>,
    /// Joints of the fingers.
    pub fingers: Vec<String>,
    /// Link of the base.
    pub base: Option<String>,
    /// Tool point.
    pub tool: Option<String>,
}

/// Side of each of the two views \[px\].
const SIDE: usize = 560;
/// Free space about the robot \[px\].
const MARGIN: usize = 30;
/// Height of the lines of text \[px\].
const TEXT: usize = 3 * caption::HEIGHT + 6;
/// Diameter of the mark of a mass of 1 kg \[px\]; the area is proportional to the mass.
const KILOGRAM: f64 = 8.0;
/// Smallest and largest diameter of such a mark \[px\].
const MARKS: [f64; 2] = [3.0, 40.0];

const PAPER: [u8; 3] = [255; 3];
const INK: Rgb888 = Rgb888::new(40, 44, 40);
const GRID: Rgb888 = Rgb888::new(222, 226, 230);
const REACH: Rgb888 = Rgb888::new(140, 149, 159);
const MASS: Rgb888 = Rgb888::new(190, 30, 30);

/// Colours of the roles, distinguishable with any colour vision (Okabe and Ito 2008): base, arm, hand, fingers, others.
const ROLES: [(&str, Rgb888); 5] = [
    ("base", Rgb888::new(0x9A, 0xA5, 0xB1)),
    ("arm", Rgb888::new(0x56, 0xB4, 0xE9)),
    ("hand", Rgb888::new(0x00, 0x9E, 0x73)),
    ("fingers", Rgb888::new(0xE6, 0x9F, 0x00)),
    ("other", Rgb888::new(0xE3, 0xD5, 0xE0)),
];

/// A view along an axis: world coordinates of the picture's right, up, and towards the viewer.
struct View {
    name: &'static str,
    /// Turns the world so that x is right, y is up and z is towards the viewer.
    turn: Rotation,
    left: usize,
}

/// Draws a robot.
pub fn draw(robot: &Articulation, parts: &Parts) -> Image<[u8; 3]> {
    let mut image = Image::filled(2 * SIDE, SIDE + TEXT, PAPER);
    let x_root_links = robot.poses_at_zero();
    let roles = roles(robot, parts);
    let shoulder = robot.link_of_joint(parts.arm.first().map_or("", String::as_str));
    let reach = shoulder.map(|l| (x_root_links[l].translation.vector, reach(robot, parts, &x_root_links)));
    let quarter = -std::f64::consts::FRAC_PI_2;
    let views = [
        View { name: "side: x right, z up", turn: Rotation::from_euler_angles(quarter, 0.0, 0.0), left: 0 },
        View { name: "above: x right, y up", turn: Rotation::identity(), left: SIDE },
    ];
    let extent = extent(robot, &x_root_links, reach);
    for view in &views {
        let scale = Scale::new(view, &extent);
        scale.grid(&mut image);
        if let Some((p_root_shoulder, radius)) = reach {
            scale.circle(&mut image, &p_root_shoulder, radius);
        }
        scale.shapes(&mut image, robot, &x_root_links, &roles);
        scale.skeleton(&mut image, robot, &x_root_links);
        scale.masses(&mut image, robot, &x_root_links);
        caption::write(&mut image, view.name, view.left + MARGIN, 2);
    }
    legend(&mut image, robot, reach.map(|r| r.1));
    image
}

/// Index in [`ROLES`] of each moving link.
fn roles(robot: &Articulation, parts: &Parts) -> Vec<usize> {
    let links = |names: &[String]| names.iter().filter_map(|n| robot.link_of_joint(n)).collect::<Vec<_>>();
    let (arm, fingers) = (links(&parts.arm), links(&parts.fingers));
    let base = parts.base.as_deref().and_then(|name| robot.frame(name)).and_then(|f| f.link);
    let first = arm.first().copied();
    let before = std::iter::successors(first, |&l| robot.links[l].parent).skip(1).collect::<Vec<_>>();
    let of = |link: usize| {
        let beyond = |from: &Option<&usize>| {
            from.is_some_and(|&end| {
                std::iter::successors(Some(link), |&l| robot.links[l].parent).any(|l| l == end)
            })
        };
        match () {
            () if fingers.iter().any(|f| beyond(&Some(f))) => 3,
            () if arm.last() == Some(&link) => 2,
            () if arm.contains(&link) => 1,
            () if beyond(&arm.last()) => 2,
            () if base == Some(link) || before.contains(&link) => 0,
            () => 4,
        }
    };
    (0..robot.links.len()).map(of).collect()
}

/// Longest distance that the arm can span, from its first joint to the tool: the sum of the distances between its joints \[m\].
fn reach(robot: &Articulation, parts: &Parts, x_root_links: &[Pose]) -> f64 {
    let joints = parts.arm.iter().filter_map(|name| robot.link_of_joint(name));
    let mut points: Vec<Vec3> = joints.map(|l| x_root_links[l].translation.vector).collect();
    if let Some(frame) = parts.tool.as_deref().and_then(|name| robot.frame(name))
        && let Some(link) = frame.link
    {
        points.push((x_root_links[link] * frame.x_link_frame).translation.vector);
    }
    points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// Corners of the box about all that is drawn.
fn extent(robot: &Articulation, x_root_links: &[Pose], reach: Option<(Vec3, f64)>) -> [Vec3; 2] {
    let (mut min, mut max) = (Vec3::repeat(-0.05), Vec3::repeat(0.05));
    let mut hold = |low: Vec3, high: Vec3| {
        min = min.inf(&low);
        max = max.sup(&high);
    };
    for (link, x) in robot.links.iter().zip(x_root_links) {
        hold(x.translation.vector, x.translation.vector);
        for s in &link.shapes {
            let around = s.shape.aabb(&(x * s.x_link_shape));
            hold(around.min, around.max);
        }
    }
    if let Some((centre, radius)) = reach {
        hold(centre.add_scalar(-radius), centre.add_scalar(radius));
    }
    [min, max]
}

/// Pixels of a view.
struct Scale<'v> {
    view: &'v View,
    /// Pixels of a metre.
    per_metre: f64,
    /// Middle of the view in its own axes \[m\].
    middle: Vec3,
}

impl<'v> Scale<'v> {
    fn new(view: &'v View, [min, max]: &[Vec3; 2]) -> Self {
        let per_metre = (SIDE - 2 * MARGIN) as f64 / (max - min).max();
        Self { view, per_metre, middle: view.turn * ((min + max) * 0.5) }
    }

    fn pixel(&self, p_root: &Vec3) -> Point {
        let p = (self.view.turn * p_root - self.middle) * self.per_metre;
        let half = SIDE as f64 / 2.0;
        let (right, down) = (self.view.left as f64 + half + p.x, half - p.y);
        Point::new(right.round() as i32, down.round() as i32)
    }

    fn inside(&self, point: Point) -> Point {
        let left = self.view.left as i32;
        Point::new(point.x.clamp(left, left + SIDE as i32 - 1), point.y.clamp(0, SIDE as i32 - 1))
    }

    fn line(&self, image: &mut Image<[u8; 3]>, from: Point, to: Point, colour: Rgb888, width: u32) {
        let line = Line::new(self.inside(from), self.inside(to));
        let Ok(()) = line.into_styled(PrimitiveStyle::with_stroke(colour, width)).draw(&mut Canvas(image));
    }

    /// Lines of the ground or of the axes through the root.
    fn grid(&self, image: &mut Image<[u8; 3]>) {
        let far = 1e3;
        for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
            let ends = [-far, far].map(|t| self.pixel(&(axis * t)));
            if ends[0] != ends[1] {
                self.line(image, ends[0], ends[1], GRID, 1);
            }
        }
    }

    fn circle(&self, image: &mut Image<[u8; 3]>, centre: &Vec3, radius: f64) {
        let diameter = (2.0 * radius * self.per_metre).round() as u32;
        let circle = Circle::with_center(self.pixel(centre), diameter);
        let Ok(()) = circle.into_styled(PrimitiveStyle::with_stroke(REACH, 1)).draw(&mut Canvas(image));
    }

    /// Filled outlines of all shapes, the farthest first.
    fn shapes(
        &self,
        image: &mut Image<[u8; 3]>,
        robot: &Articulation,
        x_root_links: &[Pose],
        roles: &[usize],
    ) {
        let turn = Pose::from_parts(Default::default(), self.view.turn);
        let mut all = Vec::new();
        for (i, link) in robot.links.iter().enumerate() {
            for s in &link.shapes {
                let x_view = turn * x_root_links[i] * s.x_link_shape;
                let corners = outline(std::iter::once((&s.shape, x_view)));
                all.push((s.shape.aabb(&x_view).max.z, roles[i], corners));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, role, corners) in all {
            let back = self.view.turn.inverse();
            let pixels: Vec<Point> =
                corners.iter().map(|p| self.pixel(&(back * Vec3::new(p[0], p[1], 0.0)))).collect();
            let fill = PrimitiveStyle::with_fill(ROLES[role].1);
            for i in 2..pixels.len() {
                let triangle = Triangle::new(pixels[0], pixels[i - 1], pixels[i]);
                let Ok(()) = triangle.into_styled(fill).draw(&mut Canvas(image));
            }
            let closed: Vec<Point> = pixels.iter().chain(pixels.first()).copied().collect();
            let edge = PrimitiveStyle::with_stroke(Rgb888::new(110, 118, 126), 1);
            let Ok(()) = Polyline::new(&closed).into_styled(edge).draw(&mut Canvas(image));
        }
    }

    /// Lines from joint to joint, with a dot at each that moves.
    fn skeleton(&self, image: &mut Image<[u8; 3]>, robot: &Articulation, x_root_links: &[Pose]) {
        for (link, x) in robot.links.iter().zip(x_root_links) {
            let here = self.pixel(&x.translation.vector);
            let parent = link.parent.map_or(Vec3::zeros(), |p| x_root_links[p].translation.vector);
            self.line(image, self.pixel(&parent), here, INK, 1);
            if link.joint != JointKind::Weld {
                let dot = Circle::with_center(here, 5).into_styled(PrimitiveStyle::with_fill(INK));
                let Ok(()) = dot.draw(&mut Canvas(image));
            }
        }
    }

    /// Circles at the centres of mass.
    fn masses(&self, image: &mut Image<[u8; 3]>, robot: &Articulation, x_root_links: &[Pose]) {
        for (link, x) in robot.links.iter().zip(x_root_links) {
            if link.inertia.mass > 0.0 {
                let diameter = (KILOGRAM * link.inertia.mass.sqrt()).clamp(MARKS[0], MARKS[1]);
                let centre = self.pixel(&transform(x, &link.inertia.p_com));
                let mark = Circle::with_center(centre, diameter.round() as u32);
                let Ok(()) = mark.into_styled(PrimitiveStyle::with_stroke(MASS, 2)).draw(&mut Canvas(image));
            }
        }
    }
}

fn legend(image: &mut Image<[u8; 3]>, robot: &Articulation, reach: Option<f64>) {
    let mut left = MARGIN;
    for (name, colour) in ROLES {
        let corner = Point::new(left as i32, SIDE as i32 + 6);
        let size = Size::new(14, 12);
        let mark = embedded_graphics::primitives::Rectangle::new(corner, size);
        let Ok(()) = mark.into_styled(PrimitiveStyle::with_fill(colour)).draw(&mut Canvas(image));
        caption::write(image, name, left + 20, SIDE);
        left += 20 + 7 * name.len() + 24;
    }
    let moving = robot.links.iter().filter(|link| link.joint != JointKind::Weld);
    let mass: f64 = moving.map(|link| link.inertia.mass).sum();
    let reach = reach.map_or(String::new(), |r| format!("; grey circle: reach of the arm {r:.2} m"));
    let ascii: String =
        robot.name.chars().map(|c| if c.is_ascii_graphic() { c } else { ' ' }).take(60).collect();
    caption::write(image, &format!("{ascii}: {mass:.2} kg in motion{reach}"), MARGIN, SIDE + caption::HEIGHT);
    let marks = "black: joints at q = 0; red: centres of mass, area by mass (3 px to 40 px wide)";
    caption::write(image, marks, MARGIN, SIDE + 2 * caption::HEIGHT);
}
