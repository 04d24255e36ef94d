#!/usr/bin/env python3
"""Tests commands under faults: a limit on file sizes, a full disk, a read-only folder, a closed pipe, little memory, no ffmpeg
or one that dies, SIGINT, SIGTERM and SIGKILL at seeded moments.

    tests/faults/faults.py --program build/substep --moments 50 --sizes 5 --seed 1

After each fault every file must be as before or as an undisturbed run makes it, no process and (except after SIGKILL) no
partial file may remain, and the exit code and one line must say what happened. The command then runs undisturbed and must
leave what it leaves in a fresh folder. Prints a Markdown table; the code is 1 where anything is wrong. Without root's right
to mount, the full disk is left out and the report says so.
"""

import argparse
import dataclasses
import datetime
import hashlib
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SWEEP = """horizon = 0.1
[[grid]]
scenes = ["pendulum.gltf"]
algorithms = ["a1", "a3", "a5"]
substeps = [1, 4]
"""
SUITE = """[defaults]
frames = 20
images = [20]
size = [96, 54]
algorithms = ["a3", "a5"]
[[case]]
scene = "../box_stack.gltf"
[[case]]
scene = "../pendulum.gltf"
"""
FILM = "video pendulum.gltf --duration 0.4 --no-reference --panel a1 --size 320x180 --hold 0"
# Files that differ from run to run: they hold times, a check's results, or a lock.
VOLATILE = re.compile(r"times\.csv|\.lock|results\.json|junit\.xml|report\.html|report\.md|.*-h1.*\.json")
# The commands, and their exit codes without a fault.
COMMANDS = {
    "run": ("run pendulum.gltf --duration 60 --output run.txt --csv run.csv", 0),
    "video": (FILM + " --output film.mp4 --poster poster.png", 0),
    "frames": (FILM + " --output frame.png", 0),
    "sweep": ("sweep sweep.toml --output sweep", 0),
    "report": ("report sweep.toml --output report", 0),
    "check": ("check", 1),  # Bench.prepare() changes a scene
    "approve": ("approve --failed --reason other", 0),
    "export": ("export pendulum.gltf --duration 20 --output run.glb", 0),
    "reference": ("measure pendulum.gltf --duration 5 --reference reference.csv", 0),
    "measure": ("measure pendulum.gltf --duration 1 --output measured.txt", 0),
}


@dataclasses.dataclass
class Ending:
    code: int
    messages: list[str]  # lines on standard error
    seconds: float
    handles_signal: bool = True  # before it does, the program has no message to print and no file to remove


def snapshot(folder: pathlib.Path) -> dict[str, str]:
    result = {}
    for file in sorted(folder.rglob("*")):
        if file.is_file() and not file.is_symlink():
            data = file.read_bytes()
            if file.suffix == ".json" and b'"approved"' in data:
                data = re.sub(rb'"date": "[^"]*"', b"", data)
            result[str(file.relative_to(folder))] = hashlib.sha256(data).hexdigest()
    return result


def broken(file: pathlib.Path) -> bool:
    """Returns whether a file is incomplete, where its content may differ from run to run."""
    text = file.read_bytes().decode(errors="replace")
    if file.suffix == ".json":
        try:
            json.loads(text)
        except ValueError:
            return True
    if file.suffix == ".html":
        return not text.rstrip().endswith("</html>")
    if file.suffix == ".xml":
        return not text.rstrip().endswith(">")
    return file.name != ".lock" and text != "" and not text.endswith("\n")


def catches(process: int, number: int) -> bool:
    try:
        status = pathlib.Path(f"/proc/{process}/status").read_text()
    except OSError:
        return True
    return bool(int(re.search(r"SigCgt:\s*([0-9a-f]+)", status)[1], 16) >> (number - 1) & 1)


def processes_in(folder: pathlib.Path) -> list[str]:
    found = []
    for process in pathlib.Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            if os.readlink(process / "cwd").startswith(str(folder)) and (process / "cmdline").read_bytes():
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")[:80])
        except OSError:
            pass
    return found


