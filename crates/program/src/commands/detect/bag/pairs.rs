//! Depth images of a bag and the colour images that belong to them.

use orchard_recording::bag::ImageHeader;

/// Nanoseconds of a second.
const PER_SECOND: i64 = 1_000_000_000;

/// Time of an image \[ns\]: its stamp, or the time in the log if it has none.
pub fn time_of(header: &ImageHeader, log_time: u64) -> i64 {
    match header.stamp {
        (0, 0) => i64::try_from(log_time).unwrap_or(i64::MAX),
        (seconds, rest) => i64::from(seconds) * PER_SECOND + i64::from(rest),
    }
}

/// A time in nanoseconds; one below 0 is 0.
pub fn nanoseconds(seconds: f64) -> u64 {
    // A float-to-integer cast saturates.
    (seconds * PER_SECOND as f64).round() as u64
}

/// Returns for each depth image the number of the colour image of nearest time, if that is within a limit; of two as near it is the earlier
/// one, of equal times the first one. All times are in nanoseconds.
pub fn partners(depths: &[i64], colours: &[i64], within: u64) -> Vec<Option<usize>> {
    let mut ordered: Vec<(i64, usize)> = colours.iter().copied().zip(0..).collect();
    ordered.sort_unstable();
    let first_at = |time: i64| ordered.partition_point(|(other, _)| *other < time);
    let partner = |time: i64| {
        let after = first_at(time);
        let before = after.checked_sub(1).map(|last| first_at(ordered[last].0));
        let near = |at: usize| ordered.get(at).map(|(other, number)| (other.abs_diff(time), *number));
        let candidates = before.into_iter().chain([after]).filter_map(near);
        candidates.min_by_key(|(distance, _)| *distance).filter(|(distance, _)| *distance <= within)
    };
    depths.iter().map(|time| partner(*time).map(|(_, number)| number)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_colour_image_within_the_limit_belongs_to_a_depth_image() {
        let colours = [100, 40, 100, 160, 10];
        let of = |depth: i64, within: u64| partners(&[depth], &colours, within)[0];
        assert_eq!(of(100, 0), Some(0), "of equal times the first one");
        assert_eq!(of(101, 0), None);
        assert_eq!((of(129, 30), of(131, 30)), (Some(0), Some(3)));
        assert_eq!(of(130, 30), Some(0), "the earlier one");
        assert_eq!((of(-20, 30), of(-21, 30)), (Some(4), None));
        assert_eq!((of(200, 40), of(i64::MAX, 40)), (Some(3), None));
        assert_eq!(partners(&[1, 2], &[], u64::MAX), [None, None]);
        assert_eq!(partners(&[i64::MIN], &[i64::MAX], u64::MAX), [Some(0)]);
    }

    #[test]
    fn an_image_without_a_stamp_has_the_time_of_the_log() {
        let header = |stamp| ImageHeader { stamp, frame_id: String::new() };
        assert_eq!(time_of(&header((12, 345)), 7), 12_000_000_345);
        assert_eq!(time_of(&header((-1, 0)), 7), -PER_SECOND);
        assert_eq!(time_of(&header((0, 0)), 7), 7);
        assert_eq!(nanoseconds(0.02), 20_000_000);
    }
}
