"""What the cards of the gallery say and show, found piece by piece while nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from ..drawing.camera import good_view
from ..drawing.raster import render
from ..drawing.solids import framed, grasp_scene
from ..grasp.grasp import Grasp
from .panels.gallery import MOST_CARDS, GalleryPanel, Pixels, caption
from .session import Session

CARD_SIZE = (340, 190)
"""Width and height of the picture of a card [pixels]."""


class Gallery:
    """Fills the cards; its methods are for the worker's thread.

    A picture takes half a second of processor time. Only what it shows is put together here; it is painted by a
    thread of its own, which touches no kinematics, so that sliders go on being answered.
    """

    def __init__(self, panel: GalleryPanel, session: Session, later: Callable[[Callable[[], None]], None]) -> None:
        """Begin without cards.

        Args:
            panel: The widgets.
            session: Holds the results.
            later: Has the worker do something.
        """
        self._panel, self._session, self._later = panel, session, later
        self._painter = ThreadPoolExecutor(1, thread_name_prefix="gallery")
        # By the identity of a grasp, which is kept with them so that the identity stays its own.
        self._closes: dict[int, tuple[Grasp, bool]] = {}
        self._pictures: dict[int, tuple[Grasp, Pixels | None]] = {}

    @property
    def _grasps(self) -> list[Grasp]:
        """The grasps that have a card."""
        return self._session.results[:MOST_CARDS]

    def show(self) -> None:
        """Show the cards as far as they are known, and forget what no card shows."""
        grasps = self._grasps
        kept = {id(grasp) for grasp in grasps}
        self._closes = {key: entry for key, entry in self._closes.items() if key in kept}
        self._pictures = {key: entry for key, entry in self._pictures.items() if key in kept}
        closes = [self._closes[id(grasp)][1] if id(grasp) in self._closes else None for grasp in grasps]
        captions = [caption(rank, *entry) for rank, entry in enumerate(zip(grasps, closes, strict=True), start=1)]
        pictures = [self._pictures[id(grasp)][1] if id(grasp) in self._pictures else None for grasp in grasps]
        self._panel.show(captions, pictures, self._session.shown)

    def climb(self) -> bool:
        """Find one piece more while nothing else is to do; return whether there was one."""
        for grasp in self._grasps:
            if grasp.feasible and id(grasp) not in self._closes:
                self._closes[id(grasp)] = grasp, grasp.closing.holds
                self.show()
                return True
        for grasp in self._grasps:
            if id(grasp) not in self._pictures:
                self._paint(grasp)
                return True
        return False

    def stop(self) -> None:
        """End the thread that paints."""
        self._painter.shutdown(wait=False, cancel_futures=True)

    def _paint(self, grasp: Grasp) -> None:
        """Have a picture painted."""
        self._pictures[id(grasp)] = grasp, None
        scene = grasp_scene(grasp)
        eye, target = good_view(grasp)
        view = framed(scene.solids, eye - target, *CARD_SIZE)

        def work() -> None:
            pixels = render(scene.solids, view)
            self._later(lambda: self._hang(grasp, pixels))

        self._painter.submit(work)

    def _hang(self, grasp: Grasp, pixels: Pixels) -> None:
        """Show a picture that was painted, if its grasp still has a card."""
        if id(grasp) in self._pictures:
            self._pictures[id(grasp)] = grasp, pixels
            self.show()
