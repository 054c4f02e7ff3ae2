//! The interface to JavaScript: a plain C ABI over one stand.
//!
//! JavaScript asks for the place of a buffer with [`input`], writes into it, and calls; it reads what a call returned at [`output`]. A panic stops the
//! instance; its message stands at [`last_words`].
#![expect(
    unsafe_code,
    reason = "exported names are an attribute that counts as unsafe; there is no unsafe block"
)]

use std::cell::RefCell;
use std::sync::Mutex;

use orchard_gpu::PackedTrees;
use serde_json::json;

use crate::stand::{Asked, Stand};

/// The stand, and the buffers.
#[derive(Default)]
struct Desk {
    stand: Option<Stand>,
    input: Vec<u8>,
    output: Vec<u8>,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::default();
}

/// Message of the panic that stopped this instance.
static LAST_WORDS: Mutex<String> = Mutex::new(String::new());

/// Calls with the desk; a problem goes into the output, and 0 is returned.
fn with(call: impl FnOnce(&mut Desk) -> Result<u32, String>) -> u32 {
    DESK.with_borrow_mut(|desk| {
        call(desk).unwrap_or_else(|problem| {
            desk.output = problem.into_bytes();
            0
        })
    })
}

impl Desk {
    fn stand(&mut self) -> Result<&mut Stand, String> {
        self.stand.as_mut().ok_or_else(|| "there is no stand".to_owned())
    }
}

/// Keeps messages of panics for [`last_words`]; call it once, first.
#[unsafe(no_mangle)]
pub extern "C" fn begin() {
    std::panic::set_hook(Box::new(|panic| {
        if let Ok(mut words) = LAST_WORDS.lock() {
            *words = panic.to_string();
        }
    }));
}

/// Makes room for a number of bytes, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn input(bytes: usize) -> *mut u8 {
    DESK.with_borrow_mut(|desk| {
        desk.input = vec![0; bytes];
        desk.input.as_mut_ptr()
    })
}

/// Address of the bytes that the last call returned.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    DESK.with_borrow(|desk| desk.output.as_ptr())
}

/// Number of these bytes.
#[unsafe(no_mangle)]
pub extern "C" fn output_bytes() -> usize {
    DESK.with_borrow(|desk| desk.output.len())
}

/// Address of the message of the panic that stopped this instance.
#[unsafe(no_mangle)]
pub extern "C" fn last_words() -> *const u8 {
    LAST_WORDS.lock().map_or(std::ptr::null(), |words| words.as_ptr())
}

/// Length of that message in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn last_words_bytes() -> usize {
    LAST_WORDS.lock().map_or(0, |words| words.len())
}

/// Begins a stand by the options in the input, JSON of [`Asked`]. Returns 1; or 0, with a sentence in the output.
#[unsafe(no_mangle)]
pub extern "C" fn stand() -> u32 {
    with(|desk| {
        let asked: Asked =
            serde_json::from_slice(&desk.input).map_err(|e| format!("the options cannot be read: {e}"))?;
        desk.stand = Some(Stand::new(&asked)?);
        Ok(1)
    })
}

/// Grows the next tree. Returns 2 if more are to grow, 1 if all are there; or 0, with a sentence in the output.
#[unsafe(no_mangle)]
pub extern "C" fn grow_one() -> u32 {
    with(|desk| Ok(1 + u32::from(desk.stand()?.grow_one()?)))
}

/// Packs the trees. Returns 1, with JSON in the output: `source` of the kernels, `kernels` (entry, constants, groups), `buffers` (name, is_read_only,
/// bytes), `substeps` of a frame, and `threads` of a workgroup; or 0, with a sentence in the output.
#[unsafe(no_mangle)]
pub extern "C" fn pack() -> u32 {
    with(|desk| {
        let packed = desk.stand()?.packed()?;
        let kernels: Vec<_> = packed
            .kernels()
            .into_iter()
            .map(|kernel| {
                let constants: serde_json::Map<_, _> = kernel
                    .constants
                    .into_iter()
                    .map(|(name, value)| (name.to_owned(), json!(value)))
                    .collect();
                json!({ "entry": kernel.entry, "constants": constants, "groups": kernel.groups })
            })
            .collect();
        let buffers: Vec<_> = packed
            .buffers()
            .iter()
            .map(|buffer| json!({ "name": buffer.name, "is_read_only": buffer.is_read_only, "bytes": buffer.bytes.len() }))
            .collect();
        let told = json!({
            "source": PackedTrees::source(),
            "kernels": kernels,
            "buffers": buffers,
            "substeps": packed.substeps(),
            "threads": PackedTrees::THREADS,
        });
        desk.output = told.to_string().into_bytes();
        Ok(1)
    })
}

/// Returns the content at the start of the buffer of a number, in the order of [`pack`].
#[unsafe(no_mangle)]
pub extern "C" fn contents(number: usize) -> u32 {
    with(|desk| {
        let buffers = desk.stand()?.packed()?.buffers();
        let bytes = buffers.get(number).ok_or_else(|| format!("there is no buffer {number}"))?.bytes.to_vec();
        desk.output = bytes;
        Ok(1)
    })
}

/// Returns the content of the buffer of rules in a frame.
#[unsafe(no_mangle)]
pub extern "C" fn rules(frame: u32) -> u32 {
    with(|desk| {
        desk.output = desk.stand()?.packed()?.rules(frame);
        Ok(1)
    })
}

/// Takes the input as what the kernels left in the buffer of a number. Returns 1; or 0, with a sentence in the output.
#[unsafe(no_mangle)]
pub extern "C" fn take(number: usize) -> u32 {
    with(|desk| {
        let bytes = std::mem::take(&mut desk.input);
        let packed = desk.stand()?.packed()?;
        let name = packed.buffers().get(number).map_or("", |buffer| buffer.name);
        if packed.take(name, &bytes) { Ok(1) } else { Err(format!("buffer {number} has another size")) }
    })
}

/// Returns the figures of the state that was taken last, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn figures() -> u32 {
    with(|desk| {
        desk.output = serde_json::to_vec(&desk.stand()?.figures()).map_err(|e| e.to_string())?;
        Ok(1)
    })
}

/// Returns the joint angles of a tree, in f64.
#[unsafe(no_mangle)]
pub extern "C" fn angles(index: usize) -> u32 {
    with(|desk| {
        let stand = desk.stand()?;
        if index >= stand.len() {
            return Err(format!("there is no tree {index}"));
        }
        desk.output = stand.angles(index).into_iter().flat_map(f64::to_le_bytes).collect();
        Ok(1)
    })
}

/// Returns the picture of the state that was taken last, in words of four bytes: for each tree the numbers of segments and fruit; then the lines; then the dots.
#[unsafe(no_mangle)]
pub extern "C" fn picture() -> u32 {
    with(|desk| {
        let picture = desk.stand()?.picture();
        let counts = picture.counts.iter().flatten().flat_map(|count| count.to_le_bytes());
        let numbers = picture.lines.iter().flatten().chain(picture.dots.iter().flatten());
        desk.output = counts.chain(numbers.flat_map(|number| number.to_le_bytes())).collect();
        Ok(1)
    })
}
