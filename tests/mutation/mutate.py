#!/usr/bin/env python3
"""Wrong lines that the tests must notice: changes one operator, constant, sign, condition, boundary or statement at a
seeded random line, builds what is needed, runs the area's tests without goldens, and where they pass `substep check`.

    tests/mutation/mutate.py --build build --area sim --count 20 --seed 1

Prints a Markdown table by area and the survivors. `equivalent.txt` beside this file holds those that were judged to
change nothing that can be seen, with the reason. Sources are put back, whatever happens.
"""

import argparse
import dataclasses
import pathlib
import random
import re
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
# A folder's tests: those of the first prefix that fits.
TESTS = (("sim/geometry", ("geometry", "sim")), ("sim/loading", ("scene",)), ("sim/log", ("log",)),
         ("sim/measure", ("measure",)), ("sim/study", ("study", "report")), ("sim/commands", ("program",)),
         ("sim", ("sim", "geometry", "measure")), ("golden", ("golden",)), ("render/report", ("report",)),
         ("render", ("render", "program")))
SWAPS = ((r"(?<=[\w\)\]]) \+ ", " - "), (r"(?<=[\w\)\]]) - ", " + "), (r" \* ", " / "), (r" / ", " * "),
         (r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "),
         (r" && ", " || "), (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "), (r"\btrue\b", "false"),
         (r"\bfalse\b", "true"), (r"std::max\(", "std::min("), (r"std::min\(", "std::max("),
         (r"\bcontinue;", "break;"), (r"= -(?=\w)", "= "), (r"\(-(?=\w)", "("), (r"\bif \(", "if (!("))
NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?![\w.])")
STATEMENT = re.compile(r"^\s+(?!return|const|auto|throw|using|break|continue|int |double |std::)[\w.\->\[\]()]+.*[;]$")


@dataclasses.dataclass(frozen=True)
class Mutant:
    file: pathlib.Path
    line: int
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.file.relative_to(SOURCE)}:{self.line + 1}: `{self.old.strip()}` → `{self.new.strip()}`"

    def key(self) -> tuple[str, str, str]:
        return str(self.file.relative_to(SOURCE)), self.old.strip(), self.new.strip()


def changes_of(line: str) -> list[str]:
    code = line.split("//")[0]
    if not code.strip() or code.lstrip().startswith(("#", "template", "namespace", "using", "static_assert", "/*")):
        return []
    result = []
    for pattern, swap in SWAPS:
        for match in re.finditer(pattern, code):
            if code[:match.start()].count('"') % 2:
                continue
            changed = line[:match.start()] + swap + line[match.end():]
            if swap == "if (!(":
                depth, at = 1, match.end() + 2
                while at < len(changed) and depth:
                    depth += {"(": 1, ")": -1}.get(changed[at], 0)
                    at += 1
                if depth:
                    continue  # the condition goes on in the next line
                changed = changed[:at] + ")" + changed[at:]
            result.append(changed)
    for match in NUMBER.finditer(code):
        if code[:match.start()].count('"') % 2 == 0:
            number = match.group(1)
            other = str(int(number) + 1) if number.isdigit() else str(2 * float(number) or 1.0)
            result.append(line[:match.start()] + other + line[match.end():])
    if STATEMENT.match(code.rstrip()) and "(" not in code.split("=")[0]:
        result.append("")
    return result


def mutants(area: str, count: int, seed: int) -> list[Mutant]:
    files = sorted(f for f in (SOURCE / area).rglob("*.cpp") if "engines" not in f.parts)
    every = [Mutant(f, i, line, new) for f in files for i, line in enumerate(f.read_text().split("\n"))
             for new in changes_of(line)]
    # Lines first, so that a line with many operators is not drawn more often.
    chooser = random.Random(seed)
    by_line: dict[tuple, list[Mutant]] = {}
    for mutant in every:
        by_line.setdefault((mutant.file, mutant.line), []).append(mutant)
    lines = sorted(by_line)
    return [chooser.choice(by_line[line]) for line in chooser.sample(lines, min(count, len(lines)))]


