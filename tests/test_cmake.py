"""The C library as a package: installed by CMake, found by CMake and by pkg-config, from C99 and C++17."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import online
from armrs.demo import true_model

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
LEVEL = 0.186 * 2.114 + (0.322 + 0.121) * 1.264
"""First moment of both segments about the shoulder, stretched out level [kg m]."""
C = """\
#include <stdio.h>
#include "armrs.h"

int main(void) {
  static armrs_arm arm;
  const armrs_segment segments[ARMRS_JOINTS] = {{0.322, 2.114, {0.186, 0}, 0.0157}, {0.264, 1.264, {0.121, 0}, 0.0061}};
  const armrs_real base[2] = {0, 0}, gravity[2] = {0, -9.81}, q[ARMRS_JOINTS] = {0, 0};
  armrs_real torque[ARMRS_JOINTS];
  if (armrs_arm_init(&arm, segments, base, gravity, 0, 0, 0) != ARMRS_OK) return 1;
  if (armrs_gravity(&arm, q, torque) != ARMRS_OK) return 2;
  printf("%.12g\\n", torque[0]);
  return 0;
}
"""
CPP = """\
#include <cstdio>
#include "armrs.hpp"

int main() {
  armrs::arm arm;
  const std::array<armrs_segment, ARMRS_JOINTS> segments{{{0.322, 2.114, {0.186, 0}, 0.0157}, {0.264, 1.264, {0.121, 0}, 0.0061}}};
  if (arm.gravity({}).status != ARMRS_NOT_INITIALISED) return 1;
  if (arm.init(segments, {0, 0}, {0, -9.81}) != ARMRS_OK) return 2;
  const auto torque = arm.gravity({0, 0});
  if (!torque) return 3;
  armrs::estimator estimator;
  const auto settings = armrs::settings(arm, 1e-3);
  if (!settings || estimator.init(arm, 0.1, settings.value) != ARMRS_OK) return 4;
  if (estimator.update(nullptr).value != ARMRS_MISSING || !estimator.health()) return 5;
  if (!estimator.carry(armrs_motion{}) || arm.tip({0, 0}).value[0] != armrs::real(0.322 + 0.264)) return 6;
  std::printf("%.12g\\n", torque.value[0]);
}
"""
SUPPORT = """\
#include <cstdio>
#include <limits>
#include "support.hpp"

int main() {
  armrs_support::Support support;
  if (support.torque({}).status != ARMRS_NOT_INITIALISED) return 1;
  if (support.init(0.5, 3.0) != ARMRS_OK) return 2;
  const auto nowhere = support.torque({std::numeric_limits<double>::quiet_NaN(), 0});
  if (nowhere.status != ARMRS_NOT_FINITE || nowhere.value[0] != 0 || nowhere.value[1] != 0) return 3;
  const auto torque = support.torque({-1.4, 0.5});
  std::printf("%.12g %.12g\\n", torque.value[0], torque.value[1]);
  return support.torque({0, 0}).value[0] == 3.0 ? 0 : 4;
}
"""
MAJOR, MINOR, _ = armrs.__version__.split(".")
PROJECT = f"""\
cmake_minimum_required(VERSION 3.20)
project(user C CXX)
find_package(armrs {MAJOR}.{MINOR} REQUIRED)
add_executable(in_c main.c)
set_target_properties(in_c PROPERTIES C_STANDARD 99 C_EXTENSIONS OFF)
add_executable(in_cpp main.cpp)
set_target_properties(in_cpp PROPERTIES CXX_STANDARD 17 CXX_EXTENSIONS OFF)
foreach(program in_c in_cpp)
  target_compile_options(${{program}} PRIVATE -Wall -Wextra -Werror -pedantic)
  target_link_libraries(${{program}} PRIVATE armrs::armrs)
endforeach()
"""


def cmake() -> str:
    """Return CMake, which may have come with a Python package."""
    found = shutil.which("cmake", path=os.pathsep.join([os.environ.get("PATH", ""), str(Path(sys.executable).parent)]))
    if found is None or shutil.which("cargo") is None or shutil.which("c++") is None:
        pytest.skip("no cmake, cargo or C++ compiler")
    return found


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library of two joints in double precision, in a folder of its own. What cargo makes is kept between runs."""
    build = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "capi-cmake"
    prefix = tmp_path_factory.mktemp("installed")
    run(cmake(), "-S", ROOT / "crates" / "arm-capi", "-B", build, "-DARMRS_TWO_JOINTS=ON")
    run(cmake(), "--build", build)
    run(cmake(), "--install", build, "--prefix", prefix)
    return prefix


