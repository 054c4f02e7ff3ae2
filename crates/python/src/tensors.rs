//! Observations in the memory of a card, as arrays of CUDA that any library with DLPack takes.

#[cfg(all(feature = "gpu", target_os = "linux"))]
pub use card::{CudaTensor, OnCard};
#[cfg(not(all(feature = "gpu", target_os = "linux")))]
pub use nowhere::{CudaTensor, OnCard};

#[cfg(all(feature = "gpu", target_os = "linux"))]
mod card {
    use dlpark::ffi::{DLDevice, DLManagedTensor, DLManagedTensorVersioned};
    use dlpark::python::{DlpackExporter, ExportRequest, export_dlpack};
    use dlpark::{DlpackFlags, Managed};
    use orchard_cuda::{Card, CudaArray, Number};
    use orchard_env::{EnvError, TaskEnv};
    use orchard_policy::Field;
    use pyo3::exceptions::PyRuntimeError;
    use pyo3::prelude::*;
    use pyo3::types::PyDict;

    /// The observations of all environments in the memory of a card.
    pub struct OnCard {
        card: Card,
        arrays: Vec<(&'static str, Py<CudaTensor>)>,
    }

    fn refused(problem: impl std::fmt::Display) -> PyErr {
        PyRuntimeError::new_err(format!("device cuda: {problem}; device=\"cpu\" works everywhere"))
    }

    impl OnCard {
        /// Keeps the observations of environments on their device, which must be the card of a number in CUDA, or any of them.
        pub fn new(py: Python<'_>, env: &mut TaskEnv, number: Option<usize>) -> PyResult<Self> {
            env.keep_on_device(true).map_err(refused)?;
            let (fields, envs) = (env.interface().policy.observation.clone(), env.len());
            let mut card: Option<Card> = None;
            let mut arrays = Vec::new();
            for (field, array) in fields.iter().zip(env.device_arrays().into_iter().flatten()) {
                let Some(memory) = array.as_mut().and_then(|array| array.take_handle()) else { continue };
                let there = match card.take() {
                    Some(there) => there,
                    None => Card::open(memory.card, number).map_err(refused)?,
                };
                let array = shaped(field, envs, there.import(memory).map_err(refused)?);
                arrays.push((field.key, Py::new(py, CudaTensor { array })?));
                card = Some(there);
            }
            let card = card.ok_or_else(|| refused("the observations have no numbers"))?;
            Ok(Self { card, arrays })
        }

        /// Waits for CUDA's work on the card, which may still read what is written next.
        pub fn wait(&self) -> Result<(), EnvError> {
            self.card.wait().map_err(|e| EnvError::Device(e.to_string()))
        }

        /// The arrays by key.
        pub fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
            let all = PyDict::new(py);
            self.arrays.iter().try_for_each(|(key, array)| all.set_item(key, array))?;
            Ok(all)
        }
    }

    fn shaped(field: &Field, envs: usize, memory: orchard_cuda::CudaMemory) -> CudaArray {
        let number = if field.dtype == "uint8" { Number::U8 } else { Number::F32 };
        CudaArray::new(memory, number, [&[envs], field.shape.as_slice()].concat())
    }

    /// An array in the memory of a card, for `from_dlpack` of any library.
    #[pyclass(frozen, module = "orchardbench._native")]
    pub struct CudaTensor {
        array: CudaArray,
    }

    #[pymethods]
    impl CudaTensor {
        #[pyo3(signature = (*, stream=None, max_version=None, dl_device=None, copy=None))]
        fn __dlpack__<'py>(
            &self,
            py: Python<'py>,
            stream: Option<&Bound<'py, PyAny>>,
            max_version: Option<(u32, u32)>,
            dl_device: Option<(u32, i32)>,
            copy: Option<bool>,
        ) -> PyResult<Py<PyAny>> {
            export_dlpack(self, py, ExportRequest::parse(stream, max_version, dl_device, copy)?)
        }

        fn __dlpack_device__(&self) -> (u32, i32) {
            self.array.device().into()
        }
    }

    impl DlpackExporter for CudaTensor {
        fn device(&self) -> DLDevice {
            self.array.device()
        }

        fn flags(&self) -> DlpackFlags {
            DlpackFlags::empty()
        }

        /// The processor has waited for the writes, so that every stream finds them.
        fn prepare_export(&self, _: Python<'_>, _: &ExportRequest<'_>) -> PyResult<()> {
            Ok(())
        }

        fn export_legacy(&self, _: Python<'_>) -> PyResult<Managed<DLManagedTensor>> {
            self.array.managed().map_err(refused)
        }

        fn export_versioned(&self, _: Python<'_>) -> PyResult<Managed<DLManagedTensorVersioned>> {
            self.array.managed().map_err(refused)
        }
    }
}

#[cfg(not(all(feature = "gpu", target_os = "linux")))]
mod nowhere {
    use orchard_env::{EnvError, TaskEnv};
    use pyo3::exceptions::PyRuntimeError;
    use pyo3::prelude::*;
    use pyo3::types::PyDict;

    /// There is none.
    pub enum OnCard {}

    impl OnCard {
        pub fn new(_: Python<'_>, _: &mut TaskEnv, _: Option<usize>) -> PyResult<Self> {
            Err(PyRuntimeError::new_err(
                "device cuda: memory is shared with CUDA on Linux alone; device=\"cpu\" works everywhere",
            ))
        }

        pub fn wait(&self) -> Result<(), EnvError> {
            match *self {}
        }

        pub fn arrays<'py>(&self, _: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
            match *self {}
        }
    }

    /// There is none.
    #[pyclass(frozen, module = "orchardbench._native")]
    pub struct CudaTensor;
}
