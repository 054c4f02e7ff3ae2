//! `orchard gpu-info`: the graphics device that batches of trees would run on.

use orchard_gpu::{Choice, Gpu, GpuError};

use crate::failure::Failure;

/// Prints the graphics adapter, its limits and the kernel that would run on it.
#[derive(clap::Args)]
#[command(
    after_help = "Any Vulkan, Metal or DirectX 12 adapter does. Without one, batches run on the processor; Debian's package \
                  mesa-vulkan-drivers has one in software, which is slow and for tests.\n\n\
                  Exit code: 0, also without an adapter; 1 if there is one that cannot be used.\n\nExample:\n  orchard gpu-info"
)]
pub struct Args {
    /// Look for an adapter in software only
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
