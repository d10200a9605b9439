"""The commands of `phalanx`, one per file: `add(commands)` declares it, its `run(arguments)` returns a Result."""
