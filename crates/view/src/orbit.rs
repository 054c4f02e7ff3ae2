//! A view that turns about a point.

use orchard_geometry::{Vec3, math};

/// Vertical field of view of a picture that is at least as wide as high \[rad\].
const FOV: f64 = 0.85;
/// Nearest and farthest distance that is drawn \[m\].
pub(crate) const NEAR: f64 = 0.05;
const FAR: f64 = 120.0;
/// Bounds of the distance to the centre \[m\], and of the centre about the tree.
const DISTANCE: [f64; 2] = [0.3, 25.0];
const CENTRE: f64 = 12.0;
const HIGHEST: f64 = 6.0;
/// Lowest height of the eye \[m\], and steepest elevation \[rad\].
const LOWEST_EYE: f64 = 0.1;
const STEEPEST: f64 = 1.5;

/// A view that turns about a point; z is up.
#[derive(Debug, Clone, PartialEq)]
pub struct Orbit {
    /// Direction from the centre to the eye about z, from x \[rad\].
    pub azimuth: f64,
    /// Direction from the centre to the eye over the horizon \[rad\].
    pub elevation: f64,
    /// Distance from the centre to the eye \[m\].
    pub distance: f64,
    /// Point in the middle of the picture \[m\], world.
    pub centre: Vec3,
}

/// Unit vectors of a view, world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// To the right.
    pub right: Vec3,
    /// Up in the picture.
    pub up: Vec3,
    /// Into the picture.
    pub forward: Vec3,
}

impl Orbit {
    /// A view from the side of a tree at the origin of a height \[m\] and a robot at `p_world_base`.
    pub fn beside(p_world_base: &Vec3, height: f64) -> Self {
        let scale = (height / 2.4).max(1.0);
        Self {
            azimuth: math::atan2(p_world_base.y, p_world_base.x) + 1.25,
            elevation: 0.16,
            distance: 4.4 * scale,
            centre: Vec3::new(0.4 * p_world_base.x, 0.4 * p_world_base.y, 1.1 * scale),
        }
    }

    /// The unit vectors.
    pub fn axes(&self) -> Axes {
        let (sa, ca) = math::sin_cos(self.azimuth);
        let (se, ce) = math::sin_cos(self.elevation);
        let (forward, right) = (Vec3::new(-ca * ce, -sa * ce, -se), Vec3::new(-sa, ca, 0.0));
        Axes { right, up: right.cross(&forward), forward }
    }

    /// Place of the eye \[m\], world.
    pub fn eye(&self) -> Vec3 {
        self.centre - self.axes().forward * self.distance
    }

    /// Half the height of the picture at distance 1. A narrow picture shows as much to the sides as a square one.
    pub(crate) fn spread(aspect: f64) -> f64 {
        math::tan(FOV / 2.0) / aspect.min(1.0)
    }

    /// Matrix from the world to clip space with depths 0 to 1, column by column. `aspect` is width over height.
    pub fn clip_world(&self, aspect: f64) -> [f32; 16] {
        let (Axes { right, up, forward }, eye, s) = (self.axes(), self.eye(), Self::spread(aspect));
        let (x, y) = (1.0 / (s * aspect), 1.0 / s);
        let (z, w) = (FAR / (FAR - NEAR), -FAR * NEAR / (FAR - NEAR));
        let rows = [
            (right * x, -x * right.dot(&eye)),
            (up * y, -y * up.dot(&eye)),
            (forward * z, -z * forward.dot(&eye) + w),
            (forward, -forward.dot(&eye)),
        ];
        std::array::from_fn(|k| {
            let (row, column) = (&rows[k % 4], k / 4);
            (if column < 3 { row.0[column] } else { row.1 }) as f32
        })
    }

    /// Ray through a place of the picture, -1 to 1 to the right and up: its start \[m\] and unit direction, world.
    pub fn ray(&self, [x, y]: [f64; 2], aspect: f64) -> (Vec3, Vec3) {
        let (Axes { right, up, forward }, s) = (self.axes(), Self::spread(aspect));
        (self.eye(), (forward + right * (x * s * aspect) + up * (y * s)).normalize())
    }

