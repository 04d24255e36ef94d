#!/usr/bin/env python3
"""Wrong lines that the tests must notice: changes one operator, constant, sign, condition, boundary or statement at a
seeded random line, compiles that one file, links the one library that holds it, runs the area's tests without goldens,
and where they pass `substep check`.

    tests/mutation/mutate.py --area sim --count 20 --seed 1
    tests/mutation/mutate.py --change 'sim/direct/mlcp.cpp | i >= 0 | i > 0'   # this one, by a part of its line
    tests/mutation/mutate.py --table                                            # of all that were judged

Works in a copy of the sources with a build of its own (--work), at the lowest priority. What was judged stands in
results.json there, so that a run that was stopped goes on. Prints a Markdown table by area and the survivors.
`equivalent.txt` beside this file holds those that were judged to change nothing that can be seen, with the reason.
"""

import argparse
import dataclasses
import datetime
import json
import os
import pathlib
import random
import re
import shlex
import shutil
import subprocess
import sys
import time

TREE = pathlib.Path(__file__).resolve().parents[2]
# A folder's tests: those of the first prefix that fits.
TESTS = (("sim/geometry", ("geometry", "sim")), ("sim/loading", ("scene",)), ("sim/log", ("log",)),
         ("sim/execution", ("execution", "program")), ("sim/measure", ("measure", "sim")),
         ("sim/study", ("study", "report", "program")), ("sim/commands", ("program",)),
         ("sim", ("sim", "geometry", "measure", "scene")), ("golden/commands", ("golden", "program")),
         ("golden", ("golden",)), ("render/report", ("report",)), ("render", ("render", "program")))
# The goldens themselves, and figures that stand in README: they say that something is other, not what is wrong.
GOLDENS = ("golden_test", "claims_report_test")
SWAPS = ((r"(?<=[\w\)\]]) \+ ", " - "), (r"(?<=[\w\)\]]) - ", " + "), (r" \* ", " / "), (r" / ", " * "),
         (r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "),
         (r" && ", " || "), (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "), (r"\btrue\b", "false"),
         (r"\bfalse\b", "true"), (r"std::max\(", "std::min("), (r"std::min\(", "std::max("),
         (r"\bcontinue;", "break;"), (r"= -(?=\w)", "= "), (r"\(-(?=\w)", "("), (r"\bif \(", "if (!("))
NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?![\w.])")
STATEMENT = re.compile(r"^\s+(?!return|const|auto|throw|using|break|continue|int |double |std::)[\w.\->\[\]()]+.*[;]$")
DECLARATION = re.compile(r"^\s+[A-Z][\w:<>, ]*[&*]? \w+(\{.*\}| = .*)?;")


@dataclasses.dataclass(frozen=True)
class Mutant:
    file: str
    line: int
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line + 1}: `{self.old.strip()}` → `{self.new.strip()}`"

    def key(self) -> str:
        return f"{self.file} | {self.old.strip()} | {self.new.strip()}"


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
    code = code.rstrip()
    if STATEMENT.match(code) and not DECLARATION.match(code) and code.count("(") == code.count(")"):
        result.append("")
    return result


def mutants(areas: list[str], count: int, seed: int) -> list[Mutant]:
    files = sorted(f for area in areas for f in ([TREE / area] if area.endswith(".cpp") else (TREE / area).rglob("*.cpp"))
                   if "engines" not in f.parts)
    every = [Mutant(str(f.relative_to(TREE)), i, line, new) for f in files
             for i, line in enumerate(f.read_text().split("\n")) for new in changes_of(line)]
    # Lines first, so that a line with many operators is not drawn more often.
    chooser = random.Random(seed)
    by_line: dict[tuple, list[Mutant]] = {}
    for mutant in every:
        by_line.setdefault((mutant.file, mutant.line), []).append(mutant)
    lines = sorted(by_line)
    return [chooser.choice(by_line[line]) for line in chooser.sample(lines, min(count, len(lines)))]


def named(change: str) -> Mutant:
    """FILE | PART OF ONE LINE | WHAT IT BECOMES."""
    file, old, new = change.split(" | ")
    lines = (TREE / file).read_text().split("\n")
    found = [i for i, line in enumerate(lines) if old in line]
    if len(found) != 1:
        sys.exit(f"{file}: {len(found)} lines have '{old}'")
    return Mutant(file, found[0], lines[found[0]], lines[found[0]].replace(old, new))


def run(command: list, seconds: float, folder: pathlib.Path) -> bool:
    try:
        return subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              stdin=subprocess.DEVNULL, timeout=seconds, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False


