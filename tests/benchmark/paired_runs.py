#!/usr/bin/env python3
"""Compares the speed of two programs: runs each scene with both in turn, and prints the median ratio of CPU times, AFTER/BEFORE.
A run takes 0.35 to 6 s of AFTER's CPU time, where 1 to 640 simulated seconds can take that.

    tests/benchmark/paired_runs.py BEFORE AFTER --algorithm a5 --rounds 5 [--scenes SCENE.gltf …]

BEFORE and AFTER are two builds' programs. Scenes (all of this tree) must be readable by both: where their runs do not end alike, no
time is compared. The last line is the median over the scenes. The code is 1 where a scene is slower by more than --limit, or was not
compared.
"""

import argparse
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"
SETTINGS = ["--set", "n=10,m=1,tau=0.6,kappa=1,joints=stable"]
LEAST = 0.35  # CPU time of a run, s
MOST = 6.0


def timed(program: str, scene: pathlib.Path, algorithm: str, duration: float, folder: str) -> tuple[float, int]:
    """Returns the CPU time, s, and the exit code: 1 where the run diverged, a step was not solved or a joint tore."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run = subprocess.run([program, "run", scene, "--algorithm", algorithm, *SETTINGS, "--duration", str(duration), "--output",
                          folder + "/run.poses"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, run.returncode


def duration_for(program: str, scene: pathlib.Path, algorithm: str, folder: str) -> float:
    duration = 5.0
    taken, _ = timed(program, scene, algorithm, duration, folder)
    while taken < LEAST and duration < 640:
        duration *= 2
        taken, _ = timed(program, scene, algorithm, duration, folder)
    return duration if taken < MOST else max(1.0, duration * MOST / taken)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("--scenes", nargs="*", type=pathlib.Path, default=[])
    parser.add_argument("--algorithm", default="a5")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--limit", type=float, default=1.05)
    arguments = parser.parse_args()
    medians = []
    is_good = True
    print("| scene | s simulated | CPU s before | after | after / before | lowest | highest |\n|---|---:|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        for scene in arguments.scenes or sorted(SCENES.glob("*.gltf")):
            duration = duration_for(arguments.after, scene, arguments.algorithm, folder)
            times: dict[str, list[float]] = {arguments.before: [], arguments.after: []}
            codes: dict[str, set[int]] = {arguments.before: set(), arguments.after: set()}
            for round_ in range(arguments.rounds):
                order = (arguments.before, arguments.after)
                for program in order if round_ % 2 else order[::-1]:
                    taken, code = timed(program, scene, arguments.algorithm, duration, folder)
                    times[program].append(taken)
                    codes[program].add(code)
            if codes[arguments.before] != codes[arguments.after] or not codes[arguments.after] <= {0, 1}:
                is_good = False
                print(f"| {scene.stem} | {duration:.3g} | code {codes[arguments.before]} | {codes[arguments.after]} | | | |", flush=True)
                continue
            before, after = times[arguments.before], times[arguments.after]
            ratios = [a / b for a, b in zip(after, before)]
            medians.append(statistics.median(ratios))
            is_good = is_good and medians[-1] <= arguments.limit
            print(f"| {scene.stem} | {duration:.3g} | {statistics.median(before):.3f} | {statistics.median(after):.3f} | "
                  f"{statistics.median(ratios):.2f} | {min(ratios):.2f} | {max(ratios):.2f} |", flush=True)
    if medians:
        print(f"| median | | | | {statistics.median(medians):.2f} | {min(medians):.2f} | {max(medians):.2f} |")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
