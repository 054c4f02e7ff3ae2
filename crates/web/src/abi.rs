//! The interface to JavaScript: a plain C ABI over one session.
//!
//! Text and numbers go through buffers of this module: JavaScript asks for the place of one with [`input`], writes into it, and calls; it reads what
//! a call returned at [`output`] or [`floats`]. A panic stops the instance; its message stands at [`last_words`].
#![expect(
    unsafe_code,
    reason = "exported names are an attribute that counts as unsafe; there is no unsafe block"
)]

use std::cell::RefCell;
use std::sync::Mutex;

use orchard_geometry::Vec3;

use orchard_play::{Reach, Session};

use crate::ask::{Ask, AskError, menu};

/// The session, and the buffers.
#[derive(Default)]
struct Desk {
    session: Option<Session>,
    input: Vec<u8>,
    output: Vec<u8>,
    floats: Vec<f32>,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::default();
}

/// Message of the panic that stopped this instance.
static LAST_WORDS: Mutex<String> = Mutex::new(String::new());

fn with<T>(call: impl FnOnce(&mut Desk) -> T) -> T {
    DESK.with_borrow_mut(call)
}

fn with_session<T>(call: impl FnOnce(&mut Session) -> T) -> Option<T> {
    with(|desk| desk.session.as_mut().map(call))
}

impl Desk {
    fn say(&mut self, text: impl Into<String>) {
        self.output = text.into().into_bytes();
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

/// Makes room for a text of a number of bytes, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn input(bytes: usize) -> *mut u8 {
    with(|desk| {
        desk.input = vec![0; bytes];
        desk.input.as_mut_ptr()
    })
}

/// Address of the bytes that the last call returned.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    with(|desk| desk.output.as_ptr())
}

/// Number of these bytes.
#[unsafe(no_mangle)]
pub extern "C" fn output_bytes() -> usize {
    with(|desk| desk.output.len())
}

/// Address of the numbers that the last call returned.
#[unsafe(no_mangle)]
pub extern "C" fn floats() -> *const f32 {
    with(|desk| desk.floats.as_ptr())
}

/// Number of these numbers.
#[unsafe(no_mangle)]
pub extern "C" fn floats_count() -> usize {
    with(|desk| desk.floats.len())
}

/// Address of the message of the panic that stopped this instance.
#[unsafe(no_mangle)]
pub extern "C" fn last_words() -> *const u8 {
    LAST_WORDS.lock().map_or(std::ptr::null(), |words| words.as_ptr())
}

/// Number of its bytes.
#[unsafe(no_mangle)]
pub extern "C" fn last_words_bytes() -> usize {
    LAST_WORDS.lock().map_or(0, |words| words.len())
}

/// Returns names and ranges that a page offers, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn offer() {
    with(|desk| desk.say(menu()));
}

/// Grows a world by the options in the input, JSON of [`Ask`]. Returns 1; or 0, with a sentence in the output, and then the session stays as it was.
#[unsafe(no_mangle)]
pub extern "C" fn grow() -> u32 {
    with(|desk| {
        let text = String::from_utf8_lossy(&desk.input).into_owned();
        let grown = Ask::from_json(&text).and_then(|ask| crate::grow(&ask));
        match grown {
            Ok(session) => {
                desk.session = Some(session);
                1
            }
            Err(AskError(problem)) => {
                desk.say(problem);
                0
            }
        }
    })
}

/// Brings world and driver back to the start.
#[unsafe(no_mangle)]
pub extern "C" fn reset() {
    with_session(Session::reset);
}

/// Advances a number of frames.
#[unsafe(no_mangle)]
pub extern "C" fn step(frames: u32) {
    with_session(|session| (0..frames).for_each(|_| session.step()));
}

/// Advances a number of frames and returns the digest of each, 32 bytes a frame.
#[unsafe(no_mangle)]
pub extern "C" fn step_watched(frames: u32) {
    with(|desk| {
        let Some(session) = &mut desk.session else { return };
        desk.output = (0..frames).flat_map(|_| session.step_watched()).collect();
    });
}

/// Returns the figures of the present state, as JSON of [`orchard_play::Told`].
#[unsafe(no_mangle)]
pub extern "C" fn tell() {
    with(|desk| {
        let told = desk.session.as_ref().and_then(|session| serde_json::to_string(&session.told()).ok());
        desk.say(told.unwrap_or_default());
    });
}

/// Returns the meshes: numbers of all vertices, and in the output the number of vertices of each mesh as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn meshes() {
    with(|desk| {
        let Some(picture) = desk.session.as_ref().map(Session::picture) else { return };
        let counts: Vec<usize> = picture.meshes.iter().map(|mesh| 3 * mesh.triangles()).collect();
        desk.floats = picture.meshes.into_iter().flat_map(|mesh| mesh.floats).collect();
        desk.say(serde_json::to_string(&counts).unwrap_or_default());
    });
}

/// Returns the instances: their numbers, and in the output the number of instances of each mesh as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn picture() {
    with(|desk| {
        let Some(picture) = desk.session.as_ref().map(Session::picture) else { return };
        let counts: Vec<usize> = picture.groups.iter().map(|group| group.count).collect();
        desk.floats = picture.instances;
        desk.say(serde_json::to_string(&counts).unwrap_or_default());
    });
}

/// Grabs what a ray from a place \[m\], world, along a direction meets, or misses by little; by a key (not 0) it may miss by more. [`tell`] tells the
/// grabbed place.
#[unsafe(no_mangle)]
pub extern "C" fn grab(x: f64, y: f64, z: f64, along_x: f64, along_y: f64, along_z: f64, by_key: u32) {
    let (p_world, along) = (Vec3::new(x, y, z), Vec3::new(along_x, along_y, along_z));
    with_session(|session| session.grab(&p_world, &along, by_key != 0, Reach::Tree));
}

/// Moves the pointer to which the hand pulls \[m\], world.
#[unsafe(no_mangle)]
pub extern "C" fn pull_to(x: f64, y: f64, z: f64) {
    with_session(|session| session.pull_to(&Vec3::new(x, y, z)));
}

/// Lets go.
#[unsafe(no_mangle)]
pub extern "C" fn release() {
    with_session(Session::release);
}
