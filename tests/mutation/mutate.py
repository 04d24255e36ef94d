#!/usr/bin/env python3
"""Mutation test: changes one operator, constant, sign, condition, boundary or statement of a random line, recompiles that
file, then relinks and runs one test program after another until one fails, beginning with those that fail most often for
their time. If all pass, runs `substep check` with the changed program, unless --no-goldens.

    tests/mutation/mutate.py --area sim --count 20 --seed 1
    tests/mutation/mutate.py --change 'sim/direct/mlcp.cpp | i >= 0 | i > 0'   # this line
    tests/mutation/mutate.py --table                                            # the table of all results

Leaves sources and build unchanged, except for the files of MEASURED_FIRST, which CTest rewrites. Runs everything at the
lowest priority. --results holds the verdicts, so that a stopped run continues; equal lines of a file share a verdict. Prints a
Markdown table by area and the survivors. `equivalent.txt` holds the changes that nothing can show, with the reason.
"""

import argparse
import dataclasses
import datetime
import json
import os
import pathlib
import random
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile

TREE = pathlib.Path(__file__).resolve().parents[2]
# Tests of each folder: the first fitting prefix counts.
TESTS = (("sim/geometry", ("geometry", "sim")), ("sim/loading", ("scene",)), ("sim/log", ("log", "execution", "program")),
         ("sim/execution", ("execution", "program")), ("sim/measure", ("measure", "sim")),
         ("sim/study", ("study", "report", "program")), ("sim/commands", ("program",)),
         ("sim", ("sim", "geometry", "measure", "scene")), ("golden/commands", ("golden", "program")),
         ("golden", ("golden",)), ("render/report", ("report",)), ("render", ("render", "program")))
# Test scripts of each folder, called with the program and the source folder.
SCRIPTS = {"golden": ("adoption_test.py",)}
# Left out: it compares goldens, as the final `substep check` does.
GOLDENS = ("golden_test",)
# MEASURED_FIRST: the command and its output that a test reads. OF_PAGES: tests that only compare a page, left out.
MEASURED_FIRST = {"claims_report_test": ("report claims", ("claims.md",))}
OF_PAGES = {"claims_report_test": "ClaimsReport.PageHasEachLine"}
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
                    continue  # the condition continues in the next line
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


def mutant_of(change: str) -> Mutant:
    """Returns the mutant that FILE | PART OF ONE LINE | WHAT IT BECOMES describes."""
    file, old, new = change.split(" | ")
    lines = (TREE / file).read_text().split("\n")
    found = [i for i, line in enumerate(lines) if old in line]
    if len(found) != 1:
        sys.exit(f"{file}: {len(found)} lines have '{old}'")
    return Mutant(file, found[0], lines[found[0]], lines[found[0]].replace(old, new))


def run(command: list, seconds: float, folder: pathlib.Path) -> bool:
    """Returns whether the command succeeded within `seconds` of processor time. Kills it after 60 + 3 `seconds` s."""
    limit = round(seconds)

    def begin() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a shell's background ignores it, and a test sends it
    try:
        return subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              stdin=subprocess.DEVNULL, timeout=60 + 3 * seconds, check=False, preexec_fn=begin).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def children_time() -> float:
    times = os.times()
    return times.children_user + times.children_system