class Workshop:
    """A copy of the sources, built with one shared library a layer: a change is one compilation and one link."""

    def __init__(self, work: pathlib.Path):
        self.source = work / "source"
        self.build = work / "build"
        self.results_file = work / "results.json"
        known = json.loads(self.results_file.read_text()) if self.results_file.exists() else {}
        self.verdicts: dict[str, str] = known.get("verdicts", {})
        self.seconds: dict[str, float] = known.get("seconds", {})
        self.ready: set[str] = set()

    def open(self) -> None:
        self.copy_sources()
        if not (self.build / "build.ninja").exists():
            # A shared library's own define, given to all, for headers parsed once serve several.
            flags = "-O2 -DNDEBUG -Dsubstep_core_EXPORTS -Dsubstep_sim_commands_EXPORTS"
            self.call(["cmake", "-S", self.source, "-B", self.build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=None",
                       f"-DCMAKE_CXX_FLAGS={flags}", "-DSUBSTEP_LIBRARIES=SHARED", "-DSUBSTEP_BENCHMARKS=OFF",
                       "-DCMAKE_POSITION_INDEPENDENT_CODE=ON", "-DCMAKE_COMPILE_WARNING_AS_ERROR=OFF"])
        commands = json.loads((self.build / "compile_commands.json").read_text())
        self.commands = {c["file"]: shlex.split(c["command"]) for c in commands}

    def call(self, command: list) -> None:
        subprocess.run(command, check=True, stdout=sys.stderr)

    def copy_sources(self) -> None:
        """Those under version control, where they differ: what did not change is not built again."""
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=TREE, check=True, capture_output=True, text=True).stdout
        for name in filter(None, listed.split("\0")):
            here, there = TREE / name, self.source / name
            if not here.is_file() or (there.exists() and there.read_bytes() == here.read_bytes()):
                continue
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(here, there)

    def programs_of(self, file: str) -> list[pathlib.Path]:
        folders = next(folders for prefix, folders in TESTS if (file + "/").startswith(prefix + "/"))
        result = []
        for folder in folders:
            text = (self.source / "tests" / folder / "CMakeLists.txt").read_text()
            for words in re.findall(r"foreach\(name ([^)]*)\)\s*substep_test\(\$\{name\}_test", text):
                result += [self.build / "tests" / folder / f"{word}_test" for word in words.split()]
            result += [self.build / "tests" / folder / name for name in re.findall(r"substep_test\((\w+)", text)]
        return [program for program in result if program.name not in GOLDENS]

    def keep(self) -> None:
        new = self.results_file.with_suffix(".new")
        new.write_text(json.dumps({"verdicts": self.verdicts, "seconds": self.seconds}, indent=1, ensure_ascii=False))
        new.replace(self.results_file)

    def test_command(self, program: pathlib.Path) -> list:
        return [program, "--gtest_brief=1", "--gtest_fail_fast"]

    def prepare(self, programs: list[pathlib.Path], suite: bool) -> None:
        """Builds them. All must pass as the sources are; how long each takes bounds what a change may make of it."""
        new = [program for program in programs if program.name not in self.ready]
        if new or (suite and "substep" not in self.ready):
            self.call(["ninja", "-C", self.build, *(["substep"] if suite else []), *(program.name for program in new)])
            self.ready |= {program.name for program in new} | ({"substep"} if suite else set())
        for program in new:
            if program.name in self.seconds:
                continue
            start = time.monotonic()
            if not run(self.test_command(program), 3600, self.build):
                sys.exit(f"{program} fails as the sources are")
            self.seconds[program.name] = time.monotonic() - start
            self.keep()

    def library_of(self, thing: str) -> tuple[pathlib.Path, list[str]]:
        """The library or program that an object goes into, and its link command."""
        text = subprocess.run(["ninja", "-C", self.build, "-t", "query", thing], check=True, capture_output=True,
                              text=True).stdout
        after = [line.strip() for line in text.split("outputs:")[1].splitlines() if line.strip()]
        target = next(t for t in after if t.endswith(".so") or t == "substep")
        commands = subprocess.run(["ninja", "-C", self.build, "-t", "commands", "-s", target], check=True,
                                  capture_output=True, text=True).stdout
        return self.build / target, commands.strip().splitlines()[-1:]

    def judge(self, mutant: Mutant, suite: bool) -> str:
        """Does not build, killed by NAME, killed by goldens, or survived."""
        self.prepare(self.programs_of(mutant.file), suite)
        source = self.source / mutant.file
        compile_command = self.commands[str(source)]
        thing = compile_command[compile_command.index("-o") + 1]
        library, link = self.library_of(thing)
        kept = [source, self.build / thing, library]
        for file in kept:
            shutil.copy2(file, str(file) + ".kept")
        try:
            lines = source.read_text().split("\n")
            if lines[mutant.line] != mutant.old:
                sys.exit(f"{source} is not as it was read")
            lines[mutant.line] = mutant.new
            source.write_text("\n".join(lines))
            if not run(compile_command, 600, self.build) or not run(["sh", "-c", link[0]], 600, self.build):
                return "does not build"
            return self.tried(mutant, suite)
        finally:
            for file in kept:
                os.replace(str(file) + ".kept", file)

    def tried(self, mutant: Mutant, suite: bool) -> str:
        # First those that kill much in little time.
        kills = [verdict.removeprefix("killed by ") for key, verdict in self.verdicts.items()
                 if key.split(" | ")[0].rsplit("/", 1)[0] == mutant.file.rsplit("/", 1)[0]]
        programs = sorted(self.programs_of(mutant.file),
                          key=lambda p: self.seconds[p.name] / (0.2 + kills.count(p.name)))
        for program in programs:
            if not run(self.test_command(program), 10 + 5 * self.seconds[program.name], self.build):
                return f"killed by {program.name}"
        if suite and not run([self.build / "substep", "check", "--suite", self.source / "golden", "--output",
                              self.build / "check"], 3600, self.build):
            return "killed by goldens"
        return "survived" if suite else "survived the tests"


