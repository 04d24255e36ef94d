"""Another repository adopts the suite and uses it in CI and by hand, with the program and a shell alone.

adoption_test.py SUBSTEP SOURCE_FOLDER [TEST]...
"""

import fcntl
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import xml.etree.ElementTree as xml

SUBSTEP = pathlib.Path(sys.argv[1]).resolve()
SOURCE = pathlib.Path(sys.argv[2]).resolve()
SCENES = SOURCE / "scenes"
SUITE = """
[defaults]
frames = 20
images = [20]
size = [96, 54]
algorithms = ["a3", "a5"]
"""


def expect(condition, what):
    if not condition:
        raise AssertionError(what)


class Project:
    """A separate repository with scenes, and `substep` on the path."""

    def __init__(self, folder, scenes=("box_stack", "pendulum")):
        self.folder = pathlib.Path(folder)
        (self.folder / "scenes").mkdir(parents=True)
        for scene in scenes:
            shutil.copy(SCENES / f"{scene}.gltf", self.folder / "scenes")

    def with_goldens(self, suite=SUITE):
        names = sorted(path.name for path in (self.folder / "scenes").iterdir())
        (self.folder / "golden").mkdir()
        cases = "".join(f'[[case]]\nscene = "../scenes/{name}"\n' for name in names)
        (self.folder / "golden/suite.toml").write_text(suite + cases)
        self.shell("substep check", 1)
        self.shell('substep approve --failed --reason "the first"', 0)
        return self

    def scene(self, name):
        return self.folder / "scenes" / f"{name}.gltf"

    def replace(self, name, old, new, count=-1):
        file = self.folder / name
        file.write_text(file.read_text().replace(old, new, count))

    def damage(self, name):
        self.scene(name).write_text(self.scene(name).read_text()[:700])

    def shell(self, command, code, folder=None):
        """Runs a command as a person types it, and expects its exit code."""
        environment = dict(os.environ, PATH=f"{SUBSTEP.parent}:{os.environ['PATH']}")
        done = subprocess.run(["sh", "-c", command], cwd=folder or self.folder, env=environment, capture_output=True,
                              text=True)
        expect(done.returncode == code, f"{command}: code {done.returncode}, not {code}\n{done.stdout}{done.stderr}")
        return done.stdout + done.stderr

    def results(self, output="out/check"):
        return json.loads((self.folder / output / "results.json").read_text())

    def verdicts(self, output="out/check"):
        return {entry["name"]: entry["verdict"] for entry in self.results(output)["cases"]}

    def junit(self, output="out/check"):
        return xml.parse(self.folder / output / "junit.xml").getroot()


def printed(text, what):
    """Returns the commands on lines that begin with `what` or with the command itself."""
    found = re.findall(rf"^ *(?:{what})? *(substep .*)$", text, re.M)
    expect(found, f"no command for {what} in\n{text}")
    return found


def damaged_scene_does_not_hide_changed_one(folder):
    project = Project(folder).with_goldens()
    project.damage("pendulum")
    project.replace("scenes/box_stack.gltf", '"mass":1.0', '"mass":2.0', 1)
    text = project.shell("substep check", 1)
    expect(project.verdicts() == {"box_stack.a3": "scene changed", "box_stack.a5": "scene changed",
                                  "pendulum.a3": "error", "pendulum.a5": "error"}, project.verdicts())
    expect("cause    mass, inertia or gravity factor of box_1" in text, text)
    expect(text.count("FAILED") == 2, f"each of two groups is shown once\n{text}")
    junit = project.junit()
    expect((junit.get("errors"), junit.get("failures")) == ("2", "2"), junit.attrib)
    expect(all(float(test.get("time")) >= 0 and test.get("file") for test in junit), "tests have times and files")