class Workshop:
    """Judges mutants in a build of its own, source by source. Replaces the program there while a test runs it."""

    def __init__(self, build: pathlib.Path, results: pathlib.Path):
        self.build, self.results_file = build, results
        known = json.loads(results.read_text()) if results.exists() else {}
        self.verdicts: dict[str, str] = known.get("verdicts", {})
        self.seconds: dict[str, float] = known.get("seconds", {})
        self.commands: dict[str, list[str]] = {}

    def open(self, files: set[str]) -> None:
        subprocess.run(["cmake", "-S", TREE, "-B", self.build, "-G", "Ninja", "-D", "CMAKE_BUILD_TYPE=Release",
                        "-D", "SUBSTEP_SOURCES_AT_ONCE=OFF"], check=True, stdout=subprocess.DEVNULL)
        for command in json.loads((self.build / "compile_commands.json").read_text()):
            self.commands[command["file"]] = shlex.split(command["command"])
        targets = sorted({program.name for file in files for program in self.programs_of(file) if program.suffix != ".py"})
        subprocess.run(["ninja", "-C", self.build, "substep", "make_scenes", *targets], check=True, stdout=sys.stderr)
        # Tests of published results read pyramids here, which CTest makes before.
        made = TREE / "build/scenes/made"
        made.mkdir(parents=True, exist_ok=True)
        subprocess.run([self.build / "scenes/make_scenes", made], check=True, stdout=subprocess.DEVNULL)

    def programs_of(self, file: str) -> list[pathlib.Path]:
        folders = next(folders for prefix, folders in TESTS if (file + "/").startswith(prefix + "/"))
        result = []
        for folder in folders:
            text = (TREE / "tests" / folder / "CMakeLists.txt").read_text()
            result += [self.build / "tests" / folder / name for name in re.findall(r"substep_test\((\w+)", text)]
            result += [TREE / "tests" / folder / name for name in SCRIPTS.get(folder, ())]
        return [program for program in result if program.name not in GOLDENS]

    def save(self) -> None:
        new = self.results_file.with_suffix(".new")
        new.write_text(json.dumps({"verdicts": self.verdicts, "seconds": self.seconds}, indent=1, ensure_ascii=False))
        new.replace(self.results_file)

    def ninja_output(self, *words: str) -> str:
        return subprocess.run(["ninja", "-C", self.build, "-t", *words], check=True, capture_output=True, text=True).stdout

    def library_of(self, object_file: str) -> str:
        """Returns the library or program that an object belongs to."""
        after = [line.strip() for line in self.ninja_output("query", object_file).split("outputs:")[1].splitlines()]
        return next(target for target in after if target.endswith(".a") or target == "substep")

    def link(self, target: str, object_file: str, library: str, mutant: pathlib.Path, out: pathlib.Path) -> bool | None:
        """Links a program with the changed object before its library. Returns None where it does not use the object."""
        command = self.ninja_output("commands", "-s", target).strip().splitlines()[-1].removeprefix(": && ").split(" && ")[0]
        words = shlex.split(command)
        if object_file in words:
            words[words.index(object_file)] = str(mutant)
        elif library not in words:
            return None
        else:
            words.insert(words.index("-o") + 2, str(mutant))
        words[words.index("-o") + 1] = str(out)
        return run(words, 600, self.build)

    def judge(self, mutant: Mutant, suite: bool) -> str:
        """Returns "does not build", "killed by NAME", "killed by goldens", "survived" or, without goldens, "survived the tests"."""
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            lines = (TREE / mutant.file).read_text().split("\n")
            lines[mutant.line] = mutant.new
            (here / "mutant.cpp").write_text("\n".join(lines))
            command = list(self.commands[str(TREE / mutant.file)])
            object_file = command[command.index("-o") + 1]
            command[command.index("-o") + 1] = str(here / "mutant.o")
            command[command.index("-c") + 1] = str(here / "mutant.cpp")
            # Ignore warnings of unused code, which a mutation can cause.
            command.insert(command.index("-c"), "-Wno-error")
            if not run(command, 600, self.build):
                return "does not build"
            return self.verdict_of_tests(mutant, object_file, here, suite)

    def time_of(self, program: pathlib.Path) -> float:
        """Times a test on unchanged sources, where it must pass. A multiple of this time bounds the mutated test."""
        if program.name not in self.seconds:
            start = children_time()
            if not run(self.call_of(program), 3600, self.build):
                sys.exit(f"{program} fails as the sources are")
            self.seconds[program.name] = children_time() - start
            self.save()
        return self.seconds[program.name]

    def call_of(self, program: pathlib.Path) -> list:
        if program.suffix == ".py":
            return ["/usr/bin/python3", program, self.build / "substep", TREE]
        call = [program, "--gtest_brief=1", "--gtest_fail_fast"]
        if program.name in OF_PAGES:
            call.append("--gtest_filter=-" + OF_PAGES[program.name])
        if program.name in MEASURED_FIRST:
            what, files = MEASURED_FIRST[program.name]
            measures = [self.build / "substep", *what.split(), "--scenes", TREE / "scenes", "--output", *(self.build / "tests" / f for f in files)]
            return ["sh", "-c", " && ".join(shlex.join(map(str, words)) for words in (measures, call))]
        return call

    def verdict_of_tests(self, mutant: Mutant, object_file: str, here: pathlib.Path, suite: bool) -> str:
        library = self.library_of(object_file)
        # Begin with the programs that kill most mutants in the least time.
        kills = [verdict.removeprefix("killed by ") for key, verdict in self.verdicts.items()
                 if key.split(" | ")[0].rsplit("/", 1)[0] == mutant.file.rsplit("/", 1)[0]]
        programs = sorted(self.programs_of(mutant.file),
                          key=lambda p: self.seconds.get(p.name, 1.0) / (0.2 + kills.count(p.name)))
        for program in programs:
            limit = 10 + 3 * self.time_of(program)
            calls_the_program = (program.name == "program_tests" or program.name in MEASURED_FIRST or
                                 program.suffix == ".py")
            called = self.build / "substep" if calls_the_program else program
            linked = self.link(str(called.relative_to(self.build)), object_file, library, here / "mutant.o", here / "linked")
            if linked is None:
                continue
            if not linked:
                return "does not build"
            if called == program:
                passed = run([here / "linked", "--gtest_brief=1", "--gtest_fail_fast"], limit, self.build)
            else:
                passed = self.with_program(here, self.call_of(program), limit)
            if not passed:
                return f"killed by {program.name}"
        if not suite:
            return "survived the tests"
        if not self.link("substep", object_file, library, here / "mutant.o", here / "linked"):
            return "does not build"
        check = [here / "linked", "check", "--suite", TREE / "golden", "--output", here / "check"]
        return "survived" if run(check, 3600, self.build) else "killed by goldens"

    def with_program(self, here: pathlib.Path, command: list, limit: float) -> bool:
        """Runs the tests that call the program, with the mutated program in its place."""
        program = self.build / "substep"
        shutil.copy2(program, str(program) + ".kept")
        try:
            os.replace(shutil.copy2(here / "linked", str(program) + ".changed"), program)
            return run(command, limit, self.build)
        finally:
            os.replace(str(program) + ".kept", program)


