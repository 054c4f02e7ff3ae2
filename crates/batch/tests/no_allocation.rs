//! The hot loop allocates nothing.
#![allow(unsafe_code)] // a global allocator that counts

#[path = "lanes/common.rs"]
mod common;

use common::{kick, siblings};
use orchard_batch::Batch;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Frames without an event allocate nothing once the threads are there; the one test of this binary, so that nothing else
/// counts.
#[test]
fn frames_without_events_allocate_nothing() {
    let mut worlds = siblings(20);
    kick(&mut worlds, 0.5);
    let mut batch = Batch::new(&worlds).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let count = pool.install(|| {
        batch.step(5);
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        assert_eq!(batch.step(60), []);
        ALLOCATIONS.load(Ordering::Relaxed) - before
    });
    assert_eq!(count, 0);
}
