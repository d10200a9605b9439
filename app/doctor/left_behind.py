"""What earlier runs left behind: reports of faults, takes that were cut off, files that nobody needs."""

from __future__ import annotations

from app.doctor.finding import Finding, good, warning
from app.doctor.storage import takes_folder

_CLEAR = "Run: phalanx doctor --clear-leftovers."


def check_left_behind() -> list[Finding]:
    """A line for each, with what can be done about it."""
    from app.left_behind.found import display_words, look, size_words

    found = look(takes_folder())
    findings = [
        warning(
            "Fault",
            f"{run.what}, begun {run.begun:%Y-%m-%d %H:%M}, was ended by a fault: {run.fault}.",
            f"Please report it, with {run.path}.",
        )
        for run in found.faults
    ]
    for run in found.displays:
        text = f"{run.what}, begun {run.begun:%Y-%m-%d %H:%M}: {display_words(run)}."
        findings.append(warning("Display", text, "Help > Left by earlier runs in the window settles it."))
    for take in found.takes:
        name = f"'{take.path}'"
        if take.only_copy:
            whole = f"'{take.path.with_suffix('')}'"
            text, action = f"{name} is a copy of a take that is gone.", f"Rename it to {whole}, then recover that."
        else:
            text, action = f"{name} ({size_words(take.bytes)}) is not sealed.", f"Run: phalanx recover {name}."
        findings.append(warning("Take cut off", text, action))
    for file in found.files:
        text = f"{file.path} ({size_words(file.bytes)}): {file.what}."
        findings.append(warning("Left behind", text, _CLEAR))
    return findings or [good("Left behind", "nothing by earlier runs")]
