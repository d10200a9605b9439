"""What earlier runs left behind that did not end by themselves: reports of faults, takes that were cut off, files that
nobody needs any more."""
