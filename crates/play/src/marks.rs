//! Arrows, spheres and axes over a world, as instances of small meshes that are drawn like it.

use orchard_geometry::{Pose, Rotation, Vec3, rotation_from_z};

use crate::mesh::{Fineness, Mesh};
use crate::paint::Colour;

/// Colours of marks, of Okabe and Ito's palette.
pub mod colour {
    use crate::paint::Colour;

    /// Orange: the axis x, and the pull of the hand.
    pub const ORANGE: Colour = [0.90, 0.62, 0.0];
    /// Bluish green: the axis y, and what the controller commands.
    pub const GREEN: Colour = [0.0, 0.62, 0.45];
    /// Blue: the axis z, and detections.
    pub const BLUE: Colour = [0.0, 0.45, 0.70];
    /// Vermilion: contact forces.
    pub const RED: Colour = [0.84, 0.37, 0.0];
    /// Yellow: the target.
    pub const YELLOW: Colour = [0.94, 0.89, 0.26];
    /// Sky blue: the reach sphere.
    pub const SKY: Colour = [0.34, 0.71, 0.91];
}

/// Places of the meshes in [`Marks::meshes`].
const CAPSULE: usize = 0;
const BALL: usize = 1;
const CONE: usize = 2;
/// Sides of round marks.
const SIDES: usize = 16;
/// Length of an arrow's head over its radius, and radius of the head over that of the shaft.
const HEAD: [f64; 2] = [5.0, 2.6];

/// Marks over a world.
#[derive(Debug, Default)]
pub struct Marks {
    instances: [Vec<f32>; 3],
}

impl Marks {
    /// The meshes: capsule, ball, cone.
    pub fn meshes() -> [Mesh; 3] {
        [Mesh::capsule(Fineness::TWIG), Mesh::capsule(Fineness::SPHERE), Mesh::cone(SIDES)]
    }

    /// The instances of each mesh. Their kind is the opacity, negative.
    pub fn instances(&self) -> &[Vec<f32>] {
        &self.instances
    }

    /// Takes all marks away.
    pub fn clear(&mut self) {
        self.instances.iter_mut().for_each(Vec::clear);
    }

    fn push(&mut self, mesh: usize, x_world: &Pose, sizes: [f64; 3], colour: Colour, opacity: f32) {
        let (p, q) = (x_world.translation.vector, x_world.rotation.coords);
        if !(p.iter().chain(q.iter()).chain(&sizes).all(|x| x.is_finite())) {
            return;
        }
        let numbers = p.iter().chain(q.iter()).chain(&sizes).map(|x| *x as f32);
        self.instances[mesh].extend(numbers.chain(colour).chain([-opacity]));
    }

    /// A sphere about a place \[m\].
    pub fn ball(&mut self, p_world: &Vec3, radius: f64, colour: Colour, opacity: f32) {
        self.push(
            BALL,
            &Pose::from_parts((*p_world).into(), Rotation::identity()),
            [radius, 0.0, 0.0],
            colour,
            opacity,
        );
    }

    /// A line between two places \[m\].
    pub fn line(&mut self, a: &Vec3, b: &Vec3, radius: f64, colour: Colour) {
        self.push(CAPSULE, &along(a, &(b - a)), [radius, (b - a).norm(), 0.0], colour, 1.0);
    }

    /// An arrow from a place \[m\] along a vector \[m\]; shorter ones than their head are all head.
    pub fn arrow(&mut self, from: &Vec3, way: &Vec3, radius: f64, colour: Colour) {
        let length = way.norm();
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let head = (HEAD[0] * radius).min(length);
        let x_world = along(from, way);
        if length > head {
            self.push(CAPSULE, &x_world, [radius, length - head, 0.0], colour, 1.0);
        }
        let x_head = along(&(from + way * (1.0 - head / length)), way);
        self.push(CONE, &x_head, [HEAD[1] * radius, head, 0.0], colour, 1.0);
    }

    /// The axes of a frame, each of a length \[m\].
    pub fn frame(&mut self, x_world_frame: &Pose, length: f64) {
        const THIN: f64 = 0.03;
        let p = x_world_frame.translation.vector;
        for (axis, colour) in
            [(Vec3::x(), colour::ORANGE), (Vec3::y(), colour::GREEN), (Vec3::z(), colour::BLUE)]
        {
            self.arrow(&p, &(x_world_frame.rotation * axis * length), THIN * length, colour);
        }
    }
}

/// Pose at a place whose z points along a vector.
fn along(p_world: &Vec3, way: &Vec3) -> Pose {
    let turn = way.try_normalize(0.0).map_or_else(Rotation::identity, |way| rotation_from_z(&way));
    Pose::from_parts((*p_world).into(), turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::INSTANCE_FLOATS;

    #[test]
    fn an_arrow_ends_where_it_points() {
        for way in [Vec3::new(0.3, -0.2, 0.5), -Vec3::z(), Vec3::z() * 0.001] {
            let mut marks = Marks::default();
            marks.arrow(&Vec3::new(1.0, 2.0, 3.0), &way, 0.004, colour::RED);
            let head: Vec<f64> = marks.instances()[CONE].iter().map(|x| f64::from(*x)).collect();
            assert_eq!(head.len(), INSTANCE_FLOATS);
            let (v, w) = (Vec3::new(head[3], head[4], head[5]), head[6]);
            let z = Vec3::z() * head[8];
            let turned = z + 2.0 * v.cross(&(v.cross(&z) + w * z));
            let tip = Vec3::new(head[0], head[1], head[2]) + turned;
            assert!((tip - (Vec3::new(1.0, 2.0, 3.0) + way)).norm() < 1e-6, "{tip}");
        }
    }

    #[test]
    fn what_is_not_finite_or_has_no_length_is_left_out() {
        let mut marks = Marks::default();
        marks.arrow(&Vec3::zeros(), &Vec3::zeros(), 0.01, colour::RED);
        marks.ball(&Vec3::new(f64::NAN, 0.0, 0.0), 0.1, colour::RED, 1.0);
        assert!(marks.instances().iter().all(Vec::is_empty));
        marks.frame(&Pose::identity(), 0.3);
        assert_eq!(marks.instances()[CONE].len(), 3 * INSTANCE_FLOATS);
        marks.clear();
        assert!(marks.instances().iter().all(Vec::is_empty));
    }
}
