"""Write what can be generated of docs/dossier.md, and the bills of materials beside it.

    scripts/dossier.py

From scripts/requirements.toml the table of requirements and their tests, from `cargo tree` and pyproject.toml the third-party code at run
time; docs/sbom/ gets the same as CycloneDX 1.6. A test compares all of it with the files.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "dossier.md"
SBOM = ROOT / "docs" / "sbom"
BLOCK = "<!-- generated: {0} -->\n{1}<!-- end: {0} -->"


def requirements() -> list[dict[str, Any]]:
    """Return the requirements.

    Raises
    ------
    SystemExit
        For a test that does not exist.
    """
    read = tomllib.loads((ROOT / "scripts" / "requirements.toml").read_text(encoding="utf-8"))["requirement"]
    for entry in read:
        for test in entry["tests"]:
            file, name = test.split("::")
            source = (ROOT / file).read_text(encoding="utf-8") if (ROOT / file).is_file() else ""
            if not re.search(rf"^\s*(fn|def) {name}\b", source, flags=re.M):
                raise SystemExit(f"scripts/requirements.toml, {entry['id']}: found {test}, allowed a test that exists")
    return list(read)


def dependencies(crate: str) -> list[dict[str, str]]:
    """Return name, version and licence of what a crate is built from on any target: no crates of armrs, build scripts or macros."""
    command = ["cargo", "tree", "--locked", "--package", crate, "--edges", "normal,no-proc-macro", "--target", "all", "--prefix", "none"]
    told = subprocess.run([*command, "--format", "{p}|{l}"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    rows = {line.removesuffix(" (*)") for line in told.splitlines() if line and str(ROOT) not in line}
    found = []
    for row in sorted(rows):
        package, licence = row.split("|")
        name, version = package.split()[:2]
        found.append({"name": name, "version": version.removeprefix("v"), "license": licence.removesuffix(" (*)")})
    return found


def component(package: dict[str, str]) -> dict[str, Any]:
    """Return a package of a registry as CycloneDX describes it."""
    purl = f"pkg:cargo/{package['name']}@{package['version']}"
    return {
        "type": "library",
        "bom-ref": purl,
        "name": package["name"],
        "version": package["version"],
        "licenses": [{"expression": package["license"].replace("/", " OR ")}],
        "purl": purl,
    }


def sbom(name: str, description: str, components: list[dict[str, Any]]) -> str:
    """Return a bill of materials in CycloneDX 1.6; it has no serial number and no time, so that it changes only with what it lists."""
    version = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]["version"]
    ref = f"pkg:generic/{name}@{version}"
    subject = {"type": "library", "bom-ref": ref, "name": name, "version": version, "description": description}
    document = {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": subject | {"licenses": [{"expression": "MIT OR Apache-2.0"}]}},
        "components": components,
        "dependencies": [{"ref": ref, "dependsOn": [c["bom-ref"] for c in components]}],
    }
    return json.dumps(document, indent=1) + "\n"


def python_requirements() -> list[str]:
    """Return what the Python package requires at run time, without extras."""
    return list(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"])


def python_component(requirement: str) -> dict[str, Any]:
    """Return what the Python package requires as CycloneDX describes it: the user's installation decides on the version."""
    name = re.split(r"[<>=!~; \[]", requirement)[0]
    return {
        "type": "library",
        "bom-ref": f"pkg:pypi/{name}",
        "name": name,
        "purl": f"pkg:pypi/{name}",
        "description": f"required: {requirement}",
    }


def generated() -> dict[Path, str]:
    """Return every file with its content."""
    device, package = dependencies("arm-capi"), dependencies("arm-py")
    tests = [
        f"| {r['id']} | {r['text']} | " + "<br>".join(f"[`{t.split('::')[1]}`](../{t.split('::')[0]})" for t in r["tests"]) + " |"
        for r in requirements()
    ]
    code = [f"| `{p['name']}` | {p['version']} | {p['license']} |" for p in device]
    blocks = {
        "requirements": "| | requirement | tests |\n| --- | --- | --- |\n" + "\n".join(tests) + "\n",
        "device": "| crate | version | licence |\n| --- | --- | --- |\n" + "\n".join(code) + "\n",
        "counts": f"{len(device)} crates in the device library, {len(package)} in the compiled module of the Python package. That asks for "
        + ", ".join(f"`{r}`" for r in python_requirements())
        + ".\n",
    }
    page = PAGE.read_text(encoding="utf-8")
    for name, text in blocks.items():
        found = re.compile(re.escape(BLOCK.format(name, "\0")).replace("\0", ".*?"), flags=re.S)
        assert len(found.findall(page)) == 1, name
        page = found.sub(lambda _, name=name, text=text: BLOCK.format(name, text), page)  # type: ignore[misc]
    python = [python_component(r) for r in python_requirements()]
    return {
        PAGE: page,
        SBOM / "device.cdx.json": sbom("armrs-c", "C library for firmware, crates/arm-capi", [component(p) for p in device]),
        SBOM / "package.cdx.json": sbom("armrs", "Python package", [*(component(p) for p in package), *python]),
    }


if __name__ == "__main__":
    SBOM.mkdir(exist_ok=True)
    for path, content in generated().items():
        path.write_text(content, encoding="utf-8")
