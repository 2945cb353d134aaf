"""Galleries: grasps that differ as ranked cards, problems that are compared; a click shows one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import viser

from ...grasp.grasp import Grasp
from ..text import degrees, fixed

MOST_CARDS = 12
"""Cards of the gallery; *next* goes on to grasps beyond them."""
Pixels = npt.NDArray[np.uint8]


@dataclass
class _Card:
    """The widgets of one card."""

    picture: viser.GuiImageHandle
    button: viser.GuiButtonHandle


class GalleryPanel:
    """Cards with a picture, force, angle and whether the hand closes; added when they are needed."""

    def __init__(self, gui: viser.GuiApi, chosen: Callable[[int], None], title: str) -> None:
        """Add the gallery to the present container.

        Args:
            gui: The widgets of the page.
            chosen: Called with the rank of a card that was clicked, from 0.
            title: Heading.
        """
        self._gui, self._chosen = gui, chosen
        self._folder = gui.add_folder(title)
        with self._folder:
            self._note = gui.add_markdown("*none yet*")
        self._cards: list[_Card] = []

    @property
    def buttons(self) -> tuple[viser.GuiButtonHandle, ...]:
        """The buttons of the cards, the best first."""
        return tuple(card.button for card in self._cards)

    @property
    def pictures(self) -> tuple[Pixels | None, ...]:
        """The pictures of the cards, None where there is none yet."""
        return tuple(np.asarray(card.picture.image) if card.picture.visible else None for card in self._cards)

    def show(self, captions: list[str], pictures: list[Pixels | None], shown: int | None) -> None:
        """Show cards; to be called by the worker only.

        Args:
            captions: What they say, the best first.
            pictures: Their pictures, as far as there are any.
            shown: The one that is drawn.
        """
        self._fit(len(captions))
        self._note.visible = not captions
        for index, (card, caption, picture) in enumerate(zip(self._cards, captions, pictures, strict=True)):
            _assign(card.button, "label", caption)
            _assign(card.button, "color", "green" if index == shown else "gray")
            _assign(card.picture, "visible", picture is not None)
            if picture is not None and card.picture.image is not picture:
                card.picture.image = picture

    def _fit(self, count: int) -> None:
        """Have as many cards as are needed."""
        while len(self._cards) > count:
            card = self._cards.pop()
            card.picture.remove()
            card.button.remove()
        with self._folder:
            while len(self._cards) < count:
                self._cards.append(self._card(len(self._cards)))

    def _card(self, index: int) -> _Card:
        """Add a card."""
        picture = self._gui.add_image(np.full((1, 1, 3), 255, np.uint8), format="jpeg", visible=False)
        button = self._gui.add_button(str(index + 1), color="gray", hint="Show this grasp")
        button.on_click(lambda _: self._chosen(index))
        return _Card(picture, button)


def caption(label: str, grasp: Grasp | None, closes: bool | None) -> str:
    """Return what a card says: force, angle between task and ellipsoid, whether the hand closes from open.

    Args:
        label: What is particular about it, or its rank.
        grasp: The grasp; None if it is not planned yet.
        closes: Whether it closes from open and then holds; None if that is not known yet.
    """
    if grasp is None:
        return f"{label} · not planned yet"
    if not grasp.feasible:
        return f"{label} · does not meet the model"
    said = "…" if closes is None else "closes ✔" if closes else "does not close ✘"
    return f"{label} · {fixed(grasp.force_norm)} N · {degrees(grasp.alignments[0][0])} · {said}"


def _assign(widget: object, name: str, value: object) -> None:
    """Set a property of a widget if it is another one, so that nothing is sent twice."""
    if getattr(widget, name) != value:
        setattr(widget, name, value)
