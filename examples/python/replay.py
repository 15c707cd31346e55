"""Replay the log of a device: what its estimator would have learned, refused and carried, and where its monitor would have stopped it."""

import numpy as np

import armrs
from armrs import online
from armrs.demo import given_model, true_model

# A device at 1 kHz that leads the demo's arm; its second angle freezes after six seconds, as the encoder's last value is repeated.
truth = true_model()
movement = armrs.Movement(np.radians([[-60, 60], [-30, 20], [-70, 80]] * 4), speed=0.8, acceleration=4.0)
run = armrs.simulate(truth, movement, rate=1000.0)
random = np.random.default_rng(1)
q = run.q + 1e-4 * random.normal(size=run.q.shape)
q[6000:6800, 1] = q[6000, 1]
log = online.Log(run.t, q, run.force_on_arm + 0.1 * random.normal(size=run.force_on_arm.shape))

# The model that the device is given is 10 % too heavy; its brakes are known.
model = given_model(truth).replace(joints=truth.joints)
for gate in (8.0, 3.0):
    settings = online.default_settings(model, period=1e-3).replace(gate=gate)
    result = online.replay(log, model, settings=settings)
    print(f"gate {gate:g}: {result.counts}")
    for estimate, true in zip(result.estimates[:2], armrs.Arm.from_model(truth).first_moments, strict=True):
        print(f"  {estimate.name} = {estimate.value:.3f} ± {estimate.std:.3f} kg m by {estimate.decided_by}; true {true:.3f}")

channels = [online.Channel("angle", -1.5, 0.0), online.Channel("angle", 0.0, 2.5, frozen_after=0.5)]
print(online.watch(log.t, log.q, channels, period=0.002, moving=np.ones(len(log.t), dtype=bool)))
