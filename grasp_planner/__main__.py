"""``python -m grasp_planner``: the command line."""

from .cli import main

main(prog_name="grasp-planner")