def judged_equivalent() -> dict[str, str]:
    """Lines FILE | OLD | NEW | REASON."""
    file = pathlib.Path(__file__).with_name("equivalent.txt")
    lines = file.read_text().splitlines() if file.exists() else []
    parts = [[part.strip() for part in line.split(" | ")] for line in lines if line and not line.startswith("#")]
    return {" | ".join(part[:3]): part[3] for part in parts}


def table(verdicts: dict[str, str]) -> str:
    equivalent = judged_equivalent()
    areas: dict[str, dict[str, int]] = {}
    survivors = []
    for key, verdict in verdicts.items():
        if verdict == "does not build":
            continue
        counts = areas.setdefault(key.split("/")[0], dict.fromkeys(("tests", "goldens", "equivalent", "survived"), 0))
        if verdict.startswith("survived"):
            reason = equivalent.get(key)
            file, old, new = key.split(" | ")
            survivors.append(f"- {file}: `{old}` → `{new}`: {f'equivalent, {reason}' if reason else verdict}")
            verdict = "equivalent" if reason else "survived"
        kind = "goldens" if verdict.endswith("goldens") else verdict if verdict in counts else "tests"
        counts[kind] += 1
    text = "| area | changes | killed by tests | by goldens alone | equivalent | survived |\n|---|---|---|---|---|---|\n"
    for area, counts in sorted(areas.items()):
        total = sum(counts.values())
        live = total - counts["equivalent"]
        share = 100 * counts["tests"] / live if live else 100
        text += (f"| {area} | {total} | {counts['tests']} ({share:.0f} %) | {counts['goldens']} | "
                 f"{counts['equivalent']} | {counts['survived']} |\n")
    return (f"Measured {datetime.date.today().isoformat()}.\n\n" + text +
            ("\n" + "\n".join(survivors) + "\n" if survivors else ""))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, default=TREE / "out/mutation", help="copy, build and results")
    parser.add_argument("--area", default=["sim"], nargs="+", help="folders or files: sim, sim/geometry, golden, …")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--change", action="append", help="FILE | PART OF ONE LINE | WHAT IT BECOMES; not kept")
    parser.add_argument("--again", action="store_true", help="judge survivors anew")
    parser.add_argument("--no-goldens", action="store_true", help="do not run substep check on survivors")
    parser.add_argument("--list", action="store_true", help="only say what would be changed")
    parser.add_argument("--table", action="store_true", help="only print the table of what was judged")
    arguments = parser.parse_args()
    chosen = [named(change) for change in arguments.change or []] or mutants(arguments.area, arguments.count,
                                                                             arguments.seed)
    if arguments.list:
        print("\n".join(str(mutant) for mutant in chosen))
        return 0
    work = arguments.work.resolve()
    if arguments.table:
        print(table(Workshop(work).verdicts))
        return 0
    os.nice(19)
    workshop = Workshop(work)
    workshop.open()
    verdicts = {}
    for mutant in chosen:
        verdict = workshop.verdicts.get(mutant.key()) if not arguments.change else None
        if not verdict or (arguments.again and verdict.startswith("survived")):
            verdict = workshop.judge(mutant, not arguments.no_goldens)
            print(f"{mutant}: {verdict}", file=sys.stderr, flush=True)
        verdicts[mutant.key()] = verdict
        if not arguments.change:
            workshop.verdicts[mutant.key()] = verdict
            workshop.keep()
    print(table(verdicts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
