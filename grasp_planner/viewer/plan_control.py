"""Searches: started from the page, followed while they run, their results ranked and shown."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..grasp.grasp import Grasp, IterationRecord
from ..planning.starts import standard_start
from ..problem.search_options import PlannerOptions
from ..spatial import Pose
from .panels.plan import PlanPanel
from .panels.widgets import set_value
from .planning import PlanEvents, PlanningProcess, PlanRequest, SearchEnd
from .presets import ENOUGH, paper_presets
from .session import Preview, Session
from .state_link import LinkedState
from .worker import Worker


class PlanControl:
    """Runs one search at a time in its process; all methods are for the worker's thread.

    Attributes:
        planning: The process that plans.
    """

    def __init__(
        self,
        session: Session,
        panel: PlanPanel,
        worker: Worker,
        stop_animation: Callable[[], None],
        report: Callable[[str], None],
    ) -> None:
        self.session, self.panel, self.worker = session, panel, worker
        self._stop_animation, self._report = stop_animation, report
        self.planning = PlanningProcess()
        self._object_pose = Pose.identity()
        self._moves = 0

    @property
    def _followed(self) -> bool:
        """Whether the picture may follow the search: not after the user has moved something meanwhile."""
        return self.session.moves == self._moves

    def start_preset(self, title: str) -> None:
        """Plan a figure of the paper, by its title."""
        if self.planning.busy:
            return
        problem = paper_presets()[title].problem()
        start = standard_start(problem)
        self.session.show(Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma), "to be planned")
        self._start(replace(self.options, enough=ENOUGH), from_here=False)

    def start(self) -> None:
        """Start planning for the problem shown, as the widgets say."""
        self._start(self.options, from_here=self.panel.from_here.value)

    @property
    def options(self) -> PlannerOptions:
        """What the widgets of the search say."""
        found: PlannerOptions = self.panel.search.options(PlannerOptions())
        return found

    @property
    def count(self) -> int:
        """How many grasps that differ are asked for."""
        return int(self.panel.count.value)

    def open_state(self, state: LinkedState) -> None:
        """Show a grasp with its problem and search."""
        self._stop_animation()
        self.panel.search.enter(state.options)
        set_value(self.panel.seed, state.seed)
        set_value(self.panel.count, state.count)
        self.session.show(state.grasp, "opened from a link" if state.posed else "from a link, not planned yet")

    def _start(self, options: PlannerOptions, *, from_here: bool) -> None:
        """Start planning for the problem shown."""
        self._stop_animation()
        session, plan = self.session, self.panel
        here, problem = session.grasp, session.problem
        posture = (here.joint_angles, here.palm_pose.homogeneous, here.delta_sigma, here.contact_forces)
        given = posture if from_here else None
        start = standard_start(problem)
        seed = here if given else Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
        request = PlanRequest(
            problem=problem,
            seed=int(plan.seed.value),
            options=options,
            count=self.count,
            start=given,
        )
        events = PlanEvents(
            progress=lambda records: self.worker.submit(lambda: self._show_progress(request, records)),
            result=lambda grasp: self.worker.submit(lambda: self._add_result(grasp)),
            best=lambda grasps: self.worker.submit(lambda: session.take_best(grasps)),
            end=lambda outcome, message: self.worker.submit(lambda: self._end_plan(outcome, message)),
        )
        if not self.planning.start(request, events):
            return
        self._object_pose, self._moves = session.live.object_pose, session.moves
        session.forget_results()
        session.seed = seed
        plan.set_running(True)
        plan.requirements.begin(problem)
        plan.status.content = "preparing starts …"

    def _show_progress(self, request: PlanRequest, records: list[IterationRecord]) -> None:
        """Show the newest iteration of the search."""
        last, session = records[-1], self.session
        self.panel.add_progress(records)
        set_value(self.panel.bar, 100.0 * min(1.0, last.start / request.options.starts))
        message = f"start {last.start + 1}, phase {last.phase}, iteration {last.iteration}"
        problem = request.problem
        feasible = [grasp.force_norm for grasp in session.results if grasp.feasible]
        found = bool(feasible)
        told = f"{len(feasible)} that differ, least F {min(feasible):.2f} N" if found else "no grasp yet"
        self.panel.status.content = f"{message}: {told}"
        if self._followed and not found and problem.hand is session.problem.hand:
            q = np.clip(last.joint_angles, problem.hand.lower, problem.hand.upper)
            preview = Grasp(problem, q, Pose.of(last.palm_pose), np.zeros(problem.n_synergies))
            session.preview, session.dirty = Preview(preview, f"Searching: {message}"), True

    def _add_result(self, grasp: Grasp) -> None:
        """Show a result if it is the best so far, unless the user is moving something else."""
        if self.session.add_result(grasp) and grasp.feasible and self._followed:
            self.session.show_result(0, self._object_pose)
        self.session.dirty = True

    def _end_plan(self, outcome: SearchEnd, message: str) -> None:
        """Show how the search ended."""
        self.panel.set_running(False)
        self.panel.status.content = f"**{outcome}**: {html.escape(message)}"
        if outcome == "failed":
            self._report(message)
        session = self.session
        session.preview, session.dirty = None, True
        if session.results and outcome == "done" and self._followed:
            session.show_result(0, self._object_pose)

    def choose(self, index: int) -> None:
        """Show a result by its rank, and stay with it if a search goes on."""
        self._stop_animation()
        self.session.show_result(index, self._object_pose)
        self.session.moves += 1

    def browse(self) -> None:
        """Show the best, previous or next result."""
        choice = str(self.panel.browse.value)
        if choice == "best":
            self.choose(0)
        else:
            self.step(1 if choice == "next" else -1)

    def step(self, by: int) -> None:
        """Show the result some ranks further."""
        shown = self.session.shown
        self.choose(0 if shown is None else shown + by)
