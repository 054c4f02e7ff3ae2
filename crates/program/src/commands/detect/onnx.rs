//! Boxes by a learned detector in ONNX format, run on the colour image: exports of the YOLO family.
//!
//! The image is fitted into the network's input, kept in shape, with grey beside it (letterbox); colours are red, green, blue from 0 to 1.
//! Of the first output, without its leading 1, three layouts are read:
//!
//! | output | layout |
//! |---|---|
//! | `[4 + classes, boxes]`, fewer rows than columns | YOLOv8 and later: centre, width, height, score of each class |
//! | `[boxes, 6]`, at most 1000 boxes | with suppression inside: two corners, score, class |
//! | `[boxes, 5 + classes]` | YOLOv5: centre, width, height, score of an object, score of each class |
//!
//! All lengths are pixels of the network's input. All classes count.

use orchard_exchange::regions::Region;
use orchard_geometry::Image;
use orchard_network::{Network, Tensor};
use orchard_perception::box_overlap;

/// Grey beside the image, as Ultralytics trains.
const GREY: f32 = 114.0 / 255.0;
/// Input of a network that leaves its size open \[px\].
const USUAL_SIDE: usize = 640;
/// Most boxes of a network that suppresses doubles itself.
const MOST_FINAL: usize = 1000;
/// Boxes of which one has more than this overlap (intersection over union) with a surer one are left out: the default of Ultralytics.
const DOUBLE: f64 = 0.7;

/// Most boxes of an image, the surest: the default of Ultralytics.
const MOST_BOXES: usize = 300;

/// Box (left, top, width, height) \[px\] with its score.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Scored {
    bounds: [f64; 4],
    score: f64,
}

/// Finds boxes of at least a score in a colour image.
///
/// # Errors
/// The network takes no image or gives no boxes in a known layout, or it cannot be computed.
pub fn boxes(network: &Network, colour: &Image<[u8; 3]>, least: f64) -> Result<Vec<Region>, String> {
    let [input] = network.inputs() else {
        return Err(format!("has {} inputs; one image is needed", network.inputs().len()));
    };
    let side = |axis: usize| input.shape.get(axis).copied().flatten();
    if input.shape.len() != 4 || side(1).is_some_and(|n| n != 3) || side(0).is_some_and(|n| n != 1) {
        return Err(format!("takes {}; [1, 3, height, width] is needed", input.shape_text()));
    }
    let (height, width) = (side(2).unwrap_or(USUAL_SIDE), side(3).unwrap_or(USUAL_SIDE));
    let fit = Fit::of((colour.width(), colour.height()), (width, height));
    let values = fit.values(colour);
    let tensor = Tensor::f32(&[1, 3, height, width], values)
        .ok_or_else(|| format!("takes an image of {width} x {height}, which is too large"))?;
    let outputs = network.run(vec![tensor]).map_err(|e| e.to_string())?;
    let output = outputs.first().ok_or("has no output")?;
    let numbers = output.as_f32().ok_or("has an output that is not floating-point")?;
    let shape = output.shape();
    let found = decoded(shape, numbers, least).ok_or_else(|| {
        format!(
            "gives {shape:?}; [1, 4 + classes, boxes], [1, boxes, 5 + classes] or [1, boxes, 6] is needed"
        )
    })?;
    let in_image = |b: Scored| Scored { bounds: fit.back(b.bounds), ..b };
    let found: Vec<Scored> = found.into_iter().map(in_image).collect();
    let size = (colour.width(), colour.height());
    let region = |b: &Scored| Region::of_box(b.bounds, size, Some(b.score));
    Ok(without_doubles(found).iter().filter_map(region).collect())
}

/// Place of the image in the network's input.
struct Fit {
    input: (usize, usize),
    scale: f64,
    /// Column and row of the image's corner.
    corner: (f64, f64),
}