def programs_of(build: pathlib.Path, file: pathlib.Path) -> list[pathlib.Path]:
    relative = str(file.relative_to(SOURCE))
    folders = next(folders for prefix, folders in TESTS if relative.startswith(prefix + "/"))
    result = []
    for folder in folders:
        here = build / "tests" / folder
        tests = (here / "CTestTestfile.cmake").read_text()
        # Those whose tests are registered one by one, and those whose are together: tests/CMakeLists.txt.
        names = re.findall(r'/([^/"]+)\[\d+\]_include\.cmake"', tests)
        names += re.findall(r'/([^/"]+)" "--gtest_filter=', tests)
        result += [here / name for name in sorted(set(names))]
    return [p for p in result if p.exists()]


def run(command: list, seconds: int) -> bool:
    try:
        return subprocess.run(command, cwd=SOURCE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              timeout=seconds, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def judge(mutant: Mutant, build: pathlib.Path, suite: bool) -> str:
    """Does not build, killed by NAME, killed by goldens, or survived."""
    programs = programs_of(build, mutant.file)
    targets = [str(p.relative_to(build)) for p in programs] + (["substep"] if suite else [])
    if not run(["ninja", "-C", build, *targets], 3600):
        return "does not build"
    for program in programs:
        # What is measured by the whole of a suite takes minutes, and is the goldens' part here.
        if not run([program, "--gtest_brief=1"], 300):
            return f"killed by {program.name}"
    if suite and not run([build / "substep", "check", "--output", build / "mutation"], 1800):
        return "killed by goldens"
    return "survived"


def judged_equivalent() -> dict[tuple[str, str, str], str]:
    """Lines FILE | OLD | NEW | REASON."""
    file = pathlib.Path(__file__).with_name("equivalent.txt")
    lines = file.read_text().splitlines() if file.exists() else []
    parts = [[part.strip() for part in line.split(" | ")] for line in lines if line and not line.startswith("#")]
    return {(part[0], part[1], part[2]): part[3] for part in parts}


def report(results: list[tuple[Mutant, str]]) -> str:
    equivalent = judged_equivalent()
    areas: dict[str, dict[str, int]] = {}
    survivors = []
    for mutant, verdict in results:
        if verdict == "does not build":
            continue
        counts = areas.setdefault(mutant.file.relative_to(SOURCE).parts[0],
                                  dict.fromkeys(("tests", "goldens", "equivalent", "survived"), 0))
        if verdict == "survived":
            reason = equivalent.get(mutant.key())
            verdict = "equivalent" if reason else "survived"
            survivors.append(f"- {mutant}{f': equivalent, {reason}' if reason else ''}")
        kind = "goldens" if verdict.endswith("goldens") else verdict if verdict in counts else "tests"
        counts[kind] += 1
    text = "| area | changes | killed by tests | by goldens alone | equivalent | survived |\n|---|---|---|---|---|---|\n"
    for area, counts in sorted(areas.items()):
        total = sum(counts.values())
        live = total - counts["equivalent"]
        share = 100 * counts["tests"] / live if live else 100
        text += (f"| {area} | {total} | {counts['tests']} ({share:.0f} %) | {counts['goldens']} | "
                 f"{counts['equivalent']} | {counts['survived']} |\n")
    return text + ("\n" + "\n".join(survivors) + "\n" if survivors else "")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=SOURCE / "build")
    parser.add_argument("--area", default="sim", help="a folder of sources: sim, sim/geometry, golden, render, …")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--no-goldens", action="store_true", help="do not run substep check on survivors")
    parser.add_argument("--list", action="store_true", help="only say what would be changed")
    arguments = parser.parse_args()
    chosen = mutants(arguments.area, arguments.count, arguments.seed)
    if arguments.list:
        print("\n".join(str(mutant) for mutant in chosen))
        return 0
    results = []
    for mutant in chosen:
        original = mutant.file.read_text()
        lines = original.split("\n")
        lines[mutant.line] = mutant.new
        try:
            mutant.file.write_text("\n".join(lines))
            verdict = judge(mutant, arguments.build.resolve(), not arguments.no_goldens)
        finally:
            mutant.file.write_text(original)
        results.append((mutant, verdict))
        print(f"{mutant}: {verdict}", file=sys.stderr, flush=True)
    print(report(results))
    return 0


if __name__ == "__main__":
    sys.exit(main())
