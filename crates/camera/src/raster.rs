//! Finds the pixels that a primitive may cover: its screen rectangle, and in wide rectangles the part of each row between
//! planes through the camera that enclose it. The exact test follows; no pixel that it would hit is left out.

use crate::bounds::PixelRect;
use crate::primitive::{Hit, NO_SIDES, Sides};
use crate::solid;
use orchard_geometry::{Intrinsics, Vec3};
use std::ops::Range;

/// Margin of a plane, as a share of the terms of its equation, and of a row's end \[px\], so that rounding never loses a
/// pixel that the exact test hits. A normal may have only half of its digits.
const SLACK: f64 = 1e-8;
const SLACK_PX: f64 = 1e-6;

/// Number of columns of a rectangle from which on the ends of its rows are worth computing.
const WIDE: usize = 8;

/// Rays of an image.
pub(crate) struct Raster {
    intrinsics: Intrinsics,
    /// Largest depth that can round to `far` or less.
    end: f64,
    /// x/z of the columns.
    x: Vec<f64>,
    /// y/z of the rows.
    y: Vec<f64>,
}

/// Adjacent pixels of a row.
pub(crate) struct Row<'a> {
    /// Range of the pixels in row-major order.
    pub(crate) pixels: Range<usize>,
    x: &'a [f64],
    y: f64,
}

impl Row<'_> {
    /// Rays of the pixels, scaled to z = 1.
    #[inline]
    pub(crate) fn rays(&self) -> impl Iterator<Item = Vec3> {
        self.x.iter().map(|&x| Vec3::new(x, self.y, 1.0))
    }
}

impl Raster {
    /// Makes the rays of a camera with a largest depth \[m\].
    pub(crate) fn new(intrinsics: &Intrinsics, far: f64) -> Self {
        let ray = |u: usize, v: usize| intrinsics.ray(u as f64, v as f64);
        Self {
            intrinsics: *intrinsics,
            // A depth is rounded to f32 before it is compared with `far`.
            end: far * (1.0 + f64::from(f32::EPSILON)),
            x: (0..intrinsics.width).map(|u| ray(u, 0).x).collect(),
            y: (0..intrinsics.height).map(|v| ray(0, v).y).collect(),
        }
    }

    /// Points whose convex hull contains all that is in view.
    pub(crate) fn view(&self) -> Vec<Vec3> {
        solid::view(&self.intrinsics, self.end)
    }

    /// Rows of pixels that may show the primitive.
    #[inline]
    pub(crate) fn rows(&self, primitive: &impl Hit) -> impl Iterator<Item = Row<'_>> {
        let (nearest, farthest) = primitive.depths();
        let in_depth = farthest > 0.0 && nearest <= self.end;
        let rect = if in_depth { primitive.bounds().pixels(&self.intrinsics) } else { None };
        let is_wide = rect.is_some_and(|rect| rect.u.1 - rect.u.0 >= WIDE);
        let sides = if is_wide { primitive.sides(self.end) } else { NO_SIDES };
        let row_of = move |rect: PixelRect, v: usize| {
            let (first, last) = if is_wide { self.ends(rect.u, v, &sides)? } else { rect.u };
            let start = v * self.intrinsics.width;
            Some(Row { pixels: start + first..start + last + 1, x: &self.x[first..=last], y: self.y[v] })
        };
        rect.into_iter().flat_map(move |rect| (rect.v.0..=rect.v.1).filter_map(move |v| row_of(rect, v)))
    }

    /// First and last column of row `v`, within `columns`, whose rays d are on the inner side of every plane: n . d >= 0.
    fn ends(&self, columns: (usize, usize), v: usize, sides: &Sides) -> Option<(usize, usize)> {
        let Intrinsics { fx, cx, .. } = self.intrinsics;
        let (mut first, mut last) = (columns.0 as f64, columns.1 as f64);
        let reach = self.x[columns.0].abs().max(self.x[columns.1].abs());
        for n in sides {
            let at_axis = n.y * self.y[v] + n.z;
            let slack = SLACK * (n.x.abs() * reach + (n.y * self.y[v]).abs() + n.z.abs());
            // Where n.x x + at_axis >= -slack has its end.
            let end = || (-at_axis - slack) / n.x * fx + cx;
            if n.x > 0.0 {
                first = first.max((end() - SLACK_PX).ceil());
            } else if n.x < 0.0 {
                last = last.min((end() + SLACK_PX).floor());
            } else if at_axis < -slack {
                return None;
            }
        }
        (first <= last).then_some((first as usize, last as usize))
    }
}
