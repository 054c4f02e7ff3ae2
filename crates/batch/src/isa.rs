//! Which vector instructions to use, found out at run time.
#![cfg_attr(target_arch = "wasm32", allow(dead_code))] // it has but one set

use crate::kernel::{Baseline, Instructions, Task};
use pulp::{Simd, WithSimd};

/// A task as pulp takes it.
struct Wide<T>(T);

impl<T: Task> WithSimd for Wide<T> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> T::Output {
        self.0.with(simd)
    }
}

/// A set of vector instructions.
///
/// A batch gives the same bits again with the same set. Sets differ only in the rounding of a product and sum
/// ([`Isa::is_fused`]): those that round once agree with each other to the bit, and so do those that round twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Isa {
    /// x86-64 with AVX-512: 16 worlds a vector.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// x86-64 with AVX2 and fused multiply-add: 8 worlds.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Any x86-64: 4 worlds.
    #[cfg(target_arch = "x86_64")]
    Sse2,
    /// ARM with NEON, fused: 4 worlds.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// The code of SSE2 on another processor, with what all of its kind have (NEON on ARM): 4 worlds.
    #[cfg(not(target_arch = "x86_64"))]
    Portable,
}

impl Isa {
    /// Instruction set that every processor of the target has.
    #[cfg(target_arch = "x86_64")]
    pub const BASELINE: Self = Self::Sse2;
    /// Instruction set that every processor of the target has.
    #[cfg(not(target_arch = "x86_64"))]
    pub const BASELINE: Self = Self::Portable;

    /// Instruction sets of this processor, fastest first.
    pub fn available() -> Vec<Self> {
        let mut available = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            if pulp::x86::V4::is_available() {
                available.push(Self::Avx512);
            }
            if pulp::x86::V3::is_available() {
                available.push(Self::Avx2);
            }
        }
        #[cfg(target_arch = "aarch64")]
        if pulp::aarch64::Neon::is_available() {
            available.push(Self::Neon);
        }
        available.push(Self::BASELINE);
        available
    }

    /// Fastest instruction set of this processor.
    pub fn best() -> Self {
        Self::available()[0]
    }

    /// True if a product and sum are rounded once.
    pub fn is_fused(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 | Self::Avx2 => true,
            #[cfg(target_arch = "aarch64")]
            Self::Neon => true,
            Self::BASELINE => Baseline::IS_FUSED,
        }
    }

    /// Worlds a vector: the width of a tile.
    pub fn lanes(self) -> usize {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => pulp::x86::V4::LANES,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => pulp::x86::V3::LANES,
            #[cfg(target_arch = "aarch64")]
            Self::Neon => pulp::aarch64::Neon::LANES,
            Self::BASELINE => Baseline::LANES,
        }
    }

    /// Does a task, compiled for this set.
    ///
    /// # Panics
    /// If the processor does not have it: a batch is only made with one that it has.
    pub(crate) fn run<T: Task>(self, task: T) -> T::Output {
        const MISSING: &str = "a batch is made with instructions that the processor has";
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => Simd::vectorize(pulp::x86::V4::try_new().expect(MISSING), Wide(task)),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => Simd::vectorize(pulp::x86::V3::try_new().expect(MISSING), Wide(task)),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => Simd::vectorize(pulp::aarch64::Neon::try_new().expect(MISSING), Wide(task)),
            Self::BASELINE => task.with(Baseline),
        }
    }
}
