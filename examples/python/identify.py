"""Simulate a session, write it as a data set, read it back, identify it."""

import tempfile
from pathlib import Path

import numpy as np

import armrs
from armrs.demo import given_model, true_model

truth = true_model()
movement = armrs.Movement(np.radians([[-60, 60], [-48, 60], [-60, 60], [-60, 72], [-60, 60]]), speed=0.1, shape="smooth")
run = armrs.simulate(truth, movement, sensors=armrs.Sensors.realistic(), seeds=range(4))
trials = tuple(
    armrs.Trial(
        file=f"trials/swing_{k}.csv",
        configuration="swing",
        repeat=k,
        role="fit" if k < 4 else "test",
        t=read.time,
        q=read.q,
        force_on_arm=read.force_on_arm,
        moment_on_arm=None,
        robot_q=read.robot_q,
    )
    for k, read in enumerate(run.readings, start=1)
)
# The given model is 10 % too heavy and has no brakes.
session = armrs.Dataset("an example", given_model(truth), trials, force_on="robot", synthetic=True)

with tempfile.TemporaryDirectory() as folder:
    armrs.write_dataset(session, folder)
    result = armrs.identify(armrs.load_dataset(folder), with_effects=["coulomb"])
    result.model.write(Path(folder) / "identified.toml")

for estimate in (*result.combinations, *result.parameters):
    if estimate.decided_by == "data":
        print(f"joint {estimate.joint}: {estimate}")
print("not separable:", *result.trades, sep="\n  ")
