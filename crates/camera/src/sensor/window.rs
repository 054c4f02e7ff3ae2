//! Sums over the matching window.

use orchard_geometry::Image;

/// Sums over all windows of 2 `radius` + 1 pixels squared that lie within an image. The result is smaller by `radius`
/// pixels on every side. The sums must fit in an i32.
pub(super) fn window_sums<T: Copy + Into<i32>>(image: &Image<T>, radius: usize) -> Image<i32> {
    let (width, span) = (image.width(), 2 * radius + 1);
    let less = |n: usize| n.saturating_sub(2 * radius);
    let mut sums = Image::filled(less(width), less(image.height()), 0);
    if sums.pixels().is_empty() {
        return sums;
    }
    let row = |v: usize| &image.pixels()[v * width..(v + 1) * width];
    // Sums down the columns of the window's rows.
    let mut columns = vec![0_i32; width];
    for v in 0..image.height() {
        columns.iter_mut().zip(row(v)).for_each(|(column, &x)| *column += x.into());
        if v + 1 < span {
            continue;
        }
        let top = v + 1 - span;
        let out_width = sums.width();
        let out = &mut sums.pixels_mut()[top * out_width..(top + 1) * out_width];
        let mut sum: i32 = columns[..span].iter().sum();
        out[0] = sum;
        let moves = columns[span..].iter().zip(&columns);
        for (out, (enters, leaves)) in out[1..].iter_mut().zip(moves) {
            sum += enters - leaves;
            *out = sum;
        }
        columns.iter_mut().zip(row(top)).for_each(|(column, &x)| *column -= x.into());
    }
    sums
}

/// Adds `margin` pixels of zero on every side of an image.
pub(super) fn padded(image: &Image<u8>, margin: usize) -> Image<u8> {
    let width = image.width() + 2 * margin;
    let mut larger = Image::filled(width, image.height() + 2 * margin, 0);
    let rows = image.pixels().chunks_exact(image.width().max(1));
    for (row, out) in rows.zip(larger.pixels_mut().chunks_exact_mut(width.max(1)).skip(margin)) {
        out[margin..margin + row.len()].copy_from_slice(row);
    }
    larger
}

/// Number of pixels along an axis that a window centred on pixel `at` has within an image of `length` pixels.
pub(super) fn within(at: usize, length: usize, radius: usize) -> i32 {
    ((at + radius).min(length - 1) - at.saturating_sub(radius) + 1) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_windows() {
        let (width, height) = (13, 9);
        let pixels = (0..width * height).map(|i| (i * i * 7919 % 101) as i32 - 50).collect();
        let image = Image::<i32>::from_pixels(width, height, pixels).unwrap();
        for radius in 0..6 {
            let sums = window_sums(&image, radius);
            assert_eq!(sums.width(), width.saturating_sub(2 * radius));
            assert_eq!(sums.height(), height.saturating_sub(2 * radius));
            for v in 0..sums.height() {
                for u in 0..sums.width() {
                    let window = (v..=v + 2 * radius).flat_map(|y| (u..=u + 2 * radius).map(move |x| (x, y)));
                    assert_eq!(sums[(u, v)], window.map(|p| image[p]).sum::<i32>());
                }
            }
        }
    }

    #[test]
    fn padding_counts_pixels_within_the_image() {
        let image = Image::filled(5, 4, 1_u8);
        let sums = window_sums(&padded(&image, 2), 2);
        for v in 0..4 {
            for u in 0..5 {
                assert_eq!(sums[(u, v)], within(u, 5, 2) * within(v, 4, 2));
            }
        }
    }
}
