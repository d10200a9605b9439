"""Files that others wrote, or a disk spoilt: read within bounds of size, depth and time, and never run.

files: only what is a file, and not too large. json_text, npz, onnx_graph: the containers, what they claim held against
what is there. values: the numbers and texts in them.
"""
