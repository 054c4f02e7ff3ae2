//! `orchard view`: a scenario live in a window, or pictures of it.

use std::path::PathBuf;

use crate::args::{IndexArgs, ScenarioArgs};

#[cfg(feature = "view")]
mod window;
#[cfg(not(feature = "view"))]
#[path = "view/without_window.rs"]
mod window;

pub use window::run;

/// Shows a scenario live in a window, or draws pictures of it.
#[derive(clap::Args)]
#[command(
    after_help = "In the window: drag a branch, a fruit or the robot to pull it; drag beside them to turn the view, with the right button or Shift to move\n\
                  it; the wheel zooms. Space pauses, `.` steps a frame, R starts again, N takes the next seed, T takes the robot over (W A S D Q E drive,\n\
                  I J K L U O move the hand, with Shift they turn it, C closes it), F follows, B begins a demonstration and\n\
                  keeps it (--demos), 1 to 9, 0, Z and X switch overlays, P writes a picture. The button\n\
                  Keys lists all of them.\n\n\
                  --screenshot and --video need a graphics driver but no screen: Vulkan, Metal or DirectX 12; on Debian the package\n\
                  mesa-vulkan-drivers draws without a graphics card.\n\n\
                  Examples:\n  orchard view --controller expert\n  orchard view --controller expert --live --headless   # then open ws://127.0.0.1:8765 in Foxglove\n  orchard view --demos demos/mine\n  orchard view --preset v-trellis --camera d435i --overlays leaves,depth,detections\n  \
                  orchard view --controller expert --frames 600 --overlays all --screenshot view.png\n  \
                  orchard view --recording results/bench-v1-quick-nominal/recordings/baseline-nominal-20250704-000.mcap\n  orchard view --controller expert --frames 1800 --video frames   # then, for example: ffmpeg -r 30 -i frames/frame-%06d.png view.mp4"
)]
pub struct Args {
    /// Seed of the population
    #[arg(long, default_value_t = 20250704, value_name = "S")]
    seed: u64,
    #[command(flatten)]
    index: IndexArgs,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Overlays that are on at first, with commas between: leaves, depth, colour, detections, plan, contacts, moments, reach, frames, plots, zones, stems; all;
    /// none
    /// [default: leaves,depth,plan,plots]
    #[arg(long, value_name = "NAMES")]
    overlays: Option<String>,
    /// Width and height of the window or the pictures [px]
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = size)]
    size: [u32; 2],
    /// Recording (.mcap) of an episode to show instead of a live world, from the folder `recordings` of a result
    #[arg(long, value_name = "FILE.mcap", conflicts_with_all = ["seed", "index"])]
    recording: Option<PathBuf>,
    #[command(flatten)]
    demos: DemosArgs,
    /// Serve the channels of a recording live over Foxglove's websocket protocol, at ws://HOST:PORT [default address: 127.0.0.1:8765]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:8765", value_parser = address)]
    live: Option<Address>,
    /// With --live: open no window, and run in real time until Ctrl-C
    #[arg(long, requires = "live", conflicts_with_all = ["screenshot", "video", "demos"])]
    headless: bool,
    /// Draw one picture after --frames frames into a PNG file instead of opening a window
    #[arg(long, value_name = "FILE.png", conflicts_with = "video")]
    screenshot: Option<PathBuf>,
    /// Draw a picture every second frame of the world, 30 a second, into a folder instead of opening a window
    #[arg(long, value_name = "DIR")]
    video: Option<PathBuf>,
    /// Trees in rows: the scenario's, and the next ones of its seed, which stand still
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=400), conflicts_with_all = ["recording", "headless"])]
    trees: u32,
    /// Draw the pictures of --video without a window and without writing them, and tell their rate and costs
    #[arg(long, conflicts_with_all = ["screenshot", "video", "headless", "demos"])]
    measure: bool,
    /// Frames of the world for --screenshot, --video and --measure, 60 a second
    #[arg(long, default_value_t = 60, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=36_000))]
    frames: u32,
}

/// Options of demonstrations that a person drives: their folder, their observations and actions.
#[derive(clap::Args)]
pub struct DemosArgs {
    /// Folder for demonstrations of a task that you drive, in the form of `orchard demos`: new, or with demonstrations of the same task and scenario. B
    /// begins one and keeps it; each seed has one, and official seeds are refused
    #[arg(long, value_name = "DIR", conflicts_with_all = ["recording", "index"])]
    demos: Option<PathBuf>,
    /// Task of --demos: harvest, reach, gentle [default: harvest]
    #[arg(long, value_name = "NAME", requires = "demos")]
    task: Option<String>,
    /// Groups of observations of --demos: state, depth, pixels [default: state,depth]
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', requires = "demos")]
    obs: Option<Vec<String>>,
    /// Rows and columns of the pictures of --demos [default: 128]
    #[arg(long, value_name = "N", requires = "demos")]
    pixels_size: Option<u32>,
    /// Meaning of the arm's actions of --demos: joint_delta, joint_absolute, ee_delta [default: joint_delta]
    #[arg(long, value_name = "NAME", requires = "demos")]
    control: Option<String>,
    /// Actions a second of --demos, a divisor of 60 [default: 10]
    #[arg(long, value_name = "HZ", requires = "demos")]
    control_hz: Option<u32>,
}

/// Smallest and largest side of a window or a picture \[px\].
const SIDES: [u32; 2] = [200, 8192];

/// Address at which channels are served.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Address {
    host: String,
    port: u16,
}

fn address(text: &str) -> Result<Address, String> {
    let parts = text.rsplit_once(':').filter(|(host, _)| !host.is_empty());
    let address =
        parts.and_then(|(host, port)| Some(Address { host: host.to_owned(), port: port.parse().ok()? }));
    address.ok_or_else(|| "must be HOST:PORT, as in 127.0.0.1:8765, the port in [0, 65535]".to_owned())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let [least, most] = SIDES;
    let side = |part: &str| part.parse().ok().filter(|side| (least..=most).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| format!("must be WIDTHxHEIGHT, as in 1280x720, each side in [{least}, {most}]"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_wrong_ones_told_the_range() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        for bad in ["", "1280", "1280x", "x720", "1280X720", "10x720", "1280x99999", "1280x-720"] {
            assert!(size(bad).is_err_and(|line| line.contains("[200, 8192]")), "{bad}");
        }
    }

    #[test]
    fn addresses_are_read_and_wrong_ones_told() {
        assert_eq!(address("0.0.0.0:0"), Ok(Address { host: "0.0.0.0".to_owned(), port: 0 }));
        for bad in ["", "8765", ":8765", "localhost", "localhost:", "localhost:99999", "localhost:-1"] {
            assert!(address(bad).is_err_and(|line| line.contains("HOST:PORT")), "{bad}");
        }
    }
}
