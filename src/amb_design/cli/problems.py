"""The packaged problems."""

from __future__ import annotations

from .arguments import Json
from .output import print_result


def list_problems(as_json: Json = False) -> None:
    """List the packaged problems."""
    from ..console import problems as console
    from ..spec.files import FILE_NAME, PROBLEM_FILE, load, load_variants, packaged
    from ..spec.problem_files import load_problem, load_problem_variants

    rows = []
    for name, folder in packaged().items():
        has_machine, has_problem = (folder / FILE_NAME).is_file(), (folder / PROBLEM_FILE).is_file()
        described = load(folder) if has_machine else load_problem(folder)
        machines = load_variants(folder) if has_machine else {}
        designs = load_problem_variants(folder) if has_problem else {}
        problem = "" if not has_problem else load_problem(folder).name if has_machine else described.name
        rows.append(
            {
                "name": name,
                "source": described.source.get("title", ""),
                "variants": [v for v in machines if v != described.name],
                "optimise": has_problem,
                "design_variants": [v for v in designs if v != problem],
            }
        )
    print_result(as_json, {"problems": rows}, lambda: console.problems(rows))
