//! Buffers of wgpu on memory that Vulkan exports.

use std::os::fd::{FromRawFd, OwnedFd};

use ash::{khr, vk};
use wgpu::hal::api::Vulkan;
use wgpu::hal::vulkan::Buffer;

use crate::{CardId, ExportError, ExportedBuffer, Handle};

/// Kind of the handle: a file descriptor that means something to the drivers of the same card alone.
const KIND: vk::ExternalMemoryHandleTypeFlags = vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;
/// Uses of the buffer for Vulkan, and the same for wgpu.
const USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw(),
);
const WGPU_USAGE: wgpu::BufferUsages =
    wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_SRC).union(wgpu::BufferUsages::COPY_DST);

/// Vulkan's handles of the device of wgpu; valid while that lives.
struct Raw<'a> {
    instance: &'a ash::Instance,
    physical: vk::PhysicalDevice,
    device: &'a ash::Device,
}

/// A buffer with memory of its own.
struct Made {
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    handle: Handle,
}

/// [`ExportedBuffer::new`].
pub(crate) fn create(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    bytes: u64,
) -> Result<ExportedBuffer, ExportError> {
    // wgpu clears in words, and no buffer is empty.
    let size = bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT).max(wgpu::COPY_BUFFER_ALIGNMENT);
    let made = {
        // SAFETY: the device is not destroyed through what this returns, which lives to the end of the block; `device` keeps it alive.
        let hal = unsafe { device.as_hal::<Vulkan>() }.ok_or(ExportError::NotVulkan)?;
        if !hal.enabled_device_extensions().contains(&khr::external_memory_fd::NAME) {
            return Err(ExportError::Unsupported("it lacks VK_KHR_external_memory_fd"));
        }
        let raw = Raw {
            instance: hal.shared_instance().raw_instance(),
            physical: hal.raw_physical_device(),
            device: hal.raw_device(),
        };
        raw.make(size)?
    };
    // SAFETY: buffer and memory were made for each other, from this device, with the memory bound at 0; nothing else destroys or maps them, and wgpu frees both.
    let hal = unsafe { Buffer::from_raw_managed(made.buffer, made.memory, 0, made.handle.bytes) };
    let descriptor =
        wgpu::BufferDescriptor { label: Some(label), size, usage: WGPU_USAGE, mapped_at_creation: false };
    // SAFETY: the buffer is of this device, has this size and these uses, and is cleared below before anything can read it.
    let buffer = unsafe { device.create_buffer_from_hal::<Vulkan>(hal, &descriptor) };
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.clear_buffer(&buffer, 0, None);
    queue.submit([encoder.finish()]);
    Ok(ExportedBuffer { buffer, handle: made.handle })
}

impl Raw<'_> {
    fn make(&self, bytes: u64) -> Result<Made, ExportError> {
        let is_dedicated = self.exports()?;
        let refused = |e: vk::Result| ExportError::Refused { bytes, why: e.to_string() };
        let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(KIND);
        let info = vk::BufferCreateInfo::default()
            .size(bytes)
            .usage(USAGE)
            .sharing_mode(vk::SharingMode::EXCLUSIVE)
            .push_next(&mut external);
        // SAFETY: the device is alive, and the description is complete.
        let buffer = unsafe { self.device.create_buffer(&info, None) }.map_err(refused)?;
        let memory = self.allocate(buffer, bytes, is_dedicated).inspect_err(|_| {
            // SAFETY: nobody else has the buffer.
            unsafe { self.device.destroy_buffer(buffer, None) };
        });
        let (memory, bytes) = memory?;
        let handle = self.bound(buffer, memory).map_err(refused).inspect_err(|_| {
            // SAFETY: nobody else has buffer or memory, and no work uses them.
            unsafe {
                self.device.destroy_buffer(buffer, None);
                self.device.free_memory(memory, None);
            }
        })?;
        Ok(Made { buffer, memory, handle: Handle { fd: handle, bytes, card: self.card() } })
    }

    /// Checks that such buffers can be exported; true if each needs memory of its own.
    fn exports(&self) -> Result<bool, ExportError> {
        let info = vk::PhysicalDeviceExternalBufferInfo::default().usage(USAGE).handle_type(KIND);
        let mut found = vk::ExternalBufferProperties::default();
        // SAFETY: the physical device is of this instance, which wgpu makes for Vulkan 1.1 or later, where this function is.
        unsafe {
            self.instance.get_physical_device_external_buffer_properties(self.physical, &info, &mut found);
        }
        let features = found.external_memory_properties.external_memory_features;
        if features.contains(vk::ExternalMemoryFeatureFlags::EXPORTABLE) {
            return Ok(features.contains(vk::ExternalMemoryFeatureFlags::DEDICATED_ONLY));
        }
        Err(ExportError::Unsupported("its buffers cannot be exported by file descriptors"))
    }

    /// Allocates exported memory for a buffer; returns it with its size.
    fn allocate(
        &self,
        buffer: vk::Buffer,
        bytes: u64,
        is_dedicated: bool,
    ) -> Result<(vk::DeviceMemory, u64), ExportError> {
        // SAFETY: the buffer is of this device.
        let needs = unsafe { self.device.get_buffer_memory_requirements(buffer) };
        // SAFETY: the physical device is of this instance.
        let has = unsafe { self.instance.get_physical_device_memory_properties(self.physical) };
        let local = vk::MemoryPropertyFlags::DEVICE_LOCAL;
        let kinds = (0..has.memory_type_count).zip(has.memory_types_as_slice());
        let mut fitting = kinds
            .filter(|(k, kind)| needs.memory_type_bits & 1 << k != 0 && kind.property_flags.contains(local));
        let (kind, _) =
            fitting.next().ok_or(ExportError::Unsupported("it has no memory of its own for them"))?;
        let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(KIND);
        let mut dedicated = vk::MemoryDedicatedAllocateInfo::default().buffer(buffer);
        let mut info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(kind)
            .push_next(&mut export);
        if is_dedicated {
            info = info.push_next(&mut dedicated);
        }
        // SAFETY: size and kind are those that the buffer needs.
        let memory = unsafe { self.device.allocate_memory(&info, None) };
        let memory = memory.map_err(|e| ExportError::Refused { bytes, why: e.to_string() })?;
        Ok((memory, needs.size))
    }

    /// Binds memory to a buffer, and exports it.
    fn bound(&self, buffer: vk::Buffer, memory: vk::DeviceMemory) -> Result<OwnedFd, vk::Result> {
        // SAFETY: the memory was allocated for this buffer, which has none yet.
        unsafe { self.device.bind_buffer_memory(buffer, memory, 0) }?;
        let exporter = khr::external_memory_fd::Device::new(self.instance, self.device);
        let info = vk::MemoryGetFdInfoKHR::default().memory(memory).handle_type(KIND);
        // SAFETY: the device has the extension, and the memory was allocated to be exported by such a handle.
        let fd = unsafe { exporter.get_memory_fd(&info) }?;
        // SAFETY: the call has made this descriptor for us.
        Ok(unsafe { OwnedFd::from_raw_fd(fd) })
    }

    fn card(&self) -> CardId {
        let mut id = vk::PhysicalDeviceIDProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut id);
        // SAFETY: the physical device is of this instance, which is of Vulkan 1.1 or later.
        unsafe { self.instance.get_physical_device_properties2(self.physical, &mut properties) };
        id.device_uuid
    }
}