impl Fit {
    fn of(image: (usize, usize), input: (usize, usize)) -> Self {
        let scale = (input.0 as f64 / image.0 as f64).min(input.1 as f64 / image.1 as f64);
        let margin = |input: usize, image: usize| (0.5 * (input as f64 - scale * image as f64)).round();
        Self { input, scale, corner: (margin(input.0, image.0), margin(input.1, image.1)) }
    }

    /// Colours of the input, channel by channel, by bilinear interpolation.
    fn values(&self, colour: &Image<[u8; 3]>) -> Vec<f32> {
        let (width, height) = self.input;
        let mut values = vec![GREY; 3 * width * height];
        for row in 0..height {
            for column in 0..width {
                let u = (column as f64 + 0.5 - self.corner.0) / self.scale - 0.5;
                let v = (row as f64 + 0.5 - self.corner.1) / self.scale - 0.5;
                let inside = u >= -0.5
                    && v >= -0.5
                    && u <= colour.width() as f64 - 0.5
                    && v <= colour.height() as f64 - 0.5;
                if inside {
                    let rgb = between(colour, u, v);
                    for (channel, value) in rgb.into_iter().enumerate() {
                        values[(channel * height + row) * width + column] = value / 255.0;
                    }
                }
            }
        }
        values
    }

    /// Box in pixels of the image.
    fn back(&self, [left, top, width, height]: [f64; 4]) -> [f64; 4] {
        let corner = [(left - self.corner.0) / self.scale, (top - self.corner.1) / self.scale];
        [corner[0], corner[1], width / self.scale, height / self.scale]
    }
}

/// Colour between pixels.
fn between(colour: &Image<[u8; 3]>, u: f64, v: f64) -> [f32; 3] {
    let (u, v) = (u.clamp(0.0, colour.width() as f64 - 1.0), v.clamp(0.0, colour.height() as f64 - 1.0));
    let (left, top) = (u as usize, v as usize);
    let (right, bottom) = ((left + 1).min(colour.width() - 1), (top + 1).min(colour.height() - 1));
    let (a, b) = ((u - left as f64) as f32, (v - top as f64) as f32);
    let mix = |x: f32, y: f32, share: f32| x + (y - x) * share;
    std::array::from_fn(|k| {
        let at = |u: usize, v: usize| f32::from(colour[(u, v)][k]);
        mix(mix(at(left, top), at(right, top), a), mix(at(left, bottom), at(right, bottom), a), b)
    })
}

/// Boxes of at least a score in pixels of the input; `None` if the layout is not known.
fn decoded(shape: &[usize], numbers: &[f32], least: f64) -> Option<Vec<Scored>> {
    let (rows, columns) = match shape {
        [1, rows, columns] | [rows, columns] => (*rows, *columns),
        _ => return None,
    };
    let final_boxes = columns == 6 && rows <= MOST_FINAL;
    let across = !final_boxes && rows < columns;
    let (boxes, fields) = if across { (columns, rows) } else { (rows, columns) };
    if fields < 5 {
        return None;
    }
    let value = |i: usize, field: usize| {
        f64::from(numbers[if across { field * columns + i } else { i * columns + field }])
    };
    let best = |i: usize, first: usize| (first..fields).map(|field| value(i, field)).fold(0.0, f64::max);
    let one = |i: usize| {
        let [a, b, c, d] = std::array::from_fn(|field| value(i, field));
        let (bounds, score) = if final_boxes {
            ([a, b, c - a, d - b], value(i, 4))
        } else {
            let score = if across {
                best(i, 4)
            } else if fields == 5 {
                value(i, 4)
            } else {
                value(i, 4) * best(i, 5)
            };
            ([a - 0.5 * c, b - 0.5 * d, c, d], score)
        };
        let sound = bounds.iter().all(|x| x.is_finite()) && score >= least && score <= 1.0;
        sound.then_some(Scored { bounds, score })
    };
    Some((0..boxes).filter_map(one).collect())
}

