//! Properties of stepping that need a real scene: snapshots, and steps without allocation.

use crate::cases::grasp::{closing, held_still};
use crate::cases::reflex::grasping;
use allocation_counter::measure;
use palmares_sim::{Command, World};

#[test]
fn a_restored_snapshot_goes_on_bit_for_bit() {
    goes_on(closing(0.4));
    // Moment arms that depend on the configuration.
    goes_on(grasping(2.0));
}

fn goes_on((mut world, command): (World, Command)) {
    let snapshot = world.state().clone();
    for _ in 0..300 {
        world.step(&command);
    }
    let (end, forces) = (world.state().hash(), world.contact_forces().to_vec());
    assert!(!forces.is_empty(), "the hand has touched the object by then");
    world.restore(snapshot.clone());
    assert_eq!(world.state().hash(), snapshot.hash());
    for _ in 0..300 {
        world.step(&command);
    }
    assert_eq!(world.state().hash(), end);
    assert_eq!(world.contact_forces(), forces);
}

#[test]
fn a_state_that_differs_in_one_bit_hashes_differently() {
    let (world, _) = closing(0.3);
    let mut state = world.state().clone();
    let hash = state.hash();
    state.q[3] = f64::from_bits(state.q[3].to_bits() ^ 1);
    assert_ne!(state.hash(), hash);
}

#[test]
fn a_steady_step_allocates_nothing() {
    assert!(measure(|| drop(std::hint::black_box(vec![0u8; 64]))).count_total > 0, "the counter counts");
    for (mut world, command) in [held_still(), grasping(4.0)] {
        let counted = measure(|| {
            for _ in 0..100 {
                world.step(&command);
            }
        });
        assert_eq!(counted.count_total, 0, "{counted:?}");
    }
}
