"""Experiments of `phalanx bench tracking`: every module with a `run` is one."""
