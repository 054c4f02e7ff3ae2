//! The hot loop does not allocate.
#![allow(unsafe_code)] // a global allocator that counts

mod trees;

use orchard_batch::Batch;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use trees::{drop_fruit, kick, siblings, state, tip_over, tips};

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is forwarded to the system's allocator unchanged.
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

/// Kicked trees, fruit on the ground, and trees that lie on it.
fn orchard() -> (Batch, usize) {
    let mut worlds = siblings(20);
    kick(&mut worlds, 0.5);
    worlds[..8].iter_mut().for_each(|world| _ = drop_fruit(world, 0.1));
    let broken: Vec<usize> = worlds[5..12].iter_mut().map(|world| tip_over(world, 4.0)).collect();
    let mut batch = Batch::new(&worlds).unwrap();
    (5..).zip(broken).for_each(|(index, segment)| batch.break_branch(index, segment));
    let mut settled = 0;
    // Until a second has passed without an event.
    while settled < 60 {
        settled = if batch.step(1).is_empty() { settled + 1 } else { 0 };
    }
    let mut lowest = |index: usize| {
        let data = state(&mut batch, &worlds[index], index);
        tips(&worlds[index], &data).iter().fold(f64::INFINITY, |m, tip| m.min(tip.z))
    };
    let fallen = (0..worlds.len()).filter(|index| lowest(*index) < 0.01).count();
    (batch, fallen)
}

/// Frames without an event do not allocate once the threads have started; the one test of this binary, so that nothing else
/// counts.
#[test]
fn frames_without_events_allocate_nothing() {
    let (mut batch, fallen) = orchard();
    assert_eq!(fallen, 7);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        // A thread that takes its first job registers itself, and on a busy machine that may come late: here each takes one.
        let met = Barrier::new(threads);
        pool.install(|| match threads {
            1 => _ = met.wait(),
            _ => _ = rayon::join(|| met.wait(), || met.wait()),
        });
        // The pool of threads itself allocates now and then, when a thread that had to wait wakes up on a busy machine. Frames that allocate do so in every spell.
        let mut of_spell = || {
            assert_eq!(batch.step(20), []);
            let before = ALLOCATIONS.load(Ordering::Relaxed);
            assert_eq!(batch.step(60), []);
            ALLOCATIONS.load(Ordering::Relaxed) - before
        };
        let count = pool.install(|| (0..3).map(|_| of_spell()).min().unwrap());
        assert_eq!(count, 0, "{threads} threads");
    }
}
