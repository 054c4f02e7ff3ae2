use super::*;
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use proptest::prelude::*;
use std::sync::LazyLock;

/// A world with a broken joint, events not yet taken, contacts and an image.
static WORLD: LazyLock<World> = LazyLock::new(|| {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let hold = robot.start_command();
    let mut world = World::new(spec, robot, 3, 0).unwrap();
    world.break_branch(5);
    world.step(&hold);
    world.observe();
    world
});

fn body() -> Vec<u8> {
    envelope::open(&WORLD.snapshot().to_bytes()).unwrap().to_vec()
}

fn content() -> Content {
    WORLD.snapshot().content
}

fn refusal(content: Content) -> Option<SnapshotError> {
    let mut world = WORLD.clone();
    let snapshot = Snapshot::from_bytes(&Snapshot { content, image: None }.to_bytes()).unwrap();
    world.restore(&snapshot).err()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// Content with a valid checksum that no world wrote is restored or refused; it never
    /// panics.
    #[test]
    fn content_that_no_world_wrote_does_not_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        cuts in any::<bool>(),
    ) {
        let mut body = body();
        for (at, byte) in changes {
            let at = at.index(body.len());
            body[at] = byte;
        }
        if cuts {
            body.truncate(cut.index(body.len()));
        }
        if let Ok(snapshot) = Snapshot::from_bytes(&envelope::seal(&body)) {
            let mut world = WORLD.clone();
            if world.restore(&snapshot).is_ok() {
                world.observe();
            }
        }
    }
}

#[test]
fn content_that_does_not_fit_is_named() {
    assert_eq!(refusal(content()), None);
    let mut wrong = content();
    wrong.gripped.pop();
    assert_eq!(refusal(wrong), Some(SnapshotError::Content("fruit")));

    let mut wrong = content();
    wrong.events.push(WorldEvent::FruitGripped { fruit: 1000, frame: 1 });
    assert_eq!(refusal(wrong), Some(SnapshotError::Content("events")));

    let mut wrong = content();
    wrong.shot = Some(Shot::default());
    assert_eq!(refusal(wrong), Some(SnapshotError::Content("image")));

    let mut wrong = content();
    wrong.flight = Flight::of(Shot::default());
    assert_eq!(refusal(wrong), Some(SnapshotError::Content("image")));

    let mut wrong = content();
    wrong.commands.push_back(RobotModel::paper().start_command());
    assert_eq!(refusal(wrong), Some(SnapshotError::Content("commands")));

    let other = orchard_multibody::ModelBuilder::new().build().unwrap();
    let mut wrong = content();
    wrong.data = Data::new(&other).state();
    let error = refusal(wrong).unwrap().to_string();
    assert!(error.starts_with("the snapshot does not fit its world: q has 0 entries"), "{error}");

    let mut longer = body();
    longer.push(0);
    let error = Snapshot::from_bytes(&envelope::seal(&longer)).unwrap_err();
    assert_eq!(error, SnapshotError::Content("length"));
    assert!(matches!(Snapshot::from_bytes(&envelope::seal(b"")), Err(SnapshotError::Unreadable(_))));
}

/// Bytes that a snapshot takes whose every number, length and variant is 1: a field more or less, there or in an entry
/// of a list, changes it. Then raise [`envelope::FORMAT_VERSION`] and write the new size here.
#[test]
fn the_layout_is_that_of_the_format_version() {
    const SIZE: usize = 1216;
    let ones = [1; 4096];
    let (_, rest) = postcard::take_from_bytes::<Content>(&ones).unwrap();
    assert_eq!((envelope::FORMAT_VERSION, ones.len() - rest.len()), (8, SIZE));
}
