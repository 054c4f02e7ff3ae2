use super::*;
use orchard_scenario::Scenario;

fn session(controller: Option<&'static str>) -> Session {
    let scenario = Scenario::of(&[("controller", controller.unwrap_or("baseline"))]).unwrap();
    let world = scenario.world(20250704, 0, 0).unwrap();
    Session::new(world, controller.map(|_| -> Make { Box::new(move || scenario.controller()) }))
}

#[test]
fn a_reset_session_repeats_every_frame_and_watching_changes_nothing() {
    let mut session = session(Some("baseline"));
    let first: Vec<FrameDigest> = (0..30).map(|_| session.step_watched()).collect();
    session.reset();
    assert_eq!(session.told().frame, 0);
    (0..29).for_each(|_| session.step());
    assert_eq!(session.step_watched(), first[29]);
    assert!(first.windows(2).all(|pair| pair[0] != pair[1]));
}

#[test]
fn with_nobody_the_robot_stands() {
    let mut session = session(None);
    let base = |session: &Session| session.world().handle().x_world_base(session.world().data());
    let start = base(&session);
    (0..60).for_each(|_| session.step());
    assert!((base(&session).translation.vector - start.translation.vector).norm() < 1e-3);
    assert_eq!(session.told().state, None);
}

/// A person takes the robot over in the middle and gives it back: the controller goes on from where the robot is.
#[test]
fn a_person_takes_over_and_gives_back() {
    let mut session = session(Some("expert"));
    (0..90).for_each(|_| session.step());
    assert!(session.told().state.is_some());
    session.wish(Wish { base: [1.0, 0.0, 0.0], ..Wish::default() });
    assert!(!session.is_taken_over() && session.jog().is_none());
    session.take_over();
    assert!(session.is_taken_over() && session.controller().is_none() && session.told().state.is_none());
    let tcp =
        |session: &Session| session.world().handle().x_world_tcp(session.world().data()).translation.vector;
    let before = tcp(&session);
    session.wish(Wish { hand: [0.0, 0.0, 1.0], ..Wish::default() });
    (0..60).for_each(|_| session.step());
    assert!(tcp(&session).z > before.z + 0.08, "{} {}", tcp(&session), before);
    session.give_back();
    assert!(!session.is_taken_over());
    (0..60).for_each(|_| session.step());
    assert!(session.told().state.is_some() && session.told().fault.is_none());
}
