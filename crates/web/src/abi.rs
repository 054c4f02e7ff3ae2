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

use orchard_play::{Reach, Wish};

use crate::ask::{Ask, Files, menu};
use crate::parts::AskError;
use crate::policy::PolicyFiles;
use crate::tab::Tab;
use crate::tree::TreeBytes;

/// The session, and the buffers.
#[derive(Default)]
struct Desk {
    tab: Option<Tab>,
    files: Files,
    input: Vec<u8>,
    output: Vec<u8>,
    floats: Vec<f32>,
    dots: Vec<u8>,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::default();
}

/// Message of the panic that stopped this instance.
static LAST_WORDS: Mutex<String> = Mutex::new(String::new());

fn with<T>(call: impl FnOnce(&mut Desk) -> T) -> T {
    DESK.with_borrow_mut(call)
}

fn with_tab<T>(call: impl FnOnce(&mut Tab) -> T) -> Option<T> {
    with(|desk| desk.tab.as_mut().map(call))
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
        let grown = Ask::from_json(&text).and_then(|ask| crate::grow(&ask, &desk.files));
        match grown {
            Ok(tab) => {
                desk.tab = Some(tab);
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
    with_tab(Tab::reset);
}

/// Advances a number of frames.
#[unsafe(no_mangle)]
pub extern "C" fn step(frames: u32) {
    with_tab(|tab| (0..frames).for_each(|_| tab.step()));
}

/// Advances a number of frames and returns the digest of each, 32 bytes a frame.
#[unsafe(no_mangle)]
pub extern "C" fn step_watched(frames: u32) {
    with(|desk| {
        let Some(tab) = &mut desk.tab else { return };
        desk.output = (0..frames).flat_map(|_| tab.step_watched()).collect();
    });
}

/// Returns the figures of the present state, as JSON of [`crate::TabTold`].
#[unsafe(no_mangle)]
pub extern "C" fn tell() {
    with(|desk| {
        let told = desk.tab.as_ref().and_then(|tab| serde_json::to_string(&tab.told()).ok());
        desk.say(told.unwrap_or_default());
    });
}

/// Returns the meshes, those of marks last: numbers of all vertices, and in the output the number of vertices of each mesh as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn meshes() {
    with(|desk| {
        let Some(meshes) = desk.tab.as_ref().map(Tab::meshes) else { return };
        let counts: Vec<usize> = meshes.iter().map(|mesh| 3 * mesh.triangles()).collect();
        desk.floats = meshes.into_iter().flat_map(|mesh| mesh.floats).collect();
        desk.say(serde_json::to_string(&counts).unwrap_or_default());
    });
}

/// Returns the instances, those of marks last: their numbers, and in the output the number of instances of each mesh as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn picture() {
    with(|desk| {
        let Some(picture) = desk.tab.as_mut().map(Tab::picture) else { return };
        desk.floats = picture.numbers;
        desk.say(serde_json::to_string(&picture.counts).unwrap_or_default());
    });
}

/// Grabs what a ray from a place \[m\], world, along a direction meets, or misses by little; by a key (not 0) it may miss by more. [`tell`] tells the
/// grabbed place.
#[unsafe(no_mangle)]
pub extern "C" fn grab(x: f64, y: f64, z: f64, along_x: f64, along_y: f64, along_z: f64, by_key: u32) {
    let (p_world, along) = (Vec3::new(x, y, z), Vec3::new(along_x, along_y, along_z));
    with_tab(|tab| tab.session_mut().grab(&p_world, &along, by_key != 0, Reach::Tree));
}

/// Moves the pointer to which the hand pulls \[m\], world.
#[unsafe(no_mangle)]
pub extern "C" fn pull_to(x: f64, y: f64, z: f64) {
    with_tab(|tab| tab.session_mut().pull_to(&Vec3::new(x, y, z)));
}

/// Lets go.
#[unsafe(no_mangle)]
pub extern "C" fn release() {
    with_tab(|tab| tab.session_mut().release());
}

/// Switches on the overlays whose names stand in the input, with commas between, and no others. Returns 1; or 0, with a sentence in the output.
#[unsafe(no_mangle)]
pub extern "C" fn show() -> u32 {
    with(|desk| {
        let names = String::from_utf8_lossy(&desk.input).into_owned();
        match desk.tab.as_mut().map(|tab| tab.show(&names)) {
            Some(Err(problem)) => {
                desk.say(problem);
                0
            }
            _ => 1,
        }
    })
}

