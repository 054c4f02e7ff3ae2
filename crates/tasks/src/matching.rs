//! One-to-one matching of detections to fruit.
//!
//! A detection and a fruit may pair when the detection's centre lies within that fruit's radius of its centre.
//! Pairs are taken nearest first; ties go to the lower detection index, then to the lower fruit index. Apples
//! do not interpenetrate, so a detection can reach only one fruit and this greedy rule finds as many pairs as
//! any other.

use orchard_geometry::Vec3;

/// A fruit to be found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre \[m, world\].
    pub p_world: Vec3,
    /// Radius \[m\].
    pub radius: f64,
}

/// The fruit index that each detection \[m, world\] is matched to, or `None`.
pub fn match_detections(detections: &[Vec3], fruit: &[Ball]) -> Vec<Option<usize>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (d, p_world) in detections.iter().enumerate() {
        for (f, ball) in fruit.iter().enumerate() {
            let distance = (p_world - ball.p_world).norm();
            if distance <= ball.radius {
                pairs.push((distance, d, f));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut matched = vec![None; detections.len()];
    let mut taken = vec![false; fruit.len()];
    for (_, d, f) in pairs {
        if matched[d].is_none() && !taken[f] {
            matched[d] = Some(f);
            taken[f] = true;
        }
    }
    matched
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(x: f64) -> Ball {
        Ball { p_world: Vec3::new(x, 0.0, 0.0), radius: 0.03 }
    }

    fn at(x: f64) -> Vec3 {
        Vec3::new(x, 0.0, 0.0)
    }

    #[test]
    fn one_to_one_and_nearest_first() {
        let fruit = [ball(0.0), ball(1.0)];
        // The second detection is nearer to fruit 0; the first is then a false positive.
        assert_eq!(match_detections(&[at(0.02), at(-0.01), at(1.0)], &fruit), [None, Some(0), Some(1)]);
    }

    #[test]
    fn within_one_radius_only() {
        assert_eq!(match_detections(&[at(0.0301)], &[ball(0.0)]), [None]);
        assert_eq!(match_detections(&[at(0.0299)], &[ball(0.0)]), [Some(0)]);
    }

    #[test]
    fn ties_go_to_the_lower_index() {
        assert_eq!(match_detections(&[at(0.01), at(-0.01)], &[ball(0.0)]), [Some(0), None]);
    }

    #[test]
    fn nothing_matches_nothing() {
        assert!(match_detections(&[], &[ball(0.0)]).is_empty());
        assert_eq!(match_detections(&[at(0.0)], &[]), [None]);
        assert_eq!(match_detections(&[Vec3::repeat(f64::NAN)], &[ball(0.0)]), [None]);
    }
}
