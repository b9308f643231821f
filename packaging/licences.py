"""Writes the licences of all that is linked into the program and the Python module: of the crates of a target, and of what
they build from C.

    packaging/licences.py TARGET > THIRD-PARTY.txt
"""

import json
import pathlib
import subprocess
import sys

NAMES = ("licen", "copying", "notice", "copyright")
# Sources of C libraries, inside the crates that build them.
INSIDE = ("vendor", "ext/hdf5", "src/zlib", "libdeflate")


def texts(folder):
    """The licence files at the top of a folder."""
    for file in sorted(folder.iterdir()) if folder.is_dir() else []:
        if file.is_file() and file.name.lower().startswith(NAMES):
            yield file.read_text(errors="replace").strip()


def linked(metadata):
    """The identifiers of the packages that end up in one of the two: neither those of tests nor what only runs in a build, but
    sources that a build compiles."""
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    ours = set(metadata["workspace_members"])
    found, open_ = set(), list(ours)
    while open_:
        for dependency in nodes[open_.pop()]["deps"]:
            kinds = {kind["kind"] for kind in dependency["dep_kinds"]}
            source = "build" in kinds and dependency["name"].endswith("_src")
            if (None in kinds or source) and dependency["pkg"] not in found:
                found.add(dependency["pkg"])
                open_.append(dependency["pkg"])
    return found - ours


def main():
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--features", "static-hdf5"]
    metadata = json.loads(subprocess.check_output([*command, "--filter-platform", sys.argv[1]]))
    wanted = linked(metadata)
    packages = [package for package in metadata["packages"] if package["id"] in wanted]
    packages.sort(key=lambda package: (package["name"], package["version"]))
    by_text = {}
    print("What the program and the Python module stickslip are made of beside their own source, with its licences.")
    print("Below each text stands whose it is.\n")
    for package in packages:
        name = f"{package['name']} {package['version']}"
        folder = pathlib.Path(package["manifest_path"]).parent
        print(f"{name}: {package['license'] or 'see below'}")
        for text in texts(folder):
            by_text.setdefault(text, []).append(name)
        for inside in INSIDE:
            for text in texts(folder / inside):
                by_text.setdefault(text, []).append(f"the C library in {name}")
    font = pathlib.Path(metadata["workspace_root"], "data/fonts/LICENSE").read_text().strip()
    by_text.setdefault(font, []).append("the font of the figures, DejaVu Sans")
    for needed in ("hdf5-metno-src", "libdeflate-sys", "libz-sys", "sundials-sys"):
        assert any(f"the C library in {needed} " in name for names in by_text.values() for name in names), needed
    for text, names in by_text.items():
        print(f"\n{'=' * 80}\n{text}\n{'-' * 80}\n{', '.join(names)}")


main()