class Bench:
    """A command with its folder before the run and after an undisturbed run."""

    def __init__(self, program: pathlib.Path, name: str, work: pathlib.Path):
        self.program, self.name, self.work = program, name, work
        self.words = COMMANDS[name][0].split()
        self.code = COMMANDS[name][1]
        self.before = work / "before"
        self.before.mkdir(parents=True)
        self.prepare()
        self.old = snapshot(self.before)
        self.after = work / "after"
        shutil.copytree(self.before, self.after)
        undisturbed = self.run(self.after)
        self.seconds = undisturbed.seconds
        if undisturbed.code != self.code:
            sys.exit(f"{name}: code {undisturbed.code} without a fault: {undisturbed.messages}")
        self.new = snapshot(self.after)
        self.made = sum((self.after / f).stat().st_size for f in self.new if f not in self.old)
        self.largest = max((self.after / f).stat().st_size for f in self.new if self.new[f] != self.old.get(f))

    def prepare(self) -> None:
        for scene in ("pendulum", "box_stack"):
            shutil.copy(SOURCE / f"scenes/{scene}.gltf", self.before)
        (self.before / "sweep.toml").write_text(SWEEP)
        if self.name not in ("check", "approve"):
            return
        (self.before / "golden").mkdir()
        (self.before / "golden/suite.toml").write_text(SUITE)
        for command, code in ((["check"], 1), (["approve", "--failed", "--reason", "the first"], 0)):
            if subprocess.run([self.program, *command], cwd=self.before, capture_output=True, check=False).returncode != code:
                sys.exit(f"{self.name}: its goldens could not be made")
        shutil.rmtree(self.before / "out")
        scene = self.before / "pendulum.gltf"
        scene.write_text(scene.read_text().replace('"mass":', '"mass":1', 1))
        if self.name == "approve":
            subprocess.run([self.program, "check"], cwd=self.before, capture_output=True, check=False)

    def run(self, folder: pathlib.Path, moment: float | None = None, number: int = 0, group: bool = False,
            environment: dict | None = None, limits=None, closed: bool = False, user: int | None = None) -> Ending:
        """Runs the command. Sends signal `number` after `moment` seconds if given; `group`: to the process group."""
        out = subprocess.DEVNULL
        if closed:
            reader, out = os.pipe()
            os.close(reader)
        start = time.monotonic()
        with open(self.work / "messages", "wb") as messages:
            process = subprocess.Popen([self.program, *self.words], cwd=folder, stdin=subprocess.DEVNULL, stdout=out,
                                       stderr=messages, start_new_session=True, preexec_fn=limits, user=user,
                                       env={**os.environ, **(environment or {})})
        if closed:
            os.close(out)
        handles_signal = True
        if moment is not None:
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                handles_signal = catches(process.pid, number)
                (os.killpg if group else os.kill)(process.pid, number)
        process.wait(600)
        lines = (self.work / "messages").read_text(errors="replace").splitlines()
        return Ending(process.returncode, lines, time.monotonic() - start, handles_signal)

    def errors_of(self, folder: pathlib.Path, ending: Ending, codes: set[int], killed: bool) -> list[str]:
        wrong = []
        if ending.code not in codes | {self.code}:
            wrong.append(f"code {ending.code}: {' / '.join(ending.messages)[-200:]}")
        errors = [line for line in ending.messages if line.startswith("substep: ") and "note: " not in line and "warning: " not in line]
        loader = len(ending.messages) == 1 and "error while loading shared libraries" in ending.messages[0]
        silent = killed or ending.code in (self.code, -signal.SIGPIPE) or loader
        cases = self.name == "check" and ending.code == self.code  # a case that cannot be checked prints a message of its own
        if len(errors) != (0 if silent else 1) and (ending.handles_signal or errors) and not cases:
            wrong.append(f"code {ending.code} and {len(errors)} lines that say why: {ending.messages}")
        for _ in range(40):
            left = processes_in(folder)
            if not left:
                break
            time.sleep(0.05)
        wrong += [f"left running: {line}" for line in left]
        for path, digest in snapshot(folder).items():
            if re.search(r"(^|/)\.[^/]*\.partial(/|$)", path):
                wrong += [] if killed else [f"left behind: {path}"]
            elif digest in (self.old.get(path), self.new.get(path)):
                pass
            elif VOLATILE.fullmatch(pathlib.Path(path).name):
                wrong += [f"broken: {path}"] if broken(folder / path) else []
            elif path.split("/")[0] != "out":  # others in out/ are used only through results.json
                wrong.append(f"neither old nor whole: {path}")
        return wrong

    def errors_after_rerun(self, folder: pathlib.Path) -> list[str]:
        if self.name == "approve":
            # Accept an approval that was complete; approve the rest otherwise.
            if subprocess.run([self.program, "check"], cwd=folder, capture_output=True, check=False).returncode == 0:
                return self.differs(folder)
        ending = self.run(folder)
        if ending.code != self.code:
            return [f"then, undisturbed: code {ending.code}: {' / '.join(ending.messages)[-200:]}"]
        return self.differs(folder)

    def differs(self, folder: pathlib.Path) -> list[str]:
        now = snapshot(folder)
        wrong = [f"then, undisturbed: left behind: {path}" for path in now if ".partial" in path]
        for path in sorted(set(self.new) | set(now)):
            name = pathlib.Path(path).name
            if ".partial" in path or (VOLATILE.fullmatch(name) and path in now) or path.startswith("out/"):
                continue
            if now.get(path) != self.new.get(path):
                wrong.append(f"then, undisturbed: {path} is not what a fresh run makes")
        return wrong

    def try_fault(self, chooser: random.Random, fault: str) -> tuple[str, list[str]]:
        """Returns 'stopped' or, where the command ended as without the fault, 'done'; and the errors."""
        folder = self.work / "here"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self.before, folder)
        ending, codes, killed = FAULTS[fault](self, folder, chooser)
        wrong = self.errors_of(folder, ending, codes, killed)
        wrong += self.errors_after_rerun(folder) if not wrong else []
        return ("done" if ending.code == self.code else "stopped"), wrong


