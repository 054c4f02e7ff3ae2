//! Instructions in words, drawn from truth by a seeded grammar: `VERB NOUN PLACE`, such as "pick the largest apple at the upper left".
//!
//! All words speak of the fruit in reach as it hangs at the start, seen from the robot's start. PLACE is the third of their heights and the third of
//! their bearings in which the target hangs. NOUN is "the apple" if it hangs there alone; else "the largest apple" and the like, if that names
//! it by a margin; else "one of the N apples". So an instruction that says "the" names the target, and every instruction is true.

use orchard_geometry::{inverse_transform, math};
use orchard_spec::{Purpose, Stream};
use orchard_world::World;

use crate::rules::InstructionRules;

/// A fruit in reach, from the robot's start.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Apple {
    fruit: usize,
    /// Height \[m\], bearing to the left of straight ahead \[rad\], level distance \[m\], radius \[m\].
    height: f64,
    bearing: f64,
    distance: f64,
    radius: f64,
}

const VERBS: [&str; 3] = ["pick", "grasp", "take hold of"];

/// Places by the thirds of height (lowest first) and bearing (rightmost first).
const PLACES: [[&str; 3]; 3] = [
    ["at the lower right", "at the bottom", "at the lower left"],
    ["on the right", "in the middle", "on the left"],
    ["at the upper right", "at the top", "at the upper left"],
];

/// The instruction for a fruit of a world at its start.
pub(crate) fn instruction(world: &World, target: usize, rules: &InstructionRules, seed: u64) -> String {
    let (truth, reachable) = (world.fruit_truth(), world.reachable());
    let x_world_odom = world.x_world_odom();
    let apple = |fruit: usize| {
        let p_odom = inverse_transform(&x_world_odom, &truth[fruit].p_world);
        let (bearing, distance) = (math::atan2(p_odom.y, p_odom.x), p_odom.xy().norm());
        Apple { fruit, height: p_odom.z, bearing, distance, radius: truth[fruit].radius }
    };
    let apples: Vec<Apple> = (0..truth.len()).filter(|&i| reachable[i] || i == target).map(apple).collect();
    let mut stream = Stream::new(seed, world.index(), Purpose::Instruction);
    worded(&apples, target, rules, &mut stream)
}

fn worded(apples: &[Apple], target: usize, rules: &InstructionRules, stream: &mut Stream) -> String {
    let Some(named) = apples.iter().find(|apple| apple.fruit == target) else {
        unreachable!("the target is among the apples")
    };
    let place = |apple: &Apple| {
        let heights = apples.iter().map(|apple| apple.height);
        let bearings = apples.iter().map(|apple| apple.bearing);
        (third(apple.height, heights), third(apple.bearing, bearings))
    };
    let (height, bearing) = place(named);
    let others: Vec<&Apple> =
        apples.iter().filter(|apple| apple.fruit != target && place(apple) == (height, bearing)).collect();
    let noun = if others.is_empty() {
        "the apple".to_owned()
    } else {
        let (size, way) = (rules.size_margin.si(), rules.place_margin.si());
        let most = |key: fn(&Apple) -> f64, margin: f64| {
            others.iter().all(|other| key(named) >= key(other) + margin)
        };
        let words = [
            ("largest", most(|a| a.radius, size)),
            ("smallest", most(|a| -a.radius, size)),
            ("highest", most(|a| a.height, way)),
            ("lowest", most(|a| -a.height, way)),
            ("nearest", most(|a| -a.distance, way)),
            ("farthest", most(|a| a.distance, way)),
        ];
        let true_words: Vec<&str> =
            words.into_iter().filter(|(_, holds)| *holds).map(|(word, _)| word).collect();
        match drawn(&true_words, stream) {
            Some(word) => format!("the {word} apple"),
            None => format!("one of the {} apples", others.len() + 1),
        }
    };
    let verb = drawn(&VERBS, stream).unwrap_or(&VERBS[0]);
    format!("{verb} {noun} {}", PLACES[height][bearing])
}

/// The third of the values' range in which a value lies, from the lowest; the middle one of a range without extent.
fn third(value: f64, values: impl Iterator<Item = f64>) -> usize {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if high > low { ((3.0 * (value - low) / (high - low)) as usize).min(2) } else { 1 }
}

