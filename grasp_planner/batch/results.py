"""Reading a run: all rows as a table, rows that meet a condition, the grasp of one row."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..records.grasp_record import grasp_from_record
from ..records.layout import GraspRecord
from .arrow import schema_of
from .errors import BatchDependencyError, ResultsError
from .journal import journal_rows, journal_table
from .rows import record_of
from .run_files import read_run_info, sound_tables

try:
    import pyarrow as pa
    import pyarrow.compute as pc
except ImportError:
    raise BatchDependencyError("pyarrow") from None


def load_table(folder: str | Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Return the rows of a run as an Arrow table, sorted by row; also while it runs or after it was killed.

    Args:
        folder: Folder of the run.
        columns: Columns to read; all if left out.

    Returns:
        The table; ``.to_pandas()`` and ``polars.from_arrow`` take it on.

    Raises:
        ResultsError: If there is no run.

    Warns:
        DamagedRunWarning: If a file of it is damaged or does not belong there; its rows are left out.
        InvalidValueError: If a column does not exist.
    """
    folder = Path(folder)
    info = read_run_info(folder)
    names = list(info.columns if columns is None else columns)
    for name in names:
        if name not in info.columns:
            raise InvalidValueError("columns", name, f"one of {', '.join(info.columns)}")
    wanted = names if "row" in names else ["row", *names]
    # The journal first: a row that moves to a Parquet file meanwhile is then seen twice, and not missed.
    journal = journal_table(journal_rows(folder, info), info).select(wanted)
    parts = list(sound_tables(folder, info, wanted))
    schema = schema_of({name: info.columns[name] for name in wanted})
    table = pa.concat_tables([schema.empty_table(), *parts])
    late = pc.invert(pc.is_in(journal["row"], value_set=table["row"].combine_chunks()))
    return pa.concat_tables([table, journal.filter(late)]).sort_by("row").select(names)


def find_rows(folder: str | Path, where: str = "") -> list[int]:
    """Return the rows that meet a condition.

    Args:
        folder: Folder of the run.
        where: Condition in SQL over the columns, such as ``feasible and n_synergies = 3``; all rows if empty. Text
            after ``order by`` sorts them.

    Returns:
        Row numbers; sorted unless the condition says otherwise.

    Raises:
        ResultsError: If there is no run.
        InvalidValueError: If the condition is malformed.
    """
    folder = Path(folder)
    light = [name for name in read_run_info(folder).columns if name != "record"]
    rows = load_table(folder, light)
    if not where.strip():
        return [int(row) for row in rows["row"].to_pylist()]
    try:
        import duckdb
    except ImportError:
        raise BatchDependencyError("duckdb") from None
    with duckdb.connect(":memory:", config={"threads": "1"}) as connection:
        connection.register("rows", rows)
        connection.execute("create table only_rows as select * from rows")
        connection.unregister("rows")
        # The condition may come from a browser: it sees these rows and nothing else of this machine.
        connection.execute("set enable_external_access = false; set lock_configuration = true")
        order = "" if "order by" in where.lower() else " order by row"
        try:
            found = connection.execute(f"select row from only_rows where {where}{order}").fetchall()
        except duckdb.Error as error:
            raise InvalidValueError("where", where, f"a condition in SQL ({str(error).splitlines()[0]})") from None
    return [int(row) for (row,) in found]


def load_row(folder: str | Path, row: int) -> GraspRecord:
    """Return the grasp of one row.

    Args:
        folder: Folder of the run.
        row: Number of the row, as in the column ``row``.

    Returns:
        The record; :func:`grasp_planner.grasp_from_record` makes the grasp of it.

    Raises:
        ResultsError: If there is no run.
        InvalidValueError: If there is no such row, or it has no grasp (an error, a crash or its time limit).
    """
    return load_rows(folder, [row])[0]


def load_rows(folder: str | Path, rows: Sequence[int]) -> list[GraspRecord]:
    """Return the grasps of some rows, in their order.

    Args:
        folder: Folder of the run.
        rows: Numbers of the rows.

    Returns:
        Their records.

    Raises:
        ResultsError: If there is no run.
        InvalidValueError: If a row does not exist or has no grasp.
    """
    return [record for _, record in load_hands_and_records(Path(folder), rows)]


def load_grasps(folder: str | Path, rows: Sequence[int], hand: str | None = None) -> list[Grasp]:
    """Return the grasps of some rows with hand, object and task, in their order.

    Hands are loaded as the case named them, so hands given by a path work too (from the same working folder).

    Args:
        folder: Folder of the run.
        rows: Numbers of the rows.
        hand: Hand to take instead of the one that each case names: name or description file.

    Returns:
        Their grasps.

    Raises:
        ResultsError: If there is no run.
        InvalidValueError: If a row does not exist or has no grasp.
    """
    hands: dict[str, Hand] = {}
    grasps = []
    for name, record in load_hands_and_records(Path(folder), rows, hand):
        if name not in hands:
            hands[name] = load_hand(name)
        grasps.append(grasp_from_record(record, hands[name]))
    return grasps


def load_hands_and_records(folder: Path, rows: Sequence[int], hand: str | None = None) -> list[tuple[str, GraspRecord]]:
    """Return hand, as the case named it or as given, and record of some rows, in their order.

    Raises:
        ResultsError: If there is no run.
        InvalidValueError: If a row does not exist or has no grasp.
    """
    numbers = set(rows)
    info = read_run_info(folder)
    names = ["row", "hand", "status", "message", "time_s", "record"]
    journal = journal_table((values for values in journal_rows(folder, info) if values["row"] in numbers), info)
    found = {values["row"]: values for values in journal.to_pylist()}
    for table in sound_tables(folder, info, names, numbers):
        found |= {values["row"]: values for values in table.to_pylist()}
    records = []
    for row in rows:
        if row not in found:
            raise InvalidValueError("row", row, f"a planned row of {folder}, from 0 to {info.cases - 1}")
        try:
            record = record_of(found[row])
        except ValidationError as error:
            where = ".".join(map(str, error.errors()[0]["loc"]))
            raise ResultsError(folder, f"row {row} was written by another version (key {where!r})") from None
        if record is None:
            raise InvalidValueError("row", row, f"a row with a grasp; {found[row]['status']}: {found[row]['message']}")
        records.append((hand or found[row]["hand"], record))
    return records
