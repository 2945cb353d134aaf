"""The glossary where its letters stand."""

from grasp_planner.viewer import text
from grasp_planner.viewer.glossary import TERMS
from grasp_planner.viewer.glossary_script import MEANINGS, glossary_script
from grasp_planner.viewer.verdict_card import headline


def test_every_letter_has_one_meaning():
    words = [word for words, _ in TERMS for word in words.split(", ")]
    assert len(words) == len(set(words)) == len(MEANINGS)


def test_the_letters_of_card_and_tables_are_explained(grasp):
    for symbol, _, _ in headline(grasp):
        assert symbol in MEANINGS, symbol
    heads = [table(grasp).splitlines()[0].strip("| ").split(" | ") for table in (text.contact_table, text.joint_table)]
    for head in (*heads[0][1:], *heads[1][1:]):
        assert any(head == term or head.startswith(f"{term} ") for term in MEANINGS), head


def test_the_script_ends_no_script():
    assert "</" not in glossary_script()
    assert "__MEANINGS__" not in glossary_script()
