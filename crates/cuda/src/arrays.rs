//! Exported memory as arrays of CUDA, and their descriptions by DLPack.

use std::sync::Arc;

use cudarc::driver::{CudaContext, DevicePtr, DriverError, MappedBuffer, result, sys};
use dlpark::ffi::{DLDataType, DLDevice};
use dlpark::metadata::Dynamic;
use dlpark::{Managed, ManagedTensorBase};
use orchard_tensor::{CardId, Handle};

/// The reason why CUDA cannot open memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CudaError {
    /// There is no driver of CUDA.
    #[error("the driver of CUDA (libcuda) is not installed")]
    NoDriver,
    /// No device of CUDA is the card.
    #[error("no device of CUDA is this card; CUDA_VISIBLE_DEVICES may hide it")]
    NotHere,
    /// Another device of CUDA is the card.
    #[error("cuda:{given} is another card than the adapter, which is cuda:{is}")]
    OtherCard {
        /// Number of the device that was asked for.
        given: usize,
        /// Number of the device that is the card.
        is: usize,
    },
    /// CUDA refused.
    #[error("CUDA refused: {0}")]
    Refused(String),
}

impl From<DriverError> for CudaError {
    fn from(e: DriverError) -> Self {
        Self::Refused(e.to_string())
    }
}

/// A card as CUDA has it, in the context that PyTorch and JAX use (the primary one).
#[derive(Debug, Clone)]
pub struct Card {
    context: Arc<CudaContext>,
}

impl Card {
    /// Finds the card among the devices of CUDA; with a number, the device of that number must be the card.
    ///
    /// # Errors
    /// There is no driver, the card is not there, or it has another number.
    pub fn open(card: CardId, number: Option<usize>) -> Result<Self, CudaError> {
        // SAFETY: loading the driver's library runs no code but its own.
        if !unsafe { sys::is_culib_present() } {
            return Err(CudaError::NoDriver);
        }
        result::init()?;
        let is_card = |k: &i32| -> Result<bool, DriverError> {
            let id = result::device::get_uuid(result::device::get(*k)?)?;
            Ok(id.bytes.map(|byte| byte as u8) == card)
        };
        for k in 0..result::device::get_count()? {
            if is_card(&k)? {
                let is = k as usize;
                return match number {
                    Some(given) if given != is => Err(CudaError::OtherCard { given, is }),
                    _ => Ok(Self { context: CudaContext::new(is)? }),
                };
            }
        }
        Err(CudaError::NotHere)
    }

    /// Number of the device in CUDA.
    pub fn number(&self) -> usize {
        self.context.ordinal()
    }

    /// Waits for all work of CUDA on the card in this process, such as kernels that still read arrays.
    ///
    /// # Errors
    /// Some of the work has failed.
    pub fn wait(&self) -> Result<(), CudaError> {
        Ok(self.context.synchronize()?)
    }

    /// Opens exported memory of this card.
    ///
    /// # Errors
    /// CUDA refuses it.
    pub fn import(&self, memory: Handle) -> Result<CudaMemory, CudaError> {
        let Handle { fd, bytes, .. } = memory;
        // SAFETY: the handle was made with these bytes.
        let imported = unsafe { self.context.import_external_memory(fd.into(), bytes) }?;
        let mapped = imported.map_all()?;
        let stream = self.context.default_stream();
        let (address, _) = mapped.device_ptr(&stream);
        Ok(CudaMemory { address, bytes, context: self.context.clone(), _mapped: mapped })
    }
}

/// Memory that CUDA has opened.
#[derive(Debug)]
pub struct CudaMemory {
    address: sys::CUdeviceptr,
    bytes: u64,
    context: Arc<CudaContext>,
    _mapped: MappedBuffer,
}

// SAFETY: handles of CUDA's driver mean the same to every thread; dropping binds the context to its thread first, and nothing else uses them.
unsafe impl Send for CudaMemory {}
// SAFETY: what a shared reference gives is numbers that do not change.
unsafe impl Sync for CudaMemory {}

/// Type of an array's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// 32-bit floating point.
    F32,
    /// Bytes.
    U8,
}

/// An array at the start of memory, row by row.
#[derive(Debug, Clone)]
pub struct CudaArray {
    memory: Arc<CudaMemory>,
    number: Number,
    shape: Vec<usize>,
}

impl CudaArray {
    /// Describes memory as an array.
    ///
    /// # Panics
    /// The memory is smaller than the array.
    pub fn new(memory: CudaMemory, number: Number, shape: Vec<usize>) -> Self {
        let array = Self { memory: Arc::new(memory), number, shape };
        let (needs, has) = (array.bytes() as u64, array.memory.bytes);
        assert!(needs <= has, "an array of {needs} bytes in memory of {has}");
        array
    }

    /// Device of the array, as DLPack names it.
    pub fn device(&self) -> DLDevice {
        DLDevice::cuda(self.memory.context.ordinal() as i32)
    }

    /// Copies the array's bytes to the processor.
    ///
    /// # Errors
    /// CUDA refused, or earlier work has failed.
    pub fn read(&self) -> Result<Vec<u8>, CudaError> {
        self.memory.context.bind_to_thread()?;
        let mut bytes = vec![0; self.bytes()];
        // SAFETY: the memory has at least these bytes, and lives as long as `self`.
        unsafe { result::memcpy_dtoh_sync(&mut bytes, self.memory.address) }?;
        Ok(bytes)
    }

    fn bytes(&self) -> usize {
        let each = if self.number == Number::F32 { size_of::<f32>() } else { size_of::<u8>() };
        self.shape.iter().product::<usize>() * each
    }

    /// Describes the array to another library, which shares the memory.
    ///
    /// # Errors
    /// The shape has a number that DLPack has no room for.
    pub fn managed<M: ManagedTensorBase>(&self) -> Result<Managed<M>, CudaError> {
        let shape: Vec<i64> = self.shape.iter().map(|n| *n as i64).collect();
        let described = Dynamic::compact(shape).initialize_as::<M>(self.memory.clone());
        let mut described = described.map_err(|e| CudaError::Refused(e.to_string()))?;
        described.set_data(self.memory.address as *mut std::ffi::c_void).set_device(self.device()).set_dtype(
            match self.number {
                Number::F32 => DLDataType::F32,
                Number::U8 => DLDataType::U8,
            },
        );
        // SAFETY: the address is that of memory which the description owns a share of, with room for the shape (checked in `new`), row by row, and the device is its own.
        Ok(unsafe { described.finish() })
    }
}
