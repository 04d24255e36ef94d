#!/usr/bin/env python3
"""Long runs and large scenes: 10⁷ steps of a pendulum and a tumbling body, piles of 10,000 boxes by A5 and 2,000 by A1, a
film of 10,000 small frames, two processes that write the same outputs in one folder.

    tests/endurance/endurance.py --program build/substep            # an hour and more
    tests/endurance/endurance.py --program build/substep --share 0.01

`--share` shortens all. A run may take MORE_MEMORY beyond that of one of a hundredth of its length; its joints and energy
must stay within STATED. Piles are measured, not judged. Prints a Markdown table; the code is 1 where anything is outside.
"""

import argparse
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PARTS = ("steps", "piles", "film", "two")
MORE_MEMORY = 4  # MB that a long run may take beyond a short one: what the allocator keeps
MORE_MEMORY_OF_FILM = 32
# Of 10⁷ steps by A3 at the scenes' 1/60 s: the gap at the pendulum's hinge (m), and energy above the start's (J).
STATED = {"pendulum": (1e-4, 1e-3), "tumbling_body": (0.0, 1e-3)}


def pile(count: int, shift: float) -> dict:
    """Returns glTF of unit boxes in layers of up to 20 x 20, 1 cm apart. Every second layer is displaced by `shift`: half
    a box joins all boxes in one pile; 0 gives separate columns, which A1 solves in a minute."""
    physics = "KHR_physics_rigid_bodies"

    def node(name: str, shape: int, **also) -> dict:
        extension = {"collider": {"geometry": {"shape": shape}, "physicsMaterial": 0}}
        if shape:
            extension["motion"] = {"mass": 1.0}
        return {"name": name, **also, "extensions": {physics: extension}}

    side = min(20, max(2, round(count ** (1 / 3))))
    nodes = [node("ground", 0)]
    for i in range(count):
        layer, place = divmod(i, side * side)
        row, column = divmod(place, side)
        aside = shift * (layer % 2)
        nodes.append(node(f"box_{i}", 1, translation=[1.02 * column + aside, 0.51 + 1.01 * layer, 1.02 * row + aside]))
    material = {"staticFriction": 0.6, "dynamicFriction": 0.6, "restitution": 0.0, "frictionCombine": "minimum",
                "restitutionCombine": "minimum"}
    shapes = [{"type": "plane", "plane": {}}, {"type": "box", "box": {"size": [1.0, 1.0, 1.0]}}]
    extras = {"substep": {"gravity": [0, -9.81, 0], "duration": 1.0, "step": 1 / 60}}
    return {"asset": {"version": "2.0"}, "extensionsUsed": [physics, "KHR_implicit_shapes"], "nodes": nodes, "scene": 0,
            "scenes": [{"name": "pile", "nodes": list(range(count + 1)), "extras": extras}],
            "extensions": {physics: {"physicsMaterials": [material]}, "KHR_implicit_shapes": {"shapes": shapes}}}


class Program:
    def __init__(self, program: pathlib.Path, folder: pathlib.Path):
        self.program, self.folder = program, folder

    def start(self, words: str, name: str) -> subprocess.Popen:
        with open(self.folder / name, "wb") as said:
            return subprocess.Popen([self.program, *words.split()], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=said,
                                    stderr=subprocess.STDOUT)

    def run(self, words: str) -> tuple[float, float, str]:
        """Returns seconds, peak memory in MB, and the output. Exits where the code is not 0."""
        begin = time.monotonic()
        process = self.start(words, "said")
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said = (self.folder / "said").read_text(errors="replace")
        if process.returncode != 0:
            sys.exit(f"{words}: code {process.returncode}: {said[-300:]}")
        return time.monotonic() - begin, usage.ru_maxrss / 1024, said


class Table:
    def __init__(self):
        self.rows: list[str] = []
        self.wrong = 0

    def add(self, what: str, seconds: float, memory: str, also: str, good: bool) -> None:
        self.rows.append(f"| {what} | {seconds:.0f} | {memory} | {also}{'' if good else ' **outside**'} |")
        self.wrong += not good
        print(self.rows[-1], file=sys.stderr, flush=True)


