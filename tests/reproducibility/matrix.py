#!/usr/bin/env python3
"""Compares state hashes of every scene with each of A1 to A5 and treatment of joints, and hashes of the pixels of three frames
each, over compilers, levels, processors, locales, rounding modes and orders of the scenes.

    tests/reproducibility/matrix.py --build DIR [--scenes NAME …]

Builds pose_hashes and pixel_hashes in folders below DIR. Processors need Debian's qemu-user, locales the package
locales-all; missing ones are reported as left out. At -O0 and on an emulator a run takes up to a hundred times as long:
there, runs of many bodies end sooner (SLOW_BODY_STEPS). Prints a Markdown table; the code is 1 where any hash differs.
"""

import argparse
import dataclasses
import datetime
import os
import pathlib
import shutil
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
COMPILERS = ("g++", "clang++")
LEVELS = ("-O0", "-O2", "-O3")
PROCESSORS = ("Nehalem", "Haswell", "EPYC")
LOCALES = ("de_DE.UTF-8", "tr_TR.UTF-8")
BODY_STEPS = 1_000_000  # of a run; two seconds of any scene take fewer
SLOW_BODY_STEPS = 500
FAILED = "failed"
ENTRIES = ("upward", "downward", "toward-zero", "flush-to-zero")


@dataclasses.dataclass(frozen=True)
class Programs:
    """The two programs of one build that print hashes."""
    folder: pathlib.Path

    def hashes(self, scenes: list, before: tuple = (), options: tuple = (), environment: dict | None = None,
               body_steps: int = BODY_STEPS) -> list[str]:
        result = []
        for name, arguments in (("pose_hashes", [str(body_steps)]), ("pixel_hashes", [])):
            command = [*before, self.folder / name, *options, *arguments, *scenes]
            run = subprocess.run(command, env={**os.environ, **(environment or {})}, capture_output=True, text=True,
                                 check=False)
            if run.returncode != 0:
                return [FAILED, f"{name}: code {run.returncode}: {run.stderr.strip()[-80:]}"]
            result += run.stdout.splitlines()
        return sorted(result)


def built(folder: pathlib.Path, compiler: str, level: str) -> Programs:
    configure = ["cmake", "-S", SOURCE, "-B", folder, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={compiler}",
                 "-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_CXX_FLAGS={level}", "-DSUBSTEP_BENCHMARKS=OFF"]
    for command in (configure, ["cmake", "--build", folder, "--target", "pose_hashes", "pixel_hashes"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return Programs(folder / "tests/reproducibility")


def has_locale(name: str) -> bool:
    known = subprocess.run(["locale", "-a"], capture_output=True, text=True, check=True).stdout
    return name.replace("UTF-8", "utf8") in known.split()


class Table:
    """Compares each row's hashes with the expected ones."""

    def __init__(self, scenes: list):
        self.scenes = scenes
        self.rows: list[tuple[str, str]] = []
        self.differs = False

    def add(self, what: str, lines: list[str], expected: list[str]) -> None:
        wrong = lines[1:] if FAILED in lines else sorted(set(lines) ^ set(expected))
        self.differs |= bool(wrong)
        pictures = sum(" frame " in line for line in lines)
        self.rows.append((what, f"differs: {wrong[0]}" if wrong else
                          f"the same {len(lines) - pictures} states, {pictures} pictures"))
        print(f"{what}: {self.rows[-1][1]}", file=sys.stderr, flush=True)

    def leave_out(self, what: str, why: str) -> None:
        self.rows.append((what, f"left out: {why}"))

    def markdown(self) -> str:
        head = f"Measured {datetime.date.today().isoformat()}, {len(self.scenes)} scenes.\n\n| run | bits |\n|---|---|\n"
        return head + "".join(f"| {what} | {bits} |\n" for what, bits in self.rows)


def add_environments(table: Table, programs: Programs, expected: list[str]) -> None:
    for entry in ENTRIES:
        table.add(f"entered with {entry}", programs.hashes(table.scenes, options=("--entry", entry)), expected)
    for name in LOCALES:
        if has_locale(name):
            table.add(f"locale {name}", programs.hashes(table.scenes, environment={"LC_ALL": name}), expected)
        else:
            table.leave_out(f"locale {name}", "apt-get install locales-all")
    table.add("scenes in the other order", programs.hashes(table.scenes[::-1]), expected)
    twice = programs.hashes(table.scenes * 2)
    table.add("every scene twice in one process", twice[::2] if twice[::2] == twice[1::2] else twice, expected)


def add_processors(table: Table, programs: Programs, expected: list[str]) -> None:
    emulator = shutil.which("qemu-x86_64")
    if not emulator:
        for processor in PROCESSORS:
            table.leave_out(f"processor {processor}", "apt-get install qemu-user")
        return
    for processor in PROCESSORS:
        table.add(f"processor {processor}, {SLOW_BODY_STEPS} body-steps a run",
                  programs.hashes(table.scenes, before=(emulator, "-cpu", processor), body_steps=SLOW_BODY_STEPS), expected)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True, help="folder for the builds")
    parser.add_argument("--scenes", nargs="*", default=[], help="only these (all)")
    arguments = parser.parse_args()
    files = sorted((SOURCE / "scenes").glob("*.gl[tb]*"))
    scenes = [f for f in files if not arguments.scenes or f.stem in arguments.scenes]
    table = Table(scenes)
    builds: dict[str, Programs] = {}
    for compiler in COMPILERS:
        if not shutil.which(compiler):
            table.leave_out(compiler, "not installed")
            continue
        for level in LEVELS:
            builds[f"{compiler} {level}"] = built(arguments.build / f"{compiler.rstrip('+')}{level}", compiler, level)
    if not builds:
        sys.exit(f"none of {', '.join(COMPILERS)} is installed")
    first = next(programs for name, programs in builds.items() if not name.endswith("-O0"))
    expected = first.hashes(scenes)
    expected_of_few = first.hashes(scenes, body_steps=SLOW_BODY_STEPS)
    for name, programs in builds.items():
        if name.endswith("-O0"):
            table.add(f"{name}, {SLOW_BODY_STEPS} body-steps a run", programs.hashes(scenes, body_steps=SLOW_BODY_STEPS),
                      expected_of_few)
        else:
            table.add(f"{name} (baseline)" if programs == first else name, expected if programs == first else programs.hashes(scenes), expected)
    add_environments(table, first, expected)
    add_processors(table, first, expected_of_few)
    print(table.markdown())
    return int(table.differs)


if __name__ == "__main__":
    sys.exit(main())