/// Boxes without those that overlap a surer one, the surest first.
fn without_doubles(mut boxes: Vec<Scored>) -> Vec<Scored> {
    boxes.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Scored> = Vec::new();
    for one in boxes {
        if kept.iter().all(|other| box_overlap(one.bounds, other.bounds) <= DOUBLE) {
            kept.push(one);
        }
        if kept.len() == MOST_BOXES {
            break;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scored(bounds: [f64; 4], score: f64) -> Scored {
        // Scores of a network have 32 bits.
        Scored { bounds, score: f64::from(score as f32) }
    }

    #[test]
    fn three_layouts_of_one_box() {
        let expected = vec![scored([10.0, 20.0, 20.0, 30.0], 0.75)];
        // Two boxes below the least score beside it; classes 0.25 and 0.75.
        let across = [
            20.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 35.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 20.0, 1.0, 1.0, 1.0, 1.0,
            1.0, 1.0, 30.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.25, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.75, 0.1, 0.0,
            0.0, 0.0, 0.0, 0.0_f32,
        ];
        assert_eq!(decoded(&[1, 6, 7], &across, 0.5), Some(expected.clone()));
        let ended = [10.0, 20.0, 30.0, 50.0, 0.75, 3.0, 0.0, 0.0, 1.0, 1.0, 0.1, 0.0_f32];
        assert_eq!(decoded(&[1, 2, 6], &ended, 0.5), Some(expected.clone()));
        // 0.75 of an object times 1 of a class.
        let mut old = vec![0.0_f32; 7 * 9];
        old[..7].copy_from_slice(&[20.0, 35.0, 20.0, 30.0, 0.75, 0.5, 1.0]);
        assert_eq!(decoded(&[1, 9, 7], &old, 0.5), Some(expected));
        for shape in [&[1, 4, 9][..], &[9, 4], &[1, 1, 6, 7], &[7]] {
            assert_eq!(decoded(shape, &vec![0.0; shape.iter().product()], 0.5), None, "{shape:?}");
        }
        let odd = [f32::NAN, 20.0, 30.0, 50.0, 0.75, 3.0, 1.0, 2.0, 3.0, 4.0, f32::NAN, 0.0];
        assert_eq!(decoded(&[1, 2, 6], &odd, 0.5), Some(Vec::new()));
    }

    #[test]
    fn an_image_keeps_its_shape_and_comes_back() {
        // 8 x 4 pixels in 4 x 4: half the size, with one row of grey above and below.
        let fit = Fit::of((8, 4), (4, 4));
        assert_eq!((fit.scale, fit.corner), (0.5, (0.0, 1.0)));
        let mut colour = Image::filled(8, 4, [0, 100, 200]);
        colour[(0, 0)] = [40, 100, 200];
        let values = fit.values(&colour);
        let channel = |k: usize| &values[16 * k..16 * (k + 1)];
        assert!(channel(1)[..4].iter().chain(&channel(1)[12..]).all(|v| *v == GREY));
        assert!(channel(2)[4..12].iter().all(|v| *v == 200.0 / 255.0));
        // The mean of four pixels.
        assert!((channel(0)[4] - 10.0 / 255.0).abs() < 1e-6 && channel(0)[5] == 0.0);
        assert_eq!(fit.back([0.0, 1.0, 4.0, 2.0]), [0.0, 0.0, 8.0, 4.0]);
    }

    #[test]
    fn doubles_are_left_out() {
        let a = scored([0.0, 0.0, 10.0, 10.0], 0.6);
        let same = scored([0.0, 0.5, 10.0, 9.5], 0.9);
        let beside = scored([5.0, 0.0, 10.0, 10.0], 0.5);
        assert_eq!(without_doubles(vec![a, beside, same]), [same, beside]);
        let far = (0..400).map(|i| scored([20.0 * f64::from(i), 0.0, 9.0, 9.0], 0.5));
        assert_eq!(without_doubles(far.collect()).len(), MOST_BOXES);
    }
}
