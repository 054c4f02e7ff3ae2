//! `orchard gpu-info`: prints the graphics device for batches of trees.

use orchard_gpu::{Choice, Gpu, GpuError};

use crate::failure::Failure;

/// Prints the graphics adapter, its limits and the kernel for it.
#[derive(clap::Args)]
#[command(
    after_help = "Any Vulkan, Metal or DirectX 12 adapter can be used. Without one, batches run on the CPU. Debian's package \
                  mesa-vulkan-drivers has a software adapter, which is slow and meant for tests.\n\n\
                  Exit code: 0, also without an adapter; 1 if the adapter cannot be used.\n\nExample:\n  orchard gpu-info"
)]
pub struct Args {
    /// Use a software adapter only
    #[arg(long)]
    software: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let choice = if args.software { Choice::Software } else { Choice::Any };
    match Gpu::open(choice) {
        Ok(gpu) => {
            let info = gpu.info();
            let kind = if info.is_software { ", in software" } else { "" };
            say!("adapter              {}{kind}", info.name);
            say!("backend              {}", info.backend);
            say!("driver               {}", info.driver);
            say!("workgroup storage    {} bytes", info.workgroup_storage);
            say!("largest buffer       {} bytes", info.storage_binding);
            say!(
                "subgroup operations  {} (the kernels need none)",
                if info.has_subgroups { "yes" } else { "no" }
            );
            say!("kernel               {}", info.kernel);
            Ok(())
        }
        Err(e @ GpuError::NoAdapter(_)) => {
            say!("{e}");
            Ok(())
        }
        Err(e) => Err(Failure::Failed(e.to_string())),
    }
}