/// Returns 1 if the wrist camera has a view that was not given before: JSON of [`crate::WristView`] in the output, its picture at [`dots`].
#[unsafe(no_mangle)]
pub extern "C" fn wrist() -> u32 {
    with(|desk| {
        let Some(mut view) = desk.tab.as_mut().and_then(Tab::wrist) else { return 0 };
        desk.dots = std::mem::take(&mut view.dots);
        desk.say(serde_json::to_string(&view).unwrap_or_default());
        1
    })
}

/// Address of the dots of the latest view of the wrist camera, four bytes each.
#[unsafe(no_mangle)]
pub extern "C" fn dots() -> *const u8 {
    with(|desk| desk.dots.as_ptr())
}

/// Number of their bytes.
#[unsafe(no_mangle)]
pub extern "C" fn dots_bytes() -> usize {
    with(|desk| desk.dots.len())
}

/// Returns the figures over time, oldest first: time \[s\], force on wood \[N\], force in the hand \[N\], fruit in the bucket, fruit on the ground.
#[unsafe(no_mangle)]
pub extern "C" fn samples() {
    with(|desk| {
        let Some(tab) = &desk.tab else { return };
        let numbers = tab.trace().samples().flat_map(|sample| {
            let [picked, dropped] = [sample.picked, sample.dropped].map(f64::from);
            [sample.time, sample.on_wood, sample.in_hand, picked, dropped]
        });
        desk.floats = numbers.map(|number| number as f32).collect();
    });
}

/// Takes the robot over from its driver. Returns 1 if the hand is closed, as its last command had it.
#[unsafe(no_mangle)]
pub extern "C" fn take_over() -> u32 {
    with_tab(|tab| {
        let session = tab.session_mut();
        let is_closed = session.hand_is_closed();
        session.take_over();
        u32::from(is_closed)
    })
    .unwrap_or_default()
}

/// Gives the robot back to its driver.
#[unsafe(no_mangle)]
pub extern "C" fn give_back() {
    with_tab(|tab| tab.session_mut().give_back());
}

/// Sets the controls of a person who drives, each -1 to 1: base forward, left, turn to the left; hand forward, left, up; hand about its x, y, z; and
/// not 0 for a closed hand.
#[expect(clippy::too_many_arguments, reason = "numbers are all that JavaScript passes")]
#[unsafe(no_mangle)]
pub extern "C" fn wish(
    forward: f64,
    left: f64,
    yaw: f64,
    hand_forward: f64,
    hand_left: f64,
    hand_up: f64,
    about_x: f64,
    about_y: f64,
    about_z: f64,
    closes: u32,
) {
    let wish = Wish {
        base: [forward, left, yaw],
        hand: [hand_forward, hand_left, hand_up],
        turn: [about_x, about_y, about_z],
        closes: closes != 0,
    };
    with_tab(|tab| tab.session_mut().wish(wish));
}

/// Takes the input as a part of a policy's files: 0 its network's file name, with which the files begin, 1 the network, 2 the spec.
#[unsafe(no_mangle)]
pub extern "C" fn policy(part: u32) {
    with(|desk| {
        let bytes = std::mem::take(&mut desk.input);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        match (part, &mut desk.files.policy) {
            (0, policy) => *policy = Some(PolicyFiles { name: text(&bytes), ..PolicyFiles::default() }),
            (1, Some(policy)) => policy.network = bytes,
            (_, Some(policy)) => policy.spec = text(&bytes),
            (_, None) => {}
        }
    });
}

/// Takes the input as a part of a tree's file: 0 its name, with which the file begins, 1 its content.
#[unsafe(no_mangle)]
pub extern "C" fn tree(part: u32) {
    with(|desk| {
        let bytes = std::mem::take(&mut desk.input);
        match (part, &mut desk.files.tree) {
            (0, tree) => {
                let name = String::from_utf8_lossy(&bytes).into_owned();
                *tree = Some(TreeBytes { name, ..TreeBytes::default() });
            }
            (_, Some(tree)) => tree.bytes = bytes,
            (_, None) => {}
        }
    });
}

/// Returns the assumptions made when the tree's file was read, as a JSON list of sentences.
#[unsafe(no_mangle)]
pub extern "C" fn notes() {
    with(|desk| {
        let notes = desk.tab.as_ref().map(Tab::notes).unwrap_or_default();
        desk.output = serde_json::to_vec(notes).unwrap_or_default();
    });
}