def judged_equivalent() -> dict[str, str]:
    """Returns the reason for each FILE | OLD | NEW. Ends the program where the file no longer has the line OLD."""
    file = pathlib.Path(__file__).with_name("equivalent.txt")
    lines = file.read_text().splitlines()
    parts = [[part.strip() for part in line.split(" | ")] for line in lines if line and not line.startswith("#")]
    for name, old, *_ in parts:
        if old not in map(str.strip, (TREE / name).read_text().splitlines()):
            sys.exit(f"{file}: {name} no longer has the line '{old}': mend or remove the entry")
    return {" | ".join(part[:3]): part[3] for part in parts}


def table(verdicts: dict[str, str]) -> str:
    equivalent = judged_equivalent()
    areas: dict[str, dict[str, int]] = {}
    survivors = []
    for key, verdict in verdicts.items():
        if verdict == "does not build":
            continue
        counts = areas.setdefault(key.split("/")[0], dict.fromkeys(("tests", "goldens", "equivalent", "survived", "not run"), 0))
        if verdict.startswith("survived"):
            reason = equivalent.get(key)
            counts["not run"] += 1 if verdict == "survived the tests" and not reason else 0
            file, old, new = key.split(" | ")
            survivors.append(f"- {file}: `{old}` → `{new}`: {f'equivalent, {reason}' if reason else verdict}")
            verdict = "equivalent" if reason else "survived"
        kind = "goldens" if verdict.endswith("goldens") else verdict if verdict in counts else "tests"
        counts[kind] += 1
    text = "| area | changes | killed by tests | by goldens alone | equivalent | survived |\n|---|---|---|---|---|---|\n"
    for area, counts in sorted(areas.items()):
        total = sum(counts.values()) - counts["not run"]
        goldens = "not run" if counts["not run"] else counts["goldens"]
        live = total - counts["equivalent"]
        percent = 100 * counts["tests"] / live if live else 100
        text += (f"| {area} | {total} | {counts['tests']} ({percent:.0f} %) | {goldens} | "
                 f"{counts['equivalent']} | {counts['survived']} |\n")
    return (f"Measured {datetime.date.today().isoformat()}.\n\n" + text +
            ("\n" + "\n".join(survivors) + "\n" if survivors else ""))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=TREE / "out/mutation")
    parser.add_argument("--results", type=pathlib.Path, default=TREE / "out/mutation/results.json")
    parser.add_argument("--area", default=["sim"], nargs="+", help="folders or files: sim, sim/geometry, golden, …")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--change", action="append", help="FILE | PART OF ONE LINE | WHAT IT BECOMES; not kept")
    parser.add_argument("--no-goldens", action="store_true", help="do not run substep check on survivors")
    parser.add_argument("--table", action="store_true", help="only print the table of what was judged")
    arguments = parser.parse_args()
    chosen = ([mutant_of(change) for change in arguments.change or []] or
              mutants(arguments.area, arguments.count, arguments.seed))
    arguments.results.parent.mkdir(parents=True, exist_ok=True)
    workshop = Workshop(arguments.build.resolve(), arguments.results.resolve())
    if arguments.table:
        print(table(workshop.verdicts))
        return 0
    judged_equivalent()  # ends here, not after all mutants, where a line is gone
    os.nice(19)
    workshop.open({mutant.file for mutant in chosen})
    verdicts = {}
    for mutant in chosen:
        verdict = workshop.verdicts.get(mutant.key()) if not arguments.change else None
        if not verdict:
            verdict = workshop.judge(mutant, not arguments.no_goldens)
            print(f"{mutant}: {verdict}", file=sys.stderr, flush=True)
        verdicts[mutant.key()] = verdict
        if not arguments.change:
            workshop.verdicts[mutant.key()] = verdict
            workshop.save()
    print(table(verdicts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
