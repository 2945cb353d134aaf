"""The viewer: puts server, page, picture, session, worker and planning together."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import viser

from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp
from .animation import Animator
from .comparisons import SERIES, Comparison
from .first_grasp import first_grasp
from .gallery import Gallery
from .handles import connect_handles
from .icons import icons_read_once
from .ladder_card import LadderCard
from .page_links import PageLinks
from .page_script import send_script
from .palette import add_commands
from .panels.changes import ChangesPanel
from .panels.chapters import COMPARE, GRASP, PLAN, SYNERGIES, TASK, WHY
from .panels.compare import ComparePanel
from .panels.display import DisplayPanel
from .panels.from_files import FromFilesPanel
from .panels.grasp import GraspPanel
from .panels.guide import add_guide
from .panels.plan import PlanPanel
from .panels.problem import ProblemPanel
from .panels.run import RunPanel
from .panels.share import SharePanel
from .panels.synergies import SynergyPanel
from .panels.task import TaskPanel
from .panels.why import WhyPanel
from .panels.widgets import FieldError
from .plan_control import PlanControl
from .problem_edits import ProblemEdits
from .push_control import PushControl
from .run_control import RunControl
from .scene.draw_grasp import fitting_scale
from .scene.picture3d import Picture
from .scripts import page_scripts
from .server import LocalServer
from .session import Session
from .worker import Worker

if TYPE_CHECKING:
    from ..batch import RunRows

PANEL_WIDTH = 390
"""Width of the panel on the right [pixels]; six tabs fit into one line."""


class GraspViewer:
    """An interactive page on a grasp.

    All that changes anything runs in one worker thread; widget callbacks only leave a request there.

    Attributes:
        server: The web server.
        session: The state all browsers see.
        worker: The thread that does the work.
        control: What runs searches and shows their results.
        planning: The process that plans.
    """

    def __init__(
        self,
        grasp: Grasp | None = None,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        allow_remote: bool = False,
        token: bool = False,
        note: str = "",
        rows: RunRows | None = None,
    ) -> None:
        """Start the server and show a grasp.

        Args:
            grasp: The grasp to open with; a good one is planned if left out.
            host: Address to listen on.
            port: Port, or 0 for any.
            allow_remote: Whether addresses other than loopback are allowed.
            token: Whether the page is only for who has the address with its token; always so off loopback.
            note: Where the grasp comes from.
            rows: Rows of a batch run to go through, instead of a grasp.

        Raises:
            InvalidValueError: If the address is not loopback and that was not allowed.
            GraspPlannerError: If the current row of the run can't be shown.
        """
        if rows is not None:
            grasp, note = rows.grasp()
        shown = grasp or first_grasp()
        self.server = LocalServer(host=host, port=port, allow_remote=allow_remote, token=token)
        self.session = Session(shown, note or ("a grasp to begin with" if grasp is None else "loaded"))
        self.picture = Picture(self.server)
        self.picture.aim(shown)
        with icons_read_once():
            self._build_page(rows)
        self.worker = Worker(self._redraw, self._report, self._climb)
        self.animator = Animator(self.session, self.worker)
        self.control = PlanControl(self.session, self.plan, self.worker, self.animator.stop, self._report)
        self.planning = self.control.planning
        self.comparison = Comparison(self.session, self.compare, self.plan, self.planning, self.worker)
        series = self.comparison
        self.galleries = (
            Gallery(self.plan.gallery, self.session.entries, lambda: self.session.shown, self.worker.submit),
            Gallery(self.compare.gallery, series.entries, series.shown, self.worker.submit),
        )
        self.run: RunControl | None = None
        if rows is not None:
            self.run = RunControl(self.session, rows, self.run_panel, self.animator.stop)
        self.edits = ProblemEdits(self.session, self.problem, self.synergies, self.animator.stop)
        self._connect()
        for script in page_scripts("Grasp viewer"):
            send_script(self.server, script)
        self.worker.submit(lambda: None)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self.server.url

    def stop(self) -> None:
        """End everything."""
        self.planning.close()
        for gallery in self.galleries:
            gallery.stop()
        self.worker.stop()
        self.server.stop()
        self.files.uploads.close()

    def _build_page(self, rows: RunRows | None) -> None:
        """Add all widgets."""
        gui = self.server.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        self.card = LadderCard(gui, self.session)
        self.changes = ChangesPanel(gui, self.session, lambda: self.animator.stop(), self._later)
        tabs = gui.add_tab_group()
        if rows is not None:
            with tabs.add_tab("Run"):
                self.run_panel = RunPanel(gui, rows)
        with tabs.add_tab(GRASP):
            self.grasp_panel = GraspPanel.add(gui)
        with tabs.add_tab(SYNERGIES):
            self.synergies = SynergyPanel(gui, lambda: self._later(self._apply_sigma, "sigma"))
        with tabs.add_tab(WHY):
            self.why = WhyPanel(gui)
        with tabs.add_tab(TASK):
            self.task = TaskPanel(gui)
        with tabs.add_tab(PLAN):
            self.plan = PlanPanel(
                gui,
                lambda: self._later(self.session.mark_dirty, "search"),
                lambda rank: self._later(lambda: self.control.choose(rank)),
            )
            self.files = FromFilesPanel(self.server)
            with gui.add_form(None) as form:
                changed = partial(self._later, self._problem_changed, "problem")
                self.problem = ProblemPanel(gui, changed, self.task.form)
            for each in (form, self.task.form):
                each.on_submit(lambda _: self.problem.typed.now())
        with tabs.add_tab(COMPARE):
            self.compare = ComparePanel(
                gui, tuple(SERIES), lambda index: self._later(lambda: self.comparison.choose(index))
            )
        self.plan.starters += [self.compare.show_preset, self.compare.plan_series]
        self.plan.stoppers.append(self.compare.stop)
        with tabs.add_tab("View"):
            scale = fitting_scale(self.session.grasp)
            own = {"springs": self.synergies.springs, "margin": self.why.margin}
            self.display = DisplayPanel(gui, lambda: self._later(self.session.mark_dirty, "display"), scale, own)
        with tabs.add_tab("Share"):
            self.share = SharePanel(self.server, self.session, self._later)
        with tabs.add_tab("Guide"):
            add_guide(gui)

    def _connect(self) -> None:
        """Connect the widgets with what they do."""
        session, panel = self.session, self.synergies
        panel.count.on_update(lambda _: self._later(self.edits.take_count, "count"))
        panel.reset.on_click(lambda _: self._later(session.reset_posture))
        panel.close.on_click(lambda _: self._later(lambda: self.animator.close(int(panel.which.value) - 1)))

        def squeeze() -> None:
            session.set_squeeze(panel.squeeze.value, panel.automatic.value)

        for widget in (panel.automatic, panel.squeeze):
            widget.on_update(lambda _: self._later(squeeze, "squeeze"))
        connect_handles(self.picture, session, (panel.move_hand, panel.move_object), self._later)
        self.picture.clicked = lambda what: self._later(lambda: session.select(what))
        pushes = PushControl(session, self.why)
        self.why.connect(session, pushes.apply, self._later)
        self.picture.push_dragged = lambda point: self._later(lambda: pushes.drag(point), "push")
        panel.story.on_update(lambda _: self._later(lambda: self.animator.tell(panel.story.value), "story"))
        self.picture.task_dragged = lambda point: self._later(lambda: self.edits.turn_task(point), "task")
        self.display.on_dark(self.server.set_dark, self.picture.set_dark)
        self.display.look.on_click(lambda event: self._look(event.client))
        self.grasp_panel.play.on_click(lambda _: self._later(self.animator.play))
        compare = self.compare
        compare.pin.on_click(lambda _: self._later(session.pin))
        compare.unpin.on_click(lambda _: self._later(session.unpin))
        self.plan.plan.on_click(lambda _: self._later(self.control.start))
        self.plan.cancel.on_click(lambda _: self.planning.cancel())
        compare.plan_series.on_click(lambda _: self._later(self.comparison.start))
        compare.stop.on_click(lambda _: self.planning.cancel())
        compare.show_preset.on_click(lambda _: self._later(lambda: self.control.start_preset(compare.preset.value)))
        self.plan.browse.on_click(lambda _: self._later(self.control.browse))
        if self.run is not None:
            self.run.connect(self._later)
        self.files.connect(self.edits, self._later, lambda: self._look(None))
        self.links = PageLinks(self.server, self.run, self._later, self.control.open_state, self._aim)
        add_commands(
            self.server.gui,
            self._later,
            (
                ("Play closing", "C", self.animator.play),
                ("Plan", "P", self.control.start),
                ("Pin this grasp", "B", session.pin),
                ("Next result, or next row of the run", "N", lambda: self._step(1)),
                ("Previous result, or previous row of the run", "V", lambda: self._step(-1)),
                ("Undo", "cmd/ctrl+Z", self.changes.undo),
                ("Redo", "cmd/ctrl+shift+Z", self.changes.redo),
            ),
        )

    def _later(self, action: Callable[[], None], key: str | None = None) -> None:
        """Have the worker do something, unless the worker itself has moved the widget."""
        if not self.worker.is_current:
            self.worker.submit(action, key)

    def _step(self, by: int) -> None:
        """Show the next result of the last search, or else the next row of the run."""
        if self.run is not None and not self.session.results:
            self.run.step(by)
        else:
            self.control.step(by)

    def _climb(self) -> bool:
        """Find one piece more of what can wait; return whether there was one."""
        return self.grasp_panel.climb(self.session) or self.card.climb() or any(each.climb() for each in self.galleries)

    def _redraw(self) -> bool:
        """Bring the page up to date; return whether it was behind. Called by the worker."""
        session = self.session
        if not session.dirty:
            return False
        session.dirty = False
        session.update()
        self.picture.draw(session, self.display.options)
        with self.server.atomic():  # each message on its own would wake the thread of the network
            self.card.show()
            if session.preview is None:
                self._show_numbers()
        return True

    def _show_numbers(self) -> None:
        """Have all panels say what is true of the grasp."""
        for panel in (self.grasp_panel, self.why, self.task, self.compare, self.synergies, self.problem):
            panel.show(self.session)
        for gallery in self.galleries:
            gallery.show()
        self.display.show(self.picture.notes)
        with contextlib.suppress(FieldError):
            self.share.show(self.control.options, int(self.plan.seed.value), self.control.count)

    def _report(self, message: str) -> None:
        """Show an error on every page, and put the widgets back to what holds."""
        for client in self.server.get_clients().values():
            client.add_notification("That did not work", message[:300], color="red", auto_close_seconds=8.0)
        self.share.last_error = message
        with contextlib.suppress(GraspPlannerError):
            self.problem.show(self.session, force=True)

    def _apply_sigma(self) -> None:
        """Move the hand as the synergy sliders say."""
        self.animator.stop()
        self.session.set_sigma(self.synergies.sigma)

    def _problem_changed(self) -> None:
        """Take the problem of the widgets; a new hand or object is looked at anew."""
        if self.edits.take_problem():
            self._look(None)
        self.server.show_used_values()

    def _aim(self) -> None:
        """Have the pages to come begin with a good view on the grasp shown."""
        self.picture.aim(self.session.grasp, object_pose=self.session.live.object_pose)

    def _look(self, client: viser.ClientHandle | None) -> None:
        """Move the camera of a page, of all without one, to a good view."""
        clients = list(self.server.get_clients().values()) if client is None else [client]
        for each in clients:
            self._later(partial(self.picture.look, session=self.session, client=each))