def damaged_goldens_are_errors_of_their_cases(folder):
    project = Project(folder).with_goldens()
    for file in ["images/box_stack/a3.f0020.png", "poses/box_stack/a5.poses", "poses/pendulum/a3.track"]:
        golden = project.folder / "golden" / file
        golden.write_bytes(golden.read_bytes()[:100])
    project.shell("substep check", 1)
    expect(project.verdicts() == {"box_stack.a3": "error", "box_stack.a5": "error", "pendulum.a3": "error",
                                  "pendulum.a5": "pass"}, project.verdicts())
    for entry in project.results()["cases"][:3]:
        expect("\n" not in entry["cause"] and entry["cause"].startswith("golden/"), entry["cause"])


def unreadable_folders_are_named(folder):
    project = Project(folder, ["pendulum"]).with_goldens()
    # Root reads every folder, so run as user `nobody`.
    user = 65534 if os.geteuid() == 0 else None

    def run(*words):
        return subprocess.run([SUBSTEP, *words], cwd=project.folder, user=user, capture_output=True, text=True)

    project.folder.parent.chmod(0o755)
    shutil.rmtree(project.folder / "out/check")
    (project.folder / "out").chmod(0o777)
    (project.folder / "golden/poses/pendulum").chmod(0)
    out = run("check").stdout
    expect("pendulum/a3.poses: Permission denied\n" in out and "orphan" not in out, out)
    (project.folder / "golden").rename(project.folder / "other")
    project.folder.chmod(0o555)
    done = run("init")
    expect((done.returncode, done.stderr) == (2, "substep: ./golden: Permission denied\n"), done)
    project.folder.chmod(0o755)
    (project.folder / "other/poses/pendulum").chmod(0o755)


def timeout_and_crash_are_errors_of_one_case(folder):
    project = Project(folder, ["bowling", "pendulum"]).with_goldens()
    project.replace("golden/suite.toml", 'bowling.gltf"', 'bowling.gltf"\ntime_limit = 0.01')
    project.shell("substep check", 1)
    entries = {entry["name"]: entry for entry in project.results()["cases"]}
    expect(entries["bowling.a3"]["cause"] == "it took longer than its limit, 0.01 s", entries["bowling.a3"]["cause"])
    expect(entries["pendulum.a5"]["verdict"] == "pass", "the case after it ran")
    # A crash: the process that checks is ended in the middle of a case.
    project.replace("golden/suite.toml", "time_limit = 0.01", "frames = 20000\nimages = [20000]")
    check = subprocess.Popen([SUBSTEP, "check"], cwd=project.folder, stdout=subprocess.DEVNULL)
    for _ in range(2):
        worker = None
        while not worker:
            worker = pathlib.Path(f"/proc/{check.pid}/task/{check.pid}/children").read_text().split()
            time.sleep(0.05)
        time.sleep(0.5)
        junit = project.junit()
        expect(junit.get("errors") != "0", "junit.xml of a running check reports errors")
        os.kill(int(worker[0]), signal.SIGSEGV)
        while pathlib.Path(f"/proc/{worker[0]}").exists():
            time.sleep(0.05)
    expect(check.wait() == 1, "a crash is a failure")
    entries = {entry["name"]: entry for entry in project.results()["cases"]}
    expect(entries["bowling.a3"]["cause"].startswith("it crashed: Segmentation fault"), entries["bowling.a3"]["cause"])
    expect(entries["pendulum.a5"]["verdict"] == "pass", "the cases after a crash ran")


