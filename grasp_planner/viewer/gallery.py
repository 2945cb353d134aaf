"""What the cards of the gallery say and show, found piece by piece while nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from ..drawing.camera import good_view
from ..drawing.raster import render
from ..drawing.solids import framed, grasp_scene
from ..grasp.grasp import Grasp
from .panels.gallery import MOST_CARDS, GalleryPanel, Pixels, caption

CARD_SIZE = (340, 190)
"""Width and height of the picture of a card [pixels]."""


class Gallery:
    """Fills the cards; its methods are for the worker's thread.

    A picture takes half a second of processor time. Only what it shows is put together here; it is painted by a
    thread of its own, which touches no kinematics, so that sliders go on being answered.
    """

    def __init__(
        self,
        panel: GalleryPanel,
        entries: Callable[[], list[tuple[str, Grasp | None]]],
        shown: Callable[[], int | None],
        later: Callable[[Callable[[], None]], None],
    ) -> None:
        """Begin without cards.

        Args:
            panel: The widgets.
            entries: Gives labels and grasps, None for one that is still to be planned.
            shown: Gives the index of the one that is drawn.
            later: Has the worker do something.
        """
        self._panel, self._entries, self._shown, self._later = panel, entries, shown, later
        self._painter = ThreadPoolExecutor(1, thread_name_prefix="gallery")
        # By the identity of a grasp, which is kept with them so that the identity stays its own.
        self._closes: dict[int, tuple[Grasp, bool]] = {}
        self._pictures: dict[int, tuple[Grasp, Pixels | None]] = {}

    def show(self) -> None:
        """Show the cards as far as they are known, and forget what no card shows."""
        entries = self._entries()[:MOST_CARDS]
        kept = {id(grasp) for _, grasp in entries}
        self._closes = {key: entry for key, entry in self._closes.items() if key in kept}
        self._pictures = {key: entry for key, entry in self._pictures.items() if key in kept}
        captions, pictures = [], []
        for label, grasp in entries:
            closes, picture = self._closes.get(id(grasp)), self._pictures.get(id(grasp))
            captions.append(caption(label, grasp, None if closes is None else closes[1]))
            pictures.append(None if picture is None else picture[1])
        self._panel.show(captions, pictures, self._shown())

    def climb(self) -> bool:
        """Find one piece more while nothing else is to do; return whether there was one."""
        grasps = [grasp for _, grasp in self._entries()[:MOST_CARDS] if grasp is not None]
        for grasp in grasps:
            if grasp.feasible and id(grasp) not in self._closes:
                self._closes[id(grasp)] = grasp, grasp.closing.holds
                self.show()
                return True
        for grasp in grasps:
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
