//! A buffer that Vulkan and CUDA see at once: the device writes through wgpu, and CUDA says where the memory is.
//!
//!     cargo run -p orchard-cuda --example shared_memory

use std::error::Error;

#[cfg(target_os = "linux")]
fn main() -> Result<(), Box<dyn Error>> {
    use orchard_cuda::{Card, CudaArray, Number};
    use orchard_tensor::ExportedBuffer;

    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    }))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let numbers = [1.0_f32, 2.0, 3.0, 4.0];
    let exported = ExportedBuffer::new(&device, &queue, "numbers", size_of_val(&numbers) as u64)?;
    println!("{}: {:?}", adapter.get_info().name, exported.handle);
    queue.write_buffer(&exported.buffer, 0, bytemuck::cast_slice(&numbers));
    queue.submit([]);
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let card = Card::open(exported.handle.card, None)?;
    let array = CudaArray::new(card.import(exported.handle)?, Number::F32, vec![2, 2]);
    let read: Vec<f32> = bytemuck::pod_collect_to_vec(&array.read()?);
    println!("cuda:{} reads {read:?}", card.number());
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn main() -> Result<(), Box<dyn Error>> {
    Err(orchard_tensor::ExportError::NotVulkan.into())
}
