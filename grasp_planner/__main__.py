"""``python -m grasp_planner``: the command line."""

from .cli.main import main

main(prog_name="grasp-planner")
