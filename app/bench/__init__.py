"""What `phalanx bench NAME` measures, one module each.

A module's first line says what it measures. It has `run(arguments) -> dict` with the figures, which also prints them
for people, and may have `add_options(parser)`.
"""