def two_checks_do_not_write_to_one_folder(folder):
    project = Project(folder, ["pendulum"]).with_goldens()
    with open(project.folder / "out/check/.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        text = project.shell("substep check", 2)
    expect(text.count("\n") == 1 and "another check is writing there" in text, text)
    project.shell("substep check", 0)


def interrupted_check_reports_once(folder):
    project = Project(folder, ["bowling", "pendulum"]).with_goldens()
    project.replace("golden/suite.toml", 'bowling.gltf"', 'bowling.gltf"\nframes = 20000\nimages = [20000]')
    case = '[[case]]\nscene = "../scenes/pendulum.gltf"\ncommand = ["sh", "-c", "exec sleep 30", "{poses}"]\n'
    project.replace("golden/suite.toml", "[[case]]", case + "[[case]]", 1)
    temporary = project.folder / "temporary"
    temporary.mkdir()
    # A terminal sends the signal to all of its group, a job's end to one process.
    for number, interrupt in [(signal.SIGINT, os.killpg), (signal.SIGTERM, os.kill)] * 3:
        check = subprocess.Popen([SUBSTEP, "check"], cwd=project.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                 start_new_session=True, text=True, env=dict(os.environ, TMPDIR=temporary))
        while not list(temporary.glob("*substep-run*")):
            expect(check.poll() is None, "the check ended before its command ran")
            time.sleep(0.01)
        interrupt(check.pid, number)
        check.wait()
        project.shell("substep check --case pendulum.a3", 0)  # the folder's lock is free at once
        expect(not list(temporary.glob("*substep-run*")), "a folder of a command is left")
        message = check.communicate()[1]
        expect(message == "substep: interrupted: what was not finished is removed\n", message)
        expect(check.returncode == -number, check.returncode)


def folder_names_are_quoted(folder):
    project = Project(folder, ["pendulum"])
    strange = "a $(touch ran) 'b\" `touch ran` -c"
    os.rename(project.with_goldens().folder / "golden", project.folder / strange)
    project.replace("scenes/pendulum.gltf", '"intensity":3.0', '"intensity":2.5')
    text = subprocess.run([SUBSTEP, "check", "--suite", strange, "--output", strange + "out"], cwd=project.folder,
                          capture_output=True, text=True).stdout
    for command in printed(text, "approve"):
        if "approve" in command:
            command = command.replace('"..."', '"as meant"')
        project.shell(command, 0)
    expect(not (project.folder / "ran").exists(), "a folder's name was run")
    arguments = ["--suite", strange]
    expect(subprocess.run([SUBSTEP, "check", *arguments], cwd=project.folder, capture_output=True).returncode == 1,
           "only the case that was named first in its group is approved")


def scene_without_pictures_needs_no_renderer(folder):
    project = Project(folder, ["pendulum"])
    project.with_goldens(SUITE.replace("images = [20]", "images = []"))
    project.shell("substep check", 0)
    project.shell("DRAW_USE_LLVM=0 substep check", 0)
    expect(not list(project.folder.glob("golden/images/*/*.png")), "there are no pictures")
    expect(project.results()["made_with"]["renderer"] == "", "the renderer was not asked for")


def other_renderers_are_reported(folder):
    project = Project(folder, ["pendulum"]).with_goldens()
    text = project.shell("DRAW_USE_LLVM=0 substep check", 2)
    expect(text.count("\n") == 1 and "DRAW_USE_LLVM=0" in text, text)
    project.shell("GALLIUM_NOSSE=1 substep check", 0)
    made_with = project.results()["made_with"]
    expect(made_with["renderer"].endswith("GALLIUM_NOSSE=1") and not made_with["pinned"], made_with)


def printed_commands_repair_suite(folder):
    project = Project(pathlib.Path(folder) / "theirs", ["box_stack", "pendulum", "bouncing_balls"])
    (project.folder / "scenes/empty.gltf").write_text("{}")
    text = project.shell("substep init .", 0)
    expect("scenes that are cases: 3; that are not: 1, " in text, text)
    expect("\n  git add golden .github/workflows/goldens.yml .gitignore scenes\n" in text, text)
    project.shell("substep init .", 2)
    check, approve = printed(text, "")
    project.shell(check, 1)
    project.shell(approve, 0)
    project.shell(check, 0)
    # Red: one scene is damaged, another was changed; on a machine whose work tree lies elsewhere.
    good = project.scene("pendulum").read_text()
    project.damage("pendulum")
    project.replace("scenes/bouncing_balls.gltf", '"restitution":0.5', '"restitution":0.4')
    machine = pathlib.Path(folder) / "runner/work"
    shutil.copytree(project.folder, machine, ignore=shutil.ignore_patterns("out"))
    text = project.shell("substep check --suite golden --output report", 1, machine)
    expect("contact material or filter of" in text, text)
    # The artifact is downloaded.
    shutil.move(machine / "report", pathlib.Path(folder) / "down load")
    shutil.rmtree(machine)
    expect(project.verdicts("../down load") == {"box_stack.a5": "pass", "pendulum.a5": "error",
                                                "bouncing_balls.a5": "scene changed"}, project.verdicts("../down load"))
    project.scene("pendulum").write_text(good)
    project.shell("substep approve bouncing_balls.a5 --output '../down load' --reason 'they bounce less'", 0)
    project.shell("substep check", 0)
    sidecar = json.loads((project.folder / "golden/images/bouncing_balls/a5.json").read_text())
    expect(sidecar["approved"]["reason"] == "they bounce less", sidecar["approved"])


def written_suite_can_be_checked(folder):
    project = Project(folder, ["pendulum"])
    os.rename(project.folder / "scenes", project.folder / 'lvl "q" \\ x')
    text = project.shell("substep init . --command 'sh run.sh {scene} {settings} {poses}'", 0)
    expect("move .github" in text, text)
    project.shell("substep check", 1)  # a suite that cannot be read would give 2
    expect(project.results()["cases"][0]["verdict"] == "error", "there is no run.sh")
    workflow = (project.folder / ".github/workflows/goldens.yml").read_text()
    version = project.shell("substep --version", 0).split()[1]
    expect(workflow.count(f'version: v{version}, setup: "true"') == 2, workflow)
    expect((project.folder / "golden/.gitattributes").read_text() == "*.poses -text\n", "line ends are kept")


def readme_pendulum_follows_printed_commands(folder):
    page = (SOURCE / "golden/README.md").read_text()
    script = re.search(r"<!-- pendulum.py -->\n```python\n(.*?)```", page, re.S).group(1)
    project = Project(folder, [])
    (project.folder / "scenes").rmdir()
    for name, text in [("pendulum.py", script), ("pendulum.gltf", (SCENES / "pendulum.gltf").read_text())]:
        (project.folder / name).write_text(text)
    identity = "git -c user.name=them -c user.email=them@example.org"
    project.shell("git init -q && git add . && " + identity + " commit -q -m start", 0)
    text = project.shell(re.search(r"substep init \. --command .*", page).group(0), 0)
    check, approve, *_ = printed(text, "")
    text += project.shell(check, 1)
    expect(project.verdicts() == {"pendulum.pendulum": "new"}, project.verdicts())
    project.shell(approve, 0)
    project.shell(re.search(r"git add .*", text).group(0) + " && " + identity + " commit -q -m goldens", 0)
    project.shell(check, 0)
    expect(project.shell("git status --short", 0) == "", "nothing is left for git")
    for old, new in [("mass, length, drag = 1.0,", "mass, length, drag = 2.0,"), ("2.0, 1.0, 0.2", "2.0, 0.9, 0.2")]:
        project.replace("pendulum.py", old, new)
        text = project.shell(check, 1)
        expect(project.verdicts() == {"pendulum.pendulum": "simulation changed"}, project.verdicts())
        entry = project.results()["cases"][0]
        # Another mass starts at the same place, another length does not.
        first = 1 if "mass" in old else 0
        expect(entry["poses"]["motion"]["first_frame"] == first and entry["poses"]["motion"]["body"] == "rod", text)
        expect((project.folder / "out/check/pendulum.pendulum" / entry["player"]).exists(), "a page plays both")
        command, = [c for c in printed(text, "approve") if "approve" in c]
        project.shell(command.replace('"..."', '"a heavier rod"'), 0)
        project.shell(check, 0)
    # The workflow run by hand approves the named cases, and commits them.
    project.replace("pendulum.py", "0.9,", "0.8,")
    project.shell("git init -q --bare ../origin && git remote add origin ../origin && git push -q -u origin HEAD", 0)
    steps = (SOURCE / ".github/workflows/suite.yml").read_text()
    checks = re.search(r"- run: (substep check .*)", steps).group(1)
    approves = textwrap.dedent(re.search(r"run: \|\n((?: {10}.*\n)+)", steps).group(1))
    environment = "export SUITE=golden APPROVE=pendulum.pendulum REASON='a shorter rod; $(touch ran)'\n"
    project.shell(environment + checks + " && " + approves, 0)
    expect(not (project.folder / "ran").exists(), "a reason is no command")
    log = project.shell("git log -1 --format=%s%n%b origin/HEAD || git log -1 --format=%s%n%b @{upstream}", 0)
    expect("Approve pendulum.pendulum\na shorter rod" in log, log)
    project.shell(check, 0)
    # A crash and a timeout are errors of the case.
    for line, limit, cause in [("sys.exit('no such rod')", "120", "python3 ended with exit code 1: no such rod"),
                               ("import time; time.sleep(9)", "1", "python3 has not ended after 1 s")]:
        project.replace("golden/suite.toml", "time_limit = 120", f"time_limit = {limit}")
        (project.folder / "pendulum.py").write_text(f"import sys\n{line}\n")
        project.shell(check, 1)
        entry = project.results()["cases"][0]
        expect((entry["verdict"], entry["cause"]) == ("error", cause), entry["cause"])


def table_is_compared_within_its_tolerance(folder):
    project = Project(folder, ["box_stack"])
    project.shell("substep run scenes/box_stack.gltf --duration 0.5 --csv stack.csv --output stack.poses.txt", 0)
    table = (project.folder / "stack.csv").read_text()
    cases = """
[defaults]
frames = 20
images = [20]
size = [96, 54]
[[case]]
scene = "../scenes/box_stack.gltf"
poses = "../stack.csv"
[[case]]
scene = "../scenes/box_stack.gltf"
poses = "../stack.csv"
variant = "loose"
pose_tolerance = { position = 0.002 }
"""
    (project.folder / "golden").mkdir()
    (project.folder / "golden/suite.toml").write_text(cases)
    project.shell("substep check", 1)
    project.shell('substep approve --failed --reason "the first"', 0)
    project.shell("substep check", 0)

    def shift_x(by):
        rows = [row.split(",") for row in table.splitlines()]
        x = rows[0].index("x")
        for row in rows[1:]:
            if float(row[0]) > 0.1:
                row[x] = str(float(row[x]) + by)
        (project.folder / "stack.csv").write_text("\n".join(",".join(row) for row in rows) + "\n")

    shift_x(0.001)
    project.shell("substep check", 1)
    expect(project.verdicts() == {"box_stack.stack": "simulation changed", "box_stack.stack-loose": "pass"},
           project.verdicts())
    shift_x(0.003)
    project.shell("substep check", 1)
    limit = project.results()["cases"][1]["poses"]["motion"]["limit"]
    expect(limit == "body box_1 position x 0.003 m (limit 0.002)", limit)
    (project.folder / "stack.csv").write_text(table.replace("box_3", "box_33"))
    project.shell("substep check", 1)
    cause = project.results()["cases"][0]["cause"]
    expect(re.match(r"stack\.csv:\d+: box_stack has no body 'box_33': there are box_1, ", cause), cause)


TESTS = [damaged_scene_does_not_hide_changed_one, damaged_goldens_are_errors_of_their_cases,
         unreadable_folders_are_named, timeout_and_crash_are_errors_of_one_case, two_checks_do_not_write_to_one_folder, interrupted_check_reports_once,
         folder_names_are_quoted, scene_without_pictures_needs_no_renderer, other_renderers_are_reported,
         printed_commands_repair_suite, written_suite_can_be_checked,
         readme_pendulum_follows_printed_commands, table_is_compared_within_its_tolerance]

def main():
    """Runs the tests that are named after program and folder, else all, each in a folder of its own."""
    failed = 0
    for test in [globals()[name] for name in sys.argv[3:]] or TESTS:  # KeyError for an unknown name
        with tempfile.TemporaryDirectory() as folder:
            try:
                test(pathlib.Path(folder) / "project")
                print("ok    ", test.__name__, flush=True)
            except AssertionError as error:
                failed += 1
                print("FAILED", test.__name__, error, flush=True)
    sys.exit(1 if failed else 0)


main()
