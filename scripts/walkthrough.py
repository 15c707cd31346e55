#!/usr/bin/env python3
"""Do what docs/firmware.md says, to the letter, in a folder that is empty: from no project to an image that runs in QEMU.

Exits with 77 and the reason where a tool is missing.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(\w+)(?: ([^\n]+))?\n(.*?)^```", flags=re.M | re.S)
TARGET = "thumbv7em-none-eabihf"
TOOLS = {
    "cargo": "from rustup",
    "cc": "Debian: gcc",
    "arm-none-eabi-gcc": "Debian: gcc-arm-none-eabi",
    "qemu-system-arm": "Debian: qemu-system-arm",
    "make": "Debian: make",
    "cmake": "Debian: cmake",
    "armrs": "make build",
}


def core_of_the_target() -> str | None:
    """Return what CMake is told of Rust's core: nothing with rustup's, the folder where it was built from Debian's source, None without."""
    found = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True, check=True).stdout.strip()
    if Path(found, "lib", "rustlib", TARGET).exists():
        return ""
    if not Path("/usr/bin/rustc").exists():
        return None
    debian = subprocess.run(["/usr/bin/rustc", "--print", "sysroot"], capture_output=True, text=True, check=True).stdout.strip()
    if not Path(debian, "lib", "rustlib", "src", "rust", "library").exists():
        return None
    made = ROOT / "target" / "sysroot-m4"
    subprocess.run([ROOT / "scripts" / "sysroot.sh", TARGET, made, "-C", "target-cpu=cortex-m4"], check=True)
    return f"-DARMRS_SYSROOT={made} "


def main() -> int:
    """Write its files, run its commands, and look for what it says they print."""
    environment = os.environ | {"PATH": f"{ROOT / '.venv' / 'bin'}:{os.environ['PATH']}"}
    for tool, package in TOOLS.items():
        if shutil.which(tool, path=environment["PATH"]) is None:
            print(f"walkthrough: skipped, {tool} is missing ({package})", file=sys.stderr)
            return 77
    core = core_of_the_target()
    if core is None:
        print("walkthrough: skipped, no Rust for the target (rustup target add thumbv7em-none-eabihf)", file=sys.stderr)
        return 77
    page = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
    section = page[page.index("## Use in your own C project") : page.index("### Other targets")]
    with tempfile.TemporaryDirectory() as folder:
        commands, promised = ["set -euo pipefail"], []
        for language, name, content in BLOCK.findall(section):
            if language == "sh":
                commands.append(
                    content.replace("../myproject", folder).replace(" ARMRS/", f" {ROOT}/").replace("-DARMRS_CPU", f"{core}-DARMRS_CPU")
                )
            elif language == "text":
                promised.append(content)
            else:
                # In its turn: a later step may replace a file.
                commands.append(f"cat >{folder}/{name} <<'END OF FILE'\n{content}END OF FILE")
        done = subprocess.run(
            ["bash", "-c", "\n".join(commands)], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=False
        )
    missing = [text for text in promised if done.stdout.count(text) != promised.count(text)]
    if done.returncode or missing or not promised:
        print(f"walkthrough: status {done.returncode}, not printed as it says: {missing}; printed:\n{done.stdout}", file=sys.stderr)
        return 1
    print("walkthrough: docs/firmware.md from an empty folder to a running image, with Make, with CMake and on this computer")
    return 0


if __name__ == "__main__":
    sys.exit(main())
