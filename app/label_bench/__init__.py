"""What `phalanx bench labels` measures of one frame alone, a table each."""
