//! Observations of all environments that lie on a graphics device.

use orchard_gpu::{DepthMask, DeviceArray, Gpu, GpuError};
use orchard_policy::{Field, Values};
use rayon::prelude::*;

use crate::slot::Slot;

/// Keys of the fields that the device itself writes.
const DEPTH: &str = "depth";
const DEPTH_VALID: &str = "depth_valid";
const PICTURES: [&str; 2] = ["pixels_wrist", "pixels_base"];

/// An array for each field, a row an environment.
#[derive(Debug)]
pub(crate) struct OnDevice {
    gpu: Gpu,
    /// In the order of the fields; text has none.
    arrays: Vec<Option<DeviceArray>>,
    /// Field of depth images, if they are observed, and the kernel that marks which pixels have a depth.
    depth: Option<(usize, DepthMask)>,
    /// Fields of pictures, of the hand and of the base, if they are observed. The device draws them if their rows have whole words.
    pictures: Option<[usize; 2]>,
}

/// Bytes of a number of a field; none of text.
fn bytes_of(field: &Field) -> Option<usize> {
    match field.dtype {
        "str" => None,
        "uint8" => Some(size_of::<u8>()),
        _ => Some(size_of::<f32>()),
    }
}

impl OnDevice {
    /// Makes arrays of zeros; `shared`: in memory that others can open.
    pub fn new(gpu: &Gpu, fields: &[Field], envs: usize, shared: bool) -> Result<Self, GpuError> {
        let array = |field: &Field| {
            let bytes = bytes_of(field)? * field.shape.iter().product::<usize>();
            Some(DeviceArray::new(gpu, field.key, envs, bytes, shared))
        };
        let arrays: Vec<Option<DeviceArray>> =
            fields.iter().map(|field| array(field).transpose()).collect::<Result<_, _>>()?;
        let place = |key| fields.iter().position(|field| field.key == key);
        let of = |key| Some((place(key)?, arrays[place(key)?].as_ref()?));
        let both = of(DEPTH).zip(of(DEPTH_VALID));
        let depth = both.map(|((place, depths), (_, masks))| (place, DepthMask::new(gpu, depths, masks)));
        let bytes = |place: usize| arrays[place].as_ref().map_or(0, |array| array.bytes() / envs);
        let whole = |key| place(key).filter(|&place| bytes(place).is_multiple_of(size_of::<u32>()));
        let [wrist, base] = PICTURES.map(whole);
        let pictures = wrist.zip(base).map(|(wrist, base)| [wrist, base]);
        Ok(Self { gpu: gpu.clone(), arrays, depth, pictures })
    }

    /// The arrays, in the order of the fields.
    pub fn arrays(&mut self) -> &mut [Option<DeviceArray>] {
        &mut self.arrays
    }

    /// The array of depth images.
    pub fn depths(&self) -> Option<&DeviceArray> {
        self.depth.as_ref().and_then(|(place, _)| self.arrays[*place].as_ref())
    }

    /// The arrays of pictures, of the hand and of the base, if the device draws them.
    pub fn pictures(&self) -> Option<[&DeviceArray; 2]> {
        let [wrist, base] = self.pictures?.map(|place| self.arrays[place].as_ref());
        wrist.zip(base).map(|(wrist, base)| [wrist, base])
    }

    /// Sends what the processor has observed, and waits until all is there.
    pub fn send(&self, fields: &[Field], slots: &[Slot]) -> Result<(), GpuError> {
        for (i, (field, array)) in fields.iter().zip(&self.arrays).enumerate() {
            let Some(array) = array else { continue };
            let drawn_there = self.depth.is_some() && [DEPTH, DEPTH_VALID].contains(&field.key)
                || self.pictures.is_some_and(|places| places.contains(&i));
            if drawn_there {
                continue;
            }
            let each = array.bytes() / slots.len();
            let mut bytes = vec![0; array.bytes()];
            bytes.par_chunks_mut(each.max(1)).zip(slots).for_each(|(row, slot)| match slot.values().get(i) {
                Some(Values::F32(numbers)) => row.copy_from_slice(bytemuck::cast_slice(numbers)),
                Some(Values::U8(numbers)) => row.copy_from_slice(numbers),
                // Before the first reset there are zeros.
                _ => {}
            });
            array.write(&bytes);
        }
        if let Some((_, mask)) = &self.depth {
            mask.mark();
        }
        self.gpu.finish()
    }
}
