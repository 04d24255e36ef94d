#!/usr/bin/env python3
"""The same bits, as a matrix: state hashes of every scene with every algorithm and treatment of joints, from every
compiler, level, processor, locale, rounding mode and order that is here, each compared with the first.

    tests/reproducibility/matrix.py --build DIR [--scenes NAME …]

Builds pose_hashes in folders below DIR. Processors need Debian's qemu-user, locales the package locales-all; what is
missing is left out and said. Prints a Markdown table; the code is 1 where any hash differs.
"""

import argparse
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
BODY_STEPS = "1000000"  # as many as two seconds take
ENTRIES = ("upward", "downward", "toward-zero", "flush-to-zero")


def built(folder: pathlib.Path, compiler: str, level: str) -> pathlib.Path:
    configure = ["cmake", "-S", SOURCE, "-B", folder, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={compiler}",
                 "-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_CXX_FLAGS={level}", "-DSUBSTEP_BENCHMARKS=OFF"]
    for command in (configure, ["cmake", "--build", folder, "--target", "pose_hashes"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder / "tests/reproducibility/pose_hashes"


def hashes(command: list, scenes: list, environment: dict | None = None) -> list[str]:
    result = subprocess.run([*command, BODY_STEPS, *scenes], env={**os.environ, **(environment or {})}, capture_output=True,
                            text=True, check=False)
    if result.returncode != 0:
        return [f"code {result.returncode}: {result.stderr.strip()[-80:]}"]
    return sorted(result.stdout.splitlines())


def has_locale(name: str) -> bool:
    known = subprocess.run(["locale", "-a"], capture_output=True, text=True, check=True).stdout
    return name.replace("UTF-8", "utf8") in known.split()


class Table:
    def __init__(self, scenes: list):
        self.scenes = scenes
        self.expected: list[str] = []
        self.rows: list[tuple[str, str]] = []
        self.differs = False

    def add(self, what: str, lines: list[str]) -> None:
        self.expected = self.expected or lines
        wrong = sorted(set(lines) ^ set(self.expected))
        self.differs |= bool(wrong)
        self.rows.append((what, f"differs: {wrong[0]}" if wrong else f"the same {len(lines)} hashes"))
        print(f"{what}: {self.rows[-1][1]}", file=sys.stderr, flush=True)

    def leave_out(self, what: str, why: str) -> None:
        self.rows.append((what, f"left out: {why}"))

    def markdown(self) -> str:
        head = f"Measured {datetime.date.today().isoformat()}, {len(self.scenes)} scenes.\n\n| run | bits |\n|---|---|\n"
        return head + "".join(f"| {what} | {bits} |\n" for what, bits in self.rows)


def add_environments(table: Table, program: pathlib.Path) -> None:
    for entry in ENTRIES:
        table.add(f"entered with {entry}", hashes([program, "--entry", entry], table.scenes))
    for name in LOCALES:
        if has_locale(name):
            table.add(f"locale {name}", hashes([program], table.scenes, {"LC_ALL": name}))
        else:
            table.leave_out(f"locale {name}", "apt-get install locales-all")
    table.add("scenes in the other order", hashes([program], table.scenes[::-1]))
    twice = hashes([program], table.scenes * 2)
    table.add("every scene twice in one process", twice[::2] if twice[::2] == twice[1::2] else twice)
    emulator = shutil.which("qemu-x86_64")
    for processor in PROCESSORS:
        if emulator:
            table.add(f"processor {processor}", hashes([emulator, "-cpu", processor, program], table.scenes))
        else:
            table.leave_out(f"processor {processor}", "apt-get install qemu-user")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True, help="folder for the builds")
    parser.add_argument("--program", type=pathlib.Path, help="pose_hashes as built already, in place of all builds")
    parser.add_argument("--scenes", nargs="*", default=[], help="only these (all)")
    arguments = parser.parse_args()
    files = sorted((SOURCE / "scenes").glob("*.gl[tb]*"))
    scenes = [f for f in files if not arguments.scenes or f.stem in arguments.scenes]
    table = Table(scenes)
    program = arguments.program
    if program:
        table.add("as built", hashes([program], scenes))
    else:
        for compiler in COMPILERS:
            if not shutil.which(compiler):
                table.leave_out(compiler, "not installed")
                continue
            for level in LEVELS:
                here = built(arguments.build / f"{compiler.rstrip('+')}{level}", compiler, level)
                table.add(f"{compiler} {level}", hashes([here], scenes))
                program = program or here
    add_environments(table, program)
    print(table.markdown())
    return int(table.differs)


if __name__ == "__main__":
    sys.exit(main())