    /// Place of a point (world, \[m\]) in the picture, -1 to 1; `None` behind the eye.
    pub fn place(&self, p_world: &Vec3, aspect: f64) -> Option<[f64; 2]> {
        let (Axes { right, up, .. }, s) = (self.axes(), Self::spread(aspect));
        let (d, depth) = (p_world - self.eye(), self.depth(p_world));
        (depth > NEAR).then(|| [d.dot(&right) / (depth * s * aspect), d.dot(&up) / (depth * s)])
    }

    /// Distance of a point along the view \[m\].
    pub fn depth(&self, p_world: &Vec3) -> f64 {
        (p_world - self.eye()).dot(&self.axes().forward)
    }

    /// The point of the ray through a place of the picture at a distance along the view \[m\].
    pub fn at(&self, place: [f64; 2], aspect: f64, depth: f64) -> Vec3 {
        let (p, along) = self.ray(place, aspect);
        p + along * (depth / along.dot(&self.axes().forward))
    }

    /// Keeps the eye above the ground, and all figures in their bounds.
    fn limit(&mut self) {
        self.distance = self.distance.clamp(DISTANCE[0], DISTANCE[1]);
        self.centre.x = self.centre.x.clamp(-CENTRE, CENTRE);
        self.centre.y = self.centre.y.clamp(-CENTRE, CENTRE);
        self.centre.z = self.centre.z.clamp(0.0, HIGHEST);
        let lowest = math::asin(((LOWEST_EYE - self.centre.z) / self.distance).clamp(-0.9, 0.9));
        self.elevation = self.elevation.clamp(lowest, STEEPEST);
    }

    /// Turns by angles \[rad\] to the right and up.
    pub fn turn(&mut self, right: f64, up: f64) {
        self.azimuth -= right;
        self.elevation += up;
        self.limit();
    }

    /// Moves the centre with the picture: by shares of its height to the right and up.
    pub fn pan(&mut self, right: f64, up: f64) {
        let (axes, s) = (self.axes(), self.distance * 2.0 * math::tan(FOV / 2.0));
        self.centre -= (axes.right * right + axes.up * up) * s;
        self.limit();
    }

    /// Scales the distance by a factor.
    pub fn zoom(&mut self, factor: f64) {
        self.distance *= factor;
        self.limit();
    }

    /// Moves centre and eye by a way \[m\], world.
    pub fn carry(&mut self, way: &Vec3) {
        self.centre += way;
        self.limit();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> Orbit {
        Orbit::beside(&Vec3::new(-1.8, 0.4, 0.0), 2.4)
    }

    #[test]
    fn rays_places_and_the_matrix_agree() {
        let view = view();
        for aspect in [0.5, 1.0, 16.0 / 9.0] {
            for place in [[0.0, 0.0], [0.7, -0.4], [-1.0, 1.0]] {
                let p = view.at(place, aspect, 3.0);
                let back = view.place(&p, aspect).unwrap();
                assert!((back[0] - place[0]).abs() < 1e-12 && (back[1] - place[1]).abs() < 1e-12);
                assert!((view.depth(&p) - 3.0).abs() < 1e-12);
                let m = view.clip_world(aspect);
                let row = |r: usize| -> f64 {
                    let of = |c: usize| f64::from(m[4 * c + r]);
                    of(0) * p.x + of(1) * p.y + of(2) * p.z + of(3)
                };
                let w = row(3);
                assert!((row(0) / w - place[0]).abs() < 1e-5 && (row(1) / w - place[1]).abs() < 1e-5);
                assert!((0.0..1.0).contains(&(row(2) / w)) && (w - 3.0).abs() < 1e-5);
            }
        }
        assert_eq!(view.place(&(view.eye() - view.axes().forward), 1.0), None);
    }

    #[test]
    fn the_eye_stays_above_the_ground() {
        let mut view = view();
        for _ in 0..200 {
            view.turn(0.1, -0.1);
            view.pan(0.1, 0.2);
            view.zoom(1.1);
            assert!(view.eye().z >= LOWEST_EYE - 1e-9, "{view:?}");
        }
        assert!(view.distance <= DISTANCE[1]);
        (0..200).for_each(|_| view.zoom(0.9));
        assert_eq!(view.distance, DISTANCE[0]);
    }
}
