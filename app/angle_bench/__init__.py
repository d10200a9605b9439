"""Known angles against tracked ones: the parts of `phalanx bench angles`."""
