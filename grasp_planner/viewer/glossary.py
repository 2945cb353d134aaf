"""What every letter and word on the page means, in one line each. No display code here."""

from __future__ import annotations

TERMS: tuple[tuple[str, str], ...] = (
    ("synergy", "a way of moving all joints together; a hand with few motors moves along few of them"),
    ("n_s", "number of synergies, that is of motor commands"),
    ("σ", "motor commands along the synergies, in rad"),
    ("δσ", "how much further the motors pull than where the fingers touch: the squeeze"),
    ("S, q̄", "the synergies as columns, and the posture at σ = 0"),
    ("q_r", "reference posture q̄ + S σ: where the motors alone would put the joints"),
    ("q", "actual posture: what the joint springs leave of q_r once the fingers touch"),
    ("τ", "torques of the contact forces at the joints"),
    ("C_q", "how far a joint gives way under a torque: its spring"),
    ("O, P", "frame of the object, frame of the palm"),
    ("contact", "a point of a fingertip on the object; its normal points into the object"),
    ("gap", "distance between fingertip and surface; zero where it touches"),
    ("f, f_n", "force of a finger on the object, and its part along the normal, in N"),
    ("μ", "friction coefficient: the largest tangential force by the normal force"),
    ("friction cone", "all forces that a contact can carry without slipping"),
    ("share of friction", "tangential force by the largest one possible; at 100 % the finger slips"),
    ("friction margin", "how far inside its cone a force is, in N"),
    ("G", "grasp matrix: from contact forces to force and torque on the object"),
    ("force closure", "the contacts can balance any force and torque on the object"),
    ("F", "size of all normal forces together, in N; small is gentle"),
    ("floor", "least F any hand could do with at these contacts"),
    ("C", "task index: how badly effort of the motors becomes the task; small is good"),
    ("w_F, w_C", "weights of F and C; without them least force comes first"),
    ("task", "a direction in which a force or torque is to be exerted, or a motion made"),
    ("force ellipsoid", "forces per unit of motor effort, long where the hand is strong"),
    ("angle", "between the task and the long axis of the ellipsoid"),
    ("α", "force or torque along the task per unit of motor effort"),
    ("β", "the same for motions, per unit of motor speed"),
    ("*, degenerate", "the ellipsoid has no end in some direction: there the structure carries, not the motors"),
    ("load case", "a disturbing force, torque or acceleration that has to be withstood"),
    ("margin", "the largest push from the worst side that is held with the motors at rest, in N"),
    ("stable", "after a small displacement the held object is pulled back"),
    ("clear of all links", "no link is inside the object or another link"),
    ("closes from open", "the open hand, closing along its synergies, gets there and then holds"),
    ("survives errors", "the same closing with the palm 2 mm off still holds, in all six directions"),
    ("seed, start", "a search begins from several starts; the seed chooses the random ones"),
    ("human, made sets", "synergies measured on people and carried over, or found from grasps planned here"),
)
"""Letters or words, and what they mean."""


def glossary_table() -> str:
    """Return all terms (Markdown)."""
    return "\n".join(["| | |", "|---|---|", *(f"| **{term}** | {meaning} |" for term, meaning in TERMS)])
