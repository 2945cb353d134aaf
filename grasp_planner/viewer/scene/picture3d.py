"""Everything in the 3-D scene of the page: the hand, its ghosts, the grasp, the gizmos, light and camera."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import viser

from ...drawing import look
from ...drawing.camera import FIELD_OF_VIEW, good_view
from ...drawing.look import Colour
from ...grasp.grasp import Grasp
from ...hand.configuration import HandConfiguration
from ...problem.problem import GraspProblem
from ...spatial import Array, Pose
from ..closing_story import StoryMoment
from ..live import contact_share
from ..push import pushed
from ..session import Session
from .clearances import link_clearances
from .draw_extras import EXTRAS, ExtraDrawing
from .draw_grasp import DisplayOptions, GraspDrawing
from .draw_hand import HandDrawing, place
from .draw_push import PushDrawing, finger_colours
from .draw_springs import SpringDrawing, resting_springs

GHOSTS = {"reference": look.REFERENCE_GHOST, "seed": look.SEED_GHOST, "pinned": look.PINNED_GHOST}


GROUND = {False: ((236, 238, 242), (222, 226, 232)), True: ((38, 40, 46), (58, 62, 70))}
"""Colours of the lines of the ground, thin and thick ones; by whether the page is dark."""


class Picture:
    """The scene; to be changed by the worker only.

    Attributes:
        hand_gizmo: Handles to move the hand.
        object_gizmo: Handles to move the object.
        clicked: Called with ("contact", index) or ("link", name) when something is clicked.
        task_dragged: Called with a point in the world when the ball of the task arrow is dragged.
        push_dragged: The same for the ball of a push.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server, self._scene = server, server.scene
        self.clicked: Callable[[tuple[str, int | str]], None] = lambda _: None
        self.task_dragged: Callable[[Array], None] = lambda _: None
        self.push_dragged: Callable[[Array], None] = lambda _: None
        self._key: Any = None
        self._hand: HandDrawing | None = None
        self._ghosts: dict[str, HandDrawing] = {}
        self._grasp: GraspDrawing | None = None
        self._springs: SpringDrawing | None = None
        self._push: PushDrawing | None = None
        self._extras: list[ExtraDrawing] = []
        self._clickable = True
        self._gizmo_version = -1
        self._set_stage()
        self.hand_gizmo = self._scene.add_transform_controls("/hand_gizmo", 0.09, depth_test=False, visible=False)
        self.object_gizmo = self._scene.add_transform_controls("/object_gizmo", 0.11, depth_test=False, visible=False)

    @property
    def notes(self) -> list[str]:
        """What the ellipsoids shown are, in words."""
        return self._grasp.notes if self._grasp is not None else []

    def draw(self, session: Session, options: DisplayOptions) -> None:
        """Draw the session's grasp, or its preview."""
        with self._server.atomic():
            self._fit(session.problem)
            assert self._hand is not None and self._grasp is not None and self._push is not None
            live = session.live
            grasp = session.grasp if session.preview is None else session.preview.grasp
            self._hand.move(grasp.configuration, live.object_pose)
            self._grasp.move(live.object_pose)
            tried = session.push if session.preview is None and grasp.feasible else None
            answer = None if tried is None else pushed(grasp, tried)
            self._grasp.draw(grasp, options, answer)
            self._push.draw(answer, grasp.passive_margin.size if answer is not None else 0.0)
            kind, which = session.selected or ("", -1)
            self._grasp.mark(int(which) if kind == "contact" else -1)
            touching = session.preview is None and contact_share(grasp) > 0.0
            for extra in self._extras:
                extra.draw(grasp, options, in_contact=touching)
            story = None if session.preview is None else session.preview.story
            self._draw_springs(story, grasp, live.object_pose, at_rest=options.springs and touching)
            if session.preview is None:
                self._paint(session, options, {} if answer is None else finger_colours(grasp, answer))
                self._draw_ghosts(session, options)
            if self._gizmo_version != session.version:
                self._gizmo_version = session.version
                place(self.hand_gizmo, live.hand_pose)
                place(self.object_gizmo, live.object_pose)

    def set_dark(self, dark: bool) -> None:
        """Draw the ground for a light or a dark page."""
        self._ground.cell_color, self._ground.section_color = GROUND[dark]

    def show_gizmos(self, hand: bool, grasp_object: bool) -> None:
        """Show or hide the handles; what is clickable would lie in front of them, so it is not meanwhile."""
        self.hand_gizmo.visible, self.object_gizmo.visible = hand, grasp_object
        if self._clickable != (not (hand or grasp_object)):
            self._clickable = not self._clickable
            self._bind_clicks()

    def aim(self, grasp: Grasp, *, object_pose: Pose | None = None, aside: float = 0.0) -> None:
        """Point the start camera at a grasp: where most of its contacts are seen.

        Args:
            grasp: The grasp.
            object_pose: Pose of the object in the world; identity if left out.
            aside: How far to the right of the middle the grasp is to be seen, as a share of its distance.
        """
        position, target = good_view(grasp)
        if aside:
            right = np.cross(target - position, [0.0, 0.0, 1.0])
            shift = aside * np.linalg.norm(target - position) * right / np.linalg.norm(right)
            position, target = position - shift, target - shift
        if object_pose is not None:
            position, target = object_pose.act(position), object_pose.act(target)
        initial = self._server.initial_camera
        initial.position, initial.look_at = tuple(position), tuple(target)
        initial.fov = FIELD_OF_VIEW

    def look(self, session: Session, client: viser.ClientHandle) -> None:
        """Move the camera of one page to a good view on the grasp shown."""
        position, target = good_view(session.grasp)
        pose = session.live.object_pose
        with client.atomic():
            client.camera.position, client.camera.look_at = pose.act(position), pose.act(target)
            client.camera.up_direction, client.camera.fov = (0.0, 0.0, 1.0), FIELD_OF_VIEW

    def _set_stage(self) -> None:
        """Set light, ground and axes."""
        scene = self._scene
        scene.set_up_direction("+z")
        scene.configure_default_lights(cast_shadow=False)
        scene.configure_environment_map(None)
        scene.add_light_ambient("/light/ambient", intensity=1.5)
        scene.add_light_directional("/light/key", intensity=1.6, position=(0.6, 0.4, 1.0))
        scene.add_light_directional("/light/fill", intensity=0.7, position=(-0.6, -0.5, 0.3))
        self._ground = scene.add_grid(
            "/ground",
            1.2,
            1.2,
            cell_size=0.05,
            section_size=0.1,
            cell_color=GROUND[False][0],
            section_color=GROUND[False][1],
            cell_thickness=0.5,
            section_thickness=0.8,
            position=(0.0, 0.0, -0.16),
            shadow_opacity=0.0,
        )

    def _fit(self, problem: GraspProblem) -> None:
        """Have drawings for this hand, object and set of contacts."""
        frames = tuple(frame.name for frame in problem.frames)
        key = (
            problem.hand.name,
            problem.grasp_object.text,
            frames,
            problem.parameters.friction,
            problem.contact_model.kind,
        )
        if key == self._key:
            return
        if self._hand is None or self._hand.hand.name != problem.hand.name:
            for drawing in [self._hand, *self._ghosts.values()]:
                if drawing is not None:
                    drawing.remove()
            self._ghosts = {}
            self._hand = HandDrawing(self._scene, "/hand", problem.hand)
        if self._grasp is not None:
            self._grasp.remove()
        self._grasp = GraspDrawing(self._scene, problem)
        self._push = PushDrawing(self._scene)
        self._springs = SpringDrawing(self._scene, len(problem.frames))
        self._extras = [extra(self._scene) for extra in EXTRAS]
        self._key = key
        self._bind_clicks()

    def _bind_clicks(self) -> None:
        """Make contacts, links and the task ball answer the mouse, or stop them."""
        if self._hand is None or self._grasp is None or self._push is None:
            return
        dots, ball, push = self._grasp.contact_handle, self._grasp.task_handle, self._push.handle
        for handle in (dots, *self._hand.meshes.values()):
            handle.remove_click_callback("all")
        ball.remove_drag_callback("all")
        push.remove_drag_callback("all")
        if not self._clickable:
            return
        dots.on_click(lambda event: self.clicked(("contact", int(event.instance_index or 0))))
        for name, mesh in self._hand.meshes.items():
            link = self._hand.links[name]
            mesh.on_click(partial(self._click_link, link))
        ball.on_drag("left")(lambda event: self.task_dragged(np.array(event.end_position)))
        push.on_drag("left")(lambda event: self.push_dragged(np.array(event.end_position)))

    def _click_link(self, link: str, event: Any) -> None:
        """React to a click on a link."""
        self.clicked(("link", link))

    def _paint(self, session: Session, options: DisplayOptions, fingers: dict[str, Colour]) -> None:
        """Colour fingers that answer to a push, links that penetrate, and the one selected."""
        assert self._hand is not None
        special = dict(fingers)
        if options.clearances and not fingers:
            found = link_clearances(session.grasp)
            special = {link: look.PENETRATING for link, value in found.items() if value[0] < -1e-5}
        if session.selected is not None and session.selected[0] == "link":
            special.setdefault(str(session.selected[1]), look.SELECTED)
        self._hand.paint(special)

    def _draw_ghosts(self, session: Session, options: DisplayOptions) -> None:
        """Show the ghosts that are asked for, where there is something to show."""
        grasp, pinned = session.grasp, session.pinned
        shown: dict[str, tuple[Grasp, Array] | None] = {
            "reference": (grasp, grasp.reference_joint_angles) if options.reference_ghost or options.springs else None,
            "seed": (session.seed, session.seed.joint_angles) if options.seed_ghost and session.seed else None,
            "pinned": (pinned, pinned.joint_angles) if options.pinned_ghost and pinned else None,
        }
        for name, entry in shown.items():
            if entry is None or entry[0].problem.hand.name != grasp.problem.hand.name:
                if name in self._ghosts:
                    self._ghosts[name].visible = False
                continue
            self._show_ghost(name, entry[0], entry[1], session.live.object_pose)

    def _draw_springs(self, story: StoryMoment | None, grasp: Grasp, frame: Pose, *, at_rest: bool) -> None:
        """Show the springs of a closing hand and the ghost of its references, those of a hand at rest, or none."""
        assert self._springs is not None
        if story is None and at_rest:
            self._springs.draw(*resting_springs(grasp))
        elif story is None:
            self._springs.draw(np.zeros((0, 2, 3)), np.zeros(0))
        else:
            self._springs.draw(story.springs, story.forces)
            self._show_ghost("reference", grasp, story.reference, frame)

    def _show_ghost(self, name: str, grasp: Grasp, q: Array, frame: Pose) -> None:
        """Show a ghost of a grasp at another posture, by the pose of the object."""
        hand = grasp.problem.hand
        if name not in self._ghosts:
            whole = name != "reference"
            self._ghosts[name] = HandDrawing(self._scene, f"/ghost_{name}", hand, ghost=GHOSTS[name], whole=whole)
        self._ghosts[name].move(HandConfiguration(hand, q, grasp.palm_pose), frame)
        self._ghosts[name].visible = True
