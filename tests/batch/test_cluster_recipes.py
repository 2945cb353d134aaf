"""The guide's recipes for Dask on SLURM and Kubernetes: shell, YAML and every option of Dask are as it knows them."""

import re
import shlex
import subprocess

import pytest
import yaml
from distributed.cli import dask_scheduler, dask_worker

from tests.documents import ROOT, blocks

COMMANDS = {"scheduler": dask_scheduler.main, "worker": dask_worker.main}
PAGE = ROOT / "docs" / "batch.md"


def recipe(mark):
    """Return the one block of the guide with a mark."""
    (found,) = [block.text for block in blocks(PAGE) if mark in block.text]
    return found


def options(words):
    """Return the options of a Dask command, parsed by Dask itself."""
    assert words[0] == "dask"
    with COMMANDS[words[1]].make_context(words[1], list(words[2:])) as context:
        # Dask takes options that it does not know for arguments.
        arguments = [context.params.get("scheduler") or "", *context.params["preload_argv"]]
        assert not any(word.startswith("-") for word in arguments), f"Dask does not know {arguments}"
        return context.params


def test_the_slurm_job_is_a_script_whose_commands_dask_knows():
    text = recipe("#SBATCH")
    assert text.startswith("#!/bin/bash\n#SBATCH")
    subprocess.run(["bash", "-n"], input=text, text=True, check=True, capture_output=True)
    wanted = dict(re.findall(r"^#SBATCH --([\w-]+)=(\S+)$", text, re.MULTILINE))
    assert {"ntasks", "cpus-per-task", "mem-per-cpu", "time"} <= wanted.keys()
    values = {"$SLURM_CPUS_PER_TASK": wanted["cpus-per-task"]}
    lines = [shlex.split(line.removesuffix("&")) for line in text.splitlines() if "dask " in line]
    scheduler, worker = ([values.get(word, word) for word in line[line.index("dask") :]] for line in lines)
    assert options(scheduler)["scheduler_file"] == options(worker)["scheduler_file"] == "$file"
    assert options(worker)["nthreads"] == int(wanted["cpus-per-task"])


def test_the_kubernetes_objects_fit_together():
    objects = {
        (each["kind"], each["metadata"]["name"]): each for each in yaml.safe_load_all(recipe("kind: Deployment"))
    }
    service, scheduler, workers = objects.values()
    for deployment in (scheduler, workers):
        labels = deployment["spec"]["template"]["metadata"]["labels"]
        assert deployment["spec"]["selector"]["matchLabels"] == labels
    assert service["spec"]["selector"] == scheduler["spec"]["template"]["metadata"]["labels"]
    ((first,), (second,)) = (each["spec"]["template"]["spec"]["containers"] for each in (scheduler, workers))
    port = service["spec"]["ports"][0]["port"]
    assert options(first["command"])["port"] == str(port)
    found = options(second["command"])
    assert found["scheduler"] == f"tcp://{service['metadata']['name']}:{port}"
    assert found["nthreads"] == int(second["resources"]["limits"]["cpu"])


def test_an_option_that_dask_does_not_know_is_seen():
    with pytest.raises(AssertionError, match="no-such"):
        options(["dask", "worker", "--no-such"])
