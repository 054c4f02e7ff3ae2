//! Images that stay on the device.

use super::{ImageBatch, View};
use crate::arrays::DeviceArray;
use crate::device::GpuError;

/// Images that are sent at once, our own choice: enough to keep a card busy while the next ones are packed.
const AT_ONCE: usize = 512;

/// Rows of an array, one for each image.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub array: &'a DeviceArray,
    pub rows: &'a [usize],
}

impl ImageBatch {
    /// Draws depth images \[m\], 0 where nothing is in range, into rows of an array of as many pixels each, and returns at once: they have the bits of [`Self::depths`], and are there once the queue has come to it.
    ///
    /// # Errors
    /// An image is larger than the device allows, or the device has no room.
    ///
    /// # Panics
    /// As [`Self::frames`]; there is not a row for each view, or an image has other pixels than a row.
    pub fn depths_into(
        &mut self,
        views: &[View<'_>],
        array: &DeviceArray,
        rows: &[usize],
    ) -> Result<(), GpuError> {
        assert_eq!(views.len(), rows.len(), "rows of images");
        for (view, row) in views.iter().zip(rows) {
            array.assert_row(*row, size_of::<f32>() * self.pixels_shown(view));
        }
        self.in_parts(views, AT_ONCE, |batch, range, most| {
            let rows = Rows { array, rows: &rows[range.clone()] };
            batch.submit(&views[range], false, most, Some(rows)).map(|_| ())
        })
    }
}
