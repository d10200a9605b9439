"""The experiments of `phalanx bench reconstruction`, one module each."""
