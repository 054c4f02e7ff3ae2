//! Scenes whose items move with bodies.

use orchard_geometry::Pose;

use crate::{Item, Scene};

/// A scene whose items are fixed to bodies: what is drawn of a world again and again, each time with other poses of the bodies.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MovingScene {
    /// The items, each posed in the frame of its body.
    still: Scene,
    /// Body of each item.
    bodies: Vec<u32>,
}

impl MovingScene {
    /// Adds items of a body, posed in its frame.
    pub fn extend(&mut self, body: u32, items: impl IntoIterator<Item = Item>) {
        self.still.items.extend(items);
        self.bodies.resize(self.still.items.len(), body);
    }

    /// The items, each posed in the frame of its body.
    pub fn items(&self) -> &[Item] {
        &self.still.items
    }

    /// The items as a scene in which every body is at the origin.
    pub fn still(&self) -> &Scene {
        &self.still
    }

    /// The items, to change their colours.
    pub fn items_mut(&mut self) -> &mut [Item] {
        &mut self.still.items
    }

    /// Body of each item.
    pub fn bodies(&self) -> &[u32] {
        &self.bodies
    }

    /// The scene with its bodies at some poses in the world.
    ///
    /// # Panics
    /// A body of an item has no pose.
    pub fn posed(&self, x_world_body: &[Pose]) -> Scene {
        let posed = |(item, body): (&Item, &u32)| Item {
            x_world_item: x_world_body[*body as usize] * item.x_world_item,
            ..item.clone()
        };
        Scene { items: self.still.items.iter().zip(&self.bodies).map(posed).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, Label};
    use orchard_geometry::{Shape, Vec3};

    #[test]
    fn items_move_with_their_bodies() {
        let ball = |x: f64| Item {
            geometry: Geometry::Shape(Shape::Sphere { radius: 0.1 }),
            x_world_item: Pose::translation(x, 0.0, 0.0),
            label: Label::Fruit,
            instance: 0,
            color: None,
            tint: None,
        };
        let mut scene = MovingScene::default();
        scene.extend(1, [ball(0.5), ball(1.5)]);
        scene.extend(0, [ball(2.5)]);
        let turned = Pose::rotation(Vec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let posed = scene.posed(&[Pose::identity(), turned]);
        let at = |i: usize| posed.items[i].x_world_item.translation.vector;
        assert!((at(0) - Vec3::new(0.0, 0.5, 0.0)).norm() < 1e-15);
        assert!((at(1) - Vec3::new(0.0, 1.5, 0.0)).norm() < 1e-15);
        assert_eq!(at(2), Vec3::new(2.5, 0.0, 0.0));
        assert_eq!(scene.bodies(), [1, 1, 0]);
    }
}
