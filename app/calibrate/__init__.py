"""What `phalanx calibrate` finds out about a performer, one module each.

The first line of a module's docstring is its help; `add_options(parser)` declares its options, `run(arguments)` does
it and hands back a Result.
"""
