//! Annotations of images in the COCO format (Lin et al. 2014), which `pycocotools` and most training programs read.
//!
//! Masks are run lengths. Images and annotations may have additional fields; readers ignore fields that they do not know.

use orchard_geometry::Image;
use serde::{Deserialize, Serialize};

/// An annotation file. `I` and `A` are the additional fields of images and annotations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Annotations<I, A> {
    /// Description of the file.
    pub info: Info,
    /// All images, with or without annotations.
    pub images: Vec<ImageEntry<I>>,
    /// Kinds of annotated objects.
    pub categories: Vec<Category>,
    /// Annotations, one for each visible object.
    pub annotations: Vec<Annotation<A>>,
}

/// Description of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// Text for people.
    pub description: String,
    /// Version of the program that made the file.
    pub version: String,
}

/// An image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageEntry<I> {
    /// Number, from 1.
    pub id: u64,
    /// Path relative to the folder of the data set.
    pub file_name: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Additional fields.
    #[serde(flatten)]
    pub more: I,
}

/// A kind of object.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Category {
    /// Number, from 1.
    pub id: u64,
    /// Name.
    pub name: String,
    /// Name of the more general kind.
    pub supercategory: String,
}

/// An annotated object in an image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Annotation<A> {
    /// Number, from 1.
    pub id: u64,
    /// Number of its image.
    pub image_id: u64,
    /// Number of its category.
    pub category_id: u64,
    /// Left, top, width and height \[px\] of the smallest box around its pixels; the upper left pixel's corner is (0, 0).
    pub bbox: [usize; 4],
    /// Number of pixels that show it.
    pub area: u64,
    /// Mask of these pixels.
    pub segmentation: Rle,
    /// 0: a single object, not a crowd.
    pub iscrowd: u8,
    /// Additional fields.
    #[serde(flatten)]
    pub more: A,
}

/// Run lengths of a mask, column by column: pixels out, in, out, ...; the first may be 0.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rle {
    /// Rows and columns.
    pub size: [usize; 2],
    /// Lengths of the runs \[px\].
    pub counts: Vec<u32>,
}

impl Rle {
    /// Makes the mask of the pixels for which `inside` is true.
    pub fn of<T>(image: &Image<T>, inside: impl Fn(&T) -> bool) -> Self {
        let mut counts = Vec::new();
        let (mut value, mut run) = (false, 0);
        for u in 0..image.width() {
            for v in 0..image.height() {
                if inside(&image[(u, v)]) != value {
                    counts.push(run);
                    (value, run) = (!value, 0);
                }
                run += 1;
            }
        }
        counts.push(run);
        Self { size: [image.height(), image.width()], counts }
    }

    /// Number of pixels in the mask.
    pub fn area(&self) -> u64 {
        self.counts.iter().skip(1).step_by(2).map(|&run| u64::from(run)).sum()
    }

    /// Mask as an image; `None` if the runs do not fill it.
    pub fn mask(&self) -> Option<Image<bool>> {
        let [height, width] = self.size;
        let total: u64 = self.counts.iter().map(|&run| u64::from(run)).sum();
        if (height as u64).checked_mul(width as u64) != Some(total) {
            return None;
        }
        let mut mask = Image::filled(width, height, false);
        let runs = self.counts.iter().enumerate();
        let values = runs.flat_map(|(i, &run)| std::iter::repeat_n(i % 2 == 1, run as usize));
        for (i, value) in values.enumerate() {
            mask[(i / height, i % height)] = value;
        }
        Some(mask)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn runs_go_down_the_columns() {
        // . x
        // x x
        let image = Image::from_pixels(2, 2, vec![false, true, true, true]).unwrap();
        let rle = Rle::of(&image, |inside| *inside);
        assert_eq!(rle, Rle { size: [2, 2], counts: vec![1, 3] });
        assert_eq!(serde_json::to_string(&rle).unwrap(), r#"{"size":[2,2],"counts":[1,3]}"#);
        let full = Rle::of(&Image::filled(3, 2, ()), |()| true);
        assert_eq!(
            (full.counts, Rle::of(&Image::filled(3, 2, ()), |()| false).counts),
            (vec![0, 6], vec![6])
        );
    }

    #[test]
    fn runs_that_do_not_fill_their_image_are_refused() {
        for (size, counts) in
            [([2, 2], vec![1, 2]), ([2, 2], vec![5]), ([usize::MAX, 2], vec![1]), ([0, 3], vec![1])]
        {
            assert_eq!(Rle { size, counts }.mask(), None);
        }
        assert_eq!(Rle { size: [0, 3], counts: vec![] }.mask(), Some(Image::filled(3, 0, false)));
    }

    proptest! {
        #[test]
        fn a_mask_reads_back(width in 0_usize..9, height in 0_usize..9, bits in any::<[bool; 64]>()) {
            let image = Image::from_pixels(width, height, bits[..width * height].to_vec()).unwrap();
            let rle = Rle::of(&image, |inside| *inside);
            prop_assert_eq!(rle.area(), image.pixels().iter().filter(|inside| **inside).count() as u64);
            prop_assert!(rle.counts.iter().skip(1).all(|&run| run > 0));
            prop_assert_eq!(rle.mask(), Some(image));
        }
    }
}
