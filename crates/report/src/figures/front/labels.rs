//! Placement of labels beside points, without overlap where there is room.

use plotters::style::text_anchor::{HPos, VPos};

use super::{FONT, SIZE};

/// Estimated mean width of a letter over the font size.
const LETTER: f64 = 0.55;
/// Offset of the name from the centre of a point \[px\].
const AWAY: (i32, i32) = (9, 2);
/// Half the width of a point \[px\].
const POINT: i32 = 6;

/// A box of pixels: left, top, right, bottom.
type Area = [i32; 4];

/// Areas that points and labels already occupy \[px\].
pub struct Labels(Vec<Area>);

impl Labels {
    /// Marks the areas of the points, given in pixels, as occupied.
    pub fn around(points: Vec<(i32, i32)>) -> Self {
        Self(points.into_iter().map(|(x, y)| [x - POINT, y - POINT, x + POINT, y + POINT]).collect())
    }

    /// Returns the position and anchor of a point's label: above right, or the first free corner.
    pub fn place(&mut self, (x, y): (i32, i32), letters: usize) -> ((i32, i32), HPos, VPos) {
        let width = (LETTER * f64::from(FONT) * letters as f64) as i32;
        let corner = |right: bool, above: bool| -> Area {
            let left = if right { x + AWAY.0 } else { x - AWAY.0 - width };
            let top = if above { y - AWAY.1 - FONT } else { y + AWAY.1 };
            [left, top, left + width, top + FONT]
        };
        let corners = [(true, true), (true, false), (false, true), (false, false)];
        let is_free = |(right, above): &(bool, bool)| {
            let area = corner(*right, *above);
            let inside = area[0] >= 0 && area[2] <= SIZE.0 as i32;
            inside && !self.0.iter().any(|other| overlap(&area, other))
        };
        let (right, above) = corners.into_iter().find(is_free).unwrap_or(corners[0]);
        let area = corner(right, above);
        self.0.push(area);
        let (h, at_x) = if right { (HPos::Left, area[0]) } else { (HPos::Right, area[2]) };
        let (v, at_y) = if above { (VPos::Bottom, area[3]) } else { (VPos::Top, area[1]) };
        ((at_x, at_y), h, v)
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_make_way_for_one_another() {
        let points = vec![(100, 100), (104, 103), (750, 300)];
        let mut labels = Labels::around(points.clone());
        for point in points {
            labels.place(point, 8);
        }
        let names = &labels.0[3..];
        for (i, a) in names.iter().enumerate() {
            assert!(names[..i].iter().all(|b| !overlap(a, b)), "{names:?}");
        }
        assert!(names[2][2] < 750, "to the left where there is no room to the right");
    }
}
