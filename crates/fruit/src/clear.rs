//! Test whether a fruit would hang clear of wood and ground.

use crate::apple::Fruit;
use orchard_geometry::Vec3;
use orchard_treegen::Skeleton;

/// The wood of a tree, with headings computed once for the tests of all sites.
pub(crate) struct Wood(Vec<Stick>);

struct Stick {
    p_base_world: Vec3,
    heading: Vec3,
    length: f64,
    radius: f64,
}

/// Relative margin of the distance test, many times its rounding.
const MARGIN: f64 = 1e-6;

impl Wood {
    pub fn new(skeleton: &Skeleton) -> Self {
        let stick = |s: &orchard_treegen::Segment| Stick {
            p_base_world: s.p_base_world,
            heading: s.heading(),
            length: s.length,
            radius: s.radius,
        };
        Self(skeleton.segments.iter().map(stick).collect())
    }

    /// True if a fruit hangs at least its diameter above the ground and outside all wood.
    pub fn leaves_clear(&self, fruit: &Fruit) -> bool {
        fruit.p_hang_world.z >= 2.0 * fruit.radius && self.0.iter().all(|stick| stick.is_clear_of(fruit))
    }
}

impl Stick {
    fn is_clear_of(&self, fruit: &Fruit) -> bool {
        let reach = fruit.radius + self.radius;
        let p_fruit = fruit.p_hang_world - self.p_base_world;
        // Most wood is far away.
        let far = (reach + self.length) * (1.0 + MARGIN);
        if p_fruit.norm_squared() > far * far {
            return true;
        }
        let along = p_fruit.dot(&self.heading).clamp(0.0, self.length);
        let nearest = self.p_base_world + self.heading * along;
        (fruit.p_hang_world - nearest).norm() > reach
    }
}
