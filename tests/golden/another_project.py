"""A repository with scenes of its own that adopts the suite, for tests that are called as TEST SUBSTEP SOURCE_FOLDER."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
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
    """A repository of its own with scenes in it, and `substep` on the path."""

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


def run(tests):
    """Those that are named after program and folder, else all, each in a folder of its own."""
    wanted = sys.argv[3:]
    failed = 0
    for test in tests:
        if wanted and test.__name__ not in wanted:
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                test(pathlib.Path(folder) / "project")
                print("ok    ", test.__name__, flush=True)
            except AssertionError as error:
                failed += 1
                print("FAILED", test.__name__, error, flush=True)
    sys.exit(1 if failed else 0)
