"""The pipelines of .github/workflows and .ci: their steps, run in a repository of its own by the shell that runs them.

What a service provides is a stand-in here: apt-get installs nothing, curl notes what it is asked for, artifacts are folders.

pipelines_test.py SUBSTEP SOURCE_FOLDER [TEST]...
"""

import os
import re
import subprocess

import yaml

from another_project import SOURCE, SUBSTEP, SUITE, Project, expect, run

STAND_INS = {
    "apt-get": "exit 0",
    "curl": 'echo "$3" >>"$LOG"',
    "gh": 'echo "gh $*" >>"$LOG"; case "$*" in *--edit-last*) exit 1;; esac',
}


def workflow(name):
    return yaml.safe_load((SOURCE / ".github/workflows" / f"{name}.yml").read_text())


class Runner:
    """Runs the steps of a job as the service does."""

    def __init__(self, project, values, **environment):
        self.project = project
        self.values = values
        self.log = project.folder.parent / "log"
        self.log.write_text("")
        tools = project.folder.parent / "tools"
        tools.mkdir(exist_ok=True)
        for name, script in STAND_INS.items():
            (tools / name).write_text(f"#!/bin/sh\n{script}\n")
            (tools / name).chmod(0o755)
        home = project.folder.parent / "home"
        home.mkdir(exist_ok=True)
        self.environment = dict(os.environ, PATH=f"{tools}:{SUBSTEP.parent}:{os.environ['PATH']}", HOME=str(home),
                                RUNNER_TEMP=str(home), LOG=str(self.log), **environment)

    def value(self, expression):
        """Of ${{ expression }}: names, comparisons and conjunctions are all that is used."""
        text = re.sub(r"(!cancelled|failure)\(\)", lambda call: str(self.failed if call[1] == "failure" else True),
                      expression)
        text = re.sub(r"'[^']*'|[a-z_]+\.[a-z_.]+", lambda name: name[0] if name[0][0] == "'" else
                      repr(self.values[name[0]]), text)
        return eval(text.replace("&&", " and "), {})  # the project's own files

    def filled(self, text):
        return re.sub(r"\$\{\{ (.*?) \}\}", lambda found: str(self.value(found[1])), str(text))

    def shell(self, script, environment):
        done = subprocess.run(["sh", "-e", "-c", script], cwd=self.project.folder, capture_output=True, text=True,
                              env={**self.environment, **environment})
        self.said += done.stdout + done.stderr
        return done.returncode

    def job(self, job, without=()):
        """Whether it passes. Steps with a word of `without` in their script are left out."""
        self.failed = False
        self.said = ""
        common = {key: self.filled(value) for key, value in job.get("env", {}).items()}
        for step in job["steps"]:
            condition = step.get("if")
            runs = self.value(re.fullmatch(r"\$\{\{ (.*) \}\}", condition)[1]) if condition else not self.failed
            if not runs or "run" not in step or any(word in step["run"] for word in without):
                continue
            own = {key: self.filled(value) for key, value in step.get("env", {}).items()}
            code = self.shell(self.filled(step["run"]), {**common, **own})
            expect(code == 0 or not step.get("continue-on-error"), f"{step['run']}\nfailed:\n{self.said}")
            self.failed = self.failed or code != 0
        return not self.failed


def git(folder, *arguments):
    return subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@invalid", *arguments], cwd=folder, check=True,
                          capture_output=True, text=True).stdout


def repository(folder):
    """One whose goldens are all right, with a remote."""
    project = Project(folder, ["box_stack", "pendulum"]).with_goldens(SUITE.replace(', "a5"', ""))
    (project.folder / ".gitignore").write_text("/out/\n/report/\n")
    remote = project.folder.parent / "remote"
    git(project.folder.parent, "init", "-q", "--bare", str(remote))
    git(project.folder, "init", "-q", "-b", "main")
    git(project.folder, "add", ".")
    git(project.folder, "commit", "-q", "-m", "all")
    git(project.folder, "remote", "add", "origin", str(remote))
    return project, remote


def dim(project, scene, to):
    file = project.scene(scene)
    file.write_text(re.sub(r'"intensity":[0-9.]+', f'"intensity":{to}', file.read_text()))


def all_are_yaml_and_use_what_there_is(folder):
    files = [*(SOURCE / ".github/workflows").glob("*.yml"), SOURCE / ".ci/gitlab.yml"]
    expect(len(files) == 6, files)
    for file in files:
        for name, job in (yaml.safe_load(file.read_text()).get("jobs") or {}).items():
            for step in job["steps"]:
                expect(("run" in step) != ("uses" in step), f"{file} {name}: {step}")
                for script in re.findall(r"(?<![\w/])\.ci/[a-z]+", step.get("run", "")):
                    expect(os.access(SOURCE / script, os.X_OK), f"{file}: {script}")


