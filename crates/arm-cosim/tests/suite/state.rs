//! States that no arm can have had, and values that no number can hold.

use arm_cosim::{ArmSpec, EffectSpec, Slave, SlaveState, Status};

fn ready() -> Slave {
    let mut arm = Slave::new(ArmSpec::sample()).unwrap();
    arm.enter_initialization_mode(0.0, None).unwrap();
    arm.exit_initialization_mode().unwrap();
    arm.do_step(0.0, 0.01).unwrap();
    arm
}

fn angles(arm: &mut Slave) -> [u64; 2] {
    let at = ["q[1]", "q[2]"].map(|name| arm.reference(name).unwrap());
    let mut q = [0.0; 2];
    arm.get(&at, &mut q).unwrap();
    q.map(f64::to_bits)
}

/// The bytes of a state with one of its words replaced, and the checksum that fits.
fn forged(state: &SlaveState, word_from_end: usize, value: f64) -> Vec<u8> {
    let mut bytes = state.to_bytes();
    bytes.truncate(bytes.len() - 8);
    let at = bytes.len() - 8 * word_from_end;
    bytes[at..at + 8].copy_from_slice(&value.to_bits().to_le_bytes());
    let check = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    bytes.extend(check.to_le_bytes());
    bytes
}

#[test]
fn a_state_with_values_that_no_arm_has_leaves_the_slave_as_it_was() {
    let (mut arm, mut other) = (ready(), ready());
    let before = angles(&mut arm);
    for value in [f64::NAN, f64::INFINITY] {
        let state = SlaveState::from_bytes(&forged(&arm.state(), 1, value)).unwrap();
        let refused = arm.set_state(&state).unwrap_err();
        assert!(refused.message.contains("does not fit"), "{refused}");
        assert_eq!(angles(&mut arm), before);
    }
    arm.do_step(0.01, 0.01).unwrap();
    other.do_step(0.01, 0.01).unwrap();
    assert_eq!(angles(&mut arm), angles(&mut other));
}

#[test]
fn an_output_beyond_all_numbers_is_not_given() {
    let mut spec = ArmSpec::sample();
    spec.port = arm_sim::Port::Motion;
    let mut arm = Slave::new(spec).unwrap();
    arm.enter_initialization_mode(0.0, None).unwrap();
    arm.exit_initialization_mode().unwrap();
    let (handle, force) = ("robot.r[1]", "contact.F[1]");
    let [handle, force] = [handle, force].map(|name| arm.reference(name).unwrap());
    arm.set(&[handle], &[1e308]).unwrap();
    let refused = arm.get(&[force], &mut [0.0]).unwrap_err();
    assert_eq!(refused.status, Status::Discard);
    assert!(refused.message.contains("contact.F[1] is"), "{refused}");
    // It can be taken back.
    arm.set(&[handle], &[0.5]).unwrap();
    arm.get(&[force], &mut [0.0]).unwrap();
    arm.do_step(0.0, 0.01).unwrap();
}

/// The sample with a reflex of the elbow.
fn reflexive(latency: f64) -> ArmSpec {
    let mut spec = ArmSpec::sample();
    spec.effects.push(EffectSpec {
        kind: "stretch_reflex".to_owned(),
        index: 1,
        values: vec![0.5, 0.1, 0.0, latency, 0.0, 0.0],
    });
    spec
}

#[test]
fn a_saved_state_holds_what_a_late_reflex_felt() {
    let mut arm = Slave::new(reflexive(0.04)).unwrap();
    arm.enter_initialization_mode(0.0, None).unwrap();
    arm.exit_initialization_mode().unwrap();
    arm.do_step(0.0, 0.1).unwrap();
    let saved = arm.state().to_bytes();
    arm.do_step(0.1, 0.1).unwrap();
    let there = angles(&mut arm);
    let state = SlaveState::from_bytes(&saved).unwrap();
    arm.set_state(&state).unwrap();
    arm.do_step(0.1, 0.1).unwrap();
    assert_eq!(angles(&mut arm), there);
    // Its three states are among the numbers: without them the arm goes elsewhere.
    let words = [6, 5, 4].map(|word| {
        let at = saved.len() - 8 - 8 * word;
        f64::from_le_bytes(saved[at..at + 8].try_into().unwrap())
    });
    assert!(words.iter().all(|state| state.abs() > 1e-3), "{words:?}");
}

#[test]
fn a_reflex_is_offered_for_model_exchange_while_it_acts_at_once() {
    let refused = Slave::for_exchange(reflexive(0.04)).err().unwrap();
    assert!(
        refused.message.contains("stretch_reflex carries a state"),
        "{refused}"
    );
    let mut arm = Slave::for_exchange(reflexive(0.0)).unwrap();
    let latency = arm.reference("effect[3].latency").unwrap();
    arm.enter_initialization_mode(0.0, None).unwrap();
    arm.set(&[latency], &[0.04]).unwrap();
    let refused = arm.exit_initialization_mode().unwrap_err();
    assert!(
        refused.message.contains("stretch_reflex carries a state"),
        "{refused}"
    );
}
