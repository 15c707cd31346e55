# The compiled core. Docstrings stand in the binary; this file is checked against it by `make test`.
from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Arm",
    "Rig",
    "__version__",
    "build_profile",
    "control",
    "design",
    "effects",
    "forecast",
    "identify",
    "literature",
    "low_pass_both_ways",
    "simulate",
    "smooth",
]

__version__: str
build_profile: str

@final
class Arm:
    def __new__(
        cls,
        lengths: ArrayLike,
        masses: ArrayLike,
        coms: ArrayLike,
        inertias: ArrayLike,
        *,
        com_normals: ArrayLike | None = None,
        gravity: float = 9.81,
        base: tuple[float, float] = ...,
        rotor_inertia: ArrayLike | None = None,
    ) -> Arm: ...
    @property
    def n_joints(self) -> int: ...
    @property
    def first_moments(self) -> list[float]: ...
    @property
    def second_moments(self) -> list[float]: ...
    def forward_kinematics(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def jacobian(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def inertia(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def coriolis(self, q: ArrayLike, qd: ArrayLike) -> NDArray[np.float64]: ...
    def gravity(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def static_torque(self, q: ArrayLike, force_on_arm: ArrayLike) -> NDArray[np.float64]: ...
    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> NDArray[np.float64]: ...
    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> NDArray[np.float64]: ...
    def regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> NDArray[np.float64]: ...

@final
class Rig:
    def __new__(cls, arm: Arm, effects: Sequence[Any], contact: Any, robot: Any = None) -> Rig: ...

def control(
    rig: Rig,
    drive: Mapping[str, Any],
    settings: Mapping[str, Any],
    watch: Mapping[str, Any],
) -> dict[str, Any]: ...
def design(rig: Rig, settings: Mapping[str, Any], sensing: Mapping[str, Any], bounds: Mapping[str, Any]) -> dict[str, Any]: ...
def effects() -> list[dict[str, Any]]: ...
def forecast(rig: Rig, settings: Mapping[str, Any], sensing: Mapping[str, Any], tasks: Sequence[Mapping[str, Any]]) -> dict[str, Any]: ...
def identify(rig: Rig, trials: Sequence[Mapping[str, Any]], settings: Mapping[str, Any]) -> dict[str, Any]: ...
def literature(body_mass: float, height: float, sex: str, lengths: Sequence[float | None]) -> list[dict[str, Any]]: ...
def simulate(
    rig: Rig,
    drive: Mapping[str, Any],
    settings: Mapping[str, Any],
    sensing: Mapping[str, Any] | None = None,
) -> dict[str, Any]: ...
def smooth(
    values: NDArray[np.float64], rate: float, cutoff: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def low_pass_both_ways(values: NDArray[np.float64], rate: float, cutoff: float, order: int) -> NDArray[np.float64]: ...