def suite_yml_shows_what_failed_with_its_pictures(folder):
    project, remote = repository(folder)
    summary = project.folder.parent / "summary.md"
    values = {"inputs.suite": "golden", "inputs.program": "someone/substep", "inputs.pictures": "", "inputs.comment": True,
              "github.event_name": "pull_request", "github.event.number": 7, "github.token": "none"}
    runner = Runner(project, values, GITHUB_STEP_SUMMARY=str(summary), GITHUB_WORKSPACE=str(project.folder),
                    GITHUB_SHA="abc", GITHUB_SERVER_URL="https://github.com", GITHUB_REPOSITORY="a/b")
    job = workflow("suite")["jobs"]["check"]
    expect(runner.job(job), runner.said)
    expect("2 pass" in summary.read_text() and "gh" not in runner.log.read_text(), "green is a line, and no comment")
    expect("https://github.com/someone/substep/releases/latest/download/substep.deb" in runner.log.read_text(), "the package")
    # Red, without a branch for pictures: they are linked as they lie in the artifact.
    dim(project, "pendulum", 2.5)
    expect(not runner.job(job), "a changed scene fails")
    text = summary.read_text()
    expect("(pendulum.a3/flicker.png)" in text and (project.folder / "report/pendulum.a3/flicker.png").exists(), text)
    expect("::error file=scenes/pendulum.gltf,title=substep check%3A scene changed::" in runner.said, runner.said)
    expect("gh pr comment 7 --body-file report/summary.md" in runner.log.read_text(), "a comment, when there is none to edit")
    # With one, at a commit of theirs; the next run's comes after it.
    values["inputs.pictures"] = "goldens-pictures"
    for number, scene in enumerate(["pendulum", "box_stack"]):
        dim(project, scene, 2.0)
        summary.write_text("")
        expect(not runner.job(job), "a changed scene fails")
        links = re.findall(r"\]\(https://github.com/a/b/raw/([0-9a-f]{40})/([^)]*)\)", summary.read_text())
        expect(len(links) >= 2 and "](" + scene not in summary.read_text(), summary.read_text())
        for commit, picture in links:
            data = subprocess.run(["git", "show", f"{commit}:{picture}"], cwd=remote, check=True, capture_output=True).stdout
            expect(data == (project.folder / "report" / picture).read_bytes(), picture)
        expect(git(remote, "rev-list", "--count", "goldens-pictures").strip() == str(number + 1), "history is kept")
    expect(git(project.folder, "status", "--porcelain", "--", "golden").strip() == "", "the work tree is as it was")
    expect(git(project.folder, "diff", "--cached", "--name-only").strip() == "", "and so is its index")


def check_yml_puts_two_parts_together(folder):
    project, _ = repository(folder)
    (project.folder / "build").mkdir()
    (project.folder / "build/substep").symlink_to(SUBSTEP)
    dim(project, "pendulum", 2.5)
    summary = project.folder.parent / "summary.md"
    values = {"matrix.part": 1}
    runner = Runner(project, values, GITHUB_STEP_SUMMARY=str(summary), GITHUB_WORKSPACE=str(project.folder))
    jobs = workflow("check")["jobs"]
    passes = []
    for values["matrix.part"] in jobs["check"]["strategy"]["matrix"]["part"]:
        passes.append(runner.job(jobs["check"], without=[".ci/install", "cmake"]))
    expect(passes == [True, False], f"the second scene is the second part's: {passes}")
    os.rename(project.folder / "build", project.folder / "program")
    expect(not runner.job(jobs["report"], without=[".ci/install"]), "the whole fails")
    expect("1 scene changed, 1 pass" in summary.read_text(), summary.read_text())


def gitlab_yml_leaves_what_gitlab_shows(folder):
    project, _ = repository(folder)
    job = yaml.safe_load((SOURCE / ".ci/gitlab.yml").read_text())[".substep"]
    dim(project, "pendulum", 2.5)
    runner = Runner(project, {}, CI_PROJECT_DIR=str(project.folder), **{**job["variables"], "PROGRAM": "someone/substep"})
    steps = [{"run": line} for line in job["before_script"] + job["script"]]
    expect(not runner.job({"steps": steps}), "a changed scene fails")
    artifacts = job["artifacts"]
    expect(artifacts["when"] == "always" and (project.folder / artifacts["paths"][0] / "report.html").exists(), artifacts)
    junit = (project.folder / artifacts["reports"]["junit"]).read_text()
    shown = re.findall(r"\[\[ATTACHMENT\|(.*?)\]\]", junit)
    expect(len(shown) == 1 and all((project.folder / picture).exists() for picture in shown), junit)


def what_init_writes_calls_what_there_is(folder):
    project = Project(folder, ["pendulum"])
    project.shell("substep init --program someone/substep .", 0)
    text = (project.folder / ".github/workflows/goldens.yml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith(("#", "name:"))]
    expect(len(lines) == 5, f"five lines\n{text}")
    job = yaml.safe_load(text)["jobs"]["goldens"]
    called = re.fullmatch(r"someone/substep/(\.github/workflows/suite\.yml)@main", job["uses"])
    # YAML takes the key `on` for true.
    inputs = yaml.safe_load((SOURCE / called[1]).read_text())[True]["workflow_call"]["inputs"]
    expect(set(job["with"]) <= set(inputs), job["with"])
    expect({name for name, of in inputs.items() if of.get("required")} <= set(job["with"]), job["with"])
    # The same for GitLab, beside a pipeline or without one.
    for name, to_do in [("golden/gitlab-ci.yml", True), (".gitlab-ci.yml", False)]:
        for path in ["golden/suite.toml", "golden/README.md", ".gitlab-ci.yml"]:
            (project.folder / path).unlink(missing_ok=True)
        if to_do:
            (project.folder / ".gitlab-ci.yml").write_text("theirs: {}\n")
        said = project.shell("substep init --program someone/substep --ci gitlab .", 0)
        expect(("include: golden/gitlab-ci.yml" in said) == to_do, said)
        pipeline = yaml.safe_load((project.folder / name).read_text())
        expect(pipeline["include"] == "https://raw.githubusercontent.com/someone/substep/main/.ci/gitlab.yml", pipeline)
        template = yaml.safe_load((SOURCE / ".ci/gitlab.yml").read_text())
        expect(set(pipeline["goldens"]["variables"]) == set(template[pipeline["goldens"]["extends"]]["variables"]), pipeline)


run([all_are_yaml_and_use_what_there_is, suite_yml_shows_what_failed_with_its_pictures, check_yml_puts_two_parts_together,
     gitlab_yml_leaves_what_gitlab_shows, what_init_writes_calls_what_there_is])