fn drawn<'a, T>(items: &'a [T], stream: &mut Stream) -> Option<&'a T> {
    let last = items.len().checked_sub(1)?;
    items.get(stream.integer(0, last as u32) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rules::LearningRules;

    /// The apples that an instruction may mean, read from its words alone.
    fn meant(words: &str, apples: &[Apple]) -> Vec<usize> {
        let range = |key: fn(&Apple) -> f64| {
            let mut all: Vec<f64> = apples.iter().map(key).collect();
            all.sort_by(f64::total_cmp);
            (all[0], all[all.len() - 1])
        };
        let (heights, bearings) = (range(|a| a.height), range(|a| a.bearing));
        // In parts of the range: 0 lowest or rightmost, 1 highest or leftmost.
        let part = |x: f64, (low, high): (f64, f64)| if high > low { (x - low) / (high - low) } else { 0.5 };
        const THIRD: f64 = 1.0 / 3.0;
        let words_hold = |apple: &Apple| {
            let (up, left) = (part(apple.height, heights), part(apple.bearing, bearings));
            let says = |word: &str| words.ends_with(word) || words.contains(&format!("{word} "));
            let up_holds = match () {
                () if says("upper") || says("top") => up >= 2.0 * THIRD,
                () if says("lower") || says("bottom") => up < THIRD,
                () => (THIRD..2.0 * THIRD).contains(&up),
            };
            let left_holds = match () {
                () if words.ends_with("left") => left >= 2.0 * THIRD,
                () if words.ends_with("right") => left < THIRD,
                () => (THIRD..2.0 * THIRD).contains(&left),
            };
            up_holds && left_holds
        };
        let there: Vec<&Apple> = apples.iter().filter(|apple| words_hold(apple)).collect();
        let best = |key: fn(&Apple) -> f64| {
            let most = there.iter().copied().max_by(|a, b| key(a).total_cmp(&key(b)));
            most.map(|apple| vec![apple.fruit]).unwrap_or_default()
        };
        match () {
            () if words.contains("largest") => best(|a| a.radius),
            () if words.contains("smallest") => best(|a| -a.radius),
            () if words.contains("highest") => best(|a| a.height),
            () if words.contains("lowest") => best(|a| -a.height),
            () if words.contains("nearest") => best(|a| -a.distance),
            () if words.contains("farthest") => best(|a| a.distance),
            () => there.iter().map(|apple| apple.fruit).collect(),
        }
    }

    #[test]
    fn instructions_are_true_and_those_with_the_name_one_apple() {
        let rules = LearningRules::v1().instruction;
        let (mut sentences, mut definite) = (std::collections::BTreeSet::new(), 0);
        for world in 0..200 {
            let mut draws = Stream::new(7, world, Purpose::Test);
            let apples: Vec<Apple> = (0..draws.integer(1, 30) as usize)
                .map(|fruit| Apple {
                    fruit,
                    height: draws.uniform(0.6, 1.9),
                    bearing: draws.uniform(-0.9, 0.9),
                    distance: draws.uniform(0.8, 1.8),
                    radius: draws.uniform(0.028, 0.042),
                })
                .collect();
            let target = draws.integer(0, apples.len() as u32 - 1) as usize;
            let mut stream = Stream::new(7, world, Purpose::Instruction);
            let words = worded(&apples, target, &rules, &mut stream);
            let found = meant(&words, &apples);
            assert!(found.contains(&target), "{words}: {target} is not among {found:?} of {apples:?}");
            if words.contains(" one of ") {
                assert!(
                    words.contains(&format!("one of the {} apples", found.len())),
                    "{words}: {found:?} of {apples:?}"
                );
            } else {
                assert_eq!(found, [target], "{words}");
                definite += 1;
            }
            let again = worded(&apples, target, &rules, &mut Stream::new(7, world, Purpose::Instruction));
            assert_eq!(words, again);
            sentences.insert(words);
        }
        assert!(sentences.len() > 60 && definite > 140, "{} sentences, {definite} name one", sentences.len());
    }
}