def test_a_project_finds_the_library_with_cmake(installed: Path, tmp_path: Path) -> None:
    for name, content in (("main.c", C), ("main.cpp", CPP), ("CMakeLists.txt", PROJECT)):
        (tmp_path / name).write_text(content, encoding="utf-8")
    run(cmake(), "-S", ".", "-B", "build", f"-DCMAKE_PREFIX_PATH={installed}", cwd=tmp_path)
    run(cmake(), "--build", "build", cwd=tmp_path)
    for program in ("in_c", "in_cpp"):
        assert float(run(tmp_path / "build" / program)) == pytest.approx(9.81 * LEVEL, rel=1e-11)


def test_a_project_that_asks_for_another_version_does_not_find_it(installed: Path, tmp_path: Path) -> None:
    later = f"{MAJOR}.{int(MINOR) + 1}"
    (tmp_path / "CMakeLists.txt").write_text(PROJECT.replace(f"armrs {MAJOR}.{MINOR}", f"armrs {later}"), encoding="utf-8")
    command = [cmake(), "-S", ".", "-B", "build", f"-DCMAKE_PREFIX_PATH={installed}"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and f'compatible with requested version "{later}"' in " ".join(done.stderr.split())


def test_the_example_for_ros_carries_half_of_an_arm(installed: Path, tmp_path: Path) -> None:
    """What of it knows armrs, that is; the controller around it needs ROS."""
    model = true_model()
    armrs.export_c(model).write(tmp_path)
    shutil.copy(ROOT / "examples" / "ros2_control" / "src" / "support.hpp", tmp_path)
    (tmp_path / "main.cpp").write_text(SUPPORT, encoding="utf-8")
    flags = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-DARMRS_TWO_JOINTS", f"-I{installed / 'include'}", "-c"]
    run("cc", "-std=c99", *flags, "armrs_model.c", cwd=tmp_path)
    run("c++", "-std=c++17", *flags, "main.cpp", cwd=tmp_path)
    library = installed / "lib" / "libarmrs_c.a"
    run("c++", "main.o", "armrs_model.o", library, "-lm", "-lpthread", "-ldl", "-o", "main", cwd=tmp_path)
    told = [float(word) for word in run(tmp_path / "main").split()]
    carried = online.Compensation(model).carry([-1.4, 0.5]).torque
    assert np.abs(carried).max() < 6.0
    assert told == pytest.approx((0.5 * carried).tolist(), rel=1e-11)


def test_a_project_finds_the_library_with_pkg_config(installed: Path, tmp_path: Path) -> None:
    if shutil.which("pkg-config") is None:
        pytest.skip("no pkg-config")
    (tmp_path / "main.c").write_text(C, encoding="utf-8")
    told = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "armrs"],
        env=os.environ | {"PKG_CONFIG_PATH": str(installed / "lib" / "pkgconfig")},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "-DARMRS_TWO_JOINTS" in told
    run("cc", "-std=c99", "main.c", *told.split(), "-o", "main", cwd=tmp_path)
    assert float(run(tmp_path / "main")) == pytest.approx(9.81 * LEVEL, rel=1e-11)


def test_a_package_of_a_release_holds_what_cmake_finds(tmp_path: Path) -> None:
    if not os.environ.get("ARMRS_EMULATOR"):
        pytest.skip("builds a library for a device: with ARMRS_EMULATOR=1, as make crosscheck does")
    command = [str(ROOT / "scripts" / "device_libraries.sh"), str(tmp_path), "cortex-m4-single-2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 77:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(tmp_path / "armrs-cortex-m4-single-2.zip") as archive:
        names = {name.split("/", 1)[1] for name in archive.namelist()}
        config = archive.read("armrs-cortex-m4-single-2/lib/cmake/armrs/armrsConfig.cmake").decode()
    assert {"include/armrs.h", "include/armrs.hpp", "lib/libarmrs_c.a", "lib/pkgconfig/armrs.pc", "LICENSE-MIT", "LICENSE-APACHE"} <= names
    assert "ARMRS_SINGLE" in config and "ARMRS_TWO_JOINTS" in config


def test_a_package_that_there_is_none_of_is_refused(tmp_path: Path) -> None:
    command = [str(ROOT / "scripts" / "device_libraries.sh"), str(tmp_path), "cortex-m0-single-2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 77:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 2 and "cortex-m0-single-2" in done.stderr and "cortex-m4-single-3" in done.stderr