def steps(program: Program, table: Table, share: float) -> None:
    for scene, (most_gap, most_energy) in STATED.items():
        count = round(1e7 * share)
        words = f"run {SOURCE}/scenes/{scene}.gltf --every 1000000000 --output /dev/null --duration "
        short = program.run(words + str(count / 6000))[1]
        seconds, memory, said = program.run(words + str(count / 60))
        gap = float(re.search(r"largest joint gap (\S+) m", said)[1])
        energy = float(re.search(r"largest rise of the energy above the start's (\S+) J", said)[1])
        table.add(f"{count} steps of {scene} by A3", seconds, f"{memory:.0f} ({memory - short:+.1f})",
                  f"joint gap {gap:g} m, energy {energy:+g} J",
                  gap <= most_gap and energy <= most_energy and memory - short <= MORE_MEMORY)


def piles(program: Program, table: Table, share: float) -> None:
    for algorithm, full, count_of_steps, shift in (("a5", 10000, 60, 0.5), ("a1", 2000, 6, 0.0)):
        count = max(10, round(full * share))
        words = f"--algorithm {algorithm} --output pile.txt --every 1000 --duration {count_of_steps / 60}"
        for boxes in (1, count):
            (program.folder / f"pile_{boxes}.gltf").write_text(json.dumps(pile(boxes, shift)))
        least = program.run(f"run pile_1.gltf {words}")[1]
        seconds, memory, said = program.run(f"run pile_{count}.gltf {words}")
        depth = re.search(r"deepest penetration (\S+) m", said)[1]
        kind = "in a pile" if shift else "in columns"
        table.add(f"{count_of_steps} steps of {count} boxes {kind} by {algorithm.upper()}", seconds,
                  f"{memory:.0f} ({1024 * (memory - least) / count:.1f} KB a body)",
                  f"{1000 * seconds / count_of_steps / count:.3f} ms a step and body, deepest {depth} m", True)


def film(program: Program, table: Table, share: float) -> None:
    frames = round(10000 * share)
    words = (f"video {SOURCE}/scenes/pendulum.gltf --no-reference --panel a1 --size 320x180 --hold 0 --output film.mp4 "
             "--duration ")
    short = program.run(words + str(max(frames / 100, 10) / 30))[1]
    seconds, memory, _ = program.run(words + str(frames / 30))
    table.add(f"a film of {frames} frames", seconds, f"{memory:.0f} ({memory - short:+.1f})", "", memory - short <= MORE_MEMORY_OF_FILM)


def two(program: Program, table: Table, share: float) -> None:
    """Checks that two processes with the same outputs in one folder write what one process writes."""
    (program.folder / "sweep.toml").write_text(
        f'horizon = 0.2\n[[grid]]\nscenes = ["{SOURCE}/scenes/pendulum.gltf"]\nalgorithms = ["a1", "a3", "a5"]\n'
        "substeps = [1, 2, 4, 8]\n")
    outputs = {f"run {SOURCE}/scenes/pendulum.gltf --duration 50 --output run.txt": "run.txt",
               "sweep sweep.toml --output swept": "swept/errors.csv",
               f"export {SOURCE}/scenes/pendulum.gltf --output run.glb": "run.glb"}
    begin = time.monotonic()
    differing = set()
    for words, output in outputs.items():
        program.run(words)
        alone = (program.folder / output).read_bytes()
        for _ in range(max(2, round(50 * share))):
            for file in [program.folder / output, *program.folder.glob("swept/jobs/*")]:
                file.unlink()
            both = [program.start(words, f"said{k}") for k in range(2)]
            codes = [process.wait() for process in both]
            if codes != [0, 0] or (program.folder / output).read_bytes() != alone:
                differing.add(f"{output} (codes {codes})")
    hidden = [str(f) for f in program.folder.rglob(".*.partial")]
    table.add("two processes in one folder: run, sweep, export", time.monotonic() - begin, "",
              f"differing: {', '.join(differing) or 'none'}; left behind: {len(hidden)}", not differing and not hidden)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=SOURCE / "build/substep")
    parser.add_argument("--share", type=float, default=1, help="of the full length, above 0")
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    arguments = parser.parse_args()
    table = Table()
    with tempfile.TemporaryDirectory() as folder:
        program = Program(arguments.program.resolve(), pathlib.Path(folder))
        for part in arguments.parts:
            {"steps": steps, "piles": piles, "film": film, "two": two}[part](program, table, arguments.share)
    print(f"Measured {datetime.date.today().isoformat()}; in brackets MB more than a short run; for piles KB a body.\n")
    print("| what | s | MB | |\n|---|---|---|---|\n" + "\n".join(table.rows))
    return int(table.wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
