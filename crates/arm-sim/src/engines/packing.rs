//! Values of several runs in the lanes of one.

use arm_core::effect::Effect;
use arm_core::{Contact, Displaced, Joints, Lanes, Plane, Segment, Setup, Wave};

use crate::closed_chain::model::Link;
use crate::closed_chain::state::{BaseMotion, Input};
use crate::preparation::prepared_run::Prepared;
use crate::{Assistance, Handle, Springs};

pub(super) fn pack<const L: usize>(value: impl Fn(usize) -> f64) -> Lanes<L> {
    Lanes(core::array::from_fn(value))
}

fn pack_plane<const L: usize>(value: impl Fn(usize) -> Plane<f64>) -> Plane<Lanes<L>> {
    [0, 1].map(|axis| pack(|i| value(i)[axis]))
}

pub(super) fn pack_link<'a, const L: usize, const N: usize>(
    lane: impl Fn(usize) -> &'a Prepared<'a, N>,
    contact: Contact<Lanes<L>>,
) -> Link<Lanes<L>> {
    match lane(0).model.link {
        Link::Compliant(_) => Link::Compliant(contact),
        Link::Free => Link::Free,
        Link::Forced(_) => Link::Forced(pack_plane(|i| match lane(i).model.link {
            Link::Forced(force) => force,
            _ => [0.0; 2],
        })),
        Link::Rigid => Link::Rigid,
    }
}

pub(super) fn pack_effect<'a, const L: usize>(
    effect: impl Fn(usize) -> &'a Effect<f64>,
) -> Effect<Lanes<L>> {
    let first = effect(0);
    Effect {
        kind: first.kind,
        index: first.index,
        parameters: core::array::from_fn(|p| pack(|i| effect(i).parameters[p])),
        on: first.on,
    }
}

pub(super) fn pack_input<const L: usize, const N: usize>(
    input: impl Fn(usize) -> Input<f64, N>,
) -> Input<Lanes<L>, N> {
    let inputs: [Input<f64, N>; L] = core::array::from_fn(input);
    Input {
        time: pack(|i| inputs[i].time),
        handle: Handle {
            position: pack_plane(|i| inputs[i].handle.position),
            velocity: pack_plane(|i| inputs[i].handle.velocity),
            acceleration: pack_plane(|i| inputs[i].handle.acceleration),
        },
        torque: Joints::from_fn(|j, _| pack(|i| inputs[i].torque[j])),
        base: BaseMotion {
            position: pack_plane(|i| inputs[i].base.position),
            velocity: pack_plane(|i| inputs[i].base.velocity),
            acceleration: pack_plane(|i| inputs[i].base.acceleration),
        },
        activity: core::array::from_fn(|j| pack(|i| inputs[i].activity[j])),
    }
}

/// Stiffness and damping of the lanes' assistance, which they all have or none has.
pub(super) fn pack_assistance<'a, const L: usize, const N: usize>(
    assistance: impl Fn(usize) -> Option<&'a Assistance<N>>,
) -> Option<[[Lanes<L>; N]; 2]> {
    assistance(0)?;
    let of = |read: fn(&Springs<N>) -> &[f64; N]| {
        core::array::from_fn(|j| pack(|i| assistance(i).map_or(0.0, |a| read(&a.springs)[j])))
    };
    Some([of(|a| &a.stiffness), of(|a| &a.damping)])
}

fn pack_wave<'a, const L: usize>(wave: impl Fn(usize) -> &'a Wave<f64>) -> Wave<Lanes<L>> {
    Wave {
        amplitude: pack_plane(|i| wave(i).amplitude),
        frequency: pack(|i| wave(i).frequency),
        phase: pack(|i| wave(i).phase),
    }
}

pub(super) fn pack_setup<'a, const L: usize, const N: usize>(
    lane: impl Fn(usize) -> &'a Prepared<'a, N>,
) -> Setup<Lanes<L>, N> {
    let setup = |i: usize| &lane(i).setup;
    Setup {
        segments: core::array::from_fn(|s| Segment {
            length: pack(|i| setup(i).segments[s].length),
            mass: pack(|i| setup(i).segments[s].mass),
            com: pack_plane(|i| setup(i).segments[s].com),
            inertia: pack(|i| setup(i).segments[s].inertia),
        }),
        rotor: core::array::from_fn(|s| pack(|i| setup(i).rotor[s])),
        base: pack_plane(|i| setup(i).base),
        gravity: pack_plane(|i| setup(i).gravity),
        contact: Contact {
            stiffness: pack_plane(|i| setup(i).contact.stiffness),
            damping: pack_plane(|i| setup(i).contact.damping),
            play: pack_plane(|i| setup(i).contact.play),
        },
        placement: pack_plane(|i| setup(i).placement),
        base_motion: pack_plane(|i| setup(i).base_motion),
        base_rest: pack(|i| setup(i).base_rest),
        heave: pack_wave(|i| &setup(i).heave),
        displaced: Displaced {
            ripple: pack_wave(|i| &setup(i).displaced.ripple),
            slip: pack_plane(|i| setup(i).displaced.slip),
            slip_start: pack(|i| setup(i).displaced.slip_start),
        },
        force_delay: pack(|i| setup(i).force_delay),
    }
}
