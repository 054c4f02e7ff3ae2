//! A world as it began: whole, straight and at rest. The settling that follows is frames of [`super::outward::Way::Settle`].

use super::Lane;
use super::math::Vec3;
use crate::layout::{first, fruit, link, notice, third, tile, world};
use crate::schedule::PARTS;

impl Lane<'_> {
    /// Puts a world that is to be reset back to its beginning. Inputs stay.
    pub(super) fn reset(&mut self) {
        if self.world(world::RESET) == 0.0 {
            return;
        }
        self.straighten();
        self.place_links();
        self.hang_fruit();
        for field in [world::STOPPED, world::SNAPPED, world::DETACHED, world::PEAK] {
            self.set_world(field, 0.0);
        }
        self.set_world(world::NOTICE, f32::from_bits(notice::STALE as u32));
    }

    fn straighten(&mut self) {
        for row in 0..self.header(tile::STARTS + PARTS) {
            self.set_state(row, 0);
            for field in link::BROKEN_INERTIA..link::FIELDS {
                self.set_link(row, field, 0.0);
            }
        }
    }

    /// Fruit under their stems, with the links where [`Lane::place_links`] has put them.
    fn hang_fruit(&mut self) {
        for row in 0..self.header(tile::STARTS + PARTS) {
            let [a, _, c, _] = self.operation(row);
            if a & first::ACTIVE == 0 {
                continue;
            }
            let (axes, p_tip) = self.placed(row);
            let p_joint = p_tip - axes.z * self.link(row, link::LENGTH);
            let first_fruit = c >> third::FIRST_FRUIT & 0xfff;
            for k in first_fruit..first_fruit + (c >> third::FRUIT & 0x3f) {
                if self.fruit(k, fruit::STIFFNESS) > 0.0 {
                    let anchor = self.fruit3(k, fruit::ANCHOR);
                    let arm = axes.x * anchor.x + axes.y * anchor.y + axes.z * anchor.z;
                    let mut p = p_joint + arm;
                    p.z += self.fruit(k, fruit::DROP);
                    self.set_fruit3(k, fruit::P, p);
                    self.set_fruit3(k, fruit::V, Vec3::zeros());
                    for field in [fruit::FRAMES_OVER, fruit::CAME_OFF, fruit::INVERSE_MASS] {
                        self.set_fruit(k, field, 0.0);
                    }
                }
            }
        }
    }
}