def size_limit(bench: Bench, folder: pathlib.Path, chooser: random.Random):
    size = chooser.randrange(0, bench.largest + 1)
    return bench.run(folder, limits=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))), {2}, False


def memory_limit(bench: Bench, folder: pathlib.Path, chooser: random.Random):
    size = chooser.randrange(150, 450) << 20
    return (bench.run(folder, limits=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size))), {2, 127}, False)


def full_disk(bench: Bench, folder: pathlib.Path, chooser: random.Random):
    inputs = sum(4096 + (bench.before / f).stat().st_size // 4096 * 4096 for f in bench.old)
    size = inputs + 65536 + chooser.randrange(0, bench.made + 1)
    shutil.rmtree(folder)
    disk = bench.work / "disk"
    disk.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", disk], check=True)
    try:
        shutil.copytree(bench.before, disk / "here")
        ending = bench.run(disk / "here")
        shutil.copytree(disk / "here", folder)
    finally:
        subprocess.run(["umount", disk], check=True)
    return ending, {2}, False


def read_only(bench: Bench, folder: pathlib.Path, _chooser: random.Random):
    """Runs as user `nobody`, to whom the folder does not belong, since root writes everywhere."""
    folders = [folder, *(p for p in folder.rglob("*") if p.is_dir())]
    for each in folders:
        each.chmod(0o555)
    ending = bench.run(folder, user=65534 if os.geteuid() == 0 else None)
    for each in folders:
        each.chmod(0o755)
    return ending, {2}, False


def closed_pipe(bench: Bench, folder: pathlib.Path, _chooser: random.Random):
    return bench.run(folder, closed=True), {2, -signal.SIGPIPE}, False


def with_ffmpeg(bench: Bench, folder: pathlib.Path, script: str):
    programs = bench.work / "bin"
    shutil.rmtree(programs, ignore_errors=True)
    programs.mkdir()
    if script:
        (programs / "ffmpeg").write_text("#!/bin/sh\n" + script)
        (programs / "ffmpeg").chmod(0o755)
    return bench.run(folder, environment={"PATH": f"{programs}:{os.environ['PATH']}" if script else str(programs)}), {2}, False


def no_ffmpeg(bench: Bench, folder: pathlib.Path, _chooser: random.Random):
    return with_ffmpeg(bench, folder, "")


def dying_ffmpeg(bench: Bench, folder: pathlib.Path, chooser: random.Random):
    moment = chooser.uniform(0, bench.seconds)
    return with_ffmpeg(bench, folder, f'exec timeout -s KILL {moment:.3f} {shutil.which("ffmpeg")} "$@"\n')


def signalled(number: int):
    def fault(bench: Bench, folder: pathlib.Path, chooser: random.Random):
        group = number == signal.SIGINT and chooser.random() < 0.5
        ending = bench.run(folder, chooser.uniform(0, bench.seconds), number, group)
        return ending, {-number}, number == signal.SIGKILL
    return fault


FAULTS = {"files' size limited": size_limit, "full disk": full_disk, "read-only folder": read_only,
          "closed pipe": closed_pipe, "memory limited": memory_limit, "no ffmpeg": no_ffmpeg, "ffmpeg dies": dying_ffmpeg,
          "SIGINT": signalled(signal.SIGINT), "SIGTERM": signalled(signal.SIGTERM), "SIGKILL": signalled(signal.SIGKILL)}
# Faults without a random size or moment: one try is enough.
ONCE = ("read-only folder", "closed pipe", "no ffmpeg")


def can_mount(folder: pathlib.Path) -> bool:
    mounted = subprocess.run(["mount", "-t", "tmpfs", "tmpfs", folder], capture_output=True, check=False).returncode == 0
    if mounted:
        subprocess.run(["umount", folder], check=True)
    return mounted


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=SOURCE / "build/substep")
    parser.add_argument("--moments", type=int, default=50, help="moments at which one of the three signals comes")
    parser.add_argument("--sizes", type=int, default=5, help="tries of each other fault that has a size or a moment")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--commands", nargs="*", default=list(COMMANDS), choices=list(COMMANDS))
    parser.add_argument("--faults", nargs="*", default=list(FAULTS), choices=list(FAULTS))
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    rows: dict[str, list[str]] = {fault: [] for fault in arguments.faults}
    is_good = True
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary).resolve()
        work.chmod(0o755)
        left_out = set() if can_mount(work) else {"full disk"}
        for name in arguments.commands:
            bench = Bench(program, name, work / name)
            for fault, cells in rows.items():
                if fault in left_out or ("ffmpeg" in fault and name != "video"):
                    cells.append("–")
                    continue
                counts = {"done": 0, "stopped": 0}
                bad = 0
                signals = [f for f in FAULTS if f.startswith("SIG")]
                moments = range(signals.index(fault), arguments.moments, 3) if fault in signals else range(arguments.sizes)
                for k in moments[:1] if fault in ONCE else moments:
                    end, found = bench.try_fault(random.Random(f"{arguments.seed} {name} {fault} {k}"), fault)
                    counts[end] += 1
                    bad += bool(found)
                    is_good = is_good and not found
                    for line in found:
                        print(f"{name}, {fault}, try {k}: {line}", file=sys.stderr, flush=True)
                cells.append(f"{counts['stopped']} + {counts['done']}" + (f", **{bad} wrong**" if bad else ""))
    print(f"Measured {datetime.date.today().isoformat()}, seed {arguments.seed}: stopped tries + tries that finished despite "
          "the fault.\n")
    print("| fault | " + " | ".join(arguments.commands) + " |\n|---" + "|---" * len(arguments.commands) + "|")
    for fault, cells in rows.items():
        print(f"| {fault} | " + " | ".join(cells) + " |")
    for fault in left_out & set(arguments.faults):
        print(f"\n{fault}: left out, it needs the right to mount")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
